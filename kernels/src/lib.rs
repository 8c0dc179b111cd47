//! Low-bit GEMV kernels and an action-head executor for microcontrollers: `no_std`, no allocation, no panic after
//! [`Image::new_checked`] or [`Image::new_checksummed`].
//!
//! The command `actq` quantizes a robot policy's last layers, or a whole small policy, into one image on a host. This
//! crate runs that image in place from flash:
//!
//! ```
//! # fn run(bytes: &[u8], scratch: &mut [u32], observation: &[f32]) -> Result<(), actq_kernels::Error> {
//! use actq_kernels::{Head, Image};
//!
//! let image = Image::new_checked(bytes)?; // checks checksum, layout, bounds and overflow limits
//! let mut head = Head::new(image, scratch)?; // `scratch` has at least `image.scratch_words()` words
//! head.reset();
//! let action = head.step(observation)?; // the same bits on every machine
//! # let _ = action; Ok(())
//! # }
//! ```
//!
//! [`include_image!`] puts an image into the program. `docs/FORMAT.md` documents the image, `docs/KERNELS.md` the
//! kernels. Everything outside the integer GEMV is IEEE 754 binary32 in a fixed order, without fused multiply-add, so
//! that a host, QEMU and a board give identical bits.
//!
//! Features:
//!
//! - `w2`, `w3`, `w4`, `w8`: matrices of weights of these bits.
//! - `single`, `paired`: matrices of one weight in a lane of 16 bits (activations above 127, or groups of 64 or 128),
//!   and of two (all others). `groups`: group scales.
//! - `elu`: ELU, tanh and sigmoid. `silu`: SiLU. `functions`: GELU, softplus, mish, exp, sine, cosine. (ReLU is in
//!   every build.)
//! - `norm`: layer norm and RMS norm. `recurrent`: LSTM and GRU cells. `flow`: flow and diffusion policies.
//! - `chunks`: action chunks of more than one action, with overlap and temporal ensemble.
//! - `around`: the operations around a network (`docs/DEPLOY.md`): raw values in, targets out.
//! - `attention`: attention, with a cache of keys and values.
//!
//! These make the code smaller when they are off; all are on by default. An image that needs one that the build leaves
//! out does not compile in [`include_image!`], and is refused with [`ImageError::LeftOut`] at run time; `actq inspect`
//! lists what an image needs. Three more:
//!
//! - `compact` shortens the assembler's loops for paired lanes of 3, 4 and 8 bits: less code, more time, the same bits.
//! - `defmt` derives `defmt::Format` for the error types.
//! - `writer` makes public what writes images and what checks the kernels: packed layouts, records, arithmetic and the
//!   parts of the cost model. The quantizer, tests and measurements use it. It is **unstable**: any version may change
//!   it. Its enums are exhaustive, so that a writer that forgets an operation does not compile.
#![cfg_attr(not(test), no_std)]
#![deny(unsafe_code)]
// Without the feature `writer`, the modules for writers are private, with public items, and nothing uses some of these.
// They are compiled in every build, so that a feature adds no code; the linker leaves out what a program does not call.
#![cfg_attr(not(feature = "writer"), allow(dead_code, unreachable_pub, unused_imports))]

/// Declares methods that are public with the feature `writer`, and private to the crate without it.
macro_rules! writer_methods {
    ($($(#[$attribute:meta])* fn $name:ident $arguments:tt -> $result:ty $body:block)*) => {
        $(
            #[cfg(feature = "writer")]
            $(#[$attribute])*
            pub fn $name $arguments -> $result $body
            #[cfg(not(feature = "writer"))]
            $(#[$attribute])*
            pub(crate) fn $name $arguments -> $result $body
        )*
    };
}

// A module that writers need is public with the feature `writer`.
#[cfg(feature = "writer")]
pub mod activations;
#[cfg(not(feature = "writer"))]
mod activations;
#[cfg(feature = "writer")]
pub mod arch;
#[cfg(not(feature = "writer"))]
mod arch;
mod arena;
mod checksum;
#[cfg(feature = "writer")]
pub mod cost;
#[cfg(not(feature = "writer"))]
mod cost;
mod cursor;
mod error;
mod head;
#[cfg(feature = "writer")]
pub mod image;
#[cfg(not(feature = "writer"))]
mod image;
#[doc(hidden)]
pub mod include;
#[cfg(feature = "writer")]
pub mod layout;
#[cfg(not(feature = "writer"))]
mod layout;
#[cfg(feature = "writer")]
pub mod math;
#[cfg(not(feature = "writer"))]
mod math;
mod meter;
#[cfg(feature = "writer")]
pub mod ops;
#[cfg(not(feature = "writer"))]
mod ops;
#[cfg(feature = "writer")]
pub mod round;
#[cfg(not(feature = "writer"))]
mod round;

pub use arch::{BACKEND, Backend};
pub use cost::Cost;
pub use error::{Error, HeadError, ImageError, PrefixError, SavedError, StepError};
pub use head::Head;
#[cfg(feature = "writer")]
pub use head::Parked;
#[cfg(feature = "attention")]
pub use image::Cache;
pub use image::{Image, ImageInfo, Kind, Port, PortKind};
#[cfg(feature = "writer")]
pub use layout::{Block, BlockShape, Width};
