//! Compiled code on disk, so that a plant starts without compiling.
//!
//! Loading machine code is executing it. So a file is used only if it lies in a folder that nobody but this user can write,
//! is a plain file that nobody else can write, and holds exactly what was written for this component, engine and
//! machine: a key over all of these and a checksum over key and code are verified before the engine sees a byte. Whatever is
//! not right is compiled anew and replaced. Without a usable folder everything works, only slower.

use crate::component::hex;
use rustix::fs::{AtFlags, FileType, Mode, OFlags, fstat, openat, renameat, unlinkat};
use sha2::{Digest, Sha256};
use std::fs::File;
use std::hash::{Hash, Hasher};
use std::io::{Read, Write};
use std::os::fd::OwnedFd;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

/// Beginning of a file; the number counts changes of its layout.
const MAGIC: &[u8; 16] = b"latchwork code 1";
/// Magic, key, checksum.
const HEADER: usize = 16 + 32 + 32;

/// What kind of code a file holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    /// The core module of a component.
    Module,
    /// A component.
    Component,
}

impl Kind {
    fn name(self) -> &'static str {
        match self {
            Self::Module => "module",
            Self::Component => "component",
        }
    }
}

/// The cache of one engine.
pub(crate) struct Cache {
    folder: PathBuf,
    /// Stands for the engine: wasmtime's version, settings, target, features of the processor.
    engine: [u8; 32],
}

impl Cache {
    /// A cache in a folder, for an engine.
    pub(crate) fn new(folder: PathBuf, engine: &wasmtime::Engine) -> Self {
        let mut hasher = ShaHasher(Sha256::new());
        engine.precompile_compatibility_hash().hash(&mut hasher);
        (std::env::consts::ARCH, std::env::consts::OS).hash(&mut hasher);
        Self { folder, engine: hasher.0.finalize().into() }
    }

    /// The code of `wasm` from the cache, or from `compile` and then kept in the cache. `load` makes it what the engine can use; if it
    /// refuses cached code, that is compiled anew, too.
    pub(crate) fn get<T>(
        &self,
        kind: Kind,
        wasm: &[u8],
        load: impl Fn(&[u8]) -> wasmtime::Result<T>,
        compile: impl FnOnce() -> wasmtime::Result<T>,
        serialize: impl FnOnce(&T) -> wasmtime::Result<Vec<u8>>,
    ) -> wasmtime::Result<T> {
        let Some(folder) = self.open() else { return compile() };
        let key = self.key(kind, wasm);
        let name = format!("{}-{}", hex(&key), kind.name());
        if let Some(file) = read(&folder, &name)
            && let Some(code) = verify(&file, &key)
            && let Ok(loaded) = load(code)
        {
            return Ok(loaded);
        }
        let compiled = compile()?;
        if let Ok(code) = serialize(&compiled) {
            // A cache that cannot be written is no reason to stop.
            let _ = write(&folder, &name, &key, &code);
        }
        Ok(compiled)
    }

    fn key(&self, kind: Kind, wasm: &[u8]) -> [u8; 32] {
        let parts = [MAGIC, &self.engine[..], kind.name().as_bytes(), &Sha256::digest(wasm)];
        // Each part but the last has a fixed length or is one of two names, none the beginning of the other.
        parts.into_iter().fold(Sha256::new(), Sha256::chain_update).finalize().into()
    }

    /// The folder, if nobody else can write to it. It is looked at every time: permissions change.
    fn open(&self) -> Option<OwnedFd> {
        make(&self.folder);
        let flags = OFlags::RDONLY | OFlags::DIRECTORY | OFlags::CLOEXEC;
        let folder = rustix::fs::open(&self.folder, flags, Mode::empty()).ok()?;
        is_ours(&folder, FileType::Directory).then_some(folder)
    }
}

/// Makes the folder, for this user alone; its parents as usual.
fn make(folder: &Path) {
    use std::os::unix::fs::DirBuilderExt;
    if folder.exists() {
        return;
    }
    if let Some(parent) = folder.parent() {
        // If it cannot be made, opening fails.
        let _ = std::fs::create_dir_all(parent);
    }
    let _ = std::fs::DirBuilder::new().mode(0o700).create(folder);
}

/// Of this type, owned by this user, and not to be written by anyone else.
fn is_ours(fd: &OwnedFd, kind: FileType) -> bool {
    fstat(fd).is_ok_and(|s| {
        FileType::from_raw_mode(s.st_mode) == kind
            && s.st_uid == rustix::process::geteuid().as_raw()
            && !Mode::from_raw_mode(s.st_mode).intersects(Mode::WGRP | Mode::WOTH)
    })
}

fn read(folder: &OwnedFd, name: &str) -> Option<Vec<u8>> {
    // No link is followed, and no pipe waited for.
    let flags = OFlags::RDONLY | OFlags::NOFOLLOW | OFlags::NONBLOCK | OFlags::CLOEXEC;
    let fd = openat(folder, name, flags, Mode::empty()).ok()?;
    if !is_ours(&fd, FileType::RegularFile) {
        return None;
    }
    let mut content = Vec::new();
    File::from(fd).read_to_end(&mut content).ok()?;
    Some(content)
}

/// The code in a file, if the file is what it should be.
fn verify<'a>(file: &'a [u8], key: &[u8; 32]) -> Option<&'a [u8]> {
    let (header, code) = file.split_at_checked(HEADER)?;
    let good = header[..16] == MAGIC[..] && header[16..48] == key[..] && header[48..] == checksum(key, code)[..];
    good.then_some(code)
}

/// Over the key, too: the checksum and code of one component behind the key of another are not right.
fn checksum(key: &[u8; 32], code: &[u8]) -> [u8; 32] {
    Sha256::new().chain_update(key).chain_update(code).finalize().into()
}

/// Writes a file beside its place and moves it there, so that a reader sees all of it or nothing.
fn write(folder: &OwnedFd, name: &str, key: &[u8; 32], code: &[u8]) -> std::io::Result<()> {
    static COUNT: AtomicU64 = AtomicU64::new(0);
    let unfinished = format!(".{}-{}-{name}", std::process::id(), COUNT.fetch_add(1, Ordering::Relaxed));
    let flags = OFlags::WRONLY | OFlags::CREATE | OFlags::EXCL | OFlags::NOFOLLOW | OFlags::CLOEXEC;
    let result = (|| {
        let mut file = File::from(openat(folder, &unfinished, flags, Mode::RUSR | Mode::WUSR)?);
        file.write_all(MAGIC)?;
        file.write_all(key)?;
        file.write_all(&checksum(key, code))?;
        file.write_all(code)?;
        drop(file);
        Ok(renameat(folder, &unfinished, folder, name)?)
    })();
    if result.is_err() {
        let _ = unlinkat(folder, &unfinished, AtFlags::empty());
    }
    result
}

/// Turns what the engine hashes into a key that cannot collide by accident.
struct ShaHasher(Sha256);

impl Hasher for ShaHasher {
    fn write(&mut self, bytes: &[u8]) {
        self.0.update(bytes);
    }

    /// Not used: the digest is taken whole.
    fn finish(&self) -> u64 {
        0
    }
}
