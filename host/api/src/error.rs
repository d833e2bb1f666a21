//! Why there is no control socket.

use std::path::PathBuf;

/// Why a control socket cannot be opened.
#[derive(Debug, thiserror::Error)]
pub enum ApiError {
    /// Another plant has it.
    #[error("{path} is the control socket of a plant that runs; stop it, or give this one another path with --socket")]
    Taken {
        /// Socket.
        path: PathBuf,
    },
    /// Something else stands there.
    #[error("{path} is there and is no socket; give another path with --socket, or remove it")]
    NoSocket {
        /// Path.
        path: PathBuf,
    },
    /// The path does not fit.
    #[error("{path} is too long for a socket: the kernel takes 107 bytes; give a shorter path with --socket")]
    TooLong {
        /// Path.
        path: PathBuf,
    },
    /// The folder or the socket.
    #[error("the control socket {path} cannot be opened: {error}")]
    Open {
        /// Socket.
        path: PathBuf,
        /// Why.
        error: std::io::Error,
    },
    /// No thread, no runtime.
    #[error("the control socket could not be served: {0}")]
    Start(std::io::Error),
}
