//! Feeds one reader with what libFuzzer makes up. `DIAPHANE_READER` names it; see README.md beside this folder.
#![no_main]

#[path = "../../src/hostile/mod.rs"]
#[allow(dead_code, unused_imports)] // The tests use the rest.
mod hostile;

use hostile::{Reader, check, reader};
use peak_alloc::PeakAlloc;
use std::sync::LazyLock;

#[global_allocator]
static MEMORY: PeakAlloc = PeakAlloc;

static READER: LazyLock<&Reader> = LazyLock::new(|| {
    let name = std::env::var("DIAPHANE_READER").unwrap_or_default();
    reader(&name).unwrap_or_else(|| panic!("DIAPHANE_READER names no reader: '{name}'"))
});

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    check(*READER, bytes, || {
        let peak = MEMORY.peak_usage();
        MEMORY.reset_peak_usage();
        [MEMORY.current_usage(), peak]
    });
});
