//! Who is at the other end: the kernel says the number, the machine's own lists say name and groups.

use nix::unistd::{Gid, Group, Uid, User, getgrouplist};
use std::ffi::CString;

/// The user at the other end of a connection. Nothing of it comes from what the client says.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Peer {
    /// Number.
    pub(crate) uid: u32,
    /// Name, if the machine knows one.
    pub(crate) user: Option<String>,
    /// Names of the groups: that the process runs with, and those that the machine lists for the user.
    pub(crate) groups: Vec<String>,
}

impl Peer {
    /// Looks a user up. It may read files or ask a directory service: not for an asynchronous task.
    pub(crate) fn of(uid: u32, gid: u32) -> Self {
        let user = User::from_uid(Uid::from_raw(uid)).ok().flatten();
        let listed = user.as_ref().and_then(|u| getgrouplist(&CString::new(u.name.as_str()).ok()?, u.gid).ok());
        let mut gids = listed.unwrap_or_default();
        gids.push(Gid::from_raw(gid));
        let mut groups: Vec<_> =
            gids.into_iter().filter_map(|gid| Group::from_gid(gid).ok().flatten()).map(|g| g.name).collect();
        groups.sort_unstable();
        groups.dedup();
        Self { uid, user: user.map(|u| u.name), groups }
    }

    /// As records have it.
    pub(crate) fn name(&self) -> String {
        self.user.clone().unwrap_or_else(|| format!("uid:{}", self.uid))
    }
}

/// The machine knows a user of this name.
pub(crate) fn is_user(name: &str) -> bool {
    User::from_name(name).ok().flatten().is_some()
}

/// The machine knows a group of this name.
pub(crate) fn is_group(name: &str) -> bool {
    Group::from_name(name).ok().flatten().is_some()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_come_from_the_machine() {
        let root = Peer::of(0, 0);
        assert_eq!((root.name().as_str(), root.groups.contains(&"root".to_owned())), ("root", true), "{root:?}");
        let nobody = Peer::of(3_999_999_999, 3_999_999_998);
        assert_eq!((nobody.name().as_str(), nobody.groups.len()), ("uid:3999999999", 0), "{nobody:?}");
    }
}
