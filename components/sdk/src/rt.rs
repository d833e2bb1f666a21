//! What the code written by `#[block]` stands on: the instance and the bindings' runtime. Not for authors.

use alloc::string::{String, ToString};

pub use wit_bindgen::rt as wit;

/// The one instance of a block in a component. It is made at the first call.
pub struct Instance<T>(#[cfg(target_arch = "wasm32")] core::cell::RefCell<Option<T>>, core::marker::PhantomData<fn(T)>);

// SAFETY: a component runs on one thread: wasm32-unknown-unknown without the atomics feature has no other, and the
// component model lets nobody enter an instance twice (the RefCell would trap).
#[cfg(target_arch = "wasm32")]
unsafe impl<T> Sync for Instance<T> {}

impl<T> Instance<T> {
    /// No instance yet.
    #[allow(clippy::new_without_default, reason = "only ever made in a static")]
    pub const fn new() -> Self {
        Self(
            #[cfg(target_arch = "wasm32")]
            core::cell::RefCell::new(None),
            core::marker::PhantomData,
        )
    }

    /// Lends the instance, made by `new` at the first call. Native code tests blocks as values: there this only
    /// type-checks the exports.
    pub fn with<R>(&self, new: fn() -> T, call: impl FnOnce(&mut T) -> R) -> R {
        #[cfg(target_arch = "wasm32")]
        return call(self.0.borrow_mut().get_or_insert_with(new));
        #[cfg(not(target_arch = "wasm32"))]
        call(&mut new())
    }
}

/// Turns any error that can be shown into the sentence that refuses settings.
pub fn refusal<E: core::fmt::Display>(result: Result<(), E>) -> Result<(), String> {
    result.map_err(|e| e.to_string())
}
