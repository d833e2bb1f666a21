//! The socket as a file: its mode, who has it, what is left of a plant that was killed.

use crate::ApiError;
use rustix::fs::{Mode, OFlags, fchmod};
use rustix::net::{AddressFamily, SocketAddrUnix, SocketFlags, SocketType, bind, listen, socket_with};
use std::fs::{DirBuilder, File, OpenOptions, Permissions, TryLockError};
use std::os::unix::fs::{DirBuilderExt, FileTypeExt, OpenOptionsExt, PermissionsExt};
use std::os::unix::net::UnixListener;
use std::path::{Path, PathBuf};

/// Connections that may wait to be accepted.
const BACKLOG: i32 = 64;

/// A listening socket. Dropped, its file goes away.
pub(crate) struct Socket {
    path: PathBuf,
    /// Held as long as the socket is served: who has it owns the path. It stays when the plant has ended, because a file that
    /// is removed while another plant opens it would be locked twice.
    _lock: File,
}

impl Socket {
    /// Opens it, for the plant's own user alone or for everybody to connect to.
    pub(crate) fn open(path: &Path, everybody: bool) -> Result<(Self, UnixListener), ApiError> {
        let failed = |error: std::io::Error| ApiError::Open { path: path.into(), error };
        let address = SocketAddrUnix::new(path).map_err(|_| ApiError::TooLong { path: path.into() })?;
        folder(path, everybody).map_err(failed)?;
        let lock = lock_file(&lock_path(path)).map_err(failed)?;
        match lock.try_lock() {
            Ok(()) => {}
            Err(TryLockError::WouldBlock) => return Err(ApiError::Taken { path: path.into() }),
            Err(TryLockError::Error(error)) => return Err(failed(error)),
        }
        // Whoever had it before has ended: the lock says so.
        match std::fs::symlink_metadata(path) {
            Ok(there) if there.file_type().is_socket() => std::fs::remove_file(path).map_err(failed)?,
            Ok(_) => return Err(ApiError::NoSocket { path: path.into() }),
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => {}
            Err(error) => return Err(failed(error)),
        }
        let flags = SocketFlags::CLOEXEC | SocketFlags::NONBLOCK;
        let made = socket_with(AddressFamily::UNIX, SocketType::STREAM, flags, None).map_err(|e| failed(e.into()))?;
        // The file takes the mode that the socket has: there is no moment in which it is wider, whatever the umask.
        fchmod(&made, Mode::RUSR | Mode::WUSR).map_err(|e| failed(e.into()))?;
        bind(&made, &address).map_err(|e| failed(e.into()))?;
        let socket = Self { path: path.into(), _lock: lock };
        if everybody {
            std::fs::set_permissions(path, Permissions::from_mode(0o666)).map_err(failed)?;
        }
        listen(&made, BACKLOG).map_err(|e| failed(e.into()))?;
        Ok((socket, UnixListener::from(made)))
    }
}

impl Drop for Socket {
    fn drop(&mut self) {
        // Somebody may have removed it already.
        let _ = std::fs::remove_file(&self.path);
    }
}

fn lock_path(path: &Path) -> PathBuf {
    let mut name = path.file_name().unwrap_or_default().to_owned();
    name.push(".lock");
    path.with_file_name(name)
}

/// Opened as it is: in a folder that others write, the name might be a link to a file of ours.
fn lock_file(path: &Path) -> std::io::Result<File> {
    let mut options = OpenOptions::new();
    options.write(true).create(true).truncate(false).mode(0o600);
    options.custom_flags(OFlags::NOFOLLOW.bits().cast_signed()).open(path)
}

/// Makes the socket's folder if there is none; others get into it only if they are to connect.
fn folder(path: &Path, everybody: bool) -> std::io::Result<()> {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() && !folder.exists() => {
            let mode = if everybody { 0o755 } else { 0o700 };
            DirBuilder::new().recursive(true).mode(mode).create(folder)
        }
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::os::unix::net::UnixStream;

    fn mode(path: &Path) -> u32 {
        std::fs::metadata(path).expect("it is there").permissions().mode() & 0o777
    }

    #[test]
    fn the_mode_is_narrow_unless_the_policy_names_others() {
        let folder = tempfile::tempdir().expect("a folder");
        for (everybody, of_socket, of_folder) in [(false, 0o600, 0o700), (true, 0o666, 0o755)] {
            let path = folder.path().join(format!("{everybody}/deep/plant.sock"));
            let (socket, _listener) = Socket::open(&path, everybody).expect("it opens");
            assert_eq!((mode(&path), mode(path.parent().expect("a folder"))), (of_socket, of_folder));
            drop(socket);
            assert!(!path.exists(), "it is removed");
        }
    }

    #[test]
    fn what_a_killed_plant_left_is_replaced_and_a_living_one_is_not() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("plant.sock");
        // A socket nobody serves any more.
        drop(UnixListener::bind(&path).expect("a socket"));
        assert!(path.exists());
        let (socket, listener) = Socket::open(&path, false).expect("the stale one is replaced");
        UnixStream::connect(&path).expect("it listens");
        let Err(ApiError::Taken { .. }) = Socket::open(&path, false) else { panic!("a living socket was taken over") };
        UnixStream::connect(&path).expect("it listens still");
        drop((socket, listener));
        Socket::open(&path, false).expect("it is free again");
    }

    #[test]
    fn other_files_are_left_alone_and_impossible_paths_are_told() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("notes.txt");
        std::fs::write(&path, "mine").expect("a file");
        let Err(error) = Socket::open(&path, false) else { panic!("a file was replaced") };
        assert!(error.to_string().contains("is there and is no socket"), "{error}");
        assert_eq!(std::fs::read_to_string(&path).expect("the file"), "mine");
        // A link in the place of the lock leads nowhere.
        std::os::unix::fs::symlink(&path, folder.path().join("trap.sock.lock")).expect("a link");
        let Err(error) = Socket::open(&folder.path().join("trap.sock"), false) else { panic!("a link was followed") };
        assert!(matches!(error, ApiError::Open { .. }), "{error}");
        let Err(error) = Socket::open(&folder.path().join("x".repeat(120)), false) else { panic!("too long") };
        assert!(error.to_string().contains("107 bytes"), "{error}");
        let Err(error) = Socket::open(&path.join("below-a-file.sock"), false) else { panic!("below a file") };
        assert!(matches!(error, ApiError::Open { .. }), "{error}");
    }
}
