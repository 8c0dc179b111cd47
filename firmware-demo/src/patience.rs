//! How long the watchdog waits.

/// Milliseconds until it resets the board.
#[derive(Clone, Copy, Debug)]
pub struct Patience {
    /// From one turn of the loop that has made progress to the next.
    pub turn: u16,
    /// For what holds the loop up: a block or a signature at the start, an erase, the check of a signature, an image's
    /// check, a slice of its self-test. All of it is slow where the crystal is dead, and nothing is armed until it has
    /// ended.
    pub long: u16,
}

/// The application's. `host-tests/tests/all/on_target/start.rs` holds each piece below them at the slowest clock.
pub const PATIENCE: Patience = Patience { turn: 500, long: 4000 };

/// The longest piece of a step that an image may need ([`actq_kernels::Image::least_budget`]), in modelled
/// instructions: one with a longer one does not run. `host-tests/tests/all/on_target/start.rs` holds it below [`Patience::turn`]
/// at the slowest clock.
pub const LONGEST: u32 = 100_000;
