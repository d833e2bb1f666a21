//! Connections: how many, whose, and how long they may do nothing.

use crate::peer::Peer;
use crate::reply::Failure;
use crate::server::{Limits, Shared};
use axum::Extension;
use axum::Router;
use hyper::server::conn::http1;
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::service::TowerToHyperService;
use std::collections::HashMap;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;
use tokio::net::{UnixListener, UnixStream};
use tokio::task::JoinSet;
use tokio_io_timeout::TimeoutStream;

/// Pause after a connection that could not be taken: the process may have no file descriptors left.
const PAUSE: Duration = Duration::from_millis(50);

/// Takes connections for ever. Dropped, it cuts them.
pub(crate) async fn accept(listener: UnixListener, shared: Arc<Shared>, router: Router) {
    let seats = Arc::new(Seats::default());
    let mut connections = JoinSet::new();
    loop {
        while connections.try_join_next().is_some() {}
        let Ok((stream, _)) = listener.accept().await else {
            tokio::time::sleep(PAUSE).await;
            continue;
        };
        let Ok(peer) = stream.peer_cred() else { continue };
        let (uid, gid) = (peer.uid(), peer.gid());
        match Seat::take(&seats, uid, shared.gate.is_own(uid), &shared.limits) {
            Some(seat) => {
                connections.spawn(serve(stream, uid, gid, seat, router.clone(), shared.limits));
            }
            None => turn_away(&stream),
        }
    }
}

/// Connections by user.
#[derive(Default)]
struct Seats {
    taken: Mutex<HashMap<u32, usize>>,
}

/// The place of one connection; given back when dropped.
struct Seat {
    seats: Arc<Seats>,
    uid: u32,
}

impl Seat {
    fn take(seats: &Arc<Seats>, uid: u32, own: bool, limits: &Limits) -> Option<Self> {
        let mut taken = seats.taken.lock().unwrap_or_else(PoisonError::into_inner);
        let all: usize = taken.values().sum();
        let of_user = taken.entry(uid).or_default();
        // Others can never take so many that the plant's own user finds none.
        let room = if own {
            all < limits.connections * 2 && *of_user < limits.connections
        } else {
            all < limits.connections && *of_user < limits.per_user
        };
        if !room {
            return None;
        }
        *of_user += 1;
        Some(Self { seats: Arc::clone(seats), uid })
    }
}

impl Drop for Seat {
    fn drop(&mut self) {
        let mut taken = self.seats.taken.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(n) = taken.get_mut(&self.uid) {
            *n -= 1;
            if *n == 0 {
                taken.remove(&self.uid);
            }
        }
    }
}

/// Says why and closes; a client that does not listen is not waited for.
fn turn_away(stream: &UnixStream) {
    let body = Failure::busy("there are too many connections; close some, or try again in half a minute").json();
    let head = "HTTP/1.1 503 Service Unavailable\r\nconnection: close\r\ncontent-type: application/json";
    let _ = stream.try_write(format!("{head}\r\ncontent-length: {}\r\n\r\n{body}", body.len()).as_bytes());
}

async fn serve(stream: UnixStream, uid: u32, gid: u32, seat: Seat, router: Router, limits: Limits) {
    let Ok(peer) = tokio::task::spawn_blocking(move || Peer::of(uid, gid)).await else { return };
    let mut stream = TimeoutStream::new(stream);
    stream.set_write_timeout(Some(limits.unread));
    let service = TowerToHyperService::new(router.layer(Extension(Arc::new(peer))));
    // What goes wrong on a connection concerns the client alone, and it is gone.
    let _ = http1::Builder::new()
        .timer(TokioTimer::new())
        .header_read_timeout(limits.idle)
        .max_buf_size(limits.body.max(16 << 10))
        .serve_connection(TokioIo::new(Box::pin(stream)), service)
        .await;
    drop(seat);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_user_takes_the_place_of_another() {
        let seats = Arc::new(Seats::default());
        let limits = Limits { connections: 4, per_user: 2, ..Limits::default() };
        let take = |uid: u32| Seat::take(&seats, uid, uid == 0, &limits);
        let alice = [take(1), take(1)];
        assert!(alice.iter().all(Option::is_some) && take(1).is_none(), "two for each");
        let bob = [take(2), take(2)];
        assert!(bob.iter().all(Option::is_some) && take(3).is_none(), "four in all");
        let own: Vec<_> = (0..4).map_while(|_| take(0)).collect();
        assert_eq!(own.len(), 4, "the own user finds as many again");
        assert!(take(0).is_none());
        drop((alice, own));
        assert!(take(3).is_some(), "places are given back");
    }
}
