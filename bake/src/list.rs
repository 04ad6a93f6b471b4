//! Lists of bakes (TOML): each entry becomes a command line.

use crate::{Error, Result};
use diaphane_formats::plain;
use std::path::Path;
use toml::{Table, Value};

/// Bytes of the defaults as text at the most: every bake of the list gets a copy of them.
const MOST_DEFAULTS: usize = 8192;

/// Options that hold for the whole program.
const WHOLE: [&str; 2] = ["threads", "quiet"];

fn wrong(message: impl AsRef<str>) -> Error {
    Error::Parameter(plain(message.as_ref()))
}

/// Program and arguments of every bake in the list, paths relative to `folder`.
///
/// # Errors
/// What is not TOML, keys that are not known, values of the wrong kind.
pub fn command_lines(text: &str, folder: &Path) -> Result<Vec<Vec<String>>> {
    let mut list: Table = text.parse().map_err(|e: toml::de::Error| wrong(e.message()))?;
    let defaults = match list.remove("defaults") {
        None => Table::new(),
        Some(Value::Table(table)) => table,
        Some(_) => return Err(wrong("'defaults' must be a table")),
    };
    let bakes = match list.remove("bake") {
        Some(Value::Array(bakes)) if !bakes.is_empty() => bakes,
        _ => return Err(wrong("holds no [[bake]]; see diaphane-bake batch --help")),
    };
    if let Some(key) = list.keys().next() {
        return Err(wrong(format!("'{key}' is no part of a list; there are [defaults] and [[bake]]")));
    }
    if defaults.to_string().len() > MOST_DEFAULTS {
        return Err(wrong(format!("'defaults' is longer than {MOST_DEFAULTS} bytes")));
    }
    let numbered = |(i, bake): (usize, Value)| {
        let Value::Table(bake) = bake else { return Err(wrong(format!("bake {} is not a table", i + 1))) };
        let mut options = defaults.clone();
        options.extend(bake);
        command_line(options, folder).map_err(|e| wrong(format!("bake {}: {e}", i + 1)))
    };
    bakes.into_iter().enumerate().map(numbered).collect()
}

fn command_line(mut options: Table, folder: &Path) -> Result<Vec<String>> {
    let mut path = |key: &str| match options.remove(key) {
        // A name that begins with a dash would be taken for an option.
        Some(Value::String(path)) if path.starts_with('-') && folder.as_os_str().is_empty() => {
            Ok(Some(format!("./{path}")))
        }
        Some(Value::String(path)) => Ok(Some(folder.join(path).to_string_lossy().into_owned())),
        Some(_) => Err(wrong(format!("'{key}' must be a path in quotes"))),
        None => Ok(None),
    };
    let mut line = vec!["diaphane-bake".to_owned()];
    for key in ["mesh", "material", "output", "report", "cache"] {
        let Some(path) = path(key)? else {
            if !["report", "cache"].contains(&key) {
                return Err(wrong(format!("'{key}' is missing")));
            }
            continue;
        };
        line.extend((key != "mesh").then(|| format!("--{key}")));
        line.push(path);
    }
    for (key, value) in options {
        if WHOLE.contains(&key.as_str()) {
            return Err(wrong(format!("'{key}' holds for a whole batch: give --{key} to it")));
        }
        let value = match value {
            Value::Boolean(true) => None,
            Value::Boolean(false) => continue,
            Value::String(s) => Some(s),
            Value::Integer(i) => Some(i.to_string()),
            Value::Float(f) => Some(f.to_string()),
            _ => return Err(wrong(format!("'{key}' must be a number, a text or true"))),
        };
        line.push(format!("--{key}"));
        line.extend(value);
    }
    Ok(line)
}
