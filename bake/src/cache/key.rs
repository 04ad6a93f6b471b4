//! What a result depends on, in one hash.

use crate::{Error, Result};
use serde::Serialize;

/// Hash of the sources of this program: another version makes other results. The build script sets it.
const CODE: &str = env!("DIAPHANE_CODE");

/// Names a result.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct Key {
    stage: &'static str,
    hash: [u8; 32],
}

impl Key {
    /// For a stage whose result depends on `inputs`, among them the keys of results that it uses, and nothing else.
    ///
    /// # Errors
    /// Inputs that cannot be encoded.
    pub fn new(stage: &'static str, inputs: &impl Serialize) -> Result<Self> {
        let bytes = bincode::serde::encode_to_vec((CODE, stage, inputs), bincode::config::legacy())
            .map_err(|e| Error::Parameter(format!("the inputs of '{stage}' cannot be encoded: {e}")))?;
        Ok(Self { stage, hash: *blake3::hash(&bytes).as_bytes() })
    }

    /// Whose result it is.
    pub fn stage(&self) -> &'static str {
        self.stage
    }

    /// Such as `optical-depth-1f9c…`.
    pub fn file_name(&self) -> String {
        let hash: String = self.hash[..16].iter().map(|b| format!("{b:02x}")).collect();
        format!("{}-{hash}", self.stage.replace(' ', "-"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn key(stage: &'static str, inputs: &impl Serialize) -> Key {
        Key::new(stage, inputs).unwrap()
    }

    #[test]
    fn every_input_counts() {
        let names = [
            key("a", &(1, 2.0)),
            key("b", &(1, 2.0)),
            key("a", &(1, 2.5)),
            key("a", &(2, 2.0)),
            key("a", &(key("c", &1), 2.0)),
            key("a", &(key("c", &2), 2.0)),
        ]
        .map(|k| k.file_name());
        for (i, name) in names.iter().enumerate() {
            assert!(!names[..i].contains(name), "{name}");
        }
        assert_eq!(key("a b", &1).file_name(), key("a b", &1).file_name());
        assert!(key("a b", &1).file_name().starts_with("a-b-"));
    }
}
