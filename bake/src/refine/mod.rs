//! Moves and resizes the samples until the error of ray integrals no longer falls.
//!
//! The samples are measured as the certificate measures them, but with exact light and on rays and lights of their own.
//! First the width of all kernels is searched: wide ones make the sum of kernels even, narrow ones keep what is sharp,
//! and which matters more depends on the medium. Then samples move: every ray's squared error is laid down along the ray
//! where its light comes from ([`map`]); where a sample bears more of it than the mean, radii shrink, elsewhere they
//! grow, and all samples are placed anew at the same number. A change that does not pay is taken back and ends the stage.

mod map;
mod trial;

use crate::field::Shape;
use crate::params::Params;
use crate::progress::Stage;
use crate::report::Refinement;
use crate::samples::{Offered, Placed, place};
use crate::{Input, Prepared, Result};
use map::Map;
use trial::{Measured, Trial};

/// What refinement works on.
pub(crate) struct Bench<'a> {
    pub input: &'a Input<'a>,
    pub shape: &'a Shape<'a>,
    pub medium: &'a Prepared<'a>,
    pub offered: &'a Offered,
    pub params: &'a Params,
}

/// Widths are tried in steps of this factor.
const WIDTH_STEP: f32 = 1.12;
/// Widest and narrowest kernels, full width at half maximum in disk radii.
const WIDTHS: [f32; 2] = [1.0, 2.2];
/// A change must leave less than this part of the error.
const PAYS: f64 = 0.985;

/// Whether a change is kept: never where there is no light to measure, or no error left.
fn pays(tried: &Measured, now: &Measured) -> bool {
    tried.error() < PAYS * now.error()
}

/// The samples, the width of their kernels and what was done, after at most `rounds` moves.
pub(crate) fn refine(
    bench: &Bench<'_>,
    placed: Placed,
    rounds: usize,
    stage: Stage<'_>,
) -> Result<(Placed, f32, Option<Refinement>)> {
    // Each trial announces its own share: the number of them depends on what they find.
    let trial = Trial::new(bench, stage)?;
    let mut width = bench.params.width_factor;
    let mut now = trial.measure(bench, &placed, width, stage)?;
    let before = now.error();
    for step in [WIDTH_STEP, 1.0 / WIDTH_STEP] {
        let started = now.error();
        loop {
            let next = width * step;
            if !(WIDTHS[0]..=WIDTHS[1]).contains(&next) {
                break;
            }
            let tried = trial.measure(bench, &placed, next, stage)?;
            if !pays(&tried, &now) {
                break;
            }
            (width, now) = (next, tried);
        }
        if now.error() < started {
            break;
        }
    }
    let (mut placed, mut moves) = (placed, 0);
    let mut map = Map::even(bench.shape);
    while moves < rounds {
        let next = map.after(&trial, &now, &placed);
        let moved = place(bench.shape, bench.offered, bench.params.samples, |p| next.factor(p), stage)?;
        let tried = trial.measure(bench, &moved, width, stage)?;
        moves += 1;
        if !pays(&tried, &now) {
            break;
        }
        (placed, now, map) = (moved, tried, next);
    }
    let done = Refinement { before, after: now.error(), moves, width_factor: width };
    Ok((placed, width, Some(done)))
}
