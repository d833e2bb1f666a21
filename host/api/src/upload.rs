//! Components on their way in: one at a time for each user, so that what waits for the plant has bounded memory.

use crate::reply::Failure;
use crate::server::{Limits, Shared};
use axum::body::Body;
use http_body_util::BodyExt;
use std::sync::{Mutex, PoisonError};

/// Users that may send components at once.
const AT_ONCE: usize = 2;
/// A whole upload may take so many times what a silent connection may.
const WHOLE: u32 = 10;
/// Bytes of a swap besides the text of its components.
const REST: usize = 64 << 10;

/// Who is sending.
#[derive(Default)]
pub(crate) struct Uploads {
    users: Mutex<Vec<u32>>,
}

/// A turn; given back when dropped.
pub(crate) struct Turn<'a> {
    uploads: &'a Uploads,
    uid: u32,
}

impl Uploads {
    /// A turn for a user.
    pub(crate) fn turn(&self, uid: u32) -> Result<Turn<'_>, Failure> {
        let mut users = self.users.lock().unwrap_or_else(PoisonError::into_inner);
        if users.contains(&uid) {
            return Err(Failure::busy("you are sending a component already; wait until that has arrived"));
        }
        if users.len() >= AT_ONCE {
            return Err(Failure::busy("others are sending components; try again when theirs have arrived"));
        }
        users.push(uid);
        Ok(Turn { uploads: self, uid })
    }
}

impl Drop for Turn<'_> {
    fn drop(&mut self) {
        let mut users = self.uploads.users.lock().unwrap_or_else(PoisonError::into_inner);
        users.retain(|uid| *uid != self.uid);
    }
}

impl Limits {
    /// Bytes of a body with components: they come as base64.
    fn upload(&self) -> usize {
        self.components.div_ceil(3) * 4 + REST
    }

    /// The components of a swap are too large.
    pub(crate) fn too_large(&self) -> Failure {
        Failure::large_components(self.components)
    }
}

/// The bytes of a body with components.
pub(crate) async fn receive(body: Body, declared: Option<u64>, shared: &Shared) -> Result<Vec<u8>, Failure> {
    let limit = shared.limits.upload();
    if declared.is_some_and(|length| length > limit as u64) {
        return Err(shared.limits.too_large());
    }
    let mut bytes = Vec::with_capacity(declared.and_then(|l| usize::try_from(l).ok()).unwrap_or_default());
    each(body, &shared.limits, |part| {
        if bytes.len() + part.len() > limit {
            return Err(shared.limits.too_large());
        }
        bytes.extend_from_slice(part);
        Ok(())
    })
    .await?;
    Ok(bytes)
}

/// Reads a body that nobody needs: a client that is still sending would not see why it is refused.
pub(crate) async fn discard(body: Body, shared: &Shared) {
    let mut left = shared.limits.upload();
    let all = each(body, &shared.limits, |part| {
        left = left.checked_sub(part.len()).ok_or_else(|| shared.limits.too_large())?;
        Ok(())
    });
    // Whatever goes wrong: the refusal is what there is to tell.
    let _ = all.await;
}

async fn each(
    mut body: Body,
    limits: &Limits,
    mut part: impl FnMut(&[u8]) -> Result<(), Failure>,
) -> Result<(), Failure> {
    let whole = async {
        loop {
            match tokio::time::timeout(limits.idle, body.frame()).await {
                Err(_) => return Err(Failure::slow()),
                Ok(None) => return Ok(()),
                Ok(Some(Ok(frame))) => part(frame.data_ref().map_or(&[], |d| d))?,
                Ok(Some(Err(error))) => {
                    return Err(Failure::malformed(format!("the body of the request breaks off: {error}")));
                }
            }
        }
    };
    tokio::time::timeout(limits.idle * WHOLE, whole).await.unwrap_or_else(|_| Err(Failure::slow()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_user_sends_one_component_at_a_time_and_not_all_users_at_once() {
        let uploads = Uploads::default();
        let alice = uploads.turn(1).expect("the first");
        let why = uploads.turn(1).err().expect("busy");
        assert_eq!((why.reason, why.message.contains("already")), ("busy", true), "{}", why.message);
        let bob = uploads.turn(2).expect("another user");
        assert!(uploads.turn(3).is_err_and(|why| why.message.contains("others")));
        drop((alice, bob));
        assert!(uploads.turn(1).is_ok() && uploads.turn(3).is_ok(), "turns are given back");
    }
}
