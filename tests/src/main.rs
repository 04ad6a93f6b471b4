//! The command line of the validation program.

#![warn(clippy::unwrap_used, clippy::expect_used)]

mod commands;

use clap::{Parser, Subcommand};
use commands::output::tell;
use diaphane_formats::one_line;
use std::process::ExitCode;

/// Checks translucent assets against a ray-marched reference.
#[derive(Parser)]
#[command(
    name = "diaphane-validate",
    version,
    after_help = "Exit codes: 0 done, 1 a check failed, 2 bad usage or bad input."
)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Render the ray-marched single-scattering reference of a mesh
    Reference(commands::reference::Arguments),
    /// Print how far a picture is from a reference
    Compare(commands::compare::Arguments),
    /// Play an asset, render the reference, and report how far apart they are
    Image(commands::image::Arguments),
    /// Bake, play and check the built-in objects
    Demo(commands::demo::Arguments),
    /// Bake, play and check a table of media, lights and views
    Range(commands::range::Arguments),
    /// Measure run time against error, beside other methods
    Sweep(Box<commands::sweep::Arguments>),
    /// Check meshes, media, lights and views at the ends of what numbers can hold
    Stress(commands::stress::Arguments),
    /// Measure how fast bakes are, as ratios within one run
    BakeSpeed(commands::bake_speed::Arguments),
    /// Measure how the time of a bake grows with samples, triangles and directions
    BakeScaling(commands::bake_scaling::Arguments),
}

fn main() -> ExitCode {
    let arguments = match Arguments::try_parse() {
        Ok(arguments) => arguments,
        Err(e) if !e.use_stderr() => {
            // Help and version were asked for.
            let _ = e.print();
            return ExitCode::SUCCESS;
        }
        Err(e) => {
            tell(&commands::usage_error(&e));
            return ExitCode::from(2);
        }
    };
    let result = match arguments.command {
        Command::Reference(a) => commands::reference::run(&a),
        Command::Compare(a) => commands::compare::run(&a),
        Command::Image(a) => commands::image::run(&a),
        Command::Demo(a) => commands::demo::run(&a),
        Command::Range(a) => commands::range::run(&a),
        Command::Sweep(a) => commands::sweep::run(&a),
        Command::Stress(a) => commands::stress::run(&a),
        Command::BakeSpeed(a) => commands::bake_speed::run(&a),
        Command::BakeScaling(a) => commands::bake_scaling::run(&a),
    };
    match result {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::from(1),
        Err(e) => {
            tell(&format!("error: {}", one_line(&format!("{e:#}"))));
            ExitCode::from(2)
        }
    }
}
