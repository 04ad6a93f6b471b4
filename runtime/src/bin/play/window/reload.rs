//! Files that change while the window shows them: read again when they have come to rest. What was read before stays until the new
//! contents are whole.

use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};

/// How often to look.
pub const PERIOD: Duration = Duration::from_millis(250);

/// A file that is looked at now and then.
#[derive(Debug)]
pub struct Watch {
    path: PathBuf,
    /// What was read last.
    known: Stamp,
    /// What the last look found, if it was something else.
    found: Option<Stamp>,
}

/// What tells one state of a file from another without reading it.
#[derive(Clone, Debug, PartialEq, Eq)]
enum Stamp {
    /// Nothing there, or nothing that may be looked at.
    Nothing,
    /// A folder, a pipe or the like.
    Other,
    /// A file: when it was written, its length, and on Unix which one it is.
    File { modified: Option<SystemTime>, length: u64, identity: (u64, u64) },
}

impl Stamp {
    fn of(path: &Path) -> Self {
        match std::fs::metadata(path) {
            Err(_) => Self::Nothing,
            Ok(about) if !about.is_file() => Self::Other,
            Ok(about) => Self::File {
                modified: about.modified().ok(),
                length: about.len(),
                identity: identity(&about),
            },
        }
    }
}

#[cfg(unix)]
fn identity(about: &std::fs::Metadata) -> (u64, u64) {
    use std::os::unix::fs::MetadataExt;
    (about.dev(), about.ino())
}

#[cfg(not(unix))]
fn identity(_: &std::fs::Metadata) -> (u64, u64) {
    (0, 0)
}

/// What a look came to.
#[derive(Debug, PartialEq, Eq)]
pub enum Look<T, E> {
    /// Nothing new, or nothing that has come to rest.
    Same,
    /// Other contents.
    New(T),
    /// Something that cannot be read; told once for each state of the file.
    Unreadable(E),
}

impl Watch {
    /// Begins before the file is read for the first time, so that no change escapes.
    pub fn new(path: &Path) -> Self {
        Self { path: path.to_owned(), known: Stamp::of(path), found: None }
    }

    /// The file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Reads the file where two looks in a row found the same change, and it did not change again while it was read.
    pub fn look<T, E>(&mut self, read: impl FnOnce(&Path) -> Result<T, E>) -> Look<T, E> {
        let now = Stamp::of(&self.path);
        if now == self.known {
            self.found = None;
            return Look::Same;
        }
        if self.found.as_ref() != Some(&now) {
            self.found = Some(now);
            return Look::Same;
        }
        let contents = read(&self.path);
        let after = Stamp::of(&self.path);
        if after != now {
            self.found = Some(after);
            return Look::Same;
        }
        (self.known, self.found) = (now, None);
        contents.map_or_else(Look::Unreadable, Look::New)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    /// A reader that takes files that end with a full stop.
    fn whole(path: &Path) -> Result<String, String> {
        let text = fs::read_to_string(path).map_err(|e| e.to_string())?;
        if text.ends_with('.') { Ok(text) } else { Err(format!("'{text}' is cut off")) }
    }

    fn new(text: &str) -> Look<String, String> {
        Look::New(text.to_owned())
    }

    /// A file with "old." that is watched.
    fn watched() -> (tempfile::TempDir, PathBuf, Watch) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("file");
        fs::write(&path, "old.").unwrap();
        let watch = Watch::new(&path);
        (folder, path, watch)
    }

    /// Renames a file with `text` onto `path`.
    fn replace(path: &Path, text: &str) {
        fs::write(path.with_extension("new"), text).unwrap();
        fs::rename(path.with_extension("new"), path).unwrap();
    }

    #[test]
    fn a_file_that_stays_is_not_read() {
        let (_folder, _, mut watch) = watched();
        for _ in 0..3 {
            assert_eq!(watch.look(|_| -> Result<String, String> { panic!("read") }), Look::Same);
        }
    }

    #[test]
    fn a_file_that_was_replaced_is_read_once_when_it_rests() {
        let (_folder, path, mut watch) = watched();
        // Of the same length, so that only time and identity tell.
        replace(&path, "new.");
        assert_eq!(watch.look(whole), Look::Same);
        assert_eq!(watch.look(whole), new("new."));
        assert_eq!(watch.look(whole), Look::Same);
    }

    #[test]
    fn a_file_that_grows_is_not_read_before_it_rests() {
        let (_folder, path, mut watch) = watched();
        for text in ["n", "ne", "new"] {
            fs::write(&path, text).unwrap();
            assert_eq!(watch.look(whole), Look::Same);
        }
        fs::write(&path, "newer.").unwrap();
        assert_eq!(watch.look(whole), Look::Same);
        assert_eq!(watch.look(whole), new("newer."));
    }

    #[test]
    fn a_file_that_was_cut_off_is_told_once_and_read_when_it_is_whole() {
        let (_folder, path, mut watch) = watched();
        fs::write(&path, "ne").unwrap();
        assert_eq!(watch.look(whole), Look::Same);
        assert_eq!(watch.look(whole), Look::Unreadable("'ne' is cut off".to_owned()));
        assert_eq!(watch.look(whole), Look::Same);
        fs::write(&path, "newer.").unwrap();
        assert_eq!(watch.look(whole), Look::Same);
        assert_eq!(watch.look(whole), new("newer."));
    }

    #[test]
    fn a_file_that_is_gone_is_told_once_and_read_when_it_is_back() {
        let (_folder, path, mut watch) = watched();
        fs::rename(&path, path.with_extension("away")).unwrap();
        assert_eq!(watch.look(whole), Look::Same);
        assert!(matches!(watch.look(whole), Look::Unreadable(_)));
        assert_eq!(watch.look(whole), Look::Same);
        fs::rename(path.with_extension("away"), &path).unwrap();
        assert_eq!(watch.look(whole), Look::Same);
        assert_eq!(watch.look(whole), new("old."));
    }

    #[test]
    fn a_file_that_became_a_folder_is_told_once() {
        let (_folder, path, mut watch) = watched();
        fs::remove_file(&path).unwrap();
        fs::create_dir(&path).unwrap();
        assert_eq!(watch.look(whole), Look::Same);
        assert!(matches!(watch.look(whole), Look::Unreadable(_)));
        assert_eq!(watch.look(whole), Look::Same);
        fs::remove_dir(&path).unwrap();
        fs::write(&path, "new.").unwrap();
        assert_eq!(watch.look(whole), Look::Same);
        assert_eq!(watch.look(whole), new("new."));
    }

    #[test]
    fn what_is_replaced_while_it_is_read_does_not_count() {
        let (_folder, path, mut watch) = watched();
        replace(&path, "first.");
        assert_eq!(watch.look(whole), Look::Same);
        let torn = watch.look(|path| {
            let first = whole(path);
            replace(path, "second.");
            first
        });
        assert_eq!(torn, Look::Same);
        assert_eq!(watch.look(whole), new("second."));
        assert_eq!(watch.look(whole), Look::Same);
    }

    #[test]
    fn what_goes_away_and_comes_back_between_two_looks_is_no_change() {
        let (_folder, path, mut watch) = watched();
        fs::rename(&path, path.with_extension("away")).unwrap();
        assert_eq!(watch.look(whole), Look::Same);
        fs::rename(path.with_extension("away"), &path).unwrap();
        (0..3).for_each(|_| assert_eq!(watch.look(whole), Look::Same));
    }
}
