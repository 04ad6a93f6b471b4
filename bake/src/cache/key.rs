//! What a result depends on, in one hash.

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
    pub fn new(stage: &'static str, inputs: &impl Serialize) -> Self {
        let mut hasher = blake3::Hasher::new();
        // Writing to a hasher cannot fail; a value that cannot be encoded leaves the hash of what came before it, and the
        // result of every other such value would be taken for its own: so it is marked by what is wrong with it.
        let encoded = bincode::serde::encode_to_vec((CODE, stage, inputs), bincode::config::legacy());
        match encoded {
            Ok(bytes) => hasher.update(&bytes),
            Err(e) => hasher.update(e.to_string().as_bytes()),
        };
        Self { stage, hash: *hasher.finalize().as_bytes() }
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

    #[test]
    fn every_input_counts() {
        let names = [
            Key::new("a", &(1, 2.0)),
            Key::new("b", &(1, 2.0)),
            Key::new("a", &(1, 2.5)),
            Key::new("a", &(2, 2.0)),
            Key::new("a", &(Key::new("c", &1), 2.0)),
            Key::new("a", &(Key::new("c", &2), 2.0)),
        ]
        .map(|k| k.file_name());
        for (i, name) in names.iter().enumerate() {
            assert!(!names[..i].contains(name), "{name}");
        }
        assert_eq!(Key::new("a b", &1).file_name(), Key::new("a b", &1).file_name());
        assert!(Key::new("a b", &1).file_name().starts_with("a-b-"));
    }
}
