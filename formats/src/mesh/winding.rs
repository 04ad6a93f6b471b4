//! Generalized winding numbers: how often triangles wrap around a point, whether or not they are closed.
//!
//! ```text
//! w(q) = 1/4π Σ Ω_t(q)        tan(Ω/2) = a·(b×c) / (|a||b||c| + (a·b)|c| + (b·c)|a| + (c·a)|b|)
//! ```
//!
//! with a, b, c the corners of triangle t seen from q (mesh units) and Ω its signed solid angle in sr. 1 inside a closed
//! surface with outward normals, 0 outside, in between where faces are missing. Jacobson, Kavan and Sorkine-Hornung 2013
//! ("Robust inside-outside segmentation using generalized winding numbers", ACM Trans. Graph. 32(4), article 33); the solid
//! angle after van Oosterom and Strackee 1983 ("The solid angle of a plane triangle", IEEE Trans. Biomed. Eng. 30, p. 125,
//! equation 8).
//!
//! The hierarchical form replaces triangles far away by a dipole at their centre, Σ A_t n_t · (c - q) / (4π |c - q|³):
//! the first term of the expansion of Barill, Dickson, Schmidt, Levin and Jacobson 2018 ("Fast winding numbers for soups
//! and clouds", ACM Trans. Graph. 37(4), article 43). Deviation: their further terms are left out, nodes must be further
//! away instead. Nodes are halves of the triangles along the longest axis, centres are weighted with area. Checked against
//! the plain sum below.

use glam::DVec3;
use std::f64::consts::PI;

/// Nodes further away than so many of their radii count as a dipole. Barill et al. take 2 with more terms.
const FAR: f64 = 3.0;

/// Triangles of a leaf, at the most.
const LEAF: usize = 8;

/// Triangles with the hierarchy that finds their winding number.
pub struct Winding {
    corners: Vec<[DVec3; 3]>,
    /// Depth first: a node's first half follows it.
    nodes: Vec<Node>,
}

struct Node {
    centre: DVec3,
    /// Σ A n of its triangles.
    dipole: DVec3,
    /// Furthest corner from the centre.
    radius: f64,
    start: usize,
    end: usize,
    /// Its second half; 0 for a leaf.
    second: usize,
}

impl Winding {
    /// Builds the hierarchy over triangles, counter-clockwise seen from outside, in mesh units. Time O(n log n).
    pub fn new(corners: Vec<[DVec3; 3]>) -> Self {
        let mut tree = Self { corners, nodes: Vec::new() };
        if !tree.corners.is_empty() {
            tree.split(0, tree.corners.len());
        }
        tree
    }

    fn split(&mut self, start: usize, end: usize) {
        let own = &mut self.corners[start..end];
        let (mut dipole, mut weighted, mut weight, mut plain) = (DVec3::ZERO, DVec3::ZERO, 0.0, DVec3::ZERO);
        let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for t in own.iter() {
            let normal = 0.5 * (t[1] - t[0]).cross(t[2] - t[0]);
            let (area, middle) = (normal.length(), middle(t));
            dipole += normal;
            weighted += area * middle;
            weight += area;
            plain += middle;
            (low, high) = (low.min(middle), high.max(middle));
        }
        let centre = if weight > 0.0 { weighted / weight } else { plain / own.len() as f64 };
        let radius = own.iter().flatten().map(|p| p.distance(centre)).fold(0.0, f64::max);
        let at = self.nodes.len();
        let leaf = own.len() <= LEAF;
        if !leaf {
            let axis = (high - low).max_position();
            let half = own.len() / 2;
            own.select_nth_unstable_by(half, |a, b| middle(a)[axis].total_cmp(&middle(b)[axis]));
        }
        self.nodes.push(Node { centre, dipole, radius, start, end, second: 0 });
        if !leaf {
            let half = start + (end - start) / 2;
            self.split(start, half);
            self.nodes[at].second = self.nodes.len();
            self.split(half, end);
        }
    }

    /// w at `point`, by the hierarchical form: within 0.03 of the sum over all triangles for the shapes of the test.
    pub fn at(&self, point: DVec3) -> f64 {
        self.with_far(point, FAR)
    }

    /// As [`Winding::at`]; nodes beyond `far` radii count as dipoles.
    fn with_far(&self, point: DVec3, far: f64) -> f64 {
        let mut sum = 0.0;
        let mut stack = vec![0];
        while let Some(at) = stack.pop() {
            let Some(node) = self.nodes.get(at) else { continue };
            let offset = node.centre - point;
            let distance = offset.length();
            if distance > far * node.radius {
                sum += node.dipole.dot(offset) / distance.powi(3);
            } else if node.second == 0 {
                sum += self.corners[node.start..node.end].iter().map(|t| solid_angle(t, point)).sum::<f64>();
            } else {
                stack.extend([node.second, at + 1]);
            }
        }
        sum / (4.0 * PI)
    }
}

