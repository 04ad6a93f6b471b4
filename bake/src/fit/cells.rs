//! The region that a sample stands for: points spread through the inside part of the ball around it.
//!
//! Light at a grazing angle fades within a fraction of the samples' spacing, so its value at a point says little about
//! the neighbourhood that the kernel stands for. Every sample therefore carries the mean of ψ over such points, valid
//! at their centroid up to the correction of [`diaphane_formats::slopes`]. Each direction looks at a few of them in
//! turn: the fit over all directions averages the rest (see [`super::depths`]). Where the density varies points are as
//! frequent as the medium scatters, because that is how much their light counts.
//!
//! Points follow the additive recurrence of the generalised golden ratio in three dimensions (Roberts 2018), shifted at
//! random for each sample: any run of consecutive ones is spread well.

use crate::Result;
use crate::field::Shape;
use crate::samples::Candidate;
use diaphane_formats::directions::hash;
use diaphane_formats::medium::Medium;
use diaphane_formats::slopes::CELL_RADIUS;
use diaphane_formats::visibility::Nearest;
use glam::DVec3;
use rayon::prelude::*;

/// Tries for each point that is wanted; samples on the boundary lose about half.
const TRIES: usize = 3;

/// The recurrence's steps: powers of the root of x⁴ = x + 1.
const STEPS: DVec3 = DVec3::new(0.819_172_513_396_164_4, 0.671_043_606_703_789_3, 0.549_700_477_901_970_3);

/// The surface point nearest to each sample within `reach` radii.
pub(crate) fn nearest(shape: &Shape<'_>, samples: &[Candidate], reach: f64) -> Vec<Option<Nearest>> {
    samples.par_iter().map(|s| shape.accel.nearest(s.position, reach * s.radius)).collect()
}

/// Whether the whole ball around each sample is inside; `nearest` must reach [`CELL_RADIUS`] radii.
pub(crate) fn buried(samples: &[Candidate], nearest: &[Option<Nearest>]) -> Vec<bool> {
    let within = |s: &Candidate, n: &Option<Nearest>| {
        n.is_some_and(|n| n.distance <= f64::from(CELL_RADIUS) * s.radius)
    };
    samples.iter().zip(nearest).map(|(s, n)| !within(s, n)).collect()
}

/// The points of all samples. They are looked at by turns, a few of every sample at each.
pub(crate) struct Cells {
    /// Row-major [turn][sample][point].
    points: Vec<DVec3>,
    samples: usize,
    /// Points of a sample, and those of one turn, which divide them.
    size: usize,
    count: usize,
}

impl Cells {
    /// `size` points for each sample, `count` at a turn; those of the samples that `buried` names are inside without a test.
    pub fn new(
        shape: &Shape<'_>,
        medium: &Medium,
        samples: &[Candidate],
        buried: &[bool],
        (size, count): (usize, usize),
        seed: u64,
    ) -> Result<Self> {
        let n = samples.len();
        if size <= 1 {
            let points = samples.iter().map(|s| s.position).collect();
            return Ok(Self { points, samples: n, size: 1, count: 1 });
        }
        let width = TRIES * size;
        let tries = |i: usize| {
            let s = &samples[i];
            let radius = f64::from(CELL_RADIUS) * s.radius;
            in_ball(hash(seed, i as u64)).take(width).map(move |p| s.position + p * radius)
        };
        let doubtful: Vec<usize> = (0..samples.len()).filter(|i| !buried[*i]).collect();
        let tested: Vec<DVec3> = doubtful.par_iter().flat_map_iter(|i| tries(*i)).collect();
        let inside = shape.inside.test(&tested)?;
        let mut row = vec![usize::MAX; samples.len()];
        doubtful.iter().enumerate().for_each(|(k, i)| row[*i] = k);
        let by_sample: Vec<DVec3> = samples
            .par_iter()
            .enumerate()
            .flat_map_iter(|(i, s)| {
                let is_inside = |k: usize| buried[i] || inside[row[i] * width + k];
                let found = tries(i).enumerate().filter(|(k, _)| is_inside(*k)).map(|(_, p)| p);
                let mut kept: Vec<DVec3> = if medium.is_homogeneous() {
                    found.take(size).collect()
                } else {
                    as_scattering(medium, &found.collect::<Vec<_>>(), size)
                };
                if kept.is_empty() {
                    kept.push(s.position);
                }
                // Too few found: those count more than once.
                let found = kept.len();
                (0..size).map(move |k| kept[k % found])
            })
            .collect();
        // A turn takes points that lie far apart in the sequence.
        let turns = size / count;
        let mut points = vec![DVec3::ZERO; by_sample.len()];
        points.par_chunks_mut(n * count).enumerate().for_each(|(turn, points)| {
            for (own, all) in points.chunks_exact_mut(count).zip(by_sample.chunks_exact(size)) {
                own.iter_mut().zip(all.iter().skip(turn).step_by(turns)).for_each(|(own, p)| *own = *p);
            }
        });
        Ok(Self { points, samples: n, size, count })
    }

