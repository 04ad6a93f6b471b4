//! The mesh on the GPU, in as many parts as the adapter's bindings ask for.
//!
//! Every triangle is drawn by one part. A ray that runs past a triangle by a rounding error is followed into its neighbours
//! (`meet` of surface.wgsl), so a part also holds those of its triangles' neighbours that other parts draw.

use super::bindings::filled_buffer;
use super::corners::Corners;
use super::neighbours::neighbours;
use diaphane_formats::morton;
use glam::{DVec3, Vec3};
use std::collections::HashMap;
use wgpu::{Buffer, BufferUsages, Device};

/// How many neighbours `meet` goes on to, one after the other.
const STEPS: usize = 3;

/// Bytes of a triangle in the largest binding of a part at the most: nine numbers, of its normals or of vertices all its own.
pub(super) const LARGEST: u64 = 36;

/// Some of a mesh's triangles.
#[derive(Clone)]
pub(super) struct MeshPart {
    pub positions: Buffer,
    pub triangles: Buffer,
    pub neighbours: Buffer,
    /// Three a triangle; only where the boundary reflects.
    pub normals: Buffer,
    /// Positions of the vertices that are drawn, and three of them for every triangle; see [`Corners`].
    pub corners: Buffer,
    pub indices: Buffer,
    /// That it draws.
    pub triangle_count: u32,
}

/// What parts are cut from.
pub(super) struct Source<'a> {
    pub positions: &'a [[f32; 3]],
    pub triangles: &'a [[u32; 3]],
    /// Empty, or three a triangle.
    pub normals: &'a [[Vec3; 3]],
}

/// Triangles of a part by their number in the mesh: the first `drawn` are drawn.
#[derive(Debug, PartialEq)]
struct Cut {
    triangles: Vec<u32>,
    drawn: usize,
}

impl Source<'_> {
    /// Uploads the mesh for bindings of `binding` bytes; `None` where not even single triangles fit.
    pub fn upload(&self, device: &Device, binding: u64) -> Option<Vec<MeshPart>> {
        let across = neighbours(self.triangles);
        let largest = (size_of_val(self.positions).max(size_of_val(self.triangles)))
            .max(size_of_val(self.normals)) as u64;
        let cuts = if largest <= binding {
            let all = (0..self.triangles.len() as u32).collect();
            vec![Cut { triangles: all, drawn: self.triangles.len() }]
        } else {
            self.cut(&across, (binding / LARGEST) as usize)?
        };
        Some(cuts.iter().map(|cut| self.part(device, &across, cut)).collect())
    }

    /// Parts of `most` triangles at the most, none of them empty.
    fn cut(&self, across: &[[u32; 3]], most: usize) -> Option<Vec<Cut>> {
        let place = |v: u32| Vec3::from(self.positions[v as usize]).as_dvec3();
        let low = self.positions.iter().map(|p| Vec3::from(*p)).fold(Vec3::MAX, Vec3::min).as_dvec3();
        let high = self.positions.iter().map(|p| Vec3::from(*p)).fold(Vec3::MIN, Vec3::max).as_dvec3();
        let middles = self.triangles.iter().map(|t| t.iter().map(|v| place(*v)).sum::<DVec3>() / 3.0);
        // Parts that hold together have few neighbours.
        let order = morton::order(middles, low, high);
        let mut count = order.len().div_ceil(most.max(1));
        loop {
            let size = order.len().div_ceil(count);
            let cuts: Option<Vec<Cut>> =
                order.chunks(size).map(|drawn| with_neighbours(drawn, across, most)).collect();
            match cuts {
                None if size == 1 => return None,
                // A quarter more of them until they fit.
                None => count = (count + count / 4 + 1).min(order.len()),
                fits => return fits,
            }
        }
    }

    fn part(&self, device: &Device, across: &[[u32; 3]], cut: &Cut) -> MeshPart {
        let mut vertices = Vec::new();
        let mut known: HashMap<u32, u32> = HashMap::new();
        let mut vertex = |v: u32| {
            *known.entry(v).or_insert_with(|| {
                vertices.push(self.positions[v as usize]);
                vertices.len() as u32 - 1
            })
        };
        let triangles: Vec<[u32; 3]> =
            cut.triangles.iter().map(|t| self.triangles[*t as usize].map(&mut vertex)).collect();
        let own: HashMap<u32, u32> = cut.triangles.iter().copied().zip(0..).collect();
        // Nobody goes on from those at the rim.
        let local = |(t, i): (&u32, u32)| across[*t as usize].map(|n| own.get(&n).copied().unwrap_or(i));
        let across: Vec<[u32; 3]> = cut.triangles.iter().zip(0..).map(local).collect();
        let normals: Vec<[Vec3; 3]> = if self.normals.is_empty() {
            Vec::new()
        } else {
            cut.triangles.iter().map(|t| self.normals[*t as usize]).collect()
        };
        let corners = Corners::new(&triangles[..cut.drawn], vertices.len());
        let drawn: Vec<[f32; 3]> = corners.vertices.iter().map(|v| vertices[*v as usize]).collect();
        let storage = BufferUsages::STORAGE;
        MeshPart {
            positions: filled_buffer(device, "positions", &vertices, storage),
            triangles: filled_buffer(device, "triangles", &triangles, storage),
            neighbours: filled_buffer(device, "neighbours", &across, storage),
            normals: filled_buffer(device, "normals", normals.as_flattened(), storage),
            corners: filled_buffer(device, "corners", &drawn, BufferUsages::VERTEX),
            indices: filled_buffer(device, "indices", &corners.indices, BufferUsages::INDEX),
            triangle_count: cut.drawn as u32,
        }
    }
}

