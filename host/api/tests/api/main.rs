//! The control socket as its clients meet it: a real socket, real requests, and a plant that answers like one.

mod access;
mod limits;
mod records;
mod requests;
mod support;
mod swaps;
mod watch;
