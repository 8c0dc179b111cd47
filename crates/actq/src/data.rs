//! Recordings for calibration and held-out measurements. The section Recordings of `docs/QUANTIZER.md` describes the
//! files.

mod arrays;
mod axes;
mod checked;
#[cfg(test)]
mod damaged;
mod dataset;
mod joined;
mod npy;
mod npz;
mod origin;
mod outliers;
mod parts;
mod range;
mod recording;
mod save;
mod sizes;
#[cfg(test)]
mod tests;
mod thinning;

pub use arrays::arrays;
pub use axes::axes_note;
pub use dataset::Dataset;
pub(crate) use dataset::mean_and_variance;
pub use joined::{Learned, MAX_FRAMES, Share, joined, longest_piece};
pub use npy::npy_header;
pub(crate) use origin::is_link_log;
pub use origin::{CRC32, DESCRIBED, described_by, driven_by};
pub(crate) use outliers::heavy_note;
pub use outliers::outside_note;
pub use parts::Part;
pub use range::{Outside, Range, runs};
pub use recording::{Recording, Recordings, files_of};
pub use save::{Element, NpzWriter, write_npy};
pub use sizes::Sizes;
