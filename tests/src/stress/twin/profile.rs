//! The medium along an inside piece: the head of `formats`' `reconstruct` in double precision.
//!
//! What the player defines is what is computed here: running sums over two midpoints in each of 32 cells, straight
//! lines between them, and four equal parts of a kernel's support with one density each. So the error bound holds what
//! single precision does to that, not what the definition leaves out.

use super::{Bounded, U};
use diaphane_formats::asset::DensityGrid;
use diaphane_formats::hits::PARTS;
use diaphane_formats::reconstruct::PROFILE_CELLS;
use glam::DVec3;

/// Midpoints in each cell of a profile.
const SUBSTEPS: usize = 2;

/// A density field, and how fast it changes.
pub struct Density<'a> {
    grid: &'a DensityGrid,
    low: DVec3,
    size: DVec3,
    /// Largest value.
    pub most: f64,
    /// Largest change of a value over a unit of length.
    slope: f64,
}

impl<'a> Density<'a> {
    /// Of an asset.
    pub fn new(grid: &'a DensityGrid) -> Self {
        let low = DVec3::from(grid.min.map(f64::from));
        let size = DVec3::from(grid.max.map(f64::from)) - low;
        let value = |i: usize| grid.values[i].map(|v| v.to_f64());
        let n = grid.size.map(|n| n as usize);
        let mut change = DVec3::ZERO;
        for i in 0..grid.values.len() {
            let place = [i % n[0], i / n[0] % n[1], i / (n[0] * n[1])];
            for (axis, stride) in [1, n[0], n[0] * n[1]].into_iter().enumerate() {
                if place[axis] + 1 < n[axis] {
                    let (a, b) = (value(i), value(i + stride));
                    let step = (a[0] - b[0]).abs().max((a[1] - b[1]).abs());
                    change[axis] = change[axis].max(step * n[axis] as f64 / size[axis]);
                }
            }
        }
        let most = grid.values.iter().flatten().map(|v| v.to_f64()).fold(0.0, f64::max);
        Self { grid, low, size, most, slope: change.length() }
    }

    /// [ρ, its scattering part] at a point.
    fn value(&self, p: DVec3) -> [f64; 2] {
        let n = self.grid.size.map(|n| n as usize);
        let unit = (p - self.low) / self.size;
        let place: [(usize, usize, f64); 3] = std::array::from_fn(|k| {
            let s = (unit[k] * n[k] as f64 - 0.5).clamp(0.0, (n[k] - 1) as f64);
            (s as usize, (s as usize + 1).min(n[k] - 1), s.fract())
        });
        let mut out = [0.0; 2];
        for corner in 0..8 {
            let (mut index, mut share) = (0, 1.0);
            for k in (0..3).rev() {
                let (low, high, f) = place[k];
                let far = corner >> k & 1 == 1;
                index = index * n[k] + if far { high } else { low };
                share *= if far { f } else { 1.0 - f };
            }
            let values = self.grid.values[index];
            out.iter_mut().zip(values).for_each(|(o, v)| *o += share * v.to_f64());
        }
        out
    }
}

/// Running integrals along a piece.
struct Sums {
    start: f64,
    cell: f64,
    /// [∫ρ, ∫scattering ρ, ∫scattering ρ · distance from the piece's start] at the ends of the cells.
    at: [[f64; 3]; PROFILE_CELLS + 1],
    /// What the sums may be off for where single precision looks the density up: in ∫ρ, and in the others likewise.
    misplaced: [f64; PROFILE_CELLS + 1],
    /// What rounding may add to each.
    rounded: [[f64; 3]; PROFILE_CELLS + 1],
    /// Largest density.
    most: f64,
}

impl Sums {
    fn new(density: &Density, origin: DVec3, direction: DVec3, start: f64, end: f64) -> Self {
        let cell = (end - start) / PROFILE_CELLS as f64;
        let h = cell / SUBSTEPS as f64;
        let mut sums = Self {
            start,
            cell,
            at: [[0.0; 3]; PROFILE_CELLS + 1],
            misplaced: [0.0; PROFILE_CELLS + 1],
            rounded: [[0.0; 3]; PROFILE_CELLS + 1],
            most: density.most,
        };
        let (mut sum, mut misplaced, mut rounded) = ([0.0; 3], 0.0, [0.0; 3]);
        for k in 0..PROFILE_CELLS {
            for s in 0..SUBSTEPS {
                let along = (k as f64 * SUBSTEPS as f64 + s as f64 + 0.5) * h;
                let t = start + along;
                let value = density.value(origin + direction * t);
                let blur = 4.0 * U * (origin.length() + t.abs() + density.size.length());
                misplaced += (density.slope * blur).min(density.most) * h;
                let terms = [value[0] * h, value[1] * h, value[1] * h * along];
                for (v, term) in terms.into_iter().enumerate() {
                    sum[v] += term;
                    rounded[v] += U * (12.0 * term + sum[v]);
                }
            }
            sums.at[k + 1] = sum;
            sums.misplaced[k + 1] = misplaced;
            sums.rounded[k + 1] = rounded;
        }
        sums
    }

