//! `diaphane-play`: opens an asset in a window, or draws one picture of it.

#![warn(clippy::unwrap_used, clippy::expect_used)]

mod args;
mod bench;
mod headless;
mod levels;
mod stats;
#[cfg(feature = "window")]
mod window;

use anyhow::Result;
use args::{Args, Arguments, Command};
use clap::Parser;
use diaphane_formats::one_line;
use std::io::{ErrorKind, Write};
use std::process::ExitCode;

fn main() -> ExitCode {
    quiet_guarded_panics();
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
        Err(error) if nobody_reads(&error) => ExitCode::SUCCESS,
        Err(error) => {
            let line = one_line(&format!("{error:#}"));
            tell(&format!("error: {}", line.strip_prefix("error: ").unwrap_or(&line)));
            ExitCode::from(2)
        }
    }
}

/// A line on standard error, if anyone reads it.
fn tell(line: &str) {
    let _ = writeln!(std::io::stderr(), "{line}");
}

/// Whether a program ended because whoever read its lines went away (`| head`).
fn nobody_reads(error: &anyhow::Error) -> bool {
    error.downcast_ref().is_some_and(|e: &std::io::Error| e.kind() == ErrorKind::BrokenPipe)
}

/// Panics of libraries about a lost device become errors, which are told in a line of their own.
fn quiet_guarded_panics() {
    let tell = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |info| {
        if !diaphane_runtime::gpu::is_guarded() {
            tell(info);
        }
    }));
}

#[cfg(feature = "window")]
fn open_window(args: &Args) -> Result<()> {
    window::run(args)
}

#[cfg(not(feature = "window"))]
fn open_window(_args: &Args) -> Result<()> {
    anyhow::bail!("this build has no window; name a picture to draw with --output")
}
