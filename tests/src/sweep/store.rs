//! Finished measurements, one JSON line each, flushed as they come: a sweep that is stopped goes on where it was.
//!
//! A line that cannot be read (the last one of a crash, a disk error) is dropped and said; its measurement is done
//! again. Lines of other versions or inputs stay in the file and are not used.

use super::record::{Key, Record};
use diaphane_formats::{Error, Result, files};
use std::collections::BTreeMap;
use std::io::Write;
use std::path::{Path, PathBuf};

/// The measurements of one folder.
pub struct Store {
    path: PathBuf,
    known: BTreeMap<Key, Record>,
}

impl Store {
    /// Opens or begins a file of measurements; also returns what a user should know about it.
    ///
    /// # Errors
    /// The file cannot be read, or not be mended.
    pub fn open(path: &Path) -> Result<(Self, Vec<String>)> {
        let mut known = BTreeMap::new();
        let mut damaged = Vec::new();
        let mut good = String::new();
        if path.exists() {
            // Bytes, not text: damage may break the encoding.
            let bytes = files::read(path, files::Kind::Kept)?;
            let unfinished = !bytes.is_empty() && !bytes.ends_with(b"\n");
            let lines: Vec<&[u8]> = bytes.split(|b| *b == b'\n').collect();
            for (i, line) in lines.iter().enumerate().filter(|(_, l)| !l.is_empty()) {
                match serde_json::from_slice::<Record>(line) {
                    Ok(record) => {
                        good.push_str(&String::from_utf8_lossy(line));
                        good.push('\n');
                        known.insert(record.key.clone(), record);
                    }
                    Err(e) => damaged.push(format!(
                        "{}: line {} is damaged ({e}); its measurement is done again",
                        path.display(),
                        i + 1
                    )),
                }
            }
            if unfinished || !damaged.is_empty() {
                files::write_atomically(path, good.as_bytes())?;
            }
        }
        Ok((Self { path: path.to_path_buf(), known }, damaged))
    }

    /// The measurement with this key, if it was made.
    pub fn get(&self, key: &Key) -> Option<&Record> {
        self.known.get(key)
    }

    /// Adds a measurement: on disk when this returns.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn add(&mut self, record: Record) -> Result<()> {
        let fail = |e: std::io::Error| Error::io("write", &self.path, e);
        let mut line = serde_json::to_string(&record)
            .map_err(|e| Error::invalid(format!("a measurement cannot be written: {e}")))?;
        line.push('\n');
        let mut file =
            std::fs::OpenOptions::new().create(true).append(true).open(&self.path).map_err(fail)?;
        file.write_all(line.as_bytes()).map_err(fail)?;
        file.sync_data().map_err(fail)?;
        self.known.insert(record.key.clone(), record);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sweep::record::samples::record;

    #[test]
    fn what_was_added_is_found_again() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("m.jsonl");
        let (mut store, warnings) = Store::open(&path).unwrap();
        assert!(warnings.is_empty());
        store.add(record(1)).unwrap();
        store.add(record(2)).unwrap();
        let (store, warnings) = Store::open(&path).unwrap();
        assert!(warnings.is_empty());
        assert_eq!(store.get(&record(2).key), Some(&record(2)));
        assert_eq!(store.get(&record(3).key), None);
    }

    #[test]
    fn damaged_lines_are_named_and_gone() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("m.jsonl");
        let (mut store, _) = Store::open(&path).unwrap();
        (1..=3).for_each(|i| store.add(record(i)).unwrap());
        let text = std::fs::read_to_string(&path).unwrap();
        let lines: Vec<&str> = text.lines().collect();
        // The second is not JSON, the third was cut off in the middle.
        let torn = format!("{}\n{}\n{}", lines[0], "\u{0}\u{1}", &lines[2][..40]);
        std::fs::write(&path, torn).unwrap();
        let (mut store, warnings) = Store::open(&path).unwrap();
        assert_eq!(warnings.len(), 2, "{warnings:?}");
        assert!(warnings[0].contains("line 2") && warnings[1].contains("line 3"));
        assert!(store.get(&record(1).key).is_some() && store.get(&record(3).key).is_none());
        store.add(record(3)).unwrap();
        let (store, warnings) = Store::open(&path).unwrap();
        assert!(warnings.is_empty() && store.get(&record(3).key).is_some());
    }
}
