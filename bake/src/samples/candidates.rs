//! Candidates on the layers and in the slabs beneath them.

use super::{Candidate, Ground};
use crate::density::LayerFluence;
use crate::field::{DistanceGrid, Shape};
use crate::layers::Layer;
use crate::params::{BOUNDARY_SNAP, DARK, Params, Placement, RADIUS_EXPONENT};
use crate::progress::Stage;
use crate::{Error, Result};
use diaphane_formats::directions::hash;
use diaphane_formats::medium::Medium;
use glam::DVec3;
use rand::seq::SliceRandom;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use rayon::prelude::*;

/// Candidates for each wanted sample.
const OVERSAMPLING: usize = 16;
/// Candidates on the boundary for each disk that finds a place there, roughly.
const SURFACE_CANDIDATES: f64 = 12.0;
/// Usable candidates for each wanted sample that end the drawing.
const ENOUGH: usize = 10;
/// Candidates that are drawn and tested together: bounds the memory of the tests.
const TOGETHER: usize = 1 << 18;
/// Draws at the most.
const ROUNDS: u64 = 8;

/// Where samples may be.
pub(crate) struct Offered {
    /// On the boundary: offered before all others, so that the layer where light enters and leaves has no gaps.
    pub surface: Vec<Candidate>,
    pub list: Vec<Candidate>,
    /// Samples closer to the boundary than this many radii are moved onto it.
    pub snap: f64,
    pub dark: usize,
    /// Drawn candidates that needed no inside test.
    pub untested: usize,
}

/// One triangle of one layer with the mass of its slab.
struct Patch {
    layer: u32,
    triangle: u32,
    volume: f64,
    /// κt-scaled fluence in the middle of the slab.
    demand: f64,
}

pub(crate) fn offer(
    shape: &Shape<'_>,
    ground: &Ground,
    medium: &Medium,
    params: &Params,
    stage: Stage<'_>,
) -> Result<Offered> {
    let Ground { grid, layers, fluence } = ground;
    if layers.is_empty() && params.placement == Placement::Boundary {
        return thin(shape, grid, medium, params);
    }
    let patches = patches(layers, fluence, medium);
    let mean = reference_demand(&patches);
    let relative_radius = |demand: f64| (demand / mean).max(1e-12).powf(-RADIUS_EXPONENT).clamp(0.5, 2.0);
    // Cumulative mass of the patches: expected number of samples, up to a common factor.
    let mut cumulative = Vec::with_capacity(patches.len());
    let mut total = 0.0;
    for p in &patches {
        total += p.volume / relative_radius(p.demand).powi(3);
        cumulative.push(total);
    }
    if !(total > 0.0) {
        return Err(no_room());
    }
    let wanted = OVERSAMPLING * params.samples + 64;
    let on_layers = params.placement == Placement::Layers;
    let one = |seed: u64, i: usize| {
        let mut rng = Pcg64Mcg::seed_from_u64(hash(seed, i as u64));
        // Stratified over the cumulative mass, so that every patch gets its share.
        let mass = (i as f64 + rng.random::<f64>()) / wanted as f64 * total;
        let patch = &patches[cumulative.partition_point(|c| *c <= mass).min(patches.len() - 1)];
        let layer = &layers[patch.layer as usize];
        let corners = layer.triangles[patch.triangle as usize].map(|v| v as usize);
        let bary = barycentric(rng.random(), rng.random());
        let down: f64 = if on_layers { 0.0 } else { rng.random() };
        let mut position = DVec3::ZERO;
        let mut inward = DVec3::ZERO;
        let mut log_fluence = 0.0;
        let (top, bottom) = (&fluence.top[patch.layer as usize], &fluence.bottom[patch.layer as usize]);
        for (b, v) in bary.into_iter().zip(corners) {
            position += layer.positions[v] * b;
            inward += layer.inward[v] * b;
            let log = |f: f32| f64::from(f.max(1e-12)).ln();
            log_fluence += b * (log(top[v]) * (1.0 - down) + log(bottom[v]) * down);
        }
        position += inward.normalize_or_zero() * (down * layer.thickness);
        let fluence = log_fluence.exp();
        let radius = relative_radius(medium.density(position) * fluence);
        Candidate { position, radius, fluence }
    };
    // Where light reaches a thin shell only, few candidates are usable: draw again until there are enough.
    let mut list: Vec<Candidate> = Vec::with_capacity(wanted);
    let (mut dark, mut untested) = (0, 0);
    for round in 0..ROUNDS {
        let seed = hash(hash(params.seed, 23), round);
        for from in (0..wanted).step_by(TOGETHER) {
            stage.step(0)?;
            let some = from..wanted.min(from + TOGETHER);
            let drawn: Vec<Candidate> = some.into_par_iter().map(|i| one(seed, i)).collect();
            let (kept, without_test) = usable(shape, grid, medium, &drawn)?;
            untested += without_test;
            dark += drawn.len() - kept.len();
            list.extend(kept);
        }
        if list.len() >= ENOUGH * params.samples {
            break;
        }
    }
    list.shuffle(&mut Pcg64Mcg::seed_from_u64(hash(params.seed, 29)));
    if list.is_empty() {
        return Err(no_room());
    }
    if on_layers {
        return Ok(Offered { surface: Vec::new(), list, snap: 0.0, dark, untested });
    }
    let (fill, _) = usable(shape, grid, medium, &fill(ground, &list))?;
    let surface = surface(shape, ground, medium, &relative_radius, params.seed);
    let (surface, _) = usable(shape, grid, medium, &surface)?;
    list.extend(fill);
    Ok(Offered { surface, list, snap: BOUNDARY_SNAP, dark, untested })
}

