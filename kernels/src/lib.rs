#![doc = include_str!("../README.md")]
#![cfg_attr(not(test), no_std)]
#![deny(unsafe_code)]
// The feature `writer` makes modules public. They are compiled in every build: the linker leaves out what nothing calls.
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

#[cfg(target_pointer_width = "16")]
compile_error!("no image runs on a machine with addresses of 16 bits: records hold offsets of 32 bits");

#[cfg(not(feature = "writer"))]
mod arch;
#[cfg(feature = "writer")]
pub mod arch;
mod arena;
mod cursor;
mod error;
mod head;
#[cfg(not(feature = "writer"))]
mod image;
#[cfg(feature = "writer")]
pub mod image;
#[doc(hidden)]
pub mod include;
#[cfg(not(feature = "writer"))]
mod layout;
#[cfg(feature = "writer")]
pub mod layout;
#[cfg(not(feature = "writer"))]
mod math;
#[cfg(feature = "writer")]
pub mod math;
mod meter;
#[cfg(not(feature = "writer"))]
mod ops;
#[cfg(feature = "writer")]
pub mod ops;
#[cfg(not(feature = "writer"))]
mod pace;
#[cfg(feature = "writer")]
pub mod pace;
#[cfg(not(feature = "writer"))]
mod round;
#[cfg(feature = "writer")]
pub mod round;
#[cfg(not(feature = "writer"))]
mod x;
#[cfg(feature = "writer")]
pub mod x;

pub use arch::{BACKEND, Backend};
pub use error::{Error, HeadError, ImageError, SavedError, StepError};
pub use head::Head;
pub use image::{Image, ImageInfo, Kind, Port, PortKind};
#[cfg(feature = "writer")]
pub use layout::{Block, BlockShape, Width};
pub use pace::cost::Cost;
