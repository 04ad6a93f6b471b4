//! Solids over a base density; later entries lie on top of earlier ones.

use crate::mesh::Mesh;
use crate::visibility::{Accel, Crossing};
use glam::DVec3;

/// A region of space.
pub enum Solid {
    /// A ball.
    Sphere {
        /// Centre.
        center: DVec3,
        /// Radius.
        radius: f64,
    },
    /// An axis-aligned box.
    Box {
        /// Lower corner.
        min: DVec3,
        /// Upper corner.
        max: DVec3,
    },
    /// A ring.
    Torus {
        /// Centre.
        center: DVec3,
        /// Unit vector along the axis.
        axis: DVec3,
        /// Distance of the tube's centre from the axis.
        radius: f64,
        /// Radius of the tube.
        tube: f64,
    },
    /// The inside of a closed mesh.
    Mesh(Box<(Mesh, Accel)>),
}

impl std::fmt::Debug for Solid {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Sphere { center, radius } => write!(f, "Sphere({center}, {radius})"),
            Self::Box { min, max } => write!(f, "Box({min}, {max})"),
            Self::Torus { center, axis, radius, tube } => {
                write!(f, "Torus({center}, {axis}, {radius}, {tube})")
            }
            Self::Mesh(m) => write!(f, "Mesh({} triangles)", m.0.triangles.len()),
        }
    }
}

/// A solid with its density.
#[derive(Debug)]
pub struct Shape {
    /// Where.
    pub solid: Solid,
    /// ρ inside.
    pub density: f64,
    /// It scatters nothing: κs = 0.
    pub absorb: bool,
}

/// A base density and solids.
#[derive(Debug)]
pub struct Shapes {
    /// ρ outside all solids.
    pub base: f64,
    /// The solids, later ones on top.
    pub shapes: Vec<Shape>,
}

impl Shapes {
    /// ρ and its scattering part.
    pub fn value(&self, x: DVec3) -> (f64, f64) {
        match self.shapes.iter().rev().find(|s| s.solid.contains(x)) {
            Some(s) => (s.density, if s.absorb { 0.0 } else { s.density }),
            None => (self.base, self.base),
        }
    }

    /// Exact up to the accuracy of the crossings: the field is constant between the solids' boundaries.
    pub(super) fn integral(&self, origin: DVec3, direction: DVec3, start: f64, end: f64) -> f64 {
        let mut cuts = vec![start, end];
        for shape in &self.shapes {
            shape.solid.crossings(origin, direction, &mut cuts);
        }
        let (low, high) = (start.min(end), start.max(end));
        cuts.retain(|t| (low..=high).contains(t));
        cuts.sort_unstable_by(f64::total_cmp);
        let sum: f64 = cuts
            .windows(2)
            .map(|w| (w[1] - w[0]) * self.value(origin + direction * (0.5 * (w[0] + w[1]))).0)
            .sum();
        if end < start { -sum } else { sum }
    }

    /// The smallest solid's size.
    pub(super) fn feature(&self) -> f64 {
        self.shapes.iter().map(|s| s.solid.size()).fold(f64::INFINITY, f64::min)
    }
}

impl Solid {
    fn contains(&self, x: DVec3) -> bool {
        match self {
            Self::Sphere { center, radius } => (x - *center).length_squared() < radius * radius,
            Self::Box { min, max } => x.cmpgt(*min).all() && x.cmplt(*max).all(),
            Self::Torus { center, axis, radius, tube } => torus_distance(x - *center, *axis, *radius) < *tube,
            Self::Mesh(m) => {
                let mut crossings: Vec<Crossing> = Vec::new();
                m.1.crossings(x, DVec3::new(0.36, 0.48, 0.8), 0.0, f64::INFINITY, &mut crossings);
                crossings.iter().map(|c| c.sign).sum::<i32>() > 0
            }
        }
    }

