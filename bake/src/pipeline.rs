//! The stages of one bake, each of whose results the cache may hold.
//!
//! ```text
//! distance field ─ samples ─ optical depth, harmonics (block by block) ─ light ─ levels, weights ─ packing ─ certificate
//! ```

use crate::cache::{Cache, Key};
use crate::certificate::{self, Measured};
use crate::field::{DistanceGrid, Shape, grid_cells};
use crate::fit::{self, FirstFits, Fits, Light, Lit};
use crate::levels::Nested;
use crate::measure::exact::means;
use crate::pack::{self, Stand};
use crate::params::{DENSITY_DIRECTIONS, Params, Visibility};
use crate::progress::Timed;
use crate::refine::{self, Bench};
use crate::report::{Facts, Refinement, Report};
use crate::samples::{Candidate, Ground, Placed};
use crate::{Error, Input, Prepared, Result, blocks, density, layers, levels, samples};
use diaphane_formats::asset::Asset;
use glam::DVec3;
use serde::{Deserialize, Serialize};
use std::cell::OnceCell;

/// Where samples stand.
#[derive(Serialize, Deserialize)]
pub(crate) struct Placing {
    placed: Placed,
    /// Of the kernels, in disk radii.
    width_factor: f32,
    refined: Option<Refinement>,
    layers: usize,
    /// Layers too deep for any light.
    dark_layers: usize,
    /// Nodes of the distance grid without a query.
    skipped: usize,
}

/// What the samples carry.
#[derive(Serialize, Deserialize)]
pub(crate) struct Lighting {
    /// Which samples stay; all that follows is of those alone.
    keep: Vec<bool>,
    light: Light,
    offset: Vec<[i8; 4]>,
    /// For each of [`certificate::exact_lights`]: what arrives at the samples.
    exact: Vec<Vec<f32>>,
    buried: usize,
    dark: usize,
}

/// What every stage of a bake may use.
pub(crate) struct Pipeline<'a> {
    input: &'a Input<'a>,
    params: &'a Params,
    cache: &'a Cache,
    timed: &'a Timed<'a>,
    shape: OnceCell<Shape<'a>>,
    medium: OnceCell<Prepared<'a>>,
}

impl Placing {
    /// Whether one read from a cache can be that of any bake.
    pub fn fits(&self) -> bool {
        self.placed.fits() && self.width_factor > 0.0 && self.width_factor.is_finite()
    }
}

impl Lighting {
    /// Whether one read from a cache can be that of `samples` samples with so many held-out lights.
    pub fn fits(&self, samples: usize, matched: bool, held_out: usize, params: &Params) -> bool {
        let kept = self.keep.iter().filter(|k| **k).count();
        let whole = |light: &Vec<f32>| light.len() == kept && light.iter().all(|v| v.is_finite());
        self.keep.len() == samples
            && kept > 0
            && self.offset.len() == kept
            && self.light.fits(kept, matched, params)
            && self.exact.len() == held_out
            && self.exact.iter().all(whole)
    }
}

/// Names of results.
struct Keys {
    placing: Key,
    /// Optical depths of all blocks.
    depths: Key,
    /// First fits of all blocks.
    first: Key,
    lighting: Key,
}

impl Keys {
    fn new(input: &Input<'_>, params: &Params) -> Result<Self> {
        let p = params;
        let object = (input.mesh.content_hash(), input.mesh_report.is_mended(), input.medium.optical_hash());
        let density = p.directions.min(DENSITY_DIRECTIONS);
        let placing = (object, p.samples, p.seed, p.placement, p.visibility, density, p.width_factor);
        let boundary = fit::boundary_order(input.medium.ior(), p.order);
        let refined = (p.refine > 0).then_some((p.refine, boundary));
        let placing = Key::new("samples", &(placing, refined))?;
        let depths = (&placing, p.directions, p.points_per_sample, p.visibility, p.certificate);
        let depths = Key::new("optical depth", &depths)?;
        let first = (&depths, fit::first_order(p), p.light_error, p.representation);
        let first = Key::new("harmonics", &first)?;
        let lighting = Key::new("light", &(&first, p.order, p.extra_bands))?;
        Ok(Self { placing, depths, first, lighting })
    }
}

impl<'a> Pipeline<'a> {
    pub fn new(input: &'a Input<'a>, params: &'a Params, cache: &'a Cache, timed: &'a Timed<'a>) -> Self {
        Self { input, params, cache, timed, shape: OnceCell::new(), medium: OnceCell::new() }
    }

