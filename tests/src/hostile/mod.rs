//! Every reader of files, ready to be fed bytes that mean harm: by the fuzzer in `tests/fuzz`, and by a test that replays
//! its corpus.
//!
//! A [`Reader`] takes any bytes, and either refuses them in one line or hands on what it made of them, to be used as the
//! programs would use it. What must hold: no panic, memory and time bounded by the number of bytes, messages that are fit
//! to be printed, and nothing accepted that is poisonous to those who use it.

mod entry;
mod mesh;
#[expect(clippy::expect_used, reason = "a panic is what the fuzzer looks for")]
mod object;
mod pictures;
#[expect(clippy::expect_used, reason = "a panic is what the fuzzer looks for")]
mod text;

pub use entry::params;

/// Uses what was read, in bounded time.
pub type Use = Box<dyn FnOnce()>;

/// A reader of one kind of file.
pub struct Reader {
    /// Name of its folders in `tests/fuzz`.
    pub name: &'static str,
    /// Reads bytes; an error is what a user would be told.
    pub read: fn(&[u8]) -> Result<Use, String>,
    /// Memory that reading may take: bytes for each byte of the file, and bytes in any case.
    pub memory: [usize; 2],
}

/// Memory that any reader may take whatever the size of the file.
const SMALL: usize = 2 << 20;

/// All of them.
pub const READERS: [Reader; 10] = [
    Reader { name: "asset", read: object::file, memory: [16, SMALL] },
    // The same with all checksums right, so that what is in the sections is reached.
    Reader { name: "asset-sections", read: object::sections, memory: [24, SMALL] },
    Reader { name: "material", read: text::material, memory: [256, SMALL] },
    Reader { name: "scene", read: text::scene, memory: [256, SMALL] },
    Reader { name: "list", read: text::list, memory: [1024, SMALL] },
    Reader { name: "mesh", read: mesh::obj, memory: [4096, SMALL] },
    Reader { name: "grid", read: pictures::grid, memory: [16, SMALL] },
    Reader { name: "coverage", read: pictures::coverage, memory: [8, SMALL] },
    // What compression can unfold, see `parse_exr`.
    Reader { name: "picture", read: pictures::exr, memory: [8 * 1376, 4 * SMALL] },
    Reader { name: "cache-entry", read: entry::entry, memory: [8, SMALL] },
];

/// The reader of this name.
pub fn reader(name: &str) -> Option<&'static Reader> {
    READERS.iter().find(|reader| reader.name == name)
}

/// Feeds `bytes` to a reader and checks what comes out. `memory` counts the bytes that are allocated now, and the most that
/// were since it was last asked. Returns whether the bytes were accepted.
///
/// # Panics
/// A reader that breaks its word.
pub fn check(reader: &Reader, bytes: &[u8], memory: impl Fn() -> [usize; 2]) -> bool {
    let [before, _] = memory();
    let read = (reader.read)(bytes);
    let [_, most] = memory();
    let [each, any] = reader.memory;
    let (taken, allowed) = (most.saturating_sub(before), each * bytes.len() + any);
    assert!(taken <= allowed, "{} bytes of a file took {taken} bytes of memory, not {allowed}", bytes.len());
    match read {
        Ok(to_use) => {
            to_use();
            true
        }
        Err(message) => {
            let printable = !message.is_empty() && !message.chars().any(char::is_control);
            assert!(printable && message.chars().count() < 2000, "not fit to be printed: {message:?}");
            false
        }
    }
}

/// Anything's words.
fn words(error: impl std::fmt::Display) -> String {
    error.to_string()
}
