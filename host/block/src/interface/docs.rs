//! Documentation of ports, from a component's custom section. WIT's own doc comments do not survive in a component's
//! types; a section that is absent or damaged only means that there is none.

use std::collections::HashMap;

/// Name of the custom section.
pub(crate) const SECTION: &str = "latchwork-docs";

/// Documentation of one class.
#[derive(Clone, Debug, Default, serde::Deserialize)]
pub(crate) struct ClassDocs {
    /// Of the class.
    #[serde(default)]
    pub(crate) class: Option<String>,
    /// By `GROUP.PATH`: `inputs.in`, `commands.reset`.
    #[serde(default)]
    pub(crate) ports: HashMap<String, String>,
}

/// Reads the section: classes by full name.
pub(crate) fn read(section: &[u8]) -> HashMap<String, ClassDocs> {
    serde_json::from_slice(section).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_damaged_counts_as_absent() {
        let docs = read(br#"{"a:b/c@0.1.0": {"class": "C.", "ports": {"inputs.in": "I."}}, "a:b/d": {}}"#);
        assert_eq!(docs["a:b/c@0.1.0"].class.as_deref(), Some("C."));
        assert_eq!(docs["a:b/c@0.1.0"].ports["inputs.in"], "I.");
        assert!(docs["a:b/d"].class.is_none());
        for damaged in [&b""[..], b"{", b"[]", b"\xff", br#"{"a": 1}"#] {
            assert!(read(damaged).is_empty());
        }
    }
}