    /// The integrals from the piece's start to `t`, and the cell that holds it.
    fn to(&self, t: f64) -> ([f64; 3], usize) {
        let s = ((t - self.start) / self.cell).clamp(0.0, PROFILE_CELLS as f64);
        let i = (s as usize).min(PROFILE_CELLS - 1);
        let f = s - i as f64;
        let (low, high) = (self.at[i], self.at[i + 1]);
        let mut value: [f64; 3] = std::array::from_fn(|v| low[v] + (high[v] - low[v]) * f);
        value[2] -= 0.5 * (high[1] - low[1]) * f * (1.0 - f) * self.cell;
        (value, i)
    }

    /// The integrals over `from..to`. What is off in the sums in front of `from` is off at both ends, and leaves the
    /// difference.
    fn between(&self, from: f64, to: f64) -> Between {
        let ((first, i), (last, k)) = (self.to(from), self.to(to));
        Between {
            value: std::array::from_fn(|v| last[v] - first[v]),
            misplaced: self.misplaced[k + 1] - self.misplaced[i],
            rounded: std::array::from_fn(|v| {
                self.rounded[k + 1][v] - self.rounded[i][v] + 8.0 * U * self.at[k + 1][v]
            }),
        }
    }
}

/// Integrals over a part of a piece, and what they may be off, as [`Sums`] has it.
struct Between {
    value: [f64; 3],
    misplaced: f64,
    rounded: [f64; 3],
}

/// A part of a kernel's support in which the density is even.
pub struct Part {
    /// Ray parameter of its start.
    pub from: f64,
    /// How long it is.
    pub length: f64,
    /// ∫ρ in front of it, from the piece's start.
    pub before: Bounded,
    /// Mean ρ.
    pub density: Bounded,
    /// Mean of its scattering part.
    pub scattering: Bounded,
    /// From its middle to where it scatters in the mean, as far as the density says.
    pub shift: Bounded,
}

/// The medium along one inside piece, at unit extinction.
pub struct Along {
    start: f64,
    end: f64,
    /// Absent where the density is even.
    sums: Option<Box<Sums>>,
}

impl Along {
    /// Along `start..end` of a ray.
    pub fn new(density: Option<&Density>, origin: DVec3, direction: DVec3, start: f64, end: f64) -> Self {
        let sums = density.map(|d| Box::new(Sums::new(d, origin, direction, start, end)));
        Self { start, end, sums }
    }

    /// ∫ρ of the whole piece.
    pub fn depth(&self) -> Bounded {
        match &self.sums {
            None => Bounded { value: self.end - self.start, error: 0.0 },
            Some(s) => {
                let [last, ..] = s.at[PROFILE_CELLS];
                Bounded { value: last, error: s.misplaced[PROFILE_CELLS] + s.rounded[PROFILE_CELLS][0] }
            }
        }
    }

    /// ∫ e^{-τ} κs/Ω dt over the piece, that is A of `reconstruct`, for the extinction `kappa`.
    pub fn emission(&self, kappa: f64) -> Bounded {
        let Some(sums) = &self.sums else {
            let value = -(-kappa * (self.end - self.start)).exp_m1();
            return Bounded { value, error: 0.0 };
        };
        let mut total = Bounded::default();
        for k in 0..PROFILE_CELLS {
            let (first, last) = (sums.at[k], sums.at[k + 1]);
            let [dense, scattering] = [0, 1].map(|v| last[v] - first[v]);
            let misplaced = sums.misplaced[k + 1] - sums.misplaced[k];
            // Of a difference of running sums: what its own terms are off, and the rounding of the sums.
            let [dense_error, scattering_error] =
                [0, 1].map(|v| misplaced + sums.rounded[k + 1][v] - sums.rounded[k][v] + 2.0 * U * last[v]);
            let seen = (-kappa * first[0]).exp() * kappa * decay_mean(kappa * dense);
            let before_error = sums.misplaced[k] + sums.rounded[k][0];
            let relative = (kappa * (before_error + dense_error)).exp_m1().min(1e30) + 8e-6;
            total.value += seen * scattering;
            total.error += seen * (scattering * relative + scattering_error * (1.0 + relative));
        }
        total
    }

