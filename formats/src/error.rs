//! The one error type of this crate. Each message says what is wrong, where, and what to do.

use std::path::{Path, PathBuf};

/// Shorthand for results of this crate.
pub type Result<T> = std::result::Result<T, Error>;

/// The first paragraph of a message in one line: what a program prints when it gives up.
pub fn one_line(message: &str) -> String {
    let paragraph = message.split("\n\n").find(|p| !p.trim().is_empty()).unwrap_or_default();
    paragraph.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// Characters of a message at the most; what a file holds may be quoted in it.
const LONGEST: usize = 600;

/// A message as one line that a terminal shows and does not obey, cut where it is too long: parts of it may come from a
/// file of a stranger.
pub fn plain(message: &str) -> String {
    let mut line = String::new();
    for (i, c) in message.chars().enumerate() {
        if i == LONGEST {
            line.push('…');
            break;
        }
        match c {
            '\n' | '\r' | '\t' => line.push(' '),
            c if c.is_control() => line.extend(c.escape_unicode()),
            c => line.push(c),
        }
    }
    line
}

fn shown(path: &Path) -> String {
    plain(&path.to_string_lossy())
}

/// What can go wrong with files and their contents.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The operating system refused to read or write a file.
    #[error("cannot {action} '{}': {cause}", shown(path))]
    Io {
        /// What was attempted, for example "read".
        action: &'static str,
        /// The file.
        path: PathBuf,
        /// What the system said.
        cause: std::io::Error,
    },
    /// A file was read but its contents make no sense.
    #[error("'{}': {message}", shown(path))]
    File {
        /// The file.
        path: PathBuf,
        /// What is wrong and what to do.
        message: String,
    },
    /// A value, wherever it came from, is out of its range.
    #[error("{0}")]
    Invalid(String),
}

impl Error {
    /// An I/O error on `path` while doing `action` ("read", "write", ...).
    pub fn io(action: &'static str, path: &Path, cause: std::io::Error) -> Self {
        Self::Io { action, path: path.to_path_buf(), cause }
    }

    /// A complaint about the contents of `path`.
    pub fn file(path: &Path, message: impl Into<String>) -> Self {
        Self::File { path: path.to_path_buf(), message: plain(&message.into()) }
    }

    /// A complaint about a value.
    pub fn invalid(message: impl Into<String>) -> Self {
        Self::Invalid(plain(&message.into()))
    }

    /// The same complaint, tied to the file that it came from.
    pub fn in_file(self, path: &Path) -> Self {
        match self {
            Self::Invalid(message) => Self::file(path, message),
            other => other,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_file_holds_cannot_break_or_flood_a_message() {
        let error =
            Error::file(Path::new("a\u{1b}[2J.toml"), format!("unknown key '\u{7}x\ny{}'", "z".repeat(9999)));
        let text = error.to_string();
        assert!(text.starts_with("'a\\u{1b}[2J.toml': unknown key '\\u{7}x yzzz"), "{text}");
        assert!(text.ends_with("z…") && text.chars().count() < LONGEST + 30, "{text}");
        assert_eq!(plain("κ̄ is fine"), "κ̄ is fine");
    }
}
