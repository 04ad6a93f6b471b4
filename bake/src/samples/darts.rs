//! Dart throwing with variable radii in constant time a dart (after White and Egbert, thesis reference 131).

use super::Candidate;
use crate::Result;
use crate::field::Shape;
use crate::progress::Stage;
use glam::DVec3;

/// Finds the scale of the radii at which about `wanted` darts are kept, and keeps them.
pub(super) fn throw_to_count(
    shape: &Shape<'_>,
    candidates: impl Iterator<Item = Candidate> + Clone,
    wanted: usize,
    stage: &Stage<'_>,
) -> Result<Vec<Candidate>> {
    let mut scale = 0.9 * shape.spacing;
    let mut best: Option<Vec<Candidate>> = None;
    for _ in 0..8 {
        let kept = throw(shape, candidates.clone(), scale, stage)?;
        stage.step(1)?;
        let count = kept.len();
        let error = |n: usize| (n as f64 / wanted as f64).ln().abs();
        if best.as_ref().is_none_or(|b| error(count) < error(b.len())) {
            best = Some(kept);
        }
        if error(count) < CLOSE {
            break;
        }
        // The count falls with the cube of the scale, less steeply where candidates run out.
        scale *= (count as f64 / wanted as f64).cbrt().clamp(0.25, 4.0);
    }
    Ok(best.unwrap_or_default())
}

/// Linked lists of kept darts in the cells of a grid.
struct Cells {
    origin: DVec3,
    inverse: f64,
    size: [i64; 3],
    first: Vec<u32>,
    next: Vec<u32>,
    /// Neighbouring cells, nearest first, with the least distance to them in cells.
    offsets: Vec<([i64; 3], f64)>,
}

/// Relative difference to the wanted number that ends the search.
const CLOSE: f64 = 0.02;

const NONE: u32 = u32::MAX;

/// Darts between two looks at whether the bake should stop.
const LOOK_UP: usize = 1 << 16;

impl Cells {
    fn new(shape: &Shape<'_>, cell: f64) -> Self {
        let (low, high) = shape.mesh.bounds();
        let inverse = 1.0 / cell;
        let size = ((high - low) * inverse).to_array().map(|e| e as i64 + 1);
        let mut offsets = Vec::new();
        for x in -2i64..=2 {
            for y in -2i64..=2 {
                for z in -2i64..=2 {
                    let gap = [x, y, z].map(|c| (c.abs() - 1).max(0) as f64);
                    offsets.push(([x, y, z], gap.iter().map(|g| g * g).sum::<f64>().sqrt()));
                }
            }
        }
        offsets.sort_by(|a, b| {
            let key = |o: &([i64; 3], f64)| o.0.iter().map(|c| c * c).sum::<i64>();
            key(a).cmp(&key(b))
        });
        let count = size.iter().product::<i64>() as usize;
        Self { origin: low, inverse, size, first: vec![NONE; count], next: Vec::new(), offsets }
    }

    fn cell(&self, p: DVec3) -> [i64; 3] {
        let s = (p - self.origin) * self.inverse;
        [0, 1, 2].map(|k| (s[k] as i64).clamp(0, self.size[k] - 1))
    }

    fn index(&self, c: [i64; 3]) -> usize {
        ((c[2] * self.size[1] + c[1]) * self.size[0] + c[0]) as usize
    }
}

/// Two samples keep the mean of their radii apart.
fn throw(
    shape: &Shape<'_>,
    candidates: impl Iterator<Item = Candidate>,
    scale: f64,
    stage: &Stage<'_>,
) -> Result<Vec<Candidate>> {
    // Radii lie within 1/2..2 of the scale, so no disk reaches further than two cells of one scale.
    let mut cells = Cells::new(shape, scale.max(shape.diagonal / 400.0));
    let cell = 1.0 / cells.inverse;
    let mut kept: Vec<Candidate> = Vec::new();
    for (i, candidate) in candidates.enumerate() {
        if i % LOOK_UP == 0 {
            stage.step(0)?;
        }
        let radius = candidate.radius * scale;
        let home = cells.cell(candidate.position);
        let reach = 0.5 * (radius + 2.0 * scale);
        let free = cells.offsets.iter().all(|(offset, gap)| {
            if gap * cell >= reach {
                return true;
            }
            let c = [0, 1, 2].map(|k| home[k] + offset[k]);
            if (0..3).any(|k| c[k] < 0 || c[k] >= cells.size[k]) {
                return true;
            }
            let mut at = cells.first[cells.index(c)];
            while at != NONE {
                let other = &kept[at as usize];
                let apart = 0.5 * (radius + other.radius);
                if (other.position - candidate.position).length_squared() < apart * apart {
                    return false;
                }
                at = cells.next[at as usize];
            }
            true
        });
        if free {
            let index = cells.index(home);
            cells.next.push(cells.first[index]);
            cells.first[index] = kept.len() as u32;
            kept.push(Candidate { radius, ..candidate });
        }
    }
    Ok(kept)
}
