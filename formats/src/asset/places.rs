//! Positions in 16 bits an axis, a 65535th of the bounding box's side, far below any sample's radius; radii as f16
//! fractions of its diagonal.

use glam::{DVec3, Vec3};
use half::f16;

/// Steps along each axis of the box.
const STEPS: f64 = 65_535.0;

/// The bounding box that positions are counted in.
#[derive(Clone, Copy, Debug)]
pub struct Places {
    low: DVec3,
    step: DVec3,
    diagonal: f64,
}

impl Places {
    /// Positions inside the box `low..high`.
    pub fn new(bounds: [[f32; 3]; 2]) -> Self {
        let [low, high] = bounds.map(|b| Vec3::from(b).as_dvec3());
        Self { low, step: (high - low) / STEPS, diagonal: (high - low).length() }
    }

    /// The nearest code of a position.
    pub fn code(&self, p: DVec3) -> [u16; 3] {
        let s = (p - self.low) / self.step;
        s.to_array().map(|v| if v.is_finite() { v.round().clamp(0.0, STEPS) as u16 } else { 0 })
    }

    /// The position of a code.
    pub fn position(&self, code: [u16; 3]) -> Vec3 {
        (self.low + DVec3::from(code.map(f64::from)) * self.step).as_vec3()
    }

    /// The position as it is stored.
    pub fn rounded(&self, p: DVec3) -> Vec3 {
        self.position(self.code(p))
    }

    /// The nearest code of a radius.
    pub fn radius_code(&self, radius: f64) -> f16 {
        f16::from_f64(radius / self.diagonal)
    }

    /// The radius of a code.
    pub fn radius(&self, code: f16) -> f32 {
        (code.to_f64() * self.diagonal) as f32
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codes_survive_and_errors_stay_below_half_a_step() {
        let places = Places::new([[-1.0, -2.0, 5.0], [3.0, 1.0, 5.5]]);
        for i in 0..1000u64 {
            let unit = |k| crate::directions::hash(i, k) as f64 / 2f64.powi(64);
            let p = DVec3::new(-1.0 + 4.0 * unit(1), -2.0 + 3.0 * unit(2), 5.0 + 0.5 * unit(3));
            let code = places.code(p);
            let q = places.position(code);
            assert_eq!(places.code(q.as_dvec3()), code);
            assert!((q.as_dvec3() - p).abs().cmple(DVec3::new(4.0, 3.0, 0.5) * 0.51 / STEPS + 4e-7).all());
        }
        let code = places.radius_code(0.03);
        assert_eq!(places.radius_code(f64::from(places.radius(code))), code);
        assert!((places.radius(code) - 0.03).abs() < 2e-5);
        assert_eq!(places.code(DVec3::NAN), [0; 3]);
        assert_eq!(Places::new([[0.0; 3]; 2]).position([9; 3]), Vec3::ZERO);
    }
}
