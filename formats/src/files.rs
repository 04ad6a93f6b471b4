//! Opening and writing files: only regular files are read, and a file appears under its name only when complete.

use crate::{Error, Result};
use std::io::{Read, Write};
use std::path::Path;

/// Reads a whole regular file. Anything else (folder, device, pipe) is refused, so that a path from a file of a
/// stranger cannot block or flood the program.
pub fn read(path: &Path) -> Result<Vec<u8>> {
    require_regular(path)?;
    std::fs::read(path).map_err(|e| Error::io("read", path, e))
}

/// Reads the first `length` bytes of a regular file, fewer where it has no more.
pub fn read_front(path: &Path, length: usize) -> Result<Vec<u8>> {
    require_regular(path)?;
    let fail = |e| Error::io("read", path, e);
    let file = std::fs::File::open(path).map_err(fail)?;
    let mut front = Vec::new();
    file.take(length as u64).read_to_end(&mut front).map_err(fail)?;
    Ok(front)
}

/// Reads a whole regular file as UTF-8 text.
pub fn read_text(path: &Path) -> Result<String> {
    String::from_utf8(read(path)?).map_err(|_| Error::file(path, "is not a text file (invalid UTF-8)"))
}

fn require_regular(path: &Path) -> Result<()> {
    let about = std::fs::metadata(path).map_err(|e| Error::io("read", path, e))?;
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
    let folder = parent(path);
    let fail = |e| Error::io("write", path, e);
    let mut file = tempfile::Builder::new().prefix(".diaphane-").tempfile_in(folder).map_err(fail)?;
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

/// Checks, before long work, that `path` can be written: its folder exists and takes files, and it is no folder.
pub fn require_writable(path: &Path) -> Result<()> {
    if path.is_dir() {
        return Err(Error::file(path, "is a folder; name a file to write to"));
    }
    let folder = parent(path);
    tempfile::Builder::new()
        .prefix(".diaphane-")
        .tempfile_in(folder)
        .map(|_| ())
        .map_err(|e| Error::io("write", path, e))
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
