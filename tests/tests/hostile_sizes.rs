//! Time and memory of what can be made hard at will, in files of a megabyte: they grow little faster than the file.

#[path = "support/hostile/sizes.rs"]
mod sizes;

use diaphane_formats::mesh::parse_obj;
use std::time::Instant;

#[test]
fn meshes() {
    for count in [2_000, 4_000, 8_000] {
        for (name, text) in sizes::meshes(count) {
            let started = Instant::now();
            let result = parse_obj(text.as_bytes());
            println!("{count} {name}: {} KB {:.2} s {:?}", text.len() / 1000, started.elapsed().as_secs_f64(), result.map(|r| r.0.triangles.len()).map_err(|e| e.to_string()));
        }
    }
}
