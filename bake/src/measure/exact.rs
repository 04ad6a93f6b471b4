//! Light that arrives at the samples as it is: means over their cells, no harmonics.

use crate::field::Shape;
use crate::fit::Cells;
use crate::progress::Stage;
use crate::{Prepared, Result, visibility};
use glam::DVec3;
use rayon::prelude::*;

/// For each of `lights` (unit vector towards it, channel): the mean of ψβ over every sample's cell.
pub(crate) fn means(
    shape: &Shape<'_>,
    medium: &Prepared<'_>,
    cells: &Cells,
    lights: &[(DVec3, usize)],
    stage: Stage<'_>,
) -> Result<Vec<Vec<f32>>> {
    stage.announce(lights.len());
    let points = cells.points();
    lights
        .par_iter()
        .map(|(towards, channel)| {
            let kappa = medium.medium.extinction()[*channel] as f32;
            let rows = visibility::depths(shape, medium, shape.visibility, points, *towards);
            let through = |q: usize| rows.boundary[0].get(q).copied().unwrap_or(1.0);
            let arriving = cells.means(|q| (-kappa * rows.forward[q]).exp() * through(q));
            stage.step(1)?;
            Ok(arriving)
        })
        .collect()
}
