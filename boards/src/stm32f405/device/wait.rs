//! Waits that end.

/// Reads until `done`, at most `turns` times; returns `true` if it was.
pub(super) fn wait(turns: u32, mut done: impl FnMut() -> bool) -> bool {
    (0..turns).any(|_| done())
}
