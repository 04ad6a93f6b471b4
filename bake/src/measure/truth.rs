//! True radiance along the rays, by quadrature with exact transmittance towards every light.
//!
//! Over an inside piece of density length M, counted in m from its start, channel c and a light of unit irradiance
//!
//!   L = B κ_c ∫_0^M e^{-κ_c (m_0 + m)} σ(m) ψ_c β dm
//!
//! with B the boundary's part of the view ray, m_0 the density length of the pieces before, σ the part of
//! the density that scatters; albedo and phase function are factors that are left out here. Points are stratified: some
//! strata are even in m, some dense at the start, some at the end, so that light from any side is resolved. Two
//! independent sets of random points give two estimates R and R'; both are unbiased, so (I - R)(I - R') is unbiased for the
//! squared error and R R' for the squared radiance: the quadrature's own noise cancels from both.

use super::views::View;
use crate::field::Shape;
use crate::progress::Stage;
use crate::{Prepared, Result, visibility};
use diaphane_formats::directions::hash;
use diaphane_formats::visibility::{DepthRows, InsidePiece};
use glam::{DVec3, Vec3};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use rayon::prelude::*;

/// Strata of a piece.
const STRATA: usize = 12;
/// Parts of the strata that are even in optical depth, dense at the start, dense at the end.
const SPREAD: [f64; 3] = [0.4, 0.4, 0.2];
/// Intervals of the running density length along a piece of a heterogeneous medium.
const CELLS: usize = 128;

/// A point where radiance is gathered.
struct Node {
    position: DVec3,
    /// Ray, counted over all views, and which of the two estimates.
    estimate: usize,
    /// What one unit of ψβ there adds to the radiance, per channel, albedo and phase function left out.
    weight: Vec3,
}

/// The points of all rays.
pub(crate) struct Nodes {
    position: Vec<DVec3>,
    node: Vec<Node>,
    rays: usize,
}

/// Two estimates of one channel's radiance for each ray.
pub(crate) type Radiance = Vec<[f32; 2]>;

impl Nodes {
    /// Points along the rays of all views.
    pub fn new(views: &[View], medium: &Prepared<'_>, seed: u64) -> Self {
        let rays: Vec<_> = views.iter().flat_map(|v| v.rays.iter().map(|r| (v.direction, r))).collect();
        let node: Vec<Node> = rays
            .par_iter()
            .enumerate()
            .flat_map_iter(|(index, (direction, ray))| {
                let mut rng = Pcg64Mcg::seed_from_u64(hash(seed, index as u64));
                let mut walk =
                    Walk { medium, origin: ray.origin, direction: *direction, before: 0.0, boundary: 1.0 };
                let mut out = Vec::new();
                for piece in &ray.pieces {
                    walk.piece(piece, index, &mut rng, &mut out);
                }
                out
            })
            .collect();
        Self { position: node.iter().map(|n| n.position).collect(), node, rays: rays.len() }
    }

    /// Number of rays.
    pub fn rays(&self) -> usize {
        self.rays
    }

    /// Every point with its ray and what light there adds to the ray, over all channels.
    pub fn emitters(&self) -> impl Iterator<Item = (DVec3, usize, f64)> {
        self.node.iter().map(|n| (n.position, n.estimate / 2, f64::from(n.weight.element_sum())))
    }

    /// What the points of each ray add together.
    pub fn emission(&self) -> Vec<f64> {
        let mut total = vec![0.0; self.rays];
        self.emitters().for_each(|(_, ray, weight)| total[ray] += weight);
        total
    }

    /// Radiance of every ray for lights in `directions` (towards each light), of the channel `light` % 3 each.
    pub fn radiance(
        &self,
        shape: &Shape<'_>,
        medium: &Prepared<'_>,
        directions: &[DVec3],
        stage: Stage<'_>,
    ) -> Result<Vec<Radiance>> {
        // One projection serves a direction and the opposite one where that follows.
        let mut groups: Vec<std::ops::Range<usize>> = Vec::new();
        for l in 0..directions.len() {
            match groups.last_mut() {
                Some(g) if g.len() == 1 && directions[g.start] == -directions[l] => g.end = l + 1,
                _ => groups.push(l..l + 1),
            }
        }
        let gathered: Vec<Vec<Radiance>> = groups
            .into_par_iter()
            .with_max_len(1)
            .map(|group| {
                let axis = directions[group.start];
                let rows = visibility::depths(shape, medium, shape.visibility, &self.position, axis);
                stage.step(group.len())?;
                Ok(group.clone().map(|l| self.gather(medium, &rows, l - group.start, l % 3)).collect())
            })
            .collect::<Result<_>>()?;
        Ok(gathered.into_iter().flatten().collect())
    }

