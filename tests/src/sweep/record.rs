//! One measurement: what was measured, and what came out.

use serde::{Deserialize, Serialize};

/// A way to draw.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Method {
    /// The player.
    Splats,
    /// The published recipe at the same samples.
    Thesis,
    /// Marching with exact shadow rays.
    March,
    /// Marching through a grid of harmonics with the same bytes.
    Grid,
}

impl Method {
    /// All of them, in the order of tables.
    pub const ALL: [Self; 4] = [Self::Splats, Self::Thesis, Self::March, Self::Grid];

    /// Its name in files and on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Splats => "splats",
            Self::Thesis => "thesis",
            Self::March => "march",
            Self::Grid => "grid",
        }
    }
}

/// What identifies a measurement. Two measurements with equal keys are the same one.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct Key {
    /// Name of the case.
    pub case: String,
    /// Hash of mesh, material, scene, picture size and noise of the reference.
    pub inputs: String,
    /// What the program bakes and draws of a probe, and on how many threads.
    pub version: String,
    /// Way to draw.
    pub method: Method,
    /// Samples asked for; 0 where there are none.
    pub samples: usize,
    /// Bands of spherical harmonics; 0 where there are none.
    pub order: usize,
    /// What the harmonics represent; "-" where there are none.
    pub encoding: String,
    /// Directions of the bake; 0 where there is none.
    pub directions: usize,
    /// Preset of everything else.
    pub preset: String,
    /// Steps of each camera ray; 0 for methods that do not march.
    pub steps: usize,
    /// Lights.
    pub lights: usize,
    /// "cpu" or "gpu".
    pub backend: String,
}

/// What came out.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Outcome {
    /// Bytes that a player needs: samples or nodes, mesh, density.
    pub bytes: usize,
    /// Bytes of the samples or nodes among them: what serves the light alone.
    pub light_bytes: usize,
    /// Bytes of a sample or node; 0 where there are none.
    pub bytes_per_sample: f64,
    /// Seconds of the bake, or of what takes its place.
    pub bake_s: f64,
    /// Milliseconds of a frame: least, lower median, most.
    pub frame_ms: [f64; 3],
    /// Mean number of kernels on a ray; 0 for methods without.
    pub splats_per_ray: f64,
    /// The metrics of [`crate::metrics`].
    pub rel_rmse: f64,
    /// As there; absent for a perfect picture.
    pub psnr_db: Option<f64>,
    /// As there.
    pub bias: f64,
    /// As there.
    pub p99_rel: f64,
    /// As there.
    pub non_finite: usize,
    /// Noise of the reference.
    pub reference_noise: f64,
    /// What did the work.
    pub adapter: String,
    /// What was chosen in favour of a rival.
    pub note: String,
}

/// A measurement.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Record {
    /// What.
    pub key: Key,
    /// Result.
    pub outcome: Outcome,
}

/// Made-up measurements for the tests of this module's users.
#[cfg(test)]
pub mod samples {
    use super::*;

    /// Eight lights on the CPU, 10 % error, 2 ms.
    pub fn record(samples: usize) -> Record {
        let key = Key {
            case: "ball".to_owned(),
            inputs: "a".to_owned(),
            version: "b".to_owned(),
            method: Method::Splats,
            samples,
            order: 5,
            encoding: crate::sweep::plan::EncodingName::DEFAULT.name().to_owned(),
            directions: 64,
            preset: "standard".to_owned(),
            steps: 0,
            lights: 8,
            backend: "cpu".to_owned(),
        };
        let outcome = Outcome {
            bytes: 10,
            light_bytes: 5,
            bytes_per_sample: 1.0,
            bake_s: 0.1,
            frame_ms: [1.0, 2.0, 3.0],
            splats_per_ray: 9.0,
            rel_rmse: 0.1,
            psnr_db: None,
            bias: 0.0,
            p99_rel: 0.2,
            non_finite: 0,
            reference_noise: 0.01,
            adapter: String::new(),
            note: String::new(),
        };
        Record { key, outcome }
    }
}
