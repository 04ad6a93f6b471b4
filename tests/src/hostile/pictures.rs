//! Pictures and arrays.

use super::{Use, words};
use diaphane_formats::medium::Grid;
use diaphane_formats::picture::{Display, parse_coverage_npy, parse_exr};
use glam::DVec3;

/// A density grid.
pub(super) fn grid(bytes: &[u8]) -> Result<Use, String> {
    let grid = Grid::parse_npy(bytes, DVec3::NEG_ONE, DVec3::ONE).map_err(words)?;
    Ok(Box::new(move || {
        assert_eq!(grid.values().len(), grid.size().iter().product::<usize>());
        for at in [DVec3::ZERO, DVec3::new(0.4, -0.7, 0.2), DVec3::splat(5.0)] {
            let value = grid.value(at);
            assert!(value >= 0.0 && value.is_finite());
        }
    }))
}

/// A coverage mask in NumPy's format.
pub(super) fn coverage(bytes: &[u8]) -> Result<Use, String> {
    let (width, height, values) = parse_coverage_npy(bytes).map_err(words)?;
    Ok(Box::new(move || assert_eq!(values.len(), width * height)))
}

/// A picture: an environment, a mask, what `compare` compares.
pub(super) fn exr(bytes: &[u8]) -> Result<Use, String> {
    let picture = parse_exr(bytes).map_err(words)?;
    Ok(Box::new(move || {
        let count = picture.width * picture.height;
        assert_eq!(picture.pixels.len(), count);
        assert!(picture.coverage.as_ref().is_none_or(|c| c.len() == count));
        let display = Display::automatic(&picture);
        picture.pixels.iter().take(4096).for_each(|p| _ = display.encode(*p));
    }))
}