    /// The parts of `from..from + length` inside the piece; ends are known up to `blur`.
    pub fn parts(&self, from: f64, length: f64, blur: f64) -> Vec<Part> {
        let exact = |value: f64| Bounded { value, error: 0.0 };
        let Some(sums) = &self.sums else {
            let before = exact((from - self.start).max(0.0));
            let (density, scattering, shift) = (exact(1.0), exact(1.0), exact(0.0));
            return vec![Part { from, length, before, density, scattering, shift }];
        };
        let length = length / PARTS as f64;
        let part = |p: usize| {
            let from = from + length * p as f64;
            let rounding = 4.0 * U * (from.abs() + length);
            let moved = 2.0 * sums.most * (rounding + blur);
            let before = sums.between(self.start, from);
            let own = sums.between(from, from + length);
            let error = |b: &Between, v: usize| b.misplaced + b.rounded[v] + moved;
            // No length in single precision is less, but 0, which has no weight.
            let span = length.max(U * from.abs()).max(f64::MIN_POSITIVE);
            let mean =
                |v: usize| Bounded { value: own.value[v].max(0.0) / span, error: error(&own, v) / span };
            let [_, mass, moment] = own.value;
            let half = 0.5 * length;
            let shift = if mass > 0.0 {
                let middle = from + half - self.start;
                // Misplaced density and moved ends count by their distance from the middle, rounding by all of it.
                let off =
                    (own.misplaced + moved) * (length + sums.cell) + own.rounded[2] + own.rounded[1] * middle;
                let error = (off / mass + 2.0 * (rounding + blur)).min(length);
                Bounded { value: (moment / mass - middle).clamp(-half, half), error }
            } else {
                Bounded { value: 0.0, error: half }
            };
            let before = Bounded { value: before.value[0], error: error(&before, 0) };
            Part { from, length, before, density: mean(0), scattering: mean(1), shift }
        };
        (0..PARTS).map(part).collect()
    }
}

/// (1 - e^{-y}) / y.
fn decay_mean(y: f64) -> f64 {
    if y > 0.0 { -(-y).exp_m1() / y } else { 1.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use diaphane_formats::directions::hash;
    use diaphane_formats::reconstruct::{self, Profile};
    use glam::Vec3;
    use half::f16;

    /// The sums of single precision lie within their bounds, and these are narrow.
    #[test]
    fn single_precision_is_within_narrow_bounds() {
        let unit = |i: u64, n: u64| f64::from((hash(i, n) >> 40) as u32) / f64::from(1u32 << 24);
        let value = |i: u64| {
            let density = 0.2 + unit(1, i);
            [density, density * unit(2, i)].map(f16::from_f64)
        };
        let values = (0..7 * 5 * 6).map(value).collect();
        let grid = DensityGrid { size: [7, 5, 6], min: [-1.0; 3], max: [1.0, 0.8, 1.1], values };
        let density = Density::new(&grid);
        for i in 0..500 {
            let origin = Vec3::new(unit(3, i) as f32 - 0.5, unit(4, i) as f32 - 0.5, 3.0);
            let direction = Vec3::new(unit(5, i) as f32 - 0.5, unit(6, i) as f32 - 0.5, -4.0).normalize();
            let start = 1.9 + unit(7, i) as f32;
            let end = start + 0.01 + 1.5 * unit(8, i) as f32;
            let single = Profile::march(&grid, origin, direction, start, end);
            let (wide_start, wide_end) = (f64::from(start), f64::from(end));
            let along =
                Along::new(Some(&density), origin.as_dvec3(), direction.as_dvec3(), wide_start, wide_end);
            let within = |got: f32, expected: Bounded, size: f64| {
                let off = (f64::from(got) - expected.value).abs();
                assert!(off <= expected.error, "{i}: {got} {expected:?}");
                assert!(expected.error <= 2e-3 * size, "{i}: {expected:?}");
            };
            let whole = along.depth();
            within(single.density[PROFILE_CELLS], whole, whole.value);
            let kappa = 20.0 * unit(9, i) as f32;
            let emitted = along.emission(f64::from(kappa));
            let player = reconstruct::Along::Profile(Vec3::splat(kappa), Box::new(single.clone()));
            within(player.emission(start, end).x, emitted, emitted.value);
            let length = 0.3 * (wide_end - wide_start);
            for part in along.parts(wide_start + length, length, 0.0) {
                let (first, last) =
                    (single.at(part.from as f32), single.at((part.from + part.length) as f32));
                within(first[0], part.before, whole.value);
                let mean = |v: usize| (last[v] - first[v]) / part.length as f32;
                within(mean(0), part.density, whole.value / part.length);
                within(mean(1), part.scattering, whole.value / part.length);
                let place = (last[2] - first[2]) / (last[1] - first[1]);
                let middle = (part.from + 0.5 * part.length - wide_start) as f32;
                within(place - middle, part.shift, 10.0 * part.length);
            }
        }
    }
}
