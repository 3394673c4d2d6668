//! Decoders of others that may panic on a damaged file: a panic becomes an error.

use std::cell::Cell;
use std::panic::{AssertUnwindSafe, catch_unwind};

thread_local! {
    static GUARDED: Cell<bool> = const { Cell::new(false) };
}

/// Whether this thread runs foreign decoding code whose panic becomes a [`crate::ReadError`]; for a panic hook, which would
/// otherwise report a damaged file as a bug.
pub fn panic_is_input_error() -> bool {
    GUARDED.get()
}

/// Runs the decoder and turns a panic into an error.
///
/// Last resort: whether an arithmetic-coded stream is valid shows only while it is decoded, the stream has no checksum,
/// and the decoder indexes tables, divides and adds with what it finds there. Sizes are checked before, so that the
/// decoder cannot exhaust memory; that no unwinding could catch.
pub(crate) fn guarded<T>(work: impl FnOnce() -> Result<T, String>) -> Result<T, String> {
    let before = GUARDED.replace(true);
    let result = catch_unwind(AssertUnwindSafe(work));
    GUARDED.set(before);
    result.unwrap_or_else(|_| Err("a damaged compressed stream".to_owned()))
}
