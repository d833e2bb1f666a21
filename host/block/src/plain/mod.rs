//! The plain path: calls straight into the one core module that most components consist of.
//!
//! The component API does for every call what is the same for every call: looking up types, allocating names, counting
//! fuel. Here it is done once, at load: the module is taken out of the component ([`extract`]), the place of every value is
//! worked out ([`plan`]), and a call only moves cells to arguments and memory to cells ([`call`]), with all checks of the
//! canonical ABI. What it accepts, refuses and returns is what the component path does; tests compare the two.

mod adapters;
mod bind;
mod call;
mod extract;
mod outline;
mod plan;

pub(crate) use bind::{Bound, Code};
pub(crate) use extract::{Extract, extract};