/// Triangles and those that can be reached from them in so many steps; `None` where these are more than `most`.
fn with_neighbours(drawn: &[u32], across: &[[u32; 3]], most: usize) -> Option<Cut> {
    let mut triangles = drawn.to_vec();
    let mut known: std::collections::HashSet<u32> = drawn.iter().copied().collect();
    let mut rim = 0..drawn.len();
    for _ in 0..STEPS {
        for k in rim.clone() {
            for next in across[triangles[k] as usize] {
                if known.insert(next) {
                    triangles.push(next);
                }
            }
        }
        rim = rim.end..triangles.len();
    }
    (triangles.len() <= most).then_some(Cut { triangles, drawn: drawn.len() })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A strip of triangles around a cylinder.
    fn strip(count: u32) -> (Vec<[f32; 3]>, Vec<[u32; 3]>) {
        let at = |k: u32| {
            let turn = std::f32::consts::TAU * k as f32 / count as f32;
            [turn.cos(), turn.sin(), (k % 2) as f32 * 0.1]
        };
        let triangle = |k: u32| {
            let [a, b, c] = [k, (k + 1) % count, (k + 2) % count];
            if k.is_multiple_of(2) { [a, b, c] } else { [b, a, c] }
        };
        ((0..count).map(at).collect(), (0..count).map(triangle).collect())
    }

    #[test]
    fn every_triangle_is_drawn_once_and_its_neighbours_are_at_hand() {
        let (positions, triangles) = strip(200);
        let source = Source { positions: &positions, triangles: &triangles, normals: &[] };
        let across = neighbours(&triangles);
        let cuts = source.cut(&across, 60).unwrap();
        assert!(cuts.len() >= 4);
        let mut drawn: Vec<u32> = cuts.iter().flat_map(|c| c.triangles[..c.drawn].to_vec()).collect();
        drawn.sort_unstable();
        assert_eq!(drawn, (0..200).collect::<Vec<u32>>());
        for cut in &cuts {
            assert!(cut.triangles.len() <= 60);
            for start in &cut.triangles[..cut.drawn] {
                let mut reached = vec![*start];
                for _ in 0..STEPS {
                    reached =
                        reached.iter().flat_map(|t| across[*t as usize]).chain(reached.clone()).collect();
                }
                assert!(reached.iter().all(|t| cut.triangles.contains(t)));
            }
        }
        // A triangle and the three on each side of it are seven.
        assert!(source.cut(&across, 7).is_some());
        assert_eq!(source.cut(&across, 6), None);
    }
}