    /// All points, those of a turn together and within it those of a sample.
    pub fn points(&self) -> &[DVec3] {
        &self.points
    }

    /// The mean over the points of each sample of a value of every point.
    pub fn means(&self, values: impl Fn(usize) -> f32) -> Vec<f32> {
        let mut sums = vec![0.0; self.samples];
        for turn in (0..self.points.len()).step_by((self.samples * self.count).max(1)) {
            for (i, sum) in sums.iter_mut().enumerate() {
                let own = turn + i * self.count;
                *sum += (own..own + self.count).map(&values).sum::<f32>();
            }
        }
        sums.iter_mut().for_each(|sum| *sum /= self.size as f32);
        sums
    }

    /// What the asset stores of the centroids: how far they lie from `samples`, in 127ths of a radius.
    pub fn offsets(&self, samples: &[Candidate]) -> Vec<[i8; 4]> {
        let one = |(i, s): (usize, &Candidate)| {
            let offset = ((self.centroid(i) - s.position) * (127.0 / s.radius)).round();
            let [x, y, z] = offset.clamp(DVec3::splat(-127.0), DVec3::splat(127.0)).to_array();
            [x as i8, y as i8, z as i8, 0]
        };
        samples.iter().enumerate().map(one).collect()
    }

    /// The mean of the points of sample `i`: where its values hold.
    fn centroid(&self, i: usize) -> DVec3 {
        let turns = self.points.chunks_exact(self.samples * self.count);
        let own = turns.flat_map(|turn| &turn[i * self.count..(i + 1) * self.count]);
        own.sum::<DVec3>() / self.size as f64
    }

    /// The points of a turn, row-major [sample][point]; after the last turn comes the first.
    pub fn turn(&self, turn: usize) -> &[DVec3] {
        let own = self.samples * self.count;
        let turn = turn % (self.size / self.count);
        &self.points[turn * own..(turn + 1) * own]
    }
}

/// `size` of `found`, each as often as its share of the scattering density says; none where nothing scatters.
fn as_scattering(medium: &Medium, found: &[DVec3], size: usize) -> Vec<DVec3> {
    let mut total = 0.0;
    let cumulative: Vec<f64> = found
        .iter()
        .map(|p| {
            total += medium.density_and_scattering(*p).1;
            total
        })
        .collect();
    if !(total > 0.0) {
        return Vec::new();
    }
    let mass = |k: usize| (k as f64 + 0.5) / size as f64 * total;
    (0..size).map(|k| found[cumulative.partition_point(|c| *c <= mass(k)).min(found.len() - 1)]).collect()
}

/// Points of the unit ball.
fn in_ball(seed: u64) -> impl Iterator<Item = DVec3> {
    let unit = |k: u64| hash(seed, k) as f64 / 2f64.powi(64);
    let shift = DVec3::new(unit(0), unit(1), unit(2));
    (0..)
        .map(move |k| (shift + STEPS * f64::from(k)).fract() * 2.0 - 1.0)
        .filter(|p| p.length_squared() < 1.0)
}
