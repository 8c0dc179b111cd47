//! The pipe protocol: any simulator runs an image as its policy, served by `actq serve` on the host or by the demo firmware.
//!
//! Little-endian. A request is one byte: [`RESET`], which has no reply, or [`STEP`] and the observation (f32), which are answered by
//! the action (f32). Chunks are queued by the policy.
#![no_std]
#![forbid(unsafe_code)]

/// Resets the policy.
pub const RESET: u8 = b'R';

/// Steps the policy.
pub const STEP: u8 = b'S';
