//! What a sweep is told.

use anyhow::ensure;
use clap::ValueEnum;
use diaphane_formats::sh::MAX_ORDER;
use std::path::PathBuf;
use validation::sweep::case::Size;
use validation::sweep::plan::{Axes, Base, EncodingName, PresetName};
use validation::sweep::record::Method;

/// Most of anything on a list; a longer one is a mistake.
const MOST: usize = 64;

/// What to measure. Lists are separated by commas; those that are not given come from the default or from --quick.
#[derive(clap::Args)]
#[command(
    after_help = "Measures run time against error: the player over samples, bands, encoding, directions and preset \
                  (one at a time around --base, and samples x bands as a small grid), and beside it, on the same rays, \
                  threads and references,\n  \
                  thesis  the published recipe at the same samples, with its best width and scale\n  \
                  march   brute-force ray marching with exact shadow rays\n  \
                  grid    marching through a grid of the same harmonics with the same bytes\n\
                  The rivals run on the CPU.\n\n\
                  Writes sweep.csv, summary.txt, summary.json and charts (*.svg) to the folder, and keeps finished \
                  measurements (measurements.jsonl) and references (references/) there: a sweep that is stopped goes on \
                  where it was, and only what is new is measured. Delete measurements.jsonl to measure again.\n\n\
                  Examples:\n  \
                  diaphane-validate sweep --quick --output-dir sweep\n  \
                  diaphane-validate sweep --cases statue --samples 2000,8000,32000 --lights 1,8,64\n  \
                  diaphane-validate sweep --cases none --case my.obj my.material.toml my.scene.toml\n  \
                  diaphane-validate sweep --methods splats,march --backend gpu"
)]
pub struct Arguments {
    /// Folder for everything, made if missing
    #[arg(long, value_name = "DIR", default_value = "sweep")]
    pub output_dir: PathBuf,
    /// Built-in objects (statue, cube, block), or none
    #[arg(long, value_name = "NAMES", value_delimiter = ',', default_value = "statue,cube,block")]
    pub cases: Vec<String>,
    /// Another object; may be given more than once
    #[arg(long, num_args = 3, value_names = ["MESH.obj", "M.toml", "S.toml"])]
    pub case: Vec<PathBuf>,
    /// Short lists and small pictures: a first impression in a few minutes
    #[arg(long)]
    pub quick: bool,
    /// What draws the splats: the CPU, or both
    #[arg(long, value_enum, default_value_t = SweepBackend::Cpu)]
    pub backend: SweepBackend,
    /// Which methods
    #[arg(long, value_name = "NAMES", value_delimiter = ',', default_value = "splats,thesis,march,grid")]
    pub methods: Vec<String>,
    /// Samples, bands and directions around which one is varied
    #[arg(long, value_name = "N,K,D", value_delimiter = ',')]
    pub base: Option<Vec<usize>>,
    /// Numbers of samples
    #[arg(long, value_name = "LIST", value_delimiter = ',')]
    pub samples: Option<Vec<usize>>,
    /// Numbers of bands
    #[arg(long, value_name = "LIST", value_delimiter = ',')]
    pub orders: Option<Vec<usize>>,
    /// What the harmonics represent
    #[arg(
        long,
        value_name = "LIST",
        value_delimiter = ',',
        value_enum,
        default_value = "reciprocal,lobe,depth,transmittance"
    )]
    pub encodings: Vec<EncodingName>,
    /// Numbers of directions
    #[arg(long, value_name = "LIST", value_delimiter = ',')]
    pub directions: Option<Vec<usize>>,
    /// Whole presets, with samples, bands and directions of their own; or none
    #[arg(long, value_name = "LIST", value_delimiter = ',')]
    pub presets: Option<Vec<String>>,
    /// Samples of the grid samples x bands
    #[arg(long, value_name = "LIST", value_delimiter = ',')]
    pub pair_samples: Option<Vec<usize>>,
    /// Bands of the grid samples x bands
    #[arg(long, value_name = "LIST", value_delimiter = ',')]
    pub pair_orders: Option<Vec<usize>>,
    /// Steps of the marcher
    #[arg(long, value_name = "LIST", value_delimiter = ',')]
    pub steps: Option<Vec<usize>>,
    /// Steps through the grid of harmonics
    #[arg(long, value_name = "N", default_value_t = 8)]
    pub grid_steps: usize,
    /// Numbers of lights: the scene's first ones, further ones around the object, their sum constant
    #[arg(long, value_name = "LIST", value_delimiter = ',', default_value = "1,8,64")]
    pub lights: Vec<usize>,
    /// Longer side of the pictures, pixels
    #[arg(long, value_name = "PIXELS")]
    pub size: Option<u32>,
    /// Sub-pixel rays
    #[arg(long, value_name = "N", default_value_t = 4)]
    pub samples_per_pixel: u32,
    /// Frames of which the median time is taken (fewer where they take seconds)
    #[arg(long, value_name = "N")]
    pub frames: Option<usize>,
    /// Relative noise of the references at which to stop
    #[arg(long)]
    pub tolerance: Option<f64>,
    /// Seed of bakes, references and further lights
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
}

/// What draws the splats.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum SweepBackend {
    /// The CPU
    Cpu,
    /// The CPU, and the GPU beside it
    Gpu,
}

