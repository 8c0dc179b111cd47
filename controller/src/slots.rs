//! Two places for an image in NOR flash, and the way from one to the other that survives a loss of power at any moment.
//!
//! A slot is whole sectors: a record of 128 bytes, 128 bytes of marks, and the image. The record is written last, once
//! the image was read back, so that a slot with a good record has been whole. Marks are words that are programmed one
//! after the other, each once: a trial begins, the image is confirmed, the image is rejected. The slot that runs is the
//! confirmed one of the highest generation; the other is the one that an update erases. So the one that runs is never
//! touched, nothing is ever programmed twice, and there is no word anywhere whose loss takes both with it.
//!
//! Flash is reached by the traits of `embedded-storage`.

mod authority;
#[cfg(feature = "signature")]
mod key;
mod layout;
mod marks;
mod readback;
mod record;
mod store;
mod updater;

pub use authority::{Anyone, Authority};
#[cfg(feature = "signature")]
pub use key::{BadKey, Key, context};
pub use layout::{HEADER, Layout, LayoutError, Slot};
pub use store::{Candidate, Slots, TRIALS};
pub use updater::{Updater, Work};
