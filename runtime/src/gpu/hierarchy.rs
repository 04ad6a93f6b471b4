//! The boundary's box hierarchy (obvhs) in the order in which a shader without a stack goes through it: depth first, every node
//! with the place where a ray goes on that misses it. All crossings count, so that the order of two children does not matter.
//! Checked by the test of the marcher against shadow rays in f64.

use bytemuck::{Pod, Zeroable};
use glam::{Vec3, Vec3A};
use obvhs::BvhBuildParams;
use obvhs::aabb::Aabb;
use obvhs::bvh2::builder::build_bvh2;

/// Boxes are larger than their triangles by this share of the object's largest side, more than their tests round.
const PADDING: f32 = 2e-6;

/// Most triangles of a leaf: four bits hold their number.
const LEAF: u32 = 8;

/// `Node` of shared/hierarchy.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(super) struct Node {
    pub low: Vec3,
    pub skip: u32,
    pub high: Vec3,
    pub leaf: u32,
}

/// Nodes, and the corners of the triangles in the order of the leaves.
pub(super) struct Hierarchy {
    pub nodes: Vec<Node>,
    /// Three a triangle: position; bit k of the first one's last says that edge k runs from the lower to the higher vertex.
    pub corners: Vec<[f32; 4]>,
}

impl Hierarchy {
    /// Whether its bindings hold no more than `most` bytes.
    pub fn fits(&self, most: u64) -> bool {
        let largest = 16 * self.corners.len().max(2 * self.nodes.len()) as u64;
        largest <= most && self.corners.len() < 3 << 28
    }

    /// Of at least one triangle, at most 2^28.
    pub fn new(positions: &[[f32; 3]], triangles: &[[u32; 3]]) -> Self {
        let place = |vertex: u32| Vec3::from(positions[vertex as usize]);
        let bounds = |list: &mut dyn Iterator<Item = Vec3>| {
            list.fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(low, high), p| (low.min(p), high.max(p)))
        };
        let (low, high) = bounds(&mut positions.iter().map(|p| Vec3::from(*p)));
        let padding = PADDING * (high - low).max_element();
        let boxes: Vec<Aabb> = triangles
            .iter()
            .map(|t| {
                let (low, high) = bounds(&mut t.iter().map(|v| place(*v)));
                Aabb::new(Vec3A::from(low - padding), Vec3A::from(high + padding))
            })
            .collect();
        // The best of the presets but for splitting triangles, which would report crossings twice.
        let params = BvhBuildParams {
            pre_split: false,
            max_prims_per_leaf: LEAF,
            ..BvhBuildParams::very_slow_build()
        };
        let bvh = build_bvh2(&boxes, params, &mut Default::default());
        let mut order = Vec::with_capacity(bvh.nodes.len());
        let mut open = if bvh.nodes.is_empty() { Vec::new() } else { vec![0u32] };
        while let Some(index) = open.pop() {
            order.push(index);
            let node = &bvh.nodes[index as usize];
            if !node.is_leaf() {
                open.extend([node.first_index + 1, node.first_index]);
            }
        }
        // Nodes below each, itself included: children come after their parents.
        let mut below = vec![1u32; bvh.nodes.len()];
        for &index in order.iter().rev() {
            let node = &bvh.nodes[index as usize];
            if !node.is_leaf() {
                let first = node.first_index as usize;
                below[index as usize] = 1 + below[first] + below[first + 1];
            }
        }
        let mut corners = Vec::with_capacity(3 * triangles.len());
        let nodes = (0u32..)
            .zip(&order)
            .map(|(at, &index)| {
                let node = &bvh.nodes[index as usize];
                let mut leaf = 0;
                if node.is_leaf() {
                    leaf = 16 * (corners.len() as u32 / 3) + node.prim_count;
                    let slots = node.first_index..node.first_index + node.prim_count;
                    for slot in slots {
                        let t = triangles[bvh.primitive_indices[slot as usize] as usize];
                        let forward = (0..3).filter(|&k| t[k] < t[(k + 1) % 3]).map(|k| 1u32 << k).sum();
                        let last = [f32::from_bits(forward), 0.0, 0.0];
                        corners.extend((0..3).map(|k| place(t[k]).extend(last[k]).to_array()));
                    }
                }
                let aabb = node.aabb();
                Node { low: aabb.min.into(), skip: at + below[index as usize], high: aabb.max.into(), leaf }
            })
            .collect();
        Self { nodes, corners }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_triangle_is_in_one_leaf_and_every_skip_leads_on() {
        // A strip of triangles along x.
        let positions: Vec<[f32; 3]> = (0..60).map(|i| [i as f32, (i % 2) as f32, 0.0]).collect();
        let triangles: Vec<[u32; 3]> = (0..58).map(|i| [i, i + 1, i + 2]).collect();
        let h = Hierarchy::new(&positions, &triangles);
        let mut seen: Vec<f32> = h.corners.iter().step_by(3).map(|c| c[0]).collect();
        seen.sort_unstable_by(f32::total_cmp);
        assert_eq!(seen, (0..58).map(|i| i as f32).collect::<Vec<_>>());
        let in_leaves: u32 = h.nodes.iter().map(|n| n.leaf & 15).sum();
        assert_eq!(in_leaves, 58);
        for (i, n) in h.nodes.iter().enumerate() {
            let next = n.skip as usize;
            assert!(next > i && next <= h.nodes.len());
            assert_eq!(n.leaf > 0, next == i + 1);
            // What is skipped lies within.
            for inner in &h.nodes[i..next] {
                assert!(inner.low.cmpge(n.low).all() && inner.high.cmple(n.high).all());
            }
        }
        assert_eq!(h.nodes[0].skip as usize, h.nodes.len());
    }
}
