//! Unpolarised Fresnel transmittance of a smooth dielectric boundary.
//!
//! F = ½ (r_s² + r_p²) with Snell's law for the inner cosine; any optics text, for example Born and Wolf §1.5.2.
//! The angle is measured outside the object, nothing is bent, and no n² factor is applied.

/// 1 - F for a ray that meets the boundary at `cosine` (absolute value is taken) measured outside; `ior` ≥ 1 is the
/// inside index over the outside one. Range 0..1; exactly 1 for `ior` = 1.
///
/// ```
/// // Normal incidence on glass reflects 4 %.
/// assert!((diaphane_formats::fresnel::transmittance(1.0, 1.5) - 0.96).abs() < 1e-12);
/// ```
pub fn transmittance(cosine: f64, ior: f64) -> f64 {
    if ior == 1.0 {
        return 1.0;
    }
    let outside = cosine.abs().min(1.0);
    let inside = (1.0 - (1.0 - outside * outside) / (ior * ior)).max(0.0).sqrt();
    let s = (outside - ior * inside) / (outside + ior * inside);
    let p = (ior * outside - inside) / (ior * outside + inside);
    (1.0 - 0.5 * (s * s + p * p)).clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::transmittance;

    #[test]
    fn limits() {
        for ior in [1.0, 1.3, 1.5, 2.4] {
            let normal = 1.0 - ((ior - 1.0) / (ior + 1.0_f64)).powi(2);
            assert!((transmittance(1.0, ior) - normal).abs() < 1e-12);
            assert!((transmittance(-1.0, ior) - normal).abs() < 1e-12);
        }
        assert_eq!(transmittance(0.0, 1.5), 0.0);
        assert_eq!(transmittance(0.3, 1.0), 1.0);
    }

    #[test]
    fn brewster_angle_transmits_all_of_p() {
        // At tan θ = n the p-polarised part is not reflected: F = r_s²/2.
        let ior: f64 = 1.5;
        let outside = 1.0 / (1.0 + ior * ior).sqrt();
        let inside = (1.0 - (1.0 - outside * outside) / (ior * ior)).sqrt();
        let s = (outside - ior * inside) / (outside + ior * inside);
        assert!((transmittance(outside, ior) - (1.0 - 0.5 * s * s)).abs() < 1e-12);
    }
}