    /// Runs what no cache holds.
    pub fn run(&self) -> Result<(Asset, Report)> {
        let keys = Keys::new(self.input, self.params)?;
        let placing = self.cache.get(&keys.placing, Placing::fits, || self.place())?;
        let params = Params { width_factor: placing.width_factor, ..self.params.clone() };
        let placed = &placing.placed;
        let (matched, held_out) = (self.input.medium.ior() == 1.0, self.held_out().len());
        let fits = |l: &Lighting| l.fits(placed.samples.len(), matched, held_out, self.params);
        let lighting = self.cache.get(&keys.lighting, fits, || self.light(&keys, &placed.samples))?;
        let samples: Vec<Candidate> = kept(&placed.samples, &lighting.keep);
        let discarded = placed.samples.len() - samples.len();
        let nested = Key::new("weights", &(&keys.depths, placing.width_factor))?;
        let fits = |n: &Nested| n.fits(samples.len());
        let nested = self.cache.get(&nested, fits, || {
            levels::nest(self.input.mesh, &samples, &placed.probes, params.width_factor, self.timed)
        })?;
        let samples = nested.arranged(&samples);
        let Lighting { light, offset, exact, buried, dark, .. } = lighting;
        let (light, offset) = (light.picked(&nested.order), nested.arranged(&offset));
        let exact: Vec<Vec<f32>> = exact.iter().map(|arriving| nested.arranged(arriving)).collect();
        let sampled = self.medium()?.sampled.as_ref();
        let mut asset = self.timed.stage("packing", |_| {
            let stand = Stand { samples: &samples, offset, discarded };
            pack::pack(self.input, sampled, &params, stand, light, nested.weights())
        })?;
        if params.certificate {
            let key = Key::new("certificate", &(&keys.lighting, placing.width_factor))?;
            let fits = |m: &Measured| m.fits(params.seed);
            let measured = self.cache.get(&key, fits, || self.measure(&exact, &asset))?;
            let (certificate, errors) = measured.certificate(self.input.medium);
            asset.info.certificate = Some(certificate);
            asset.levels.iter_mut().zip(errors).for_each(|(level, error)| level.error = error);
        }
        let facts = Facts {
            medium: self.input.medium,
            placed,
            refinement: placing.refined.clone(),
            layers: placing.layers,
            dark_layers: placing.dark_layers,
            skipped_queries: placing.skipped,
            buried,
            dark,
            discarded,
            visibility: self.method(placed.samples.len()),
            tested: self.shape.get().map(|s| s.inside.tested()).unwrap_or_default(),
        };
        let report = Report::new(&params, &facts, &asset, &self.timed.seconds.borrow(), self.cache.report());
        Ok((asset, report))
    }

