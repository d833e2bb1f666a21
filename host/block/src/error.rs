//! Why a component cannot be loaded: what was found, what was expected, the way out.

/// Why a component cannot be loaded. The message does not repeat the component's name: whoever loads knows it.
#[derive(Debug, thiserror::Error)]
pub enum LoadError {
    /// The file cannot be read.
    #[error("the file cannot be read: {0}; check its path and permissions")]
    Read(#[from] std::io::Error),
}
