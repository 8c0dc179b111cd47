//! The watchdog's timeouts.

/// Timeouts of the watchdog, in milliseconds.
#[derive(Clone, Copy, Debug)]
pub struct Timeouts {
    /// Timeout from one turn of the loop with progress to the next.
    pub turn: u16,
    /// Timeout for long work: a block or a signature at the start, an erase, the check of a signature, an image's
    /// check, a slice of its self-test. All of it is slow if the crystal is dead, and the controller is not armed until
    /// it has ended.
    pub long: u16,
}

/// The application's timeouts. `host-tests/tests/all/on_target/start.rs` asserts that each piece is shorter at the
/// slowest clock.
pub const TIMEOUTS: Timeouts = Timeouts { turn: 500, long: 4000 };

/// Longest piece of a step that an image may need ([`actq_kernels::Image::least_budget`]), in modelled instructions. An
/// image with a longer one is refused. `host-tests/tests/all/on_target/start.rs` asserts that it is shorter than
/// [`Timeouts::turn`] at the slowest clock.
pub const MAX_SLICE: u32 = 100_000;

/// Most slices of a self-test. An image that needs more is refused, because nothing else is done meanwhile. They are
/// 1e9 modelled instructions with slices of [`crate::running::SLICE`]: 8 s of a Cortex-M4 at 168 MHz.
pub const MAX_TEST: u32 = 50_000;
