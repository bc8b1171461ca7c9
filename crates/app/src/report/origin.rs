//! When a run was made, and from what.

/// When a run was made, and from what: enough to tell whether two results come from the same input.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Origin {
    /// Date and time in UTC, as in `2026-11-27T08:15:30Z` (RFC 3339); empty if nobody looked at the clock.
    pub made: String,
    /// Every file that the result depends on.
    pub inputs: Vec<InputFile>,
}

/// A file that a result depends on.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct InputFile {
    /// What it is: `scene`, `mesh`, `tool`.
    pub kind: &'static str,
    /// Its name, without folders.
    pub name: String,
    /// BLAKE3 of its bytes.
    pub hash: [u8; 32],
}

impl Origin {
    /// One hash over the kinds and bytes of all inputs, not over their names: 64 hexadecimal digits. Empty without inputs.
    pub fn hash(&self) -> String {
        if self.inputs.is_empty() {
            return String::new();
        }
        let mut hash = blake3::Hasher::new();
        for input in &self.inputs {
            hash.update(input.kind.as_bytes());
            hash.update(&input.hash);
        }
        hash.finalize().to_hex().to_string()
    }
}

impl InputFile {
    /// The hash as `b3sum` prints it.
    pub fn hex(&self) -> String {
        blake3::Hash::from_bytes(self.hash).to_hex().to_string()
    }
}