/// Settings of the whole sweep.
pub struct Checked {
    /// What is measured.
    pub axes: Axes,
    /// Pictures.
    pub size: Size,
    /// Frames for a median.
    pub frames: usize,
    /// Noise of the references.
    pub tolerance: f64,
    /// Built-in objects by name.
    pub built_in: Vec<String>,
}

impl Arguments {
    /// Fills in the lists and checks them.
    pub fn check(&self) -> anyhow::Result<Checked> {
        let quick = self.quick;
        let list = |given: &Option<Vec<usize>>, full: &[usize], short: &[usize]| -> Vec<usize> {
            given.clone().unwrap_or_else(|| if quick { short.to_vec() } else { full.to_vec() })
        };
        let base = list(&self.base, &[8_000, 10, 768], &[2_000, 10, 768]);
        let [samples, order, directions] = base[..] else {
            anyhow::bail!("--base takes three numbers (samples, bands, directions), not {}", base.len());
        };
        let presets = match &self.presets {
            Some(names) => names.clone(),
            None if quick => vec!["none".to_owned()],
            None => vec!["draft".to_owned(), "standard".to_owned(), "fine".to_owned()],
        };
        let axes = Axes {
            base: Base { samples, order, directions },
            samples: list(&self.samples, &[1_000, 2_000, 4_000, 8_000, 16_000, 32_000], &[500, 2_000, 4_000]),
            orders: list(&self.orders, &[3, 5, 7, 10, 14], &[3, 5, 7]),
            encodings: self.encodings.clone(),
            directions: list(&self.directions, &[64, 128, 256, 512, 768, 1_536], &[128]),
            presets: names(&presets, "--presets", |n| PresetName::from_str(n, true).ok())?,
            pair_samples: list(&self.pair_samples, &[2_000, 8_000, 32_000], &[]),
            pair_orders: list(&self.pair_orders, &[5, 7, 10], &[]),
            steps: list(&self.steps, &[1, 2, 4, 8, 16, 32], &[1, 2, 4, 8]),
            grid_steps: self.grid_steps,
            lights: self.lights.clone(),
            methods: names(&self.methods, "--methods", |n| {
                Method::ALL.into_iter().find(|m| m.name().eq_ignore_ascii_case(n))
            })?,
        };
        let size = Size {
            side: self.size.unwrap_or(if quick { 48 } else { 96 }),
            samples_per_pixel: self.samples_per_pixel,
        };
        let frames = self.frames.unwrap_or(if quick { 2 } else { 3 });
        let tolerance = self.tolerance.unwrap_or(if quick { 0.02 } else { 0.008 });
        let one = |n: usize| vec![n];
        within("--base", &one(axes.base.samples), 1..=20_000_000)?;
        within("--samples", &axes.samples, 1..=20_000_000)?;
        within("--pair-samples", &axes.pair_samples, 1..=20_000_000)?;
        within("--base", &one(axes.base.order), 1..=MAX_ORDER)?;
        within("--orders", &axes.orders, 1..=MAX_ORDER)?;
        within("--pair-orders", &axes.pair_orders, 1..=MAX_ORDER)?;
        within("--base", &one(axes.base.directions), 1..=65_536)?;
        within("--directions", &axes.directions, 1..=65_536)?;
        within("--steps", &axes.steps, 1..=4_096)?;
        within("--grid-steps", &one(axes.grid_steps), 1..=4_096)?;
        within("--lights", &axes.lights, 1..=4_096)?;
        within("--size", &one(size.side as usize), 8..=4_096)?;
        within("--samples-per-pixel", &one(size.samples_per_pixel as usize), 1..=1_024)?;
        within("--frames", &one(frames), 1..=1_000)?;
        ensure!(tolerance > 0.0 && tolerance.is_finite(), "--tolerance must be above 0, not {tolerance}");
        ensure!(!axes.lights.is_empty(), "--lights needs at least one number");
        let built_in = names(&self.cases, "--cases", |n| {
            diaphane_assets::OBJECTS.iter().find(|o| o.name == n).map(|o| o.name.to_owned())
        })?;
        ensure!(
            !built_in.is_empty() || !self.case.is_empty(),
            "nothing to measure: name --cases or a --case"
        );
        Ok(Checked { axes, size, frames, tolerance, built_in })
    }
}

/// Each name's meaning; "none" alone is an empty list.
fn names<T>(given: &[String], option: &str, meaning: impl Fn(&str) -> Option<T>) -> anyhow::Result<Vec<T>> {
    if given == ["none"] {
        return Ok(Vec::new());
    }
    given
        .iter()
        .map(|n| meaning(n).ok_or_else(|| anyhow::anyhow!("{option}: '{n}' is not known (see --help)")))
        .collect()
}

fn within(option: &str, values: &[usize], range: std::ops::RangeInclusive<usize>) -> anyhow::Result<()> {
    ensure!(values.len() <= MOST, "{option} has {} values, at most {MOST} are allowed", values.len());
    for v in values {
        let (low, high) = (range.start(), range.end());
        ensure!(range.contains(v), "{option} must lie within {low}..{high}, not {v}");
    }
    Ok(())
}
