//! Meshes that are as much work as a file of their size can be: repeated, nested, crossing or torn everywhere.

#[path = "support/hostile/sizes.rs"]
mod sizes;

use diaphane_formats::mesh::parse_obj;
use peak_alloc::PeakAlloc;
use std::time::{Duration, Instant};

#[global_allocator]
static MEMORY: PeakAlloc = PeakAlloc;

/// Faces of each.
const COUNT: usize = 2000;
/// Splitting every open edge at every other took minutes and gigabytes; what is left takes a few seconds where it is worst.
const LONG: Duration = Duration::from_secs(60);

#[test]
fn the_hardest_meshes_take_bounded_time_and_memory() {
    for (name, text) in sizes::meshes(COUNT) {
        MEMORY.reset_peak_usage();
        let (before, started) = (MEMORY.current_usage(), Instant::now());
        let result = parse_obj(text.as_bytes());
        let (seconds, taken) = (started.elapsed(), MEMORY.peak_usage().saturating_sub(before));
        let outcome =
            result.map_or_else(|e| e.to_string(), |(mesh, _)| format!("{} faces", mesh.triangles.len()));
        println!("{name}: {} bytes, {seconds:.2?}, {taken} bytes of memory, {outcome}", text.len());
        assert!(seconds < LONG, "{name}: {seconds:?}");
        assert!(taken < 500 * text.len() + (1 << 22), "{name}: {taken} bytes of memory for {}", text.len());
    }
}
