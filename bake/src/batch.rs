//! `diaphane-bake batch`: many bakes from one list, each of which is also a plain command line.

use crate::cli::{self, Arguments};
use crate::inspect::percent;
use crate::terminal::{Bars, say, tell};
use anyhow::{Context, bail};
use clap::Parser;
use diaphane_bake::list;
use diaphane_bake::progress::Progress;
use diaphane_bake::report::Report;
use diaphane_formats::{files, one_line};
use std::path::{Path, PathBuf};
use std::time::Instant;

/// What to bake.
#[derive(clap::Args)]
#[command(
    after_help = "The list, paths relative to its folder:\n  [defaults]              # optional: options of all bakes\n  \
                  preset = \"draft\"\n\n  [[bake]]\n  mesh = \"bunny.obj\"\n  material = \"wax.material.toml\"\n  output = \
                  \"bunny.dph\"\n  samples = 20000         # any other option by its long name; flags are true\n\n\
                  Examples:\n  diaphane-bake batch assets.toml\n  diaphane-bake batch assets.toml --commands | parallel\n\n\
                  Exit codes: 0 all baked, 1 some failed, 2 the list is wrong or the batch was stopped."
)]
pub struct BatchArguments {
    /// The list (TOML).
    list: PathBuf,
    /// Prints each bake's command line and bakes nothing.
    #[arg(long)]
    commands: bool,
    /// Threads to use; all cores if not given.
    #[arg(long, value_name = "T")]
    threads: Option<usize>,
    /// No progress bars; the summary stays.
    #[arg(long, short)]
    quiet: bool,
}

/// Bakes that failed, of a batch that went to its end.
#[derive(Debug, thiserror::Error)]
#[error("{failed} of {all} bakes failed")]
pub struct SomeFailed {
    failed: usize,
    all: usize,
}

/// Bakes the list, one after the other; a failure does not stop the rest.
pub fn run(arguments: &BatchArguments) -> anyhow::Result<()> {
    let folder = arguments.list.parent().unwrap_or(Path::new(""));
    let text = files::read_text(&arguments.list)?;
    let name = arguments.list.display();
    let lines = list::command_lines(&text, folder).with_context(|| format!("'{name}'"))?;
    if arguments.commands {
        lines.iter().for_each(|line| say(&shell(line)));
        return Ok(());
    }
    let bakes: Vec<Arguments> = lines
        .iter()
        .enumerate()
        .map(|(i, line)| {
            Arguments::try_parse_from(line)
                .map_err(|e| anyhow::anyhow!("'{name}': bake {}: {}", i + 1, one_line(&e.to_string())))
        })
        .collect::<anyhow::Result<_>>()?;
    for (i, bake) in bakes.iter().enumerate() {
        if let Some(k) = bakes[..i].iter().position(|other| other.output() == bake.output()) {
            bail!(
                "'{name}': bakes {} and {} write the same file '{}'",
                k + 1,
                i + 1,
                bake.output().display()
            );
        }
    }
    cli::use_threads(arguments.threads)?;
    let bars = Bars::new(arguments.quiet);
    bars.cancel_on_interrupt().context("cannot listen for Ctrl-C")?;
    let (mut summary, mut failed) = (Vec::new(), 0);
    for (i, bake) in bakes.iter().enumerate() {
        if !arguments.quiet {
            tell(&format!("bake {} of {}: {}", i + 1, bakes.len(), bake.output().display()));
        }
        let start = Instant::now();
        let result = cli::run_bake(bake, &bars);
        if bars.cancelled() {
            bail!("stopped in bake {} of {}; those before it are done", i + 1, bakes.len());
        }
        failed += usize::from(result.is_err());
        summary.push(line(bake.output(), &result, start.elapsed().as_secs_f64()));
    }
    summary.iter().for_each(|line| say(line));
    if failed > 0 { Err(SomeFailed { failed, all: bakes.len() }.into()) } else { Ok(()) }
}

fn line(output: &Path, result: &anyhow::Result<Report>, seconds: f64) -> String {
    let name = output.display();
    match result {
        Ok(report) => {
            let error = report.certificate.and_then(|c| c.error);
            let error = error.map_or("not measured".to_owned(), |e| percent(e.rel_rmse));
            let megabytes = report.bytes as f64 / 1e6;
            format!(
                "done    {name}  {} samples, {megabytes:.1} MB, error {error}, {seconds:.1} s",
                report.samples
            )
        }
        Err(e) => format!("FAILED  {name}  {}", one_line(&format!("{e:#}"))),
    }
}

/// A command line that a shell takes apart as it was.
fn shell(line: &[String]) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_./=,:+@%".contains(c);
    let quoted = |word: &String| {
        let safe = !word.is_empty() && word.chars().all(plain);
        if safe { word.clone() } else { format!("'{}'", word.replace('\'', r"'\''")) }
    };
    line.iter().map(quoted).collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lines(text: &str) -> anyhow::Result<Vec<String>> {
        Ok(list::command_lines(text, Path::new("in"))?.iter().map(|line| shell(line)).collect())
    }

    #[test]
    fn entries_become_command_lines() {
        let list = "[defaults]\nseed = 7\ncache = \"kept\"\n[[bake]]\nmesh = \"a b.obj\"\nmaterial = \"m.toml\"\noutput = \"/o/a.dph\"\n\
                    seed = 8\nno-certificate = true\nlight-error = 0.02\n[[bake]]\nmesh = \"it's.obj\"\nmaterial = \
                    \"m.toml\"\noutput = \"b.dph\"\npreset = \"draft\"\n";
        assert_eq!(
            lines(list).unwrap(),
            [
                "diaphane-bake 'in/a b.obj' --material in/m.toml --output /o/a.dph --cache in/kept --light-error 0.02 --no-certificate --seed 8",
                r"diaphane-bake 'in/it'\''s.obj' --material in/m.toml --output in/b.dph --cache in/kept --preset draft --seed 7",
            ]
        );
    }

    #[test]
    fn wrong_lists_are_refused_in_words() {
        let bake = "[[bake]]\nmesh = \"a\"\nmaterial = \"m\"\n";
        for (text, part) in [
            ("", "holds no [[bake]]"),
            ("bake = 3", "holds no [[bake]]"),
            ("bake = [3]", "bake 1 is not a table"),
            (bake, "'output' is missing"),
            (&format!("{bake}output = 3"), "must be a path"),
            (&format!("{bake}output = \"o\"\nthreads = 2"), "whole batch"),
            (&format!("{bake}output = \"o\"\nseed = [1]"), "'seed' must be"),
            (&format!("extra = 1\n{bake}output = \"o\""), "'extra' is no part"),
            ("[[bake", "expected"),
            (
                &format!("[defaults]\nreport = \"{}\"\n{bake}output = \"o\"", "r".repeat(9000)),
                "'defaults' is longer",
            ),
        ] {
            let error = format!("{:#}", lines(text).unwrap_err());
            assert!(error.contains(part), "{text}: {error}");
        }
    }
}