    fn shape(&self) -> Result<&Shape<'a>> {
        if let Some(shape) = self.shape.get() {
            return Ok(shape);
        }
        let made = self
            .timed
            .stage("mesh", |_| Ok(Shape::new(self.input.mesh, self.input.mesh_report, self.params)))?;
        Ok(self.shape.get_or_init(|| made))
    }

    fn medium(&self) -> Result<&Prepared<'a>> {
        if let Some(medium) = self.medium.get() {
            return Ok(medium);
        }
        let made = self.timed.stage("medium", |_| Ok(Prepared::new(self.input.medium, self.input.mesh)))?;
        Ok(self.medium.get_or_init(|| made))
    }

    fn method(&self, samples: usize) -> Visibility {
        fit::method(self.params, samples, self.input.mesh.triangles.len())
    }

    fn place(&self) -> Result<Placing> {
        let (params, timed) = (self.params, self.timed);
        let (shape, medium) = (self.shape()?, self.medium()?);
        let cells = grid_cells(shape.mesh, params.samples);
        let key = Key::new(
            "distance field",
            &(shape.mesh.content_hash(), self.input.mesh_report.is_mended(), cells),
        )?;
        let make = || timed.stage("distance field", |p| DistanceGrid::new(shape, cells, p));
        let grid = self.cache.get(&key, DistanceGrid::fits, make)?;
        let skipped = grid.skipped;
        let (layers, dark_layers) =
            timed.stage("layers", |p| layers::build(shape, &grid, medium.medium, params.placement, p))?;
        let fluence = timed.stage("density", |p| density::evaluate(shape, &layers, medium, params, p))?;
        let count = layers.len();
        let ground = Ground { grid, layers, fluence };
        let (offered, placed) = timed.stage("samples", |p| {
            let offered = samples::offer(shape, &ground, medium.medium, params, p)?;
            let placed = samples::place(shape, &offered, params.samples, |_| 1.0, p)?;
            Ok((offered, placed))
        })?;
        let bench = Bench { input: self.input, shape, medium, offered: &offered, params };
        let (placed, width_factor, refined) = match params.refine {
            0 => (placed, params.width_factor, None),
            rounds => timed.stage("refinement", |p| refine::refine(&bench, placed, rounds, p))?,
        };
        Ok(Placing { placed, width_factor, refined, layers: count, dark_layers, skipped })
    }

    /// Block by block: depths in all directions, then their fits, of which alone anything stays.
    fn light(&self, keys: &Keys, samples: &[Candidate]) -> Result<Lighting> {
        let (params, timed) = (self.params, self.timed);
        let ranges = blocks::ranges(samples.len());
        let exact = self.held_out();
        let matched = self.input.medium.ior() == 1.0;
        let directions = params.directions.next_multiple_of(2);
        // Work is announced when the first block turns out not to be in the cache.
        let (mut depths_announced, mut fits_announced) = (false, false);
        let method = self.method(samples.len());
        let mut all: Option<Fits> = None;
        let (mut keep, mut offset, mut buried, mut dark) = (Vec::new(), Vec::new(), 0, 0);
        let mut arriving = vec![Vec::new(); exact.len()];
        for (b, range) in ranges.iter().enumerate() {
            let own = &samples[range.clone()];
            let block = (b, ranges.len());
            let key = Key::new(keys.depths.stage(), &(&keys.depths, block))?;
            let fits = |l: &Lit| l.fits(own.len(), directions, matched, exact.len());
            let lit = self.cache.get(&key, fits, || {
                let (shape, medium) = (self.shape()?, self.medium()?);
                let task = timed.stage("cells", |_| fit::Task::new(shape, medium, own, b, params))?;
                if !std::mem::replace(&mut depths_announced, true) {
                    let blocks = ranges.len() - b;
                    timed.announce("optical depth", blocks * params.directions.div_ceil(2));
                }
                let mut lit =
                    timed.stage("optical depth", |p| fit::depths(shape, medium, &task, method, params, p))?;
                if !exact.is_empty() {
                    let arriving =
                        timed.stage("held-out light", |p| means(shape, medium, &task.cells, &exact, p))?;
                    lit.hold_out(arriving);
                }
                Ok(lit)
            })?;
            let lit_samples = lit.surface.len();
            let key = Key::new(keys.first.stage(), &(&keys.first, block))?;
            let encoding = all.as_ref().map(|fits| fits.encoding);
            let fits = |f: &FirstFits| {
                f.fits(lit_samples, params) && encoding.is_none_or(|encoding| encoding == f.encoding)
            };
            let first = self.cache.get(&key, fits, || {
                if !std::mem::replace(&mut fits_announced, true) {
                    timed.announce("harmonics", samples.len() - range.start);
                }
                timed.stage("harmonics", |p| fit::first_fits(&lit, encoding, params, p))
            })?;
            let encoding = first.encoding;
            let make = || timed.stage("more bands", |p| fit::fits(&lit, first, params, p));
            // The light of a single block is kept as a whole.
            let fits = match ranges.len() {
                1 => make()?,
                _ => {
                    let fits = |f: &Fits| f.encoding == encoding && f.fits(lit_samples, matched, params);
                    self.cache.get(&Key::new("more bands", &(&keys.lighting, block))?, fits, make)?
                }
            };
            match &mut all {
                Some(all) => all.append(fits),
                None => all = Some(fits),
            }
            buried += lit.buried;
            dark += lit.dark;
            keep.extend(lit.keep);
            offset.extend(lit.offset);
            arriving.iter_mut().zip(lit.held_out).for_each(|(all, own)| all.extend(own));
        }
        let lit = all.filter(|_| !offset.is_empty());
        let all = lit.ok_or_else(|| Error::NoRoom("no light reaches its inside".to_owned()))?;
        let light = timed.stage("rounding", |p| fit::quantised(all, params, p))?;
        Ok(Lighting { keep, light, offset, exact: arriving, buried, dark })
    }

    /// The lights whose exact means over cells the certificate plays too.
    fn held_out(&self) -> Vec<(DVec3, usize)> {
        if self.params.certificate { certificate::exact_lights(self.params.seed) } else { Vec::new() }
    }

    fn measure(&self, exact: &[Vec<f32>], asset: &Asset) -> Result<Measured> {
        let (shape, medium) = (self.shape()?, self.medium()?);
        self.timed
            .stage("certificate", |p| certificate::measure(shape, medium, exact, asset, self.params.seed, p))
    }
}

fn kept(samples: &[Candidate], keep: &[bool]) -> Vec<Candidate> {
    samples.iter().zip(keep).filter(|(_, keep)| **keep).map(|(s, _)| *s).collect()
}