    /// Ray parameters where the ray may pass the boundary.
    fn crossings(&self, origin: DVec3, direction: DVec3, out: &mut Vec<f64>) {
        match self {
            Self::Sphere { center, radius } => {
                let p = origin - *center;
                let b = p.dot(direction);
                let d = b * b - p.length_squared() + radius * radius;
                if d > 0.0 {
                    out.extend([-b - d.sqrt(), -b + d.sqrt()]);
                }
            }
            Self::Box { min, max } => {
                for k in 0..3 {
                    if direction[k] != 0.0 {
                        out.extend([
                            (min[k] - origin[k]) / direction[k],
                            (max[k] - origin[k]) / direction[k],
                        ]);
                    }
                }
            }
            Self::Torus { center, axis, radius, tube } => {
                torus_crossings(origin - *center, direction, *axis, *radius, *tube, out);
            }
            Self::Mesh(m) => {
                let mut crossings = Vec::new();
                m.1.crossings(origin, direction, f64::NEG_INFINITY, f64::INFINITY, &mut crossings);
                out.extend(crossings.iter().map(|c| c.t));
            }
        }
    }

    fn size(&self) -> f64 {
        match self {
            Self::Sphere { radius, .. } => *radius,
            Self::Box { min, max } => (*max - *min).min_element(),
            Self::Torus { tube, .. } => *tube,
            Self::Mesh(m) => 0.05 * m.0.diagonal(),
        }
    }
}

/// Distance from the tube's centre circle.
fn torus_distance(p: DVec3, axis: DVec3, radius: f64) -> f64 {
    let h = p.dot(axis);
    let ring = (p - axis * h).length() - radius;
    ring.hypot(h)
}

/// Steps to a torus's crossings at the most; a ray that needs more runs along its surface.
const MOST_STEPS: usize = 100_000;

/// Steps along the ray by the distance to the tube, which never oversteps, and bisects each change of sign.
fn torus_crossings(p: DVec3, direction: DVec3, axis: DVec3, radius: f64, tube: f64, out: &mut Vec<f64>) {
    let b = p.dot(direction);
    // A little larger than the torus, so that the first step starts outside it.
    let bound = radius + 1.01 * tube;
    let d = b * b - p.length_squared() + bound * bound;
    if d <= 0.0 {
        return;
    }
    let distance = |t: f64| torus_distance(p + direction * t, axis, radius) - tube;
    let (mut t, last) = (-b - d.sqrt(), -b + d.sqrt());
    let mut value = distance(t);
    // A step that is lost in rounding would never arrive.
    let least = (1e-4 * tube).max(4.0 * f64::EPSILON * (t.abs() + last.abs()));
    for _ in 0..MOST_STEPS {
        if t >= last {
            break;
        }
        let step = value.abs().max(least);
        let next_value = distance(t + step);
        if (value < 0.0) != (next_value < 0.0) {
            let (mut low, mut high) = (t, t + step);
            for _ in 0..40 {
                let middle = 0.5 * (low + high);
                if (distance(middle) < 0.0) == (value < 0.0) { low = middle } else { high = middle }
            }
            out.push(0.5 * (low + high));
        }
        t += step;
        value = next_value;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn torus_and_sphere_lengths() {
        let shapes = Shapes {
            base: 0.5,
            shapes: vec![
                Shape {
                    solid: Solid::Torus { center: DVec3::ZERO, axis: DVec3::Y, radius: 0.5, tube: 0.2 },
                    density: 10.0,
                    absorb: true,
                },
                Shape {
                    solid: Solid::Sphere { center: DVec3::ZERO, radius: 0.1 },
                    density: 2.0,
                    absorb: false,
                },
            ],
        };
        // Through the middle along x: two tube diameters of 0.4, the ball of 0.2, the rest of 2 at the base density.
        let got = shapes.integral(DVec3::new(-1.0, 0.0, 0.0), DVec3::X, 0.0, 2.0);
        assert!((got - (0.8 * 10.0 + 0.2 * 2.0 + 1.0 * 0.5)).abs() < 1e-9, "{got}");
        assert_eq!(shapes.value(DVec3::new(0.5, 0.0, 0.0)), (10.0, 0.0));
        assert_eq!(shapes.value(DVec3::ZERO), (2.0, 2.0));
    }
}
