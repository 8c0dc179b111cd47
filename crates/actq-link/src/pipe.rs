//! The pipe protocol: a simulator runs an image as its policy, served by `actq serve` on the host or by the demo
//! firmware.
//!
//! Little-endian. A request is the byte [`RESET`], which has no reply, or the byte [`STEP`] and the observation (f32),
//! whose reply is the action (f32). The policy queues action chunks. If the observation or a value computed from it is
//! not finite, all values of the reply are [`NO_ACTION`]. The recurrent state and the rest of a chunk are then
//! discarded, the last action is kept for the step limit, and serving continues. `actq serve` also takes the byte
//! [`PREFIX`] and all keys and values (f32) of a policy that reads a prefix, in the order of its recordings, without a
//! reply.

/// Resets the policy.
pub const RESET: u8 = b'R';

/// Sets the policy's prefix.
pub const PREFIX: u8 = b'P';

/// Steps the policy.
pub const STEP: u8 = b'S';

/// The value in a reply without an action: a quiet NaN.
pub const NO_ACTION: f32 = f32::from_bits(0x7fc0_0000);
