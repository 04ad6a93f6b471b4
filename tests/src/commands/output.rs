//! Lines on standard output and standard error. A reader that goes away (`| head`) is no reason to fail.

use std::io::Write;

/// A line on standard output.
pub fn say(line: &str) {
    let _ = writeln!(std::io::stdout(), "{line}");
}

/// A line on standard error.
pub fn tell(line: &str) {
    let _ = writeln!(std::io::stderr(), "{line}");
}

/// Warnings on standard error.
pub fn warn(lines: &[String]) {
    lines.iter().for_each(|line| tell(&format!("warning: {line}")));
}