/// Candidates of an object so thin that no node of the distance grid lies inside and there are no layers: on the mesh
/// itself, evenly, and lit as if nothing were in the way. The bake leaves out later what is dark.
fn thin(shape: &Shape<'_>, grid: &DistanceGrid, medium: &Medium, params: &Params) -> Result<Offered> {
    let mesh = shape.mesh;
    let mut cumulative = Vec::with_capacity(mesh.triangles.len());
    let mut total = 0.0;
    for t in 0..mesh.triangles.len() {
        total += mesh.area_normal(t).length();
        cumulative.push(total);
    }
    let count = OVERSAMPLING * params.samples + 64;
    let one = |i: usize| {
        let mut rng = Pcg64Mcg::seed_from_u64(hash(hash(params.seed, 43), i as u64));
        let mass = (i as f64 + rng.random::<f64>()) / count as f64 * total;
        let t = cumulative.partition_point(|c| *c <= mass).min(cumulative.len() - 1);
        let bary = barycentric(rng.random(), rng.random());
        let p: DVec3 = bary.into_iter().zip(mesh.corners(t)).map(|(b, corner)| corner * b).sum();
        let inward = -mesh.area_normal(t).normalize_or_zero();
        Candidate { position: p + inward * (1e-5 * shape.diagonal), radius: 1.0, fluence: 1.0 }
    };
    let drawn: Vec<Candidate> = (0..count).into_par_iter().map(one).collect();
    let (mut list, untested) = usable(shape, grid, medium, &drawn)?;
    if list.is_empty() {
        return Err(no_room());
    }
    list.shuffle(&mut Pcg64Mcg::seed_from_u64(hash(params.seed, 29)));
    Ok(Offered { surface: list.clone(), dark: drawn.len() - list.len(), list, snap: BOUNDARY_SNAP, untested })
}

/// Candidates on the boundary: on the first layer in proportion to 1/radius², moved onto the mesh.
fn surface(
    shape: &Shape<'_>,
    Ground { grid, layers, fluence }: &Ground,
    medium: &Medium,
    relative_radius: &(impl Fn(f64) -> f64 + Sync),
    seed: u64,
) -> Vec<Candidate> {
    let Some(layer) = layers.first() else { return Vec::new() };
    let light = |corners: &[u32; 3], bary: [f64; 3]| -> f64 {
        bary.iter().zip(corners).map(|(b, v)| b * f64::from(fluence.top[0][*v as usize])).sum()
    };
    let mut cumulative = Vec::with_capacity(layer.triangles.len());
    let mut total = 0.0;
    for corners in &layer.triangles {
        let [a, b, c] = corners.map(|v| layer.positions[v as usize]);
        let rho = medium.density((a + b + c) / 3.0);
        let radius = relative_radius(rho * light(corners, [1.0 / 3.0; 3])) * shape.spacing;
        total += 0.5 * (b - a).cross(c - a).length() / (radius * radius);
        cumulative.push(total);
    }
    let count = (SURFACE_CANDIDATES * total).min(1e8) as usize;
    (0..count)
        .into_par_iter()
        .filter_map(|i| {
            let mut rng = Pcg64Mcg::seed_from_u64(hash(hash(seed, 41), i as u64));
            let mass = rng.random::<f64>() * total;
            let t = cumulative.partition_point(|c| *c <= mass).min(cumulative.len() - 1);
            let corners = &layer.triangles[t];
            let bary = barycentric(rng.random(), rng.random());
            let p: DVec3 = bary.iter().zip(corners).map(|(b, v)| layer.positions[*v as usize] * *b).sum();
            let nearest = shape.accel.nearest(p, 2.0 * grid.cell)?;
            let inward = (p - nearest.point).try_normalize().unwrap_or(-shape.accel.normal(nearest.triangle));
            let position = nearest.point + inward * (1e-5 * shape.diagonal);
            let fluence = light(corners, bary);
            let radius = relative_radius(medium.density(position) * fluence);
            Some(Candidate { position, radius, fluence })
        })
        .collect()
}

