//! Runs a program up to one of its system calls and kills it there.
//!
//! Random kills seldom hit the few microseconds between two system calls; this hits each of them. Only what is done to the
//! files of one folder counts. In the middle of a writing a limit of the file's length ends it, as a power cut would.

use rustix::process::{Pid, Resource, Rlimit, prlimit};
use std::fs::File;
use std::io::{Error, Result};
use std::os::unix::fs::FileExt;
use std::path::Path;
use std::process::Command;

/// Where a program is killed; calls are counted from 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Cut {
    /// Before this call.
    Before(usize),
    /// In the middle of this one, which writes; before it, if it writes nothing.
    Within(usize),
}

/// A system call that changes a file, or brings it to the disk.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Call {
    /// Such as `write own/a.wasm`.
    pub(crate) text: String,
    /// Length of the file in the middle of what it writes, bytes.
    middle: Option<u64>,
}

/// What has become of a run.
pub(crate) struct Done {
    /// Every call, also the one it was cut at.
    pub(crate) calls: Vec<Call>,
    /// It was killed at the cut; otherwise it has ended before.
    pub(crate) cut: bool,
}

/// What a program says that may not be traced here.
const NOT_TRACED: i32 = 77;
/// Most seconds of a run.
const LIMIT: u32 = 60;

/// The program's side: what its thread does from here on is seen, and what threads do that it makes.
pub(crate) fn trace_me() {
    // SAFETY: none of them has anything to do with memory.
    let traced = unsafe {
        libc::alarm(LIMIT);
        libc::ptrace(libc::PTRACE_TRACEME, 0, 0, 0)
    };
    if traced != 0 {
        std::process::exit(NOT_TRACED);
    }
    // SAFETY: as above.
    unsafe { libc::raise(libc::SIGSTOP) };
}

/// Runs a program that calls [`trace_me`]; `None` where programs may not be traced.
pub(crate) fn run(command: &mut Command, folder: &Path, cut: Option<Cut>) -> Result<Option<Done>> {
    let child = command.spawn()?;
    let pid = i32::try_from(child.id()).expect("a process");
    let (mut done, mut traced, mut code) = (Done { calls: Vec::new(), cut: false }, false, None);
    loop {
        let mut status = 0;
        // SAFETY: the status is ours. Only children of this thread: other tests have their own.
        let thread = unsafe { libc::waitpid(-1, &raw mut status, libc::__WALL | libc::__WNOTHREAD) };
        if thread < 0 {
            // Nobody is left.
            break;
        }
        if !libc::WIFSTOPPED(status) {
            if thread == pid {
                code = libc::WIFEXITED(status).then(|| libc::WEXITSTATUS(status));
            }
            continue;
        }
        let mut deliver = 0;
        match libc::WSTOPSIG(status) {
            _ if !traced => {
                traced = true;
                let options = libc::PTRACE_O_TRACESYSGOOD | libc::PTRACE_O_TRACECLONE | libc::PTRACE_O_EXITKILL;
                // SAFETY: it stands still, and no memory is handed over.
                unsafe { libc::ptrace(libc::PTRACE_SETOPTIONS, thread, 0, options) };
            }
            signal if signal == libc::SIGTRAP | 0x80 && !done.cut => {
                if let Some(call) = entered(pid, thread, folder)? {
                    let (at, middle) = (done.calls.len(), call.middle);
                    done.calls.push(call);
                    done.cut = cut == Some(Cut::Before(at)) || cut == Some(Cut::Within(at)) && middle.is_none();
                    if cut == Some(Cut::Within(at)) {
                        middle.map_or(Ok(()), |middle| limit(pid, middle))?;
                    }
                }
            }
            libc::SIGXFSZ => done.cut = true,
            libc::SIGTRAP | libc::SIGSTOP => {}
            signal if signal & 0x80 == 0 => deliver = signal,
            _ => {}
        }
        let kill = if done.cut { libc::SIGKILL } else { 0 };
        // SAFETY: no memory is handed over. One that is gone meanwhile is no error.
        unsafe {
            if kill != 0 {
                libc::kill(pid, kill);
            }
            libc::ptrace(libc::PTRACE_SYSCALL, thread, 0, deliver);
        }
    }
    match code {
        Some(NOT_TRACED) => Ok(None),
        Some(0) => Ok(Some(done)),
        None if done.cut => Ok(Some(done)),
        other => Err(Error::other(format!("it ends with {other:?} after {:?}", done.calls))),
    }
}

