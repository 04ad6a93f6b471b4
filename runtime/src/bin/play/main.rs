//! `diaphane-play`: opens an asset in a window, or draws one picture of it.

mod args;
mod headless;
mod stats;
#[cfg(feature = "window")]
mod window;

use anyhow::Result;
use args::Args;
use clap::Parser;
use std::process::ExitCode;

fn main() -> ExitCode {
    env_logger::Builder::from_env(env_logger::Env::default().default_filter_or("error")).init();
    let args = Args::parse();
    let done = match &args.output {
        Some(output) => headless::run(&args, output),
        None => open_window(&args),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            // One line, whatever a message quotes.
            eprintln!("error: {}", error.to_string().replace(['\n', '\r'], " "));
            ExitCode::from(2)
        }
    }
}

#[cfg(feature = "window")]
fn open_window(args: &Args) -> Result<()> {
    window::run(args)
}

#[cfg(not(feature = "window"))]
fn open_window(_args: &Args) -> Result<()> {
    anyhow::bail!("this build has no window; name a picture to draw with --output")
}
