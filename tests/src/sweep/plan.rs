//! Which measurements a sweep makes: one axis varied at a time around a default, samples × order as a small grid, and
//! the rivals at the same samples.

use super::record::Method;
use diaphane_bake::params::{Params, Preset, Representation};

/// Lists of values along each axis, and what is held fixed.
#[derive(Clone, Debug)]
pub struct Axes {
    /// Samples, bands, directions of the middle point; its preset is `standard`.
    pub base: Base,
    /// Samples at the default of everything else.
    pub samples: Vec<usize>,
    /// Bands.
    pub orders: Vec<usize>,
    /// What the harmonics represent.
    pub encodings: Vec<EncodingName>,
    /// Directions of the bake.
    pub directions: Vec<usize>,
    /// Whole presets, with their own samples, directions and bands.
    pub presets: Vec<PresetName>,
    /// Samples of the grid samples × order.
    pub pair_samples: Vec<usize>,
    /// Bands of that grid.
    pub pair_orders: Vec<usize>,
    /// Steps of the marcher.
    pub steps: Vec<usize>,
    /// Steps through the grid of harmonics.
    pub grid_steps: usize,
    /// Numbers of lights.
    pub lights: Vec<usize>,
    /// Which methods to measure.
    pub methods: Vec<Method>,
}

/// The middle of all axes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Base {
    /// Stored samples.
    pub samples: usize,
    /// Bands.
    pub order: usize,
    /// Directions of the bake.
    pub directions: usize,
}

/// Encodings by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum EncodingName {
    /// 1/(τ+ε)
    Reciprocal,
    /// The same with a lobe towards the nearest surface where that helps, the default
    Lobe,
    /// The optical depth τ
    Depth,
    /// ψ itself, the thesis' choice
    Transmittance,
}

impl EncodingName {
    /// What a bake takes if nothing is said.
    pub const DEFAULT: Self = Self::Lobe;

    /// Name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Reciprocal => "reciprocal",
            Self::Lobe => "lobe",
            Self::Depth => "depth",
            Self::Transmittance => "transmittance",
        }
    }

    /// What the bake is told.
    pub fn representation(self) -> Representation {
        match self {
            Self::Reciprocal => Representation::Reciprocal,
            Self::Lobe => Representation::Lobe,
            Self::Depth => Representation::Depth,
            Self::Transmittance => Representation::Transmittance,
        }
    }
}

/// Presets by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum PresetName {
    /// Seconds
    Draft,
    /// The default
    Standard,
    /// More directions and bands
    Fine,
}

impl PresetName {
    /// Name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Draft => "draft",
            Self::Standard => "standard",
            Self::Fine => "fine",
        }
    }

    /// The bake's parameters.
    pub fn params(self) -> Params {
        Params::preset(match self {
            Self::Draft => Preset::Draft,
            Self::Standard => Preset::Standard,
            Self::Fine => Preset::Fine,
        })
    }
}

/// One asset to bake.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Baked {
    /// Stored samples.
    pub samples: usize,
    /// Bands.
    pub order: usize,
    /// What the harmonics represent.
    pub encoding: EncodingName,
    /// Directions.
    pub directions: usize,
    /// Everything else.
    pub preset: PresetName,
}

impl Baked {
    /// What the bake is told; `seed` chooses its randomness.
    pub fn params(&self, seed: u64) -> Params {
        let preset = self.preset.params();
        Params {
            samples: self.samples,
            order: self.order,
            // Only whole defaults lend bytes from sample to sample.
            extra_bands: if self.order == preset.order { preset.extra_bands } else { 0 },
            directions: self.directions,
            representation: self.encoding.representation(),
            seed,
            ..preset
        }
    }
}

/// A way to draw, apart from the lights.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Drawing {
    /// How.
    pub method: Method,
    /// Steps of each ray, for methods that march.
    pub steps: usize,
}

/// An asset and everything that is drawn from it (or beside it).
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Job {
    /// What to bake.
    pub baked: Baked,
    /// What to draw, each with every number of lights.
    pub drawings: Vec<Drawing>,
}

impl Axes {
    /// The jobs of one case, the default asset first; nothing twice.
    pub fn jobs(&self) -> Vec<Job> {
        let base = Baked {
            samples: self.base.samples,
            order: self.base.order,
            encoding: EncodingName::DEFAULT,
            directions: self.base.directions,
            preset: PresetName::Standard,
        };
        let wants = |m: Method| self.methods.contains(&m);
        let mut jobs: Vec<Job> = Vec::new();
        let mut add = |baked: Baked, drawing: Drawing| {
            if !wants(drawing.method) {
                return;
            }
            let known = jobs.iter().position(|j| j.baked == baked).unwrap_or_else(|| {
                jobs.push(Job { baked, drawings: Vec::new() });
                jobs.len() - 1
            });
            if !jobs[known].drawings.contains(&drawing) {
                jobs[known].drawings.push(drawing);
            }
        };
        let splats = Drawing { method: Method::Splats, steps: 0 };
        add(base, splats);
        for &steps in &self.steps {
            add(base, Drawing { method: Method::March, steps });
        }
        for samples in self.samples.iter().copied().chain([base.samples]) {
            let baked = Baked { samples, ..base };
            add(baked, splats);
            add(baked, Drawing { method: Method::Thesis, steps: 0 });
            add(baked, Drawing { method: Method::Grid, steps: self.grid_steps });
        }
        for &order in &self.orders {
            add(Baked { order, ..base }, splats);
        }
        for &encoding in &self.encodings {
            add(Baked { encoding, ..base }, splats);
        }
        for &directions in &self.directions {
            add(Baked { directions, ..base }, splats);
        }
        for &samples in &self.pair_samples {
            for &order in &self.pair_orders {
                add(Baked { samples, order, ..base }, splats);
            }
        }
        for &preset in &self.presets {
            let p = preset.params();
            let (samples, order, directions) = (p.samples, p.order, p.directions);
            add(Baked { samples, order, directions, preset, ..base }, splats);
        }
        jobs
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn axes() -> Axes {
        Axes {
            base: Base { samples: 100, order: 5, directions: 64 },
            samples: vec![50, 100],
            orders: vec![4, 5],
            encodings: vec![EncodingName::DEFAULT, EncodingName::Transmittance],
            directions: vec![32, 64],
            presets: vec![PresetName::Draft],
            pair_samples: vec![50, 100],
            pair_orders: vec![4, 5],
            steps: vec![2, 4],
            grid_steps: 8,
            lights: vec![1],
            methods: Method::ALL.to_vec(),
        }
    }

    #[test]
    fn every_asset_once_and_rivals_where_they_belong() {
        let jobs = axes().jobs();
        // Base, 50 samples, 4 bands, transmittance, 32 directions, (50, 4), draft.
        assert_eq!(jobs.len(), 7);
        for (i, a) in jobs.iter().enumerate() {
            assert!(jobs[..i].iter().all(|b| b.baked != a.baked));
        }
        let count = |m: Method| jobs.iter().flat_map(|j| &j.drawings).filter(|d| d.method == m).count();
        assert_eq!([Method::Splats, Method::Thesis, Method::March, Method::Grid].map(count), [7, 2, 2, 2]);
        assert_eq!(jobs[0].drawings.len(), 5);
    }

    #[test]
    fn unwanted_methods_need_no_assets() {
        let jobs = Axes { methods: vec![Method::March], ..axes() }.jobs();
        assert_eq!(jobs.len(), 1);
        assert_eq!(jobs[0].drawings.len(), 2);
    }
}
