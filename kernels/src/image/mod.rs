//! The image: one run of little-endian words, parsed once. `docs/FORMAT.md` has the byte tables.
//!
//! [`Image::new_checked`] verifies everything; afterwards no accessor panics or fails. Offsets in the image count
//! 32-bit words from its start, offsets in the arena (the scratch memory) count words too. Sums of offsets wrap: where
//! flash has changed since the check, an offset may be any word, and what is not there is refused where it is read.
//! What is read here can be written here, too: a record's `emit` stands beside its `parse`.

mod check;
mod contract;
mod crc;
pub mod header;
mod info;
mod matrix;
pub mod op;
mod playback;
mod proof;
mod region;
mod text;
mod view;
mod words;

pub use contract::CONTRACT_ARRAYS;
pub use crc::{checksum, seal};
pub use header::{Header, Kind};
pub use info::ImageInfo;
pub(crate) use matrix::row_block;
pub use matrix::{BlockRecord, Matrix, MatrixRecord, RowBlock, block_bytes, half_words, quarter_words};
pub use op::{Op, OpKind, OpRecord};
pub use playback::kept_words;
pub use proof::{largest_sum_bound, worst_case};
pub use region::Region;
pub use view::Image;
pub use words::{Records, TooLarge};
