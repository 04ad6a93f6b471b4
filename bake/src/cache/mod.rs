//! Results of stages in a folder of the user's choice, so that nothing is computed twice.
//!
//! A file is named after its stage and a hash of all that the result depends on: mesh, medium, parameters, results before it
//! and the code itself. It holds a checksum; a file that does not fit is made again, and said so. Files appear complete or not
//! at all, so an interrupted bake goes on from the last one. Everything in the folder can be deleted at any time.

pub(crate) mod bytes;
mod key;

pub(crate) use key::Key;

use crate::Result;
use diaphane_formats::files;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use std::cell::RefCell;
use std::path::{Path, PathBuf};

/// What a cache did during a bake.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct CacheReport {
    /// Stages whose result was there, in order.
    pub reused: Vec<String>,
    /// Stages whose result was made and kept.
    pub kept: Vec<String>,
    /// Damaged entries and what could not be kept, in sentences.
    pub problems: Vec<String>,
}

/// A folder of results, or none: then everything is made and nothing kept.
pub(crate) struct Cache {
    folder: Option<PathBuf>,
    report: RefCell<CacheReport>,
}

/// In front of every file.
const MAGIC: &[u8; 16] = b"diaphane cache 1";
/// Bytes of a checksum.
const SUM: usize = 32;

impl Cache {
    /// Makes the folder if it is not there.
    ///
    /// # Errors
    /// A folder that cannot be made.
    pub fn open(folder: Option<&Path>) -> Result<Self> {
        if let Some(folder) = folder {
            std::fs::create_dir_all(folder).map_err(|e| diaphane_formats::Error::io("make", folder, e))?;
        }
        Ok(Self { folder: folder.map(Path::to_owned), report: RefCell::default() })
    }

    /// What was reused so far; `None` without a folder.
    pub fn report(&self) -> Option<CacheReport> {
        self.folder.as_ref().map(|_| self.report.borrow().clone())
    }

    /// The result that belongs to `key`: from the folder if it `fits` the bake, or made and kept there.
    pub fn get<T: Serialize + DeserializeOwned>(
        &self,
        key: &Key,
        fits: impl FnOnce(&T) -> bool,
        make: impl FnOnce() -> Result<T>,
    ) -> Result<T> {
        let Some(folder) = &self.folder else { return make() };
        let path = folder.join(key.file_name());
        match read(&path) {
            Ok(Some(value)) if !fits(&value) => {
                self.problem(format!("'{}' belongs to another bake and was made again", path.display()));
            }
            Ok(Some(value)) => {
                self.report.borrow_mut().reused.push(key.stage().to_owned());
                return Ok(value);
            }
            Ok(None) => {}
            Err(problem) => self.problem(format!("'{}' {problem} and was made again", path.display())),
        }
        let value = make()?;
        match write(&path, &value) {
            Ok(()) => self.report.borrow_mut().kept.push(key.stage().to_owned()),
            Err(e) => self.problem(format!("{} was not kept: {e}", key.stage())),
        }
        Ok(value)
    }

    fn problem(&self, sentence: String) {
        self.report.borrow_mut().problems.push(sentence);
    }
}

/// `None` where there is no such file; an error says what is wrong with it.
fn read<T: DeserializeOwned>(path: &Path) -> std::result::Result<Option<T>, String> {
    match files::read(path, files::Kind::Kept) {
        Ok(bytes) => parse(&bytes).map(Some),
        Err(diaphane_formats::Error::Io { cause, .. }) if cause.kind() == std::io::ErrorKind::NotFound => {
            Ok(None)
        }
        Err(e) => Err(format!("could not be read ({e})")),
    }
}

/// The value in a file of the cache. Its memory is a small multiple of the file's size: lists grow as they are read.
pub(crate) fn parse<T: DeserializeOwned>(bytes: &[u8]) -> std::result::Result<T, String> {
    let damaged = || "is damaged".to_owned();
    let (head, rest) = bytes.split_at_checked(MAGIC.len()).ok_or_else(damaged)?;
    let (sum, payload) = rest.split_at_checked(SUM).ok_or_else(damaged)?;
    if head != MAGIC || sum != blake3::hash(payload).as_bytes() {
        return Err(damaged());
    }
    match bincode::serde::decode_from_slice(payload, bincode::config::legacy()) {
        Ok((value, used)) if used == payload.len() => Ok(value),
        _ => Err(damaged()),
    }
}