    fn gather(&self, medium: &Prepared<'_>, rows: &DepthRows, side: usize, channel: usize) -> Radiance {
        let kappa = medium.medium.extinction()[channel] as f32;
        let length = if side == 0 { &rows.forward } else { &rows.backward };
        let mut out = vec![[0.0; 2]; self.rays];
        for (i, node) in self.node.iter().enumerate() {
            let through = rows.boundary[side].get(i).copied().unwrap_or(1.0);
            let arriving = (-kappa * length[i]).exp() * through;
            out[node.estimate / 2][node.estimate % 2] += node.weight[channel] * arriving;
        }
        out
    }
}

/// Follows one ray from piece to piece.
struct Walk<'a> {
    medium: &'a Prepared<'a>,
    origin: DVec3,
    direction: DVec3,
    /// Density length of the pieces so far.
    before: f64,
    /// Fresnel transmittance so far.
    boundary: f64,
}

impl Walk<'_> {
    fn piece(&mut self, piece: &InsidePiece, ray: usize, rng: &mut Pcg64Mcg, out: &mut Vec<Node>) {
        let medium = self.medium.medium;
        let cells = if medium.is_homogeneous() { 1 } else { CELLS };
        let step = (piece.end - piece.start) / cells as f64;
        let mut running = vec![0.0];
        for k in 0..cells {
            let from = piece.start + k as f64 * step;
            let length = medium.density_length(self.origin, self.direction, from, from + step);
            running.push(running[k] + length.max(0.0));
        }
        let whole = running[cells];
        let kappa = medium.reference_extinction();
        let depth = kappa * whole;
        self.boundary *= piece.boundary[0];
        if depth > 0.0 {
            let strata: Vec<f64> = (0..=STRATA).map(|s| stratum(s as f64 / STRATA as f64, depth)).collect();
            for ends in strata.windows(2) {
                for estimate in 0..2 {
                    // A random point and its mirror image: what is linear over the stratum comes out exactly.
                    let unit: f64 = rng.random();
                    for unit in [unit, 1.0 - unit] {
                        let m = (ends[0] + unit * (ends[1] - ends[0])) / kappa;
                        let cell = running.partition_point(|r| *r <= m).clamp(1, cells);
                        let (low, high) = (running[cell - 1], running[cell]);
                        let within =
                            if high > low { ((m - low) / (high - low)).clamp(0.0, 1.0) } else { 0.5 };
                        let t = piece.start + ((cell - 1) as f64 + within) * step;
                        let position = self.origin + self.direction * t;
                        let (rho, scattering) = medium.density_and_scattering(position);
                        if scattering <= 0.0 {
                            continue;
                        }
                        let attenuation = (-medium.extinction() * (self.before + m)).exp();
                        let emitted = medium.extinction() * (scattering / rho);
                        let width = 0.5 * (ends[1] - ends[0]) / kappa;
                        let weight = (attenuation * emitted * width * self.boundary).as_vec3();
                        out.push(Node { position, estimate: 2 * ray + estimate, weight });
                    }
                }
            }
        }
        self.before += whole;
        self.boundary *= piece.boundary[1];
    }
}

/// Optical depth below which the fraction `unit` of the points of a piece of optical depth `depth` lies.
fn stratum(unit: f64, depth: f64) -> f64 {
    let whole = -(-depth).exp_m1();
    let below = |x: f64| {
        let (start, end) = (-(-x).exp_m1() / whole, ((x - depth).exp() - (-depth).exp()) / whole);
        SPREAD[0] * x / depth + SPREAD[1] * start + SPREAD[2] * end
    };
    let (mut low, mut high) = (0.0, depth);
    for _ in 0..40 {
        let middle = 0.5 * (low + high);
        if below(middle) < unit { low = middle } else { high = middle }
    }
    if unit <= 0.0 {
        0.0
    } else if unit >= 1.0 {
        depth
    } else {
        0.5 * (low + high)
    }
}
