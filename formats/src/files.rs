//! Opening and writing files: only regular files of the expected kind and size are read, and a file appears under its
//! name only when complete.

use crate::{Error, Result};
use std::fs::{File, Metadata, TryLockError};
use std::io::{Read, Write};
use std::path::Path;
use std::time::Duration;
use tempfile::NamedTempFile;

/// What a file is opened for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// A material, a scene, a list of bakes.
    Text,
    /// An OBJ mesh.
    Mesh,
    /// An array of NumPy.
    Npy,
    /// An EXR picture.
    Exr,
    /// A baked asset.
    Asset,
    /// What this program kept for itself: results of stages, measurements.
    Kept,
}

impl Kind {
    /// Its first bytes, as far as they are always the same.
    fn magic(self) -> &'static [u8] {
        match self {
            Self::Npy => crate::npy::MAGIC,
            Self::Exr => crate::picture::EXR_MAGIC,
            Self::Asset => crate::asset::MAGIC,
            Self::Text | Self::Mesh | Self::Kept => b"",
        }
    }

    /// Bytes at the most: far above what makes sense, far below what a file without data can claim.
    fn most(self) -> u64 {
        match self {
            Self::Text => 16 << 20,
            Self::Mesh | Self::Exr => 4 << 30,
            Self::Npy | Self::Asset | Self::Kept => 16 << 30,
        }
    }

    fn complaint(self) -> &'static str {
        match self {
            Self::Npy => "is not a usable .npy file: it does not begin like one",
            Self::Exr => "is not a usable EXR picture: it does not begin like one",
            Self::Asset => "is not a diaphane asset",
            Self::Text | Self::Mesh | Self::Kept => "is of another kind",
        }
    }
}

/// Reads a whole regular file. Anything else (folder, device, pipe) is refused, and so is what does not begin like a
/// file of its kind or is too large for one, so that a path from a file of a stranger cannot block or flood the program.
pub fn read(path: &Path, kind: Kind) -> Result<Vec<u8>> {
    read_up_to(path, kind, u64::MAX)
}

/// Reads the first `length` bytes of a regular file, fewer where it has no more.
pub fn read_front(path: &Path, kind: Kind, length: usize) -> Result<Vec<u8>> {
    read_up_to(path, kind, length as u64)
}

/// Reads a whole regular file as UTF-8 text.
pub fn read_text(path: &Path) -> Result<String> {
    String::from_utf8(read(path, Kind::Text)?)
        .map_err(|_| Error::file(path, "is not a text file (invalid UTF-8)"))
}

fn read_up_to(path: &Path, kind: Kind, wanted: u64) -> Result<Vec<u8>> {
    let fail = |e| Error::io("read", path, e);
    // Looked at before it is opened: opening a pipe waits for its other end, opening a device may do anything.
    require_regular(path, &std::fs::metadata(path).map_err(fail)?)?;
    let file = File::open(path).map_err(fail)?;
    // Something else may have taken the name meanwhile.
    let about = file.metadata().map_err(fail)?;
    require_regular(path, &about)?;
    let (length, most) = (about.len(), kind.most());
    if length > most {
        let message = format!("has {length} bytes; a file of its kind has at most {most}");
        return Err(Error::file(path, message));
    }
    let magic = kind.magic();
    let mut bytes = Vec::new();
    (&file).take(magic.len() as u64).read_to_end(&mut bytes).map_err(fail)?;
    if bytes != magic {
        return Err(Error::file(path, kind.complaint()));
    }
    // No more than the file was said to have: one that grows or never ends is not followed.
    let rest = length.min(wanted).saturating_sub(magic.len() as u64);
    let reserved = usize::try_from(rest).ok().and_then(|rest| bytes.try_reserve_exact(rest).ok());
    reserved.ok_or_else(|| Error::file(path, format!("has {length} bytes, more than memory holds")))?;
    file.take(rest).read_to_end(&mut bytes).map_err(fail)?;
    Ok(bytes)
}

fn require_regular(path: &Path, about: &Metadata) -> Result<()> {
    if about.is_file() { Ok(()) } else { Err(Error::file(path, "is not a regular file")) }
}

/// Writes `bytes` beside `path` under a temporary name, flushes, then renames: readers see the old file or the new
/// one, never a part.
pub fn write_atomically(path: &Path, bytes: &[u8]) -> Result<()> {
    replace(path, bytes, true)
}

/// As [`write_atomically`], but without waiting for the disk: for what can be made again.
pub fn write_scratch(path: &Path, bytes: &[u8]) -> Result<()> {
    replace(path, bytes, false)
}