/// No file gets longer than so many bytes: what is beyond is not written, and the next try ends the program.
fn limit(pid: i32, bytes: u64) -> Result<()> {
    let limit = Rlimit { current: Some(bytes), maximum: None };
    prlimit(Pid::from_raw(pid), Resource::Fsize, limit)?;
    Ok(())
}

/// The call that a thread has entered, if it does something to a file of the folder.
fn entered(pid: i32, thread: i32, folder: &Path) -> Result<Option<Call>> {
    // SAFETY: all zeros are a value of it.
    let mut info: libc::ptrace_syscall_info = unsafe { std::mem::zeroed() };
    let size = size_of_val(&info);
    // SAFETY: the thread stands still, and no more than `size` bytes are written.
    let got = unsafe { libc::ptrace(libc::PTRACE_GET_SYSCALL_INFO, thread, size, &raw mut info) };
    if got < 0 {
        return Err(Error::last_os_error());
    }
    if info.op != libc::PTRACE_SYSCALL_INFO_ENTRY {
        return Ok(None);
    }
    // SAFETY: that is what `op` says.
    let entry = unsafe { info.u.entry };
    let (args, number) = (entry.args, i64::try_from(entry.nr).unwrap_or(-1));
    let path = |at: usize| text(pid, args[at]);
    let file = || std::fs::read_link(format!("/proc/{pid}/fd/{}", args[0])).ok();
    let known = if number == libc::SYS_openat {
        let changes = args[2] & (libc::O_CREAT | libc::O_TRUNC) as u64 != 0;
        changes.then(|| ("open", path(1)))
    } else if number == libc::SYS_write || number == libc::SYS_pwrite64 {
        file().map(|file| ("write", file.display().to_string()))
    } else if number == libc::SYS_fsync || number == libc::SYS_fdatasync {
        file().map(|file| ("sync", file.display().to_string()))
    } else if number == libc::SYS_ftruncate {
        file().map(|file| ("cut", file.display().to_string()))
    } else {
        named(number).map(|(what, at)| (what, path(at)))
    };
    let Some((what, path)) = known else { return Ok(None) };
    let Ok(inside) = Path::new(&path).strip_prefix(folder) else { return Ok(None) };
    let offset = || match number {
        libc::SYS_pwrite64 => args[3],
        _ => position(pid, args[0]),
    };
    let middle = (what == "write").then(|| offset() + args[2] / 2);
    Ok(Some(Call { text: format!("{what} {}", inside.display()).trim_end().to_owned(), middle }))
}

/// Calls with a path, and where among their arguments it stands: of a name that is given, the new one.
fn named(number: i64) -> Option<(&'static str, usize)> {
    #[cfg(target_arch = "x86_64")]
    match number {
        libc::SYS_rename => return Some(("rename", 1)),
        libc::SYS_unlink => return Some(("remove", 0)),
        libc::SYS_mkdir => return Some(("make", 0)),
        _ => {}
    }
    match number {
        libc::SYS_renameat | libc::SYS_renameat2 => Some(("rename", 3)),
        libc::SYS_unlinkat => Some(("remove", 1)),
        libc::SYS_mkdirat => Some(("make", 1)),
        _ => None,
    }
}

/// A text in the memory of another process; empty where there is none.
fn text(pid: i32, at: u64) -> String {
    let mut bytes = [0; 4096];
    let read = File::open(format!("/proc/{pid}/mem")).and_then(|memory| memory.read_at(&mut bytes, at)).unwrap_or(0);
    let end = bytes[..read].iter().position(|b| *b == 0).unwrap_or(0);
    String::from_utf8_lossy(&bytes[..end]).into_owned()
}

/// Where a file of another process is written next.
fn position(pid: i32, file: u64) -> u64 {
    let text = std::fs::read_to_string(format!("/proc/{pid}/fdinfo/{file}")).unwrap_or_default();
    text.lines().find_map(|line| line.strip_prefix("pos:")?.trim().parse().ok()).unwrap_or(0)
}
