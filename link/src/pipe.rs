//! The pipe protocol: any simulator runs an image as its policy, served by `actq serve` on the host or by the demo
//! firmware.
//!
//! Little-endian. A request is one byte: [`RESET`], which has no reply, or [`STEP`] and the observation (f32), which
//! are answered by the action (f32). Chunks are queued by the policy. Where the observation, or a value that the
//! network makes of it, is not finite, all values of the answer are [`NO_ACTION`]: the recurrent state and what was
//! left of a chunk are forgotten, the last action is kept for the step limit, and serving goes on.

/// Resets the policy.
pub const RESET: u8 = b'R';

/// Steps the policy.
pub const STEP: u8 = b'S';

/// The value of an answer without an action: a quiet NaN.
pub const NO_ACTION: f32 = f32::from_bits(0x7fc0_0000);