fn replace(path: &Path, bytes: &[u8], flush: bool) -> Result<()> {
    let fail = |e| Error::io("write", path, e);
    let mut file = temporary(path).map_err(fail)?;
    file.write_all(bytes).map_err(fail)?;
    if flush {
        file.as_file().sync_all().map_err(fail)?;
    }
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        // Temporary files are private; what a user asked for is readable like any other file.
        file.as_file().set_permissions(std::fs::Permissions::from_mode(0o644)).map_err(fail)?;
    }
    file.persist(path).map_err(|e| Error::io("write", path, e.error))?;
    Ok(())
}

/// How the names of all files begin that are to become `path`. A checksum stands for its name, which may be as long as
/// names can be.
fn stem(path: &Path) -> String {
    let name = path.file_name().unwrap_or_default();
    format!(".diaphane-{:08x}-", crc32fast::hash(name.as_encoded_bytes()))
}

/// A file beside `path` to be written and renamed. It is locked for as long as it is open, so that [`remove_unfinished`]
/// knows that somebody is at work.
fn temporary(path: &Path) -> std::io::Result<NamedTempFile> {
    loop {
        let file = tempfile::Builder::new().prefix(&stem(path)).tempfile_in(parent(path))?;
        // Some file systems have no locks; age alone speaks for a file there.
        let _ = file.as_file().lock();
        // Gone only if it was taken for an abandoned one in the moment before it was locked.
        if file.path().exists() || !parent(path).exists() {
            return Ok(file);
        }
    }
}

/// Removes what writers of `path` left beside it that were killed before they were done, and says how many files that were.
/// What is being written now is locked and stays; without locks everything stays for a day. A folder that cannot be listed
/// holds nothing to remove.
pub fn remove_unfinished(path: &Path) -> usize {
    let stem = stem(path);
    let Ok(entries) = std::fs::read_dir(parent(path)) else { return 0 };
    let ours = |name: &std::ffi::OsStr| {
        name.to_str()
            .and_then(|n| n.strip_prefix(&stem))
            .is_some_and(|rest| rest.len() == RANDOM && rest.bytes().all(|b| b.is_ascii_alphanumeric()))
    };
    entries.flatten().filter(|e| ours(&e.file_name()) && remove_abandoned(&e.path())).count()
}

/// Letters at the end of a temporary name.
const RANDOM: usize = 6;
/// After this long a file that cannot be locked counts as abandoned.
const ABANDONED: Duration = Duration::from_secs(24 * 60 * 60);

/// Removes a file that nobody writes any more; says whether it is gone.
fn remove_abandoned(file: &Path) -> bool {
    if !file.symlink_metadata().is_ok_and(|m| m.is_file()) {
        return false;
    }
    let Ok(open) = std::fs::OpenOptions::new().write(true).open(file) else { return false };
    let abandoned = match open.try_lock() {
        Ok(()) => true,
        Err(TryLockError::WouldBlock) => false,
        Err(TryLockError::Error(_)) => {
            open.metadata().and_then(|m| m.modified()).is_ok_and(|m| m.elapsed().is_ok_and(|e| e > ABANDONED))
        }
    };
    // While the lock is held: a writer that waits for it sees that its file is gone and begins another one.
    abandoned && std::fs::remove_file(file).is_ok()
}

/// Checks, before long work, that `path` can be written: its folder exists and takes files, and it is no folder.
pub fn require_writable(path: &Path) -> Result<()> {
    if path.is_dir() {
        return Err(Error::file(path, "is a folder; name a file to write to"));
    }
    temporary(path).map(|_| ()).map_err(|e| Error::io("write", path, e))
}

/// Fails when two paths name the same file, so that an output never replaces an input.
pub fn require_different(output: &Path, input: &Path) -> Result<()> {
    let same = match (output.canonicalize(), input.canonicalize()) {
        (Ok(a), Ok(b)) => a == b,
        _ => output == input,
    };
    if same { Err(Error::file(output, "is both input and output; choose another output")) } else { Ok(()) }
}

