//! Low-bit GEMV kernels and an action-head executor for microcontrollers: `no_std`, no allocation, no panic after
//! [`Image::new_checked`].
//!
//! A robot policy's last layers, or a whole small policy, are quantized on a host (by the command `actq`) into one
//! image of bytes. This crate runs that image in place from flash:
//!
//! ```
//! # fn run(bytes: &[u8], scratch: &mut [u32], observation: &[f32]) -> Result<(), Box<dyn std::error::Error>> {
//! use actq_kernels::{Head, Image};
//!
//! let image = Image::new_checked(bytes)?; // checksum, layout, bounds, overflow limits: all of it here, once
//! let mut head = Head::new(image, scratch)?; // `image.scratch_words()` says how many words
//! head.reset();
//! let action = head.step(observation)?; // the same bits on every machine
//! # let _ = action; Ok(())
//! # }
//! ```
//!
//! The arithmetic, in the order in which it happens, is documented in [`ops::linear`]; the packed layouts in
//! [`layout`]; the image in `docs/FORMAT.md`. Everything outside the integer GEMV is IEEE 754 binary32 in a fixed
//! order, without fused multiply-add, so that a host, QEMU and a board give identical bits.
#![cfg_attr(not(test), no_std)]
#![deny(unsafe_code)]

// Which of these may use which: the table in docs/ARCHITECTURE.md, which a test reads.
pub mod arch;
mod cursor;
mod error;
pub mod head;
pub mod image;
mod include;
pub mod layout;
pub mod math;
mod meter;
pub mod ops;
pub mod pace;
pub mod round;
pub mod x;

pub use error::{HeadError, ImageError, SavedError, StepError};
pub use head::Head;
pub use image::{Image, ImageInfo};
#[doc(hidden)]
pub use include::included;
pub use layout::{Block, BlockShape, Width};