fn write<T: Serialize>(path: &Path, value: &T) -> std::result::Result<(), String> {
    let mut bytes = vec![0; MAGIC.len() + SUM];
    bincode::serde::encode_into_std_write(value, &mut bytes, bincode::config::legacy())
        .map_err(|e| e.to_string())?;
    let sum = blake3::hash(&bytes[MAGIC.len() + SUM..]);
    bytes[..MAGIC.len()].copy_from_slice(MAGIC);
    bytes[MAGIC.len()..MAGIC.len() + SUM].copy_from_slice(sum.as_bytes());
    files::write_scratch(path, &bytes).map_err(|e| e.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn get(cache: &Cache, key: &Key, value: u64) -> u64 {
        cache.get(key, |_| true, || Ok(value)).unwrap()
    }

    #[test]
    fn results_are_made_once() {
        let folder = tempfile::tempdir().unwrap();
        let cache = Cache::open(Some(&folder.path().join("new"))).unwrap();
        let key = Key::new("numbers", &1).unwrap();
        assert_eq!((get(&cache, &key, 5), get(&cache, &key, 6)), (5, 5));
        assert_eq!(get(&cache, &Key::new("numbers", &2).unwrap(), 7), 7);
        assert_eq!(get(&cache, &Key::new("others", &1).unwrap(), 8), 8);
        let report = cache.report().unwrap();
        assert_eq!(report.reused, ["numbers"]);
        assert_eq!(report.kept, ["numbers", "numbers", "others"]);
        assert!(report.problems.is_empty());
        let none = Cache::open(None).unwrap();
        assert_eq!((get(&none, &key, 5), get(&none, &key, 6)), (5, 6));
        assert_eq!(none.report(), None);
    }

    #[test]
    fn damaged_files_are_made_again_and_said_so() {
        let folder = tempfile::tempdir().unwrap();
        let key = Key::new("numbers", &1).unwrap();
        let path = folder.path().join(key.file_name());
        let whole = {
            get(&Cache::open(Some(folder.path())).unwrap(), &key, 5);
            std::fs::read(&path).unwrap()
        };
        let mut flipped = whole.clone();
        *flipped.last_mut().unwrap() ^= 1;
        for damaged in [&whole[..whole.len() - 1], &whole[..20], &[], &flipped, &[&whole[..], b"x"].concat()]
        {
            std::fs::write(&path, damaged).unwrap();
            let cache = Cache::open(Some(folder.path())).unwrap();
            assert_eq!(get(&cache, &key, 6), 6);
            let report = cache.report().unwrap();
            assert!(report.problems[0].contains("is damaged and was made again"), "{:?}", report.problems);
            assert_eq!(get(&cache, &key, 7), 6);
        }
    }

    #[test]
    fn what_does_not_fit_is_made_again_and_said_so() {
        let folder = tempfile::tempdir().unwrap();
        let key = Key::new("numbers", &1).unwrap();
        let cache = Cache::open(Some(folder.path())).unwrap();
        get(&cache, &key, 5);
        assert_eq!(cache.get(&key, |v| *v != 5, || Ok(6u64)).unwrap(), 6);
        assert!(cache.report().unwrap().problems[0].contains("belongs to another bake and was made again"));
        assert_eq!(get(&cache, &key, 7), 6);
    }

    #[cfg(unix)]
    #[test]
    fn a_pipe_in_the_folder_is_not_waited_for() {
        let folder = tempfile::tempdir().unwrap();
        let key = Key::new("numbers", &1).unwrap();
        let pipe = folder.path().join(key.file_name());
        assert!(std::process::Command::new("mkfifo").arg(&pipe).status().unwrap().success());
        let cache = Cache::open(Some(folder.path())).unwrap();
        assert_eq!(get(&cache, &key, 5), 5);
        assert!(cache.report().unwrap().problems[0].contains("not a regular file"));
    }

    #[test]
    fn a_folder_that_takes_no_files_does_not_stop_a_bake() {
        let folder = tempfile::tempdir().unwrap();
        let key = Key::new("numbers", &1).unwrap();
        // A folder stands where the file should be.
        std::fs::create_dir(folder.path().join(key.file_name())).unwrap();
        let cache = Cache::open(Some(folder.path())).unwrap();
        assert_eq!(get(&cache, &key, 5), 5);
        assert_eq!(cache.report().unwrap().problems.len(), 2);
        assert!(
            Cache::open(Some(&{
                let file = folder.path().join("file");
                std::fs::write(&file, "").unwrap();
                file
            }))
            .is_err()
        );
    }
}
