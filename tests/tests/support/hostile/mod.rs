//! Hostile bytes: kept ones, and such as are made from them.

pub mod mutate;
pub mod seeds;

use std::path::PathBuf;

/// A folder of the fuzzer: `corpus` or `regressions` of one reader.
pub fn folder(what: &str, reader: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("fuzz").join(what).join(reader)
}

/// Names and bytes of the files in a folder, in order; none where the folder is missing.
pub fn files(what: &str, reader: &str) -> Vec<(String, Vec<u8>)> {
    let Ok(entries) = std::fs::read_dir(folder(what, reader)) else { return Vec::new() };
    let mut files: Vec<_> = entries
        .map(|entry| {
            let path = entry.unwrap().path();
            (path.file_name().unwrap().to_string_lossy().into_owned(), std::fs::read(path).unwrap())
        })
        .collect();
    files.sort();
    files
}
