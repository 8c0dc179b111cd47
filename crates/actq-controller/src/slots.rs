//! Two image slots in NOR flash, and updates that survive a loss of power at any moment.
//!
//! A slot is whole sectors: a record of 128 bytes, 128 bytes of marks, and the image. The record is written last, after
//! the image was read back, so a slot with a valid record was complete. Marks are words that are programmed one after
//! another, each once: a trial begins, the image is confirmed, the image is rejected. The confirmed slot with the
//! highest generation runs; an update erases the other one. So the running slot is never touched, no word is programmed
//! twice, and the loss of any single word leaves one of the slots valid.
//!
//! Access to flash is through the traits of `embedded-storage`.

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