fn patches(layers: &[Layer], fluence: &LayerFluence, medium: &Medium) -> Vec<Patch> {
    let mut patches = Vec::new();
    for (l, layer) in layers.iter().enumerate() {
        for (t, corners) in layer.triangles.iter().enumerate() {
            let [a, b, c] = corners.map(|v| layer.positions[v as usize]);
            let mean =
                |values: &[f32]| corners.iter().map(|v| f64::from(values[*v as usize])).sum::<f64>() / 3.0;
            let light = 0.5 * (mean(&fluence.top[l]) + mean(&fluence.bottom[l]));
            if mean(&fluence.top[l]).max(mean(&fluence.bottom[l])) < DARK {
                continue;
            }
            let rho = medium.density((a + b + c) / 3.0);
            patches.push(Patch {
                layer: l as u32,
                triangle: t as u32,
                volume: 0.5 * (b - a).cross(c - a).length() * layer.thickness,
                demand: rho * light,
            });
        }
    }
    patches
}

/// Volume-weighted geometric mean of the demand: the demand that gets the mean radius.
fn reference_demand(patches: &[Patch]) -> f64 {
    let volume: f64 = patches.iter().map(|p| p.volume).sum();
    let sum: f64 = patches.iter().map(|p| p.volume * p.demand.max(1e-12).ln()).sum();
    if volume > 0.0 { (sum / volume).exp() } else { 1.0 }
}

fn no_room() -> Error {
    Error::NoRoom(
        "no light reaches its inside, or nothing there scatters; a lower extinction or a larger density there may help"
            .to_owned(),
    )
}

fn barycentric(u: f64, v: f64) -> [f64; 3] {
    let root = u.sqrt();
    [1.0 - root, root * (1.0 - v), root * v]
}

/// Nodes of the distance grid that lie inside, with the radius and light of the nearest slab's mean: offered last, so
/// that they only close holes which the layers left.
fn fill(Ground { grid, layers, .. }: &Ground, drawn: &[Candidate]) -> Vec<Candidate> {
    if layers.is_empty() {
        return Vec::new();
    }
    // Mean radius and light by depth, in bins of one grid cell.
    let bin = |depth: f64| (depth / grid.cell).max(0.0) as usize;
    let deepest = grid.depth.iter().copied().fold(0.0, f32::max);
    let mut sums = vec![(0.0, 0.0, 0.0); bin(f64::from(deepest)) + 2];
    let last = sums.len() - 1;
    for c in drawn.iter().step_by(7) {
        if let Some(depth) = grid.depth_near(c.position) {
            let s = &mut sums[bin(depth).min(last)];
            *s = (s.0 + 1.0, s.1 + c.radius, s.2 + c.fluence);
        }
    }
    (0..grid.depth.len())
        .filter(|&i| grid.depth[i] > 0.0)
        .filter_map(|i| {
            let (n, radius, light) = sums[bin(f64::from(grid.depth[i])).min(last)];
            (n > 0.0).then(|| Candidate { position: grid.node(i), radius: radius / n, fluence: light / n })
        })
        .collect()
}

/// The candidates that are inside, lit and where something scatters, and how many of them needed no test: those in the
/// ball around a node of the distance grid which no surface enters.
fn usable(
    shape: &Shape<'_>,
    grid: &DistanceGrid,
    medium: &Medium,
    list: &[Candidate],
) -> Result<(Vec<Candidate>, usize)> {
    let lit = |c: &Candidate| c.fluence >= DARK && medium.density_and_scattering(c.position).1 > 0.0;
    let certain: Vec<Option<bool>> = list
        .par_iter()
        .map(|c| if lit(c) { grid.certainly_inside(c.position).then_some(true) } else { Some(false) })
        .collect();
    let doubtful: Vec<DVec3> =
        list.iter().zip(&certain).filter(|(_, c)| c.is_none()).map(|(c, _)| c.position).collect();
    let mut tested = shape.inside.test(&doubtful)?.into_iter();
    let kept = |known: &Option<bool>| known.unwrap_or_else(|| tested.next().unwrap_or(false));
    let keep: Vec<bool> = certain.iter().map(kept).collect();
    let kept = list.iter().zip(keep).filter(|(_, keep)| *keep).map(|(c, _)| *c).collect();
    Ok((kept, list.len() - doubtful.len()))
}
