//! Files that mean harm: no reader panics, hangs, takes more memory than the file's size allows, or says what a terminal
//! should not show. Replays the fuzzer's seeds and what it once broke, and goes on from there a little.

#[path = "support/hostile/mod.rs"]
mod support;

use peak_alloc::PeakAlloc;
use rand::SeedableRng;
use rand_pcg::Pcg64Mcg;
use std::time::{Duration, Instant};
use support::{files, folder, mutate::mutated, seeds};
use validation::hostile::{READERS, Reader, check};

#[global_allocator]
static MEMORY: PeakAlloc = PeakAlloc;

/// Changed files for each reader.
const CHANGES: usize = 3000;
/// Time that a file of a few kilobytes may take; most take less than a millisecond.
const LONG: Duration = Duration::from_secs(2);

fn feed(reader: &Reader, bytes: &[u8]) -> bool {
    let started = Instant::now();
    let accepted = check(reader, bytes, || {
        let peak = MEMORY.peak_usage();
        MEMORY.reset_peak_usage();
        [MEMORY.current_usage(), peak]
    });
    assert!(started.elapsed() < LONG, "{} took {:?}", reader.name, started.elapsed());
    accepted
}

/// One test, so that nothing else allocates meanwhile.
#[test]
fn readers_survive_whatever_they_are_fed() {
    check_seeds();
    let mut rng = Pcg64Mcg::seed_from_u64(17);
    for reader in &READERS {
        let seeds = files("corpus", reader.name);
        assert!(seeds.iter().any(|(name, _)| name.starts_with("good")), "{} has no good seed", reader.name);
        for (name, bytes) in &seeds {
            let accepted = feed(reader, bytes);
            assert_eq!(accepted, name.starts_with("good"), "{}: {name}", reader.name);
        }
        let mut kept = files("regressions", reader.name);
        for (name, bytes) in &kept {
            let accepted = feed(reader, bytes);
            assert_eq!(accepted, name.starts_with("good"), "{}: {name}", reader.name);
        }
        kept.extend(seeds);
        for i in 0..CHANGES {
            let bytes = mutated(&kept[i % kept.len()].1, &kept[(i * 7 + i / 5) % kept.len()].1, &mut rng);
            feed(reader, &bytes);
        }
    }
}

/// With `DIAPHANE_WRITE_SEEDS=1` they are written anew, after a change of a format.
fn check_seeds() {
    let write = std::env::var_os("DIAPHANE_WRITE_SEEDS").is_some_and(|v| v == "1");
    for (reader, name, bytes) in seeds::all() {
        let path = folder("corpus", reader).join(&name);
        if write {
            std::fs::create_dir_all(folder("corpus", reader)).unwrap();
            std::fs::write(&path, &bytes).unwrap();
        }
        let kept = std::fs::read(&path).unwrap_or_default();
        assert!(
            kept == bytes,
            "{reader}: {name} is of another format; DIAPHANE_WRITE_SEEDS=1 writes it anew"
        );
    }
}
