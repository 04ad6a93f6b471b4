//! What [`project`](super::project()) computes, by rays through the box hierarchy: the oracle of the projection, the
//! faster way for few points in a large mesh, and the only one where shells overlap: the medium counts once there, which
//! takes sorting.

use super::along::Along;
use super::rays::count_once;
use super::{Accel, Crossing, DepthRows};
use crate::fresnel;
use crate::medium::{Medium, SampledDensity};
use glam::DVec3;

/// Depths of `points` along the unit vector `direction` and its opposite, one line each.
pub fn trace(
    accel: &Accel,
    medium: &Medium,
    sampled: Option<&SampledDensity>,
    points: &[DVec3],
    direction: DVec3,
) -> DepthRows {
    let running = sampled.map(|s| s.running(direction));
    let along = Along::new(medium, running.as_ref(), points, direction);
    let n = points.len();
    let matched = medium.ior() == 1.0;
    let ones = || vec![1.0f32; if matched { 0 } else { n }];
    let mut rows = DepthRows {
        forward: vec![0.0; n],
        backward: vec![0.0; n],
        boundary: [ones(), ones()],
        winding: [vec![0; n], vec![0; n]],
    };
    let mut crossings: Vec<Crossing> = Vec::new();
    for (i, point) in points.iter().enumerate() {
        for side in 0..2 {
            let turn = if side == 0 { 1.0 } else { -1.0 };
            accel.crossings(*point, turn * direction, 0.0, f64::INFINITY, &mut crossings);
            let winding: i32 = crossings.iter().map(|c| c.sign).sum();
            count_once(&mut crossings);
            let mut depth = 0.0;
            for c in &crossings {
                depth += f64::from(c.sign) * turn * along.integral(i, turn * c.t);
                if !matched {
                    let cosine = accel.normal(c.triangle).dot(direction);
                    rows.boundary[side][i] *= fresnel::transmittance(cosine, medium.ior()) as f32;
                }
            }
            let out = if side == 0 { &mut rows.forward } else { &mut rows.backward };
            out[i] = depth.max(0.0) as f32;
            rows.winding[side][i] = winding as i8;
        }
    }
    rows
}
