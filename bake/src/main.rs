//! `diaphane-bake`: bakes a mesh, or shows what is in an asset.

#![warn(clippy::unwrap_used, clippy::expect_used)]

mod batch;
mod cli;
mod inspect;
mod terminal;

use clap::Parser;
use diaphane_formats::one_line;
use std::process::ExitCode;

fn main() -> ExitCode {
    let result = match cli::Arguments::try_parse() {
        Err(e) if !e.use_stderr() => {
            // Help and version were asked for.
            let _ = e.print();
            return ExitCode::SUCCESS;
        }
        Err(e) => Err(anyhow::anyhow!("{} (see --help)", one_line(&e.to_string()))),
        Ok(arguments) => cli::run(&arguments),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            let line = one_line(&format!("{error:#}"));
            terminal::tell(&format!("error: {}", line.strip_prefix("error: ").unwrap_or(&line)));
            let failed = matches!(error.downcast_ref(), Some(diaphane_bake::Error::TooInaccurate(_)))
                || error.is::<batch::SomeFailed>();
            ExitCode::from(if failed { 1 } else { 2 })
        }
    }
}
