//! Metadata to bytes and back: the only place of this crate that knows bincode, which nobody maintains any more, so that it can be
//! replaced.

use super::Info;
use crate::{Error, Result};

/// Metadata never needs more than this; larger claims are refused before anything is allocated.
const LIMIT: usize = 1 << 20;

pub(super) fn encode(info: &Info) -> Result<Vec<u8>> {
    bincode::serde::encode_to_vec(info, bincode::config::standard().with_limit::<LIMIT>())
        .map_err(|e| Error::invalid(format!("cannot encode the asset's metadata: {e}")))
}

pub(super) fn decode(bytes: &[u8]) -> Result<Info> {
    let config = bincode::config::standard().with_limit::<LIMIT>();
    let (info, used) = bincode::serde::decode_from_slice(bytes, config)
        .map_err(|e| Error::invalid(format!("the asset's metadata cannot be read: {e}")))?;
    if used == bytes.len() {
        Ok(info)
    } else {
        Err(Error::invalid("the asset's metadata has bytes left over"))
    }
}
