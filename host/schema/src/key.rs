//! What a key may hold.

/// One key of a section.
#[derive(Debug)]
pub struct Key {
    /// Name in the file.
    pub name: &'static str,
    /// What it holds.
    pub kind: Kind,
    /// The file is wrong without it.
    pub required: bool,
    /// Value when it is absent, as written in TOML; empty when there is none.
    pub default: &'static str,
    /// One or two sentences: meaning, unit, range.
    pub doc: &'static str,
}

/// What a key holds.
#[derive(Debug)]
pub enum Kind {
    /// Any string.
    Text,
    /// `true` or `false`.
    Bool,
    /// A whole number within a range.
    Integer {
        /// Smallest value.
        min: i64,
        /// Largest value.
        max: i64,
    },
    /// A duration such as `"200ms"`, in ns within a range.
    Duration {
        /// Shortest, ns.
        min: u64,
        /// Longest, ns.
        max: u64,
    },
    /// A size such as `"4MiB"` or `"64KiB"`, in bytes within a range.
    Size {
        /// Smallest, bytes.
        min: u64,
        /// Largest, bytes.
        max: u64,
    },
    /// One of some words.
    OneOf(&'static [&'static str]),
    /// The name of a tag.
    Tag,
    /// A constant whose type only its user knows: a boolean, a number or a string.
    Constant,
    /// A list.
    List(&'static Kind),
    /// A table with keys of its own.
    Table(&'static Section),
    /// A table from names the user chooses to values of one kind.
    Map(&'static Kind),
    /// Either of two kinds, tried in order.
    Either(&'static Kind, &'static Kind),
    /// Anything: whoever owns the section checks it (points of a driver, whose keys the driver's kind decides).
    Any,
}

/// A table with known keys.
#[derive(Debug)]
pub struct Section {
    /// Name for messages and the reference: `lane`, `driver (modbus-tcp)`.
    pub name: &'static str,
    /// What it is for, one or two sentences.
    pub doc: &'static str,
    /// Its keys, in the order the reference shows them.
    pub keys: &'static [Key],
}

impl Key {
    /// A key that may be absent.
    pub const fn optional(name: &'static str, kind: Kind, default: &'static str, doc: &'static str) -> Self {
        Self { name, kind, required: false, default, doc }
    }

    /// A key that must be there.
    pub const fn required(name: &'static str, kind: Kind, doc: &'static str) -> Self {
        Self { name, kind, required: true, default: "", doc }
    }
}
