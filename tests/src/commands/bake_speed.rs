//! `diaphane-validate bake-speed`: the table of ratios that tells how fast bakes are.

use super::output::{say, tell, warn};
use diaphane_bake::params::{Params, Visibility};
use diaphane_bake::progress::Silent;
use diaphane_formats::mesh::{self, Mesh};
use diaphane_formats::visibility::Accel;
use std::path::PathBuf;
use validation::range::objects::Object;
use validation::speed::bakes::{by, medium, seconds, stages, timed};
use validation::speed::ball::bumpy_ball;
use validation::speed::visibility::{agreement, along_the_curve, points_inside, rates};
use validation::speed::{Line, text};

/// What to measure on.
#[derive(clap::Args)]
#[command(
    after_help = "Ratios are taken within one run, so that they mean the same on any machine. Close other programs: they \
                  take part in the measurement.\n\nExamples:\n  diaphane-validate bake-speed\n  diaphane-validate \
                  bake-speed --mesh bunny.obj --points 1000000 --lines 10000000\n  diaphane-validate bake-speed --ball 500000 \
                  --lines 10000000 --no-bakes"
)]
pub struct Arguments {
    /// The mesh (OBJ); the built-in bird if not given
    #[arg(long, value_name = "MESH.obj")]
    mesh: Option<PathBuf>,
    /// A bumpy ball of about so many triangles instead
    #[arg(long, value_name = "N", conflicts_with = "mesh")]
    ball: Option<usize>,
    /// Points for the rates of both methods
    #[arg(long, value_name = "N", default_value_t = 100_000)]
    points: usize,
    /// Lines along which both methods are compared
    #[arg(long, value_name = "N", default_value_t = 1_000_000)]
    lines: usize,
    /// Samples of the bakes
    #[arg(long, value_name = "N", default_value_t = 50_000)]
    samples: usize,
    /// Directions of the bakes
    #[arg(long, value_name = "D", default_value_t = 256)]
    directions: usize,
    /// Leaves out the bakes
    #[arg(long)]
    no_bakes: bool,
}

/// Points that are traced, at most: tracing is the slow one.
const TRACED: usize = 20_000;
/// Directions for the rates.
const DIRECTIONS: usize = 8;
/// Points that are compared along each direction.
const COMPARED: usize = 50_000;

/// Measures and prints.
pub fn run(a: &Arguments) -> anyhow::Result<bool> {
    anyhow::ensure!(a.points > 0 && a.lines > 0, "--points and --lines must be at least 1");
    let mesh: Mesh = match (&a.mesh, a.ball) {
        (Some(path), _) => {
            let (mesh, report) = mesh::load_obj(path)?;
            warn(&report.warnings());
            mesh
        }
        (None, Some(triangles)) => bumpy_ball(triangles)?,
        (None, None) => Object::Bird.place()?.mesh,
    };
    let even = medium(&mesh, false)?;
    let accel = Accel::new(&mesh);
    let mut lines = vec![Line::new("triangles", mesh.triangles.len().to_string())];

    tell("rays per second by both methods ...");
    let points = points_inside(&mesh, &accel, a.points, 0.0, 3);
    anyhow::ensure!(!points.is_empty(), "no point inside the mesh was found");
    let count = points.len();
    lines.push(Line::new("points", count.to_string()));
    let million = |rate: f64| format!("{:.2} M/s", rate / 1e6);
    let curve = along_the_curve(&points);
    for (order, points) in [("at random", &points), ("in a bake's order", &curve)] {
        let r = rates(&mesh, &accel, &even, points, DIRECTIONS, TRACED);
        lines.push(Line::new(format!("rays of one thread, points {order}, traced"), million(r.trace)));
        lines.push(Line::new("  projected", million(r.project)));
        lines.push(Line::new("  projected over traced", format!("{:.1}", r.project / r.trace)));
    }

    tell("agreement of both methods ...");
    let some = &points[..count.min(COMPARED)];
    let g = agreement(&mesh, &accel, &even, some, a.lines.div_ceil(some.len()));
    lines.push(Line::new(
        format!("wrong windings in {} lines, projected", g.lines),
        g.wrong_projected.to_string(),
    ));
    lines.push(Line::new("  traced", g.wrong_traced.to_string()));
    lines.push(Line::new("  largest difference of depth, diagonals", format!("{:.1e}", g.largest)));

    if !a.no_bakes {
        let params = Params { samples: a.samples, directions: a.directions, ..Params::default() };
        let bake = |name: &str, medium, how| {
            tell(&format!("{name} ..."));
            timed(&mesh, medium, &by(&params, how), &Silent)
        };
        let project = bake("a bake by projection", &even, Visibility::Project)?;
        let trace = bake("a bake by tracing", &even, Visibility::Trace)?;
        let uneven = medium(&mesh, true)?;
        let uneven = bake("a bake with a density grid", &uneven, Visibility::Project)?;
        let ratio = |a: f64, b: f64| format!("{:.2}", a / b);
        let of = |stage: &str| ratio(seconds(&trace, stage), seconds(&project, stage));
        lines.push(Line::new("optical depth, traced over projected", of("optical depth")));
        lines.push(Line::new("whole bake, traced over projected", of("total")));
        let uneven_ratio = ratio(seconds(&uneven, "total"), seconds(&project, "total"));
        lines.push(Line::new("whole bake, density grid over even density", uneven_ratio));
        lines.push(Line::new(
            format!("stages, {} samples, {} directions", project.samples, project.directions),
            "",
        ));
        lines.extend(stages(&project));
    }
    say(text(&lines).trim_end());
    Ok(g.wrong_projected == 0)
}
