//! The command line.

use crate::bench::BenchArgs;
use clap::{Parser, Subcommand, ValueEnum};
use diaphane_runtime::edit::{Edit, parse_channels};
use diaphane_runtime::gpu::SplatPath;
use diaphane_runtime::player::{Backend, LightMode};
use glam::DVec3;
use std::path::PathBuf;

const EXAMPLES: &str = "\
Examples:
  diaphane-play statue.dph
      opens the window
  diaphane-play statue.dph --budget 16
      the same; while something moves levels of detail keep a frame within 16 ms
  diaphane-play statue.dph --output statue.png
      draws the asset in a default scene: from 45 degrees above, three lights
  diaphane-play statue.dph --scene side.scene.toml --output side.exr
      linear radiance with coverage in alpha
  diaphane-play statue.dph --scene side.scene.toml --output side.exr --frames 20 --stats side.json
      draws the frame 20 times, every pass anew, and writes timings
  diaphane-play statue.dph --output statue.png --frames 200 --level auto --budget 16 --stats statue.json
      draws it 200 times, at levels of detail that keep a frame within 16 ms, and says which
  diaphane-play lamp.dph --scene inside.scene.toml --output inside.exr --light auto
      traces rays to lights that stand inside the object
  diaphane-play statue.dph --extinction-scale 0.5 --albedo 0.9,0.8,0.6 --output amber.png
      half as dense as baked, and another colour: no new bake is needed
  diaphane-play bench statue.dph --output statue.bench.json --plots charts
      frame times against lights, resolution and level of detail, and beside a ray marcher (bench --help)";

/// Plays a baked translucent asset in a window, or draws one picture of it.
#[derive(Debug, Parser)]
#[command(
    name = "diaphane-play",
    version,
    args_conflicts_with_subcommands = true,
    subcommand_negates_reqs = true,
    after_help = EXAMPLES
)]
pub struct Arguments {
    #[command(subcommand)]
    pub command: Option<Command>,
    #[command(flatten)]
    pub play: Option<Args>,
}

/// Other things to do with an asset.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Times frames along an orbit: lights, resolutions, levels of detail, one varied at a time; and beside other methods
    /// at equal error
    Bench(BenchArgs),
}

/// How an asset is played.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// The baked asset (*.dph)
    pub asset: PathBuf,
    /// Camera, image, surface and lights (*.scene.toml); without it the asset is framed from 45 degrees above
    #[arg(long, value_name = "S.toml")]
    pub scene: Option<PathBuf>,
    /// Draw one picture to this file (.exr: linear radiance, coverage in alpha; .png: to look at) and quit; without
    /// it the window opens
    #[arg(long, value_name = "IMG")]
    pub output: Option<PathBuf>,
    /// What draws
    #[arg(long, value_enum, default_value_t = BackendArg::Auto)]
    pub backend: BackendArg,
    /// How a GPU sums the kernels
    #[arg(long, value_enum, default_value_t = SplatArg::Auto, requires = "output")]
    pub splat: SplatArg,
    /// Depth from the samples to the lights: baked, exact (rays to every light of the scene) or auto (rays to lights
    /// inside the object's bounding box and to those that the scene marks `exact = true`). A picture has all of them at once;
    /// its default is baked, or auto where a light is marked. In the window, whose default is auto, rays are spread over
    /// frames, and auto traces all lights that have come to rest
    #[arg(long, value_enum)]
    pub light: Option<LightArg>,
    /// Play with the baked extinction times S, one factor for all channels or one for each (0.6..1.8 is nearly as
    /// good as a new bake)
    #[arg(long, value_name = "S|R,G,B", value_parser = parse_channels, allow_hyphen_values = true)]
    pub extinction_scale: Option<DVec3>,
    /// Play with this single-scattering albedo (0..1) instead of the baked one
    #[arg(long, value_name = "A|R,G,B", value_parser = parse_channels, allow_hyphen_values = true)]
    pub albedo: Option<DVec3>,
    /// Play this level of detail alone, and read no more of the file than it needs: 0 are all samples, each further
    /// one has about a quarter of them; `auto`: the coarsest that is fine enough for the object's size in the picture, by what the
    /// bake measured of its error
    #[arg(long, value_name = "K|auto", requires = "output", value_parser = parse_level)]
    pub level: Option<LevelArg>,
    /// Take coarser levels of detail where a frame takes longer than this many milliseconds, by what the frames before took, and
    /// finer ones again when there is time: with `--level auto` than that does, over --frames; in the window than all samples,
    /// while something moves (and fewer pixels where levels do not suffice)
    #[arg(long, value_name = "MS", value_parser = parse_budget, allow_negative_numbers = true)]
    pub budget: Option<f64>,
    /// Draw the frame this many times, for timings
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=1_000_000),
          requires = "output")]
    pub frames: u32,
    /// Keep what has not changed from frame to frame instead of redoing every pass
    #[arg(long, requires = "output")]
    pub reuse: bool,
    /// Write counts and timings as JSON to this file
    #[arg(long, value_name = "S.json", requires = "output")]
    pub stats: Option<PathBuf>,
    /// Open the window, draw N frames, save what it shows to FILE.png and quit: for tests
    #[arg(long, num_args = 2, value_names = ["N", "FILE.png"], conflicts_with = "output")]
    pub screenshot_after: Option<Vec<String>>,
}

impl Args {
    /// The material that is asked for.
    pub fn edit(&self) -> Edit {
        Edit { extinction_scale: self.extinction_scale.unwrap_or(DVec3::ONE), albedo: self.albedo }
    }
}

/// A level of detail.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LevelArg {
    Auto,
    One(usize),
}

fn parse_level(text: &str) -> Result<LevelArg, String> {
    if text == "auto" {
        return Ok(LevelArg::Auto);
    }
    text.parse().map(LevelArg::One).map_err(|_| "a level is a number from 0 on, or auto".to_owned())
}

fn parse_budget(text: &str) -> Result<f64, String> {
    let milliseconds = text.parse().ok().filter(|ms: &f64| ms.is_finite() && *ms > 0.0);
    milliseconds.ok_or_else(|| "a budget is a number of milliseconds above 0".to_owned())
}

/// [`Backend`] on the command line.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub enum BackendArg {
    /// The GPU where there is one, else the CPU
    Auto,
    /// The GPU, or an error
    Gpu,
    /// The CPU
    Cpu,
}

impl From<BackendArg> for Backend {
    fn from(arg: BackendArg) -> Self {
        match arg {
            BackendArg::Auto => Self::Auto,
            BackendArg::Gpu => Self::Gpu,
            BackendArg::Cpu => Self::Cpu,
        }
    }
}

/// [`SplatPath`] on the command line.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub enum SplatArg {
    /// Whichever suits the adapter
    Auto,
    /// Quads, blended
    Quads,
    /// Tiles that gather in registers
    Tiles,
}

impl From<SplatArg> for Option<SplatPath> {
    fn from(arg: SplatArg) -> Self {
        match arg {
            SplatArg::Auto => None,
            SplatArg::Quads => Some(SplatPath::Quads),
            SplatArg::Tiles => Some(SplatPath::Tiles),
        }
    }
}

/// [`LightMode`] on the command line.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub enum LightArg {
    /// Baked depths
    Baked,
    /// Rays to every light of the scene
    Exact,
    /// Rays to lights inside the bounding box, marked exact, or in the window at rest
    Auto,
}

impl From<LightArg> for LightMode {
    fn from(arg: LightArg) -> Self {
        match arg {
            LightArg::Baked => Self::Baked,
            LightArg::Exact => Self::Exact,
            LightArg::Auto => Self::Auto,
        }
    }
}
