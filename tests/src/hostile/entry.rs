//! Entries of a bake's cache.

use super::{Use, words};
use diaphane_bake::entries;
use diaphane_bake::params::{Params, Preset};

/// What the bake that reads them was asked for.
pub fn params() -> Params {
    Params { samples: 12, directions: 8, order: 3, ..Params::preset(Preset::Draft) }
}

/// One byte for the stage, one for the number of samples, and the entry without magic and checksum, which it gets; where the
/// first byte is not below 128 it stays as it is.
pub(super) fn entry(bytes: &[u8]) -> Result<Use, String> {
    let Some(([stage, samples], payload)) = bytes.split_first_chunk() else {
        return Err("too short".to_owned());
    };
    let file = match stage {
        128.. => payload.to_vec(),
        _ => [b"diaphane cache 1", &blake3::hash(payload).as_bytes()[..], payload].concat(),
    };
    let stage = entries::STAGES[usize::from(*stage) % entries::STAGES.len()];
    entries::check(stage, &file, usize::from(*samples), &params()).map_err(words)?;
    Ok(Box::new(|| ()))
}
