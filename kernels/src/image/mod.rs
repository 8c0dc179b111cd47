//! The image: a sequence of little-endian words, checked once. `docs/FORMAT.md` has the byte tables.
//!
//! [`Image::new_checked`] verifies everything; afterwards no accessor panics or fails. Offsets in the image count
//! 32-bit words from its start; offsets in the arena (the scratch memory) count words, too. Sums of offsets wrap: if
//! flash has changed since the check, an offset may be any word, and each read refuses what the image does not have.
//! The same files read and write: a record's `emit` is next to its `parse`.

#[cfg(feature = "attention")]
mod attention;
mod check;
mod contract;
mod crc;
pub(crate) mod features;
mod front;
pub mod header;
mod info;
mod matrix;
pub mod op;
mod playback;
mod ports;
mod proof;
pub mod record;
mod region;
mod text;
mod view;
mod words;

#[cfg(feature = "attention")]
pub use attention::{Cache, MAX_DIM, MAX_SLOTS};
pub use contract::CONTRACT_ARRAYS;
pub use crc::checksum;
pub use crc::seal;
pub use header::Header;
pub use header::Kind;
pub use info::ImageInfo;
pub(crate) use matrix::row_block;
pub use matrix::{BlockRecord, MatrixRecord, block_bytes, half_words, quarter_words};
pub use matrix::{Matrix, RowBlock};
pub(crate) use op::Around;
pub use op::OpKind;
pub use playback::kept_words;
pub use ports::{Port, PortKind};
pub use proof::{largest_sum_bound, worst_case};
pub use record::Op;
pub use record::OpRecord;
pub use region::Region;
pub use view::Image;
pub use words::{Records, TooLarge};
