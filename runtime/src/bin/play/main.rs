//! `diaphane-play`: opens an asset in a window, or draws one picture of it.

mod args;
mod bench;
mod headless;
mod stats;
#[cfg(feature = "window")]
mod window;

use anyhow::Result;
use args::{Args, Arguments, Command};
use clap::Parser;
use diaphane_formats::one_line;
use std::process::ExitCode;

fn main() -> ExitCode {
    env_logger::Builder::from_env(env_logger::Env::default().default_filter_or("error")).init();
    let done = match Arguments::try_parse() {
        Err(e) if !e.use_stderr() => {
            // Help and version were asked for.
            let _ = e.print();
            return ExitCode::SUCCESS;
        }
        Err(e) => Err(anyhow::anyhow!("{} (see --help)", one_line(&e.to_string()))),
        Ok(Arguments { command: Some(Command::Bench(bench)), .. }) => bench::run(&bench),
        Ok(Arguments { play: Some(args), .. }) => match &args.output {
            Some(output) => headless::run(&args, output),
            None => open_window(&args),
        },
        Ok(_) => Err(anyhow::anyhow!("an asset is needed (see --help)")),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            let line = one_line(&format!("{error:#}"));
            eprintln!("error: {}", line.strip_prefix("error: ").unwrap_or(&line));
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
