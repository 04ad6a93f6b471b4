//! Changes of the material while an asset plays.
//!
//! One density length m serves all channels, τ_c = `extinction`_c · m, so another extinction or albedo needs no new
//! bake: the stored optical depths are for the reference extinction κ̄ and are scaled by κ_c/κ̄, whatever κ_c is.
//! Phase function, index of refraction and density field stay as they were baked.

use crate::{Error, Result};
use diaphane_formats::asset::Info;
use diaphane_formats::medium::Medium;
use glam::DVec3;

/// Largest factor on the extinction.
pub const MOST_SCALE: f64 = 1e6;

/// Factors on the extinction within which an edited asset was measured to have at most 1.5 times the error of one baked
/// anew. Below, the harmonics must tell apart depths that were equally dark when they were fitted (exact depths do
/// not have this limit); above, the samples lie too far apart for light that fades so fast.
pub const MEASURED_SCALES: [f64; 2] = [0.6, 1.8];

/// A material relative to the one that was baked. [`Edit::default`] leaves it as it is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Edit {
    /// Factor on the baked extinction, per channel, 0..=[`MOST_SCALE`].
    pub extinction_scale: DVec3,
    /// Ω per channel, 0..1, instead of the baked one.
    pub albedo: Option<DVec3>,
}

impl Default for Edit {
    fn default() -> Self {
        Self { extinction_scale: DVec3::ONE, albedo: None }
    }
}

impl Edit {
    /// The parameters of an edited asset, from those of the baked one. An error certificate speaks of the material
    /// that was baked and is left out where the edit changes it.
    ///
    /// # Errors
    /// As [`Self::validate`]; an extinction that overflows.
    pub fn apply(&self, baked: &Info) -> Result<Info> {
        self.validate()?;
        let mut info = baked.clone();
        info.extinction = (DVec3::from(baked.extinction) * self.extinction_scale).to_array();
        if !DVec3::from(info.extinction).is_finite() {
            return Err(Error::Edit(format!(
                "the extinction scale {} makes the extinction infinite; use a smaller one",
                self.extinction_scale
            )));
        }
        info.albedo = self.albedo.map_or(baked.albedo, |a| a.to_array());
        if info != *baked {
            info.certificate = None;
        }
        Ok(info)
    }

    /// The same change of a medium.
    ///
    /// # Errors
    /// As [`Self::validate`]; an extinction that overflows.
    pub fn medium(&self, baked: Medium) -> Result<Medium> {
        self.validate()?;
        let extinction = baked.extinction() * self.extinction_scale;
        let albedo = self.albedo.unwrap_or(baked.albedo());
        Ok(baked.with_material(extinction, albedo)?)
    }

    /// Checks the ranges.
    ///
    /// # Errors
    /// The value that is out of range, and the range.
    pub fn validate(&self) -> Result<()> {
        let within = |v: DVec3, most: f64| v.to_array().iter().all(|x| (0.0..=most).contains(x));
        if !within(self.extinction_scale, MOST_SCALE) {
            return Err(Error::Edit(format!(
                "the extinction scale must lie within 0..{MOST_SCALE} in every channel, not {}; 1 is as baked",
                self.extinction_scale
            )));
        }
        match self.albedo {
            Some(albedo) if !within(albedo, 1.0) => Err(Error::Edit(format!(
                "the albedo must lie within 0..1 in every channel, not {albedo}; leave it out to keep the baked one"
            ))),
            _ => Ok(()),
        }
    }

    /// What a user should know about an edit beyond [`MEASURED_SCALES`].
    pub fn warning(&self) -> Option<String> {
        let [least, most] = MEASURED_SCALES;
        let scale = self.extinction_scale;
        (scale.min_element() < least || scale.max_element() > most).then(|| {
            format!(
                "the extinction scale {scale} lies outside {least}..{most}, where edited assets are nearly as good as \
                 new ones; bake that material if errors matter"
            )
        })
    }
}

/// Three channels from text: one number for all, or three with commas between them.
///
/// # Errors
/// What is wrong with the text, in words.
pub fn parse_channels(text: &str) -> std::result::Result<DVec3, String> {
    let numbers: Vec<f64> = text
        .split(',')
        .map(|part| part.trim().parse().map_err(|_| format!("'{}' is not a number", part.trim())))
        .collect::<std::result::Result<_, _>>()?;
    match numbers[..] {
        [all] => Ok(DVec3::splat(all)),
        [r, g, b] => Ok(DVec3::new(r, g, b)),
        _ => Err(format!("give one number or three with commas between them, not {}", numbers.len())),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn channels_are_one_number_or_three() {
        assert_eq!(parse_channels("2"), Ok(DVec3::splat(2.0)));
        assert_eq!(parse_channels("0.5, 1,2e1"), Ok(DVec3::new(0.5, 1.0, 20.0)));
        for wrong in ["", "1,2", "1,2,3,4", "1;2;3", "1,,3", "red"] {
            assert!(parse_channels(wrong).is_err(), "{wrong}");
        }
    }
}
