//! `diaphane-bake`: bakes a mesh, or shows what is in an asset.

mod cli;
mod inspect;
mod terminal;

use clap::Parser;
use std::process::ExitCode;

fn main() -> ExitCode {
    match cli::run(cli::Arguments::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            // One line, whatever the chain of causes.
            let line = format!("{error:#}").replace('\n', " ");
            eprintln!("diaphane-bake: {line}");
            ExitCode::from(2)
        }
    }
}