fn middle(t: &[DVec3; 3]) -> DVec3 {
    (t[0] + t[1] + t[2]) / 3.0
}

/// Signed solid angle of a triangle seen from `point`, sr: positive where its back is seen, as from inside.
pub(super) fn solid_angle(corners: &[DVec3; 3], point: DVec3) -> f64 {
    let [a, b, c] = corners.map(|p| p - point);
    let (la, lb, lc) = (a.length(), b.length(), c.length());
    let denominator = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
    2.0 * a.dot(b.cross(c)).atan2(denominator)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A tube around the y axis whose radius varies, in `n` rings; closed by discs if asked.
    fn vase(n: usize, closed: bool) -> Vec<[DVec3; 3]> {
        let at = |ring: usize, k: usize| {
            let (y, turn) = (ring as f64 / n as f64, 2.0 * PI * (k % n) as f64 / n as f64);
            let radius = 0.5 + 0.3 * (6.0 * y).sin();
            DVec3::new(radius * turn.cos(), 2.0 * y - 1.0, radius * turn.sin())
        };
        let mut triangles = Vec::new();
        for k in 0..n {
            for ring in 0..n {
                let [a, b, c, d] = [at(ring, k), at(ring + 1, k), at(ring + 1, k + 1), at(ring, k + 1)];
                triangles.extend([[a, b, c], [a, c, d]]);
            }
            if closed {
                triangles.push([at(0, k), at(0, k + 1), DVec3::NEG_Y]);
                triangles.push([at(n, k + 1), at(n, k), DVec3::Y]);
            }
        }
        triangles
    }

    fn plain(triangles: &[[DVec3; 3]], q: DVec3) -> f64 {
        triangles.iter().map(|t| solid_angle(t, q)).sum::<f64>() / (4.0 * PI)
    }

    fn lattice() -> impl Iterator<Item = DVec3> {
        (0..1000).map(|i| DVec3::new((i % 10) as f64, (i / 10 % 10) as f64, (i / 100) as f64) / 4.37 - 1.03)
    }

    /// Largest difference from the plain sum.
    fn worst(triangles: &[[DVec3; 3]], far: f64) -> f64 {
        let tree = Winding::new(triangles.to_vec());
        lattice().map(|q| (tree.with_far(q, far) - plain(triangles, q)).abs()).fold(0.0, f64::max)
    }

    #[test]
    fn closed_surfaces_wind_once_or_not_at_all() {
        let triangles = vase(40, true);
        for q in lattice() {
            let w = plain(&triangles, q);
            assert!((w - w.round()).abs() < 1e-9, "{w} at {q}");
        }
        assert!((plain(&triangles, DVec3::ZERO) - 1.0).abs() < 1e-9);
        assert_eq!(Winding::new(triangles).at(DVec3::ZERO).round(), 1.0);
    }

    #[test]
    fn a_square_seen_from_its_side() {
        // The face of a cube takes a sixth of the sphere around its centre; from behind the sign is the other one.
        let corner = |x: f64, z: f64| DVec3::new(x, 1.0, z);
        let [a, b, c, d] = [corner(-1.0, -1.0), corner(-1.0, 1.0), corner(1.0, 1.0), corner(1.0, -1.0)];
        let square = [[a, b, c], [a, c, d]];
        assert!((plain(&square, DVec3::ZERO) - 1.0 / 6.0).abs() < 1e-12);
        assert!((plain(&square, 2.0 * DVec3::Y) + 1.0 / 6.0).abs() < 1e-12);
    }

    #[test]
    fn the_hierarchy_agrees_with_the_plain_sum() {
        for closed in [false, true] {
            let triangles = vase(40, closed);
            let errors = [FAR, 2.0 * FAR, 4.0 * FAR].map(|far| worst(&triangles, far));
            // The first term left out falls with the square of the distance at least.
            assert!(
                errors[0] < 0.03 && errors[1] < 0.5 * errors[0] && errors[2] < 0.5 * errors[1],
                "{errors:?}"
            );
            assert!(worst(&triangles, f64::INFINITY) < 1e-12);
        }
    }

    #[test]
    fn nothing_has_no_winding() {
        assert_eq!(Winding::new(Vec::new()).at(DVec3::ZERO), 0.0);
        let point = Winding::new(vec![[DVec3::X; 3]]);
        assert!(point.at(DVec3::X).is_finite() && point.at(DVec3::ZERO).is_finite());
    }
}