fn parent(path: &Path) -> &Path {
    match path.parent() {
        Some(p) if !p.as_os_str().is_empty() => p,
        _ => Path::new("."),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Instant;

    /// Names in a folder.
    fn names(folder: &Path) -> Vec<String> {
        let mut names: Vec<_> = std::fs::read_dir(folder)
            .unwrap()
            .map(|e| e.unwrap().file_name().into_string().unwrap())
            .collect();
        names.sort();
        names
    }

    #[test]
    fn what_killed_writers_left_goes_and_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.dph");
        let put = |name: &str| std::fs::write(folder.path().join(name), b"x").unwrap();
        let mine = stem(&path);
        put(&format!("{mine}abc123"));
        put(&format!("{mine}XYZ789"));
        let mut others = vec![
            format!("{mine}abc"),
            format!("{mine}abc12."),
            format!("{}abc123", stem(&folder.path().join("b.dph"))),
            ".diaphane-abc123".to_owned(),
            "a.dph".to_owned(),
        ];
        others.iter().for_each(|name| put(name));
        std::fs::create_dir(folder.path().join(format!("{mine}folder"))).unwrap();
        others.push(format!("{mine}folder"));
        let at_work = temporary(&path).unwrap();
        others.push(at_work.path().file_name().unwrap().to_str().unwrap().to_owned());
        others.sort();
        assert_eq!(remove_unfinished(&path), 2);
        assert_eq!(names(folder.path()), others);
        assert_eq!(remove_unfinished(&path), 0);
        assert_eq!(remove_unfinished(&folder.path().join("missing/a.dph")), 0);
    }

    #[test]
    fn names_as_long_as_they_can_be_are_written() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("n".repeat(255));
        write_atomically(&path, b"x").unwrap();
        assert_eq!(names(folder.path()).len(), 1);
    }

    #[test]
    fn writers_and_removers_at_once_lose_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.dph");
        std::thread::scope(|scope| {
            let writers: Vec<_> = (0..4)
                .map(|k| {
                    let path = &path;
                    scope.spawn(move || {
                        for _ in 0..200 {
                            write_scratch(path, &[k; 1000]).unwrap();
                        }
                    })
                })
                .collect();
            while writers.iter().any(|w| !w.is_finished()) {
                remove_unfinished(&path);
            }
        });
        let bytes = read(&path, Kind::Kept).unwrap();
        assert!(bytes.len() == 1000 && bytes.iter().all(|b| *b == bytes[0]));
        assert_eq!(names(folder.path()), ["a.dph"]);
    }

    const KINDS: [Kind; 6] = [Kind::Text, Kind::Mesh, Kind::Npy, Kind::Exr, Kind::Asset, Kind::Kept];

    fn message(path: &Path, kind: Kind) -> String {
        let started = Instant::now();
        let message = read(path, kind).unwrap_err().to_string();
        assert!(started.elapsed() < Duration::from_secs(1), "{message}");
        message
    }

    #[test]
    fn whole_files_and_their_fronts_are_read() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a");
        for kind in KINDS {
            let whole = [kind.magic(), b"and more"].concat();
            std::fs::write(&path, &whole).unwrap();
            assert_eq!(read(&path, kind).unwrap(), whole);
            let magic = kind.magic().len();
            assert_eq!(read_front(&path, kind, magic + 3).unwrap(), whole[..magic + 3]);
            assert_eq!(read_front(&path, kind, 1 << 40).unwrap(), whole);
        }
    }

    #[test]
    fn files_of_another_kind_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a");
        std::fs::write(&path, "v 0 0 0\n").unwrap();
        assert!(message(&path, Kind::Exr).contains("EXR"));
        assert!(message(&path, Kind::Npy).contains(".npy"));
        assert!(message(&path, Kind::Asset).contains("not a diaphane asset"));
        assert!(message(folder.path(), Kind::Text).contains("not a regular file"));
    }

    #[cfg(unix)]
    #[test]
    fn devices_and_pipes_are_refused_and_not_waited_for() {
        for device in ["/dev/zero", "/dev/stdin", "/dev/tty"].map(Path::new) {
            if device.exists() && !device.is_file() {
                KINDS.iter().for_each(|kind| assert!(message(device, *kind).contains("not a regular file")));
            }
        }
        let folder = tempfile::tempdir().unwrap();
        let pipe = folder.path().join("pipe");
        assert!(std::process::Command::new("mkfifo").arg(&pipe).status().unwrap().success());
        KINDS.iter().for_each(|kind| assert!(message(&pipe, *kind).contains("not a regular file")));
        let link = folder.path().join("link");
        std::os::unix::fs::symlink("/dev/zero", &link).unwrap();
        assert!(message(&link, Kind::Mesh).contains("not a regular file"));
    }

    #[test]
    fn what_is_far_too_large_is_refused_unread() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a");
        // Without data on the disk.
        File::create(&path).unwrap().set_len(100 << 30).unwrap();
        KINDS.iter().for_each(|kind| assert!(message(&path, *kind).contains("at most")));
    }
}
