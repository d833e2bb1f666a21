//! The `#[block]` macro of `latchwork-sdk`.
//!
//! It owns the way from a device class in WIT to Rust: find the class, compare the author's impl with it, say in the
//! author's words what does not fit, and write the bindings and the exports. It knows no host and no single class.
//!
//! ```text
//! "latchwork:device/ton" ──wit──► class (functions, types, docs) ──check──► messages at the author's code
//!                                              └────────────────bind───► bindings, types in scope, exports
//! ```

mod args;
mod bind;
mod check;
mod class;
mod names;
#[cfg(test)]
mod tests;
mod wit;

use proc_macro::TokenStream;

/// Makes a struct a function block of a device class; see the documentation of `latchwork_sdk`.
#[proc_macro_attribute]
pub fn block(args: TokenStream, item: TokenStream) -> TokenStream {
    bind::block(args.into(), item.into()).into()
}

/// Bindings of `latchwork:block`, which the SDK itself is built on. Not for blocks.
#[doc(hidden)]
#[proc_macro]
pub fn __shared(_: TokenStream) -> TokenStream {
    bind::shared().into()
}
