//! Waits with a limit.

/// Polls `done` at most `turns` times; returns `true` if it was done.
pub(super) fn wait(turns: u32, mut done: impl FnMut() -> bool) -> bool {
    (0..turns).any(|_| done())
}
