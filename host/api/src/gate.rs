//! The policy, decided for one user and one right.

use crate::peer::{Peer, is_group, is_user};
use latchwork_plant::operate::{Policy, Whom};

/// Decides who may do what.
pub(crate) struct Gate {
    policy: Policy,
    /// Whom the plant runs as.
    own: Peer,
}

impl Gate {
    /// The gate of a plant that this process runs.
    pub(crate) fn new(policy: Policy) -> Self {
        let own = Peer::of(rustix::process::geteuid().as_raw(), rustix::process::getegid().as_raw());
        Self { policy, own }
    }

    /// Others than the plant's own user may connect.
    pub(crate) fn names_others(&self) -> bool {
        self.policy.named().next().is_some()
    }

    /// The user needs no policy: whoever can stop the plant and change its file gains nothing here.
    pub(crate) fn is_own(&self, uid: u32) -> bool {
        uid == 0 || uid == self.own.uid
    }

    /// Why a user may not do what needs a right; `None`: it may.
    pub(crate) fn forbids(&self, peer: &Peer, right: &str) -> Option<String> {
        let is = |whom: &Whom| match whom {
            Whom::Everyone => true,
            Whom::User(name) => peer.user.as_ref() == Some(name),
            Whom::Group(name) => peer.groups.contains(name),
            Whom::Uid(uid) => peer.uid == *uid,
        };
        if self.is_own(peer.uid) || self.policy.given(right).any(is) {
            return None;
        }
        let own = self.own.name();
        let mut given: Vec<_> = self.policy.given(right).map(ToString::to_string).collect();
        given.dedup();
        let who = peer.user.as_ref().map_or_else(|| format!("uid:{}", peer.uid), |name| format!("user:{name}"));
        let has = if given.is_empty() { String::new() } else { format!("{}, ", given.join(", ")) };
        let root = if self.own.uid == 0 { "" } else { " and root" };
        Some(format!(
            "{} has no right to `{right}`; {has}{own}{root} may; `{right} = [\"{who}\"]` in [policy] of the plant file gives it",
            peer.name()
        ))
    }

    /// What the policy names and this machine does not know.
    pub(crate) fn unknown(&self) -> Vec<String> {
        let mut list: Vec<String> = Vec::new();
        for whom in self.policy.named() {
            let known = match whom {
                Whom::User(name) => is_user(name),
                Whom::Group(name) => is_group(name),
                Whom::Everyone | Whom::Uid(_) => true,
            };
            let text = format!("[policy] names {whom}, which this machine does not know: nobody gets a right by it");
            if !known && !list.contains(&text) {
                list.push(text);
            }
        }
        list
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn peer(uid: u32, user: Option<&str>, groups: &[&str]) -> Peer {
        Peer { uid, user: user.map(String::from), groups: groups.iter().map(|g| (*g).into()).collect() }
    }

    fn gate(own: u32, given: &[(&'static str, &str)]) -> Gate {
        let mut policy = Policy::default();
        for (right, whom) in given {
            policy.give(right, whom.parse().expect("it names somebody"));
        }
        Gate { policy, own: peer(own, Some("plant"), &["plant"]) }
    }

    #[test]
    fn without_a_policy_only_the_own_user_and_root_may() {
        let gate = gate(500, &[]);
        assert!(!gate.names_others());
        for (peer, may) in [
            (peer(0, Some("root"), &["root"]), true),
            (peer(500, Some("plant"), &["plant"]), true),
            (peer(501, Some("alice"), &["plant", "root"]), false),
            (peer(502, None, &[]), false),
        ] {
            for right in latchwork_plant::operate::RIGHTS {
                assert_eq!(gate.forbids(&peer, right).is_none(), may, "{peer:?} {right}");
            }
        }
        let why = gate.forbids(&peer(501, Some("alice"), &[]), "force").expect("forbidden");
        assert_eq!(
            why,
            "alice has no right to `force`; plant and root may; `force = [\"user:alice\"]` in [policy] of the plant file gives it"
        );
    }

    #[test]
    fn rights_are_given_by_user_group_number_or_to_everyone() {
        let given = [("view", "everyone"), ("alarm", "group:shift"), ("command", "user:alice"), ("set", "uid:502")];
        let gate = gate(500, &given);
        assert!(gate.names_others());
        let (alice, bob, nameless) =
            (peer(501, Some("alice"), &["alice"]), peer(503, Some("bob"), &["bob", "shift"]), peer(502, None, &[]));
        for (peer, rights) in
            [(&alice, &["view", "command"][..]), (&bob, &["view", "alarm"]), (&nameless, &["view", "set"])]
        {
            for right in latchwork_plant::operate::RIGHTS {
                assert_eq!(gate.forbids(peer, right).is_none(), rights.contains(right), "{peer:?} {right}");
            }
        }
        // A name is no number, and a number no name.
        let sly = peer(504, Some("502"), &["alice", "everyone"]);
        assert!(gate.forbids(&sly, "set").is_some() && gate.forbids(&sly, "command").is_some());
        let why = gate.forbids(&nameless, "alarm").expect("forbidden");
        assert!(why.starts_with("uid:502 has no right to `alarm`; group:shift, plant and root may;"), "{why}");
    }

    #[test]
    fn names_the_machine_does_not_know_are_told_once() {
        let given = [("alarm", "user:no-such-user-here"), ("set", "user:no-such-user-here"), ("set", "user:root")];
        let unknown = gate(500, &given).unknown();
        assert_eq!(unknown.len(), 1, "{unknown:?}");
        assert!(unknown[0].contains("user:no-such-user-here"), "{unknown:?}");
    }
}
