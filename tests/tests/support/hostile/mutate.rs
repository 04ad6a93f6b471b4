//! Bytes changed at random, a few changes at a time.

use rand::{Rng, RngExt};

/// Numbers that sit at ends of what fits.
const ODD: [u64; 12] =
    [0, 1, 2, 0x7f, 0x80, 0xff, 0x7fff, 0xffff, 0x7fff_ffff, 0xffff_ffff, 1 << 40, u64::MAX];
/// Words that readers of text look for.
const WORDS: [&str; 12] =
    ["-1", "nan", "inf", "1e39", "1e-320", "99999999999999999999", "[", "]]", "\"", "\n", "f ", "."];

/// `bytes` after one to four changes; parts come from `other` too.
pub fn mutated(bytes: &[u8], other: &[u8], rng: &mut impl Rng) -> Vec<u8> {
    let mut out = bytes.to_vec();
    for _ in 0..rng.random_range(1..5) {
        change(&mut out, other, rng);
    }
    out
}

fn change(out: &mut Vec<u8>, other: &[u8], rng: &mut impl Rng) {
    let at = rng.random_range(0..out.len() + 1);
    let end = (at + rng.random_range(1..64)).min(out.len());
    match rng.random_range(0..8) {
        0 if at < out.len() => out[at] ^= 1 << rng.random_range(0..8),
        1 if at < out.len() => out[at] = rng.random(),
        2 => {
            let number = ODD[rng.random_range(0..ODD.len())].to_le_bytes();
            let width = [1, 2, 4, 8][rng.random_range(0..4)].min(out.len() - at);
            out[at..at + width].copy_from_slice(&number[..width]);
        }
        3 => _ = out.splice(at..at, WORDS[rng.random_range(0..WORDS.len())].bytes()),
        4 => _ = out.drain(at..end),
        5 => {
            let part = out[at..end].to_vec();
            let to = rng.random_range(0..out.len() + 1);
            out.splice(to..to, part);
        }
        6 => out.truncate(at),
        _ if !other.is_empty() => {
            let from = rng.random_range(0..other.len());
            let part = &other[from..(from + end - at + 1).min(other.len())];
            out.splice(at..end, part.iter().copied());
        }
        _ => {}
    }
}
