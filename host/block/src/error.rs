//! Why a component cannot be loaded: what was found, what was expected, the way out.

/// Why a component cannot be loaded. The message does not repeat the component's name: whoever loads knows it.
#[derive(Debug, thiserror::Error)]
pub enum LoadError {
    /// The file cannot be read.
    #[error("the file cannot be read: {0}; check its path and permissions")]
    Read(#[from] std::io::Error),

    /// The bytes are something else than a component.
    #[error("{found}; expected a WebAssembly component: {way_out}")]
    NotAComponent {
        /// What the bytes are.
        found: String,
        /// What to do.
        way_out: String,
    },

    /// A component that is cut off or whose content breaks the rules.
    #[error("the component is damaged: {reason} (at byte {offset} of {size}); build or copy it again")]
    Damaged {
        /// What the check found.
        reason: String,
        /// Where.
        offset: usize,
        /// Size of the component.
        size: usize,
    },

    /// Imports that a block may not have.
    #[error("import not allowed: {}; a block may import only \"latchwork:block/log\". {way_out}", quoted(.imports))]
    Import {
        /// The forbidden imports.
        imports: Vec<String>,
        /// What to do.
        way_out: String,
    },

    /// A component of another world.
    #[error(
        "no device class found: the component exports {}; expected an exported interface with a function \"execute\", such as \
         \"latchwork:device/ton\": build it for a world that exports one", list(.exports)
    )]
    NoClass {
        /// Its exports.
        exports: Vec<String>,
    },

    /// An exported interface has `execute` but does not follow the pattern of a device class.
    #[error("\"{class}\" is not a device class: {}", .problems.join("; "))]
    Class {
        /// The interface.
        class: String,
        /// What is wrong, each with what was expected.
        problems: Vec<String>,
    },

    /// The class that was asked for is not exported.
    #[error(
        "the component has no class \"{wanted}\"{}; it exports {}",
        .nearest.as_ref().map(|n| format!(" (did you mean \"{n}\"?)")).unwrap_or_default(), list(.classes)
    )]
    UnknownClass {
        /// What was asked for.
        wanted: String,
        /// The class whose name is nearest.
        nearest: Option<String>,
        /// The classes there are.
        classes: Vec<String>,
    },

    /// No class was chosen and there are several.
    #[error("the component exports several classes, {}; choose one with `class = \"…\"`", list(.classes))]
    SeveralClasses {
        /// The classes there are.
        classes: Vec<String>,
    },

    /// The engine cannot compile or link it.
    #[error(
        "the component cannot be compiled: {reason}; build it with current tools and without experimental features"
    )]
    Compile {
        /// What the engine says.
        reason: String,
    },

    /// The plain path was forced on a component that cannot take it.
    #[error("the plain call path was demanded, but {reason}; allow the component path")]
    NotPlain {
        /// Why not.
        reason: String,
    },
}

fn quoted(names: &[String]) -> String {
    names.iter().map(|n| format!("\"{n}\"")).collect::<Vec<_>>().join(", ")
}

fn list(names: &[String]) -> String {
    if names.is_empty() { "nothing".into() } else { quoted(names) }
}
