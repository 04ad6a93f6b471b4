//! Entries of the cache by the name of their stage, for checks from outside a bake.

use crate::cache;
use crate::certificate::Measured;
use crate::field::DistanceGrid;
use crate::fit::{FirstFits, Fits, Lit};
use crate::levels::Nested;
use crate::params::Params;
use crate::pipeline::{Lighting, Placing};
use crate::{Error, Result};

/// Stages whose results a cache keeps.
pub const STAGES: [&str; 8] = [
    "samples",
    "distance field",
    "optical depth",
    "harmonics",
    "more bands",
    "light",
    "weights",
    "certificate",
];

/// Checks the bytes of an entry as a bake of an index-matched object with `samples` samples does before it uses it.
///
/// # Errors
/// A damaged entry, one of another bake, an unknown stage.
pub fn check(stage: &str, bytes: &[u8], samples: usize, params: &Params) -> Result<()> {
    let held_out = if params.certificate { crate::certificate::exact_lights(params.seed).len() } else { 0 };
    let directions = params.directions.next_multiple_of(2);
    let fits = match stage {
        "samples" => cache::parse(bytes).map(|v: Placing| v.fits()),
        "distance field" => cache::parse(bytes).map(|v: DistanceGrid| v.fits()),
        "optical depth" => cache::parse(bytes).map(|v: Lit| v.fits(samples, directions, true, held_out)),
        "harmonics" => cache::parse(bytes).map(|v: FirstFits| v.fits(samples, params)),
        "more bands" => cache::parse(bytes).map(|v: Fits| v.fits(samples, true, params)),
        "light" => cache::parse(bytes).map(|v: Lighting| v.fits(samples, true, held_out, params)),
        "weights" => cache::parse(bytes).map(|v: Nested| v.fits(samples)),
        "certificate" => cache::parse(bytes).map(|v: Measured| v.fits(params.seed)),
        other => Err(format!("has the unknown stage '{other}'")),
    };
    match fits {
        Ok(true) => Ok(()),
        Ok(false) => Err(Error::Parameter("the entry belongs to another bake".to_owned())),
        Err(problem) => Err(Error::Parameter(format!("the entry {problem}"))),
    }
}
