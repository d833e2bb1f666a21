//! Who may do what: `[policy]` of the plant file.

use std::fmt;
use std::str::FromStr;

/// Whom a right is given to.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Whom {
    /// Every user of the machine.
    Everyone,
    /// A user by name.
    User(String),
    /// All members of a group.
    Group(String),
    /// A user by number, for one that has no name.
    Uid(u32),
}

/// The rights that the plant file gives. Whom the plant runs as, and root, may do everything without it: they can stop the
/// process and change its file.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Policy {
    given: Vec<(&'static str, Whom)>,
}

impl Policy {
    /// Gives a right of [`RIGHTS`](super::RIGHTS).
    pub fn give(&mut self, right: &'static str, whom: Whom) {
        self.given.push((right, whom));
    }

    /// To whom a right is given. Who has any right may view: nobody can acknowledge what he cannot see.
    pub fn given<'a>(&'a self, right: &'a str) -> impl Iterator<Item = &'a Whom> {
        self.given.iter().filter(move |(r, _)| *r == right || right == "view").map(|(_, whom)| whom)
    }

    /// Everybody who is named, once for each right.
    pub fn named(&self) -> impl Iterator<Item = &Whom> {
        self.given.iter().map(|(_, whom)| whom)
    }
}

impl fmt::Display for Whom {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Everyone => f.write_str("everyone"),
            Self::User(name) => write!(f, "user:{name}"),
            Self::Group(name) => write!(f, "group:{name}"),
            Self::Uid(uid) => write!(f, "uid:{uid}"),
        }
    }
}

/// A text that names nobody.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("\"{found}\" names nobody; expected \"user:NAME\", \"group:NAME\", \"uid:NUMBER\" or \"everyone\"")]
pub struct WhomError {
    /// What was found.
    pub found: String,
}

impl FromStr for Whom {
    type Err = WhomError;

    fn from_str(text: &str) -> Result<Self, WhomError> {
        let error = || WhomError { found: text.into() };
        let name = |name: &str| {
            let sound = !name.is_empty() && !name.contains([':', ' ', ',']) && !name.chars().any(char::is_control);
            if sound { Ok(name.to_owned()) } else { Err(error()) }
        };
        match text.split_once(':') {
            None if text == "everyone" => Ok(Self::Everyone),
            Some(("user", rest)) => name(rest).map(Self::User),
            Some(("group", rest)) => name(rest).map(Self::Group),
            Some(("uid", rest)) => rest.parse().map(Self::Uid).map_err(|_| error()),
            _ => Err(error()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_reads_back_and_the_rest_is_refused() {
        for text in ["everyone", "user:alice", "group:night-shift", "uid:1000"] {
            assert_eq!(text.parse::<Whom>().map(|w| w.to_string()), Ok(text.into()));
        }
        for text in ["", "alice", "user:", "group:a:b", "user:a b", "uid:-1", "uid:x", "everybody", "all", "user:a\n"] {
            assert!(text.parse::<Whom>().is_err(), "{text:?}");
        }
    }

    #[test]
    fn any_right_lets_one_view_and_no_right_gives_another() {
        let mut policy = Policy::default();
        policy.give("alarm", Whom::Uid(7));
        assert_eq!(policy.given("alarm").collect::<Vec<_>>(), [&Whom::Uid(7)]);
        assert_eq!(policy.given("view").collect::<Vec<_>>(), [&Whom::Uid(7)]);
        for right in super::super::RIGHTS.iter().filter(|r| !["view", "alarm"].contains(r)) {
            assert_eq!(policy.given(right).count(), 0, "{right}");
        }
    }
}
