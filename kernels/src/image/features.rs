//! The features of this crate that an image needs.

use super::view::Image;
use crate::layout::BlockShape;

/// The features that leave something out when they are off, in the order of Cargo.toml.
const FEATURES: [&str; 15] = [
    "w2",
    "w3",
    "w4",
    "w8",
    "single",
    "paired",
    "groups",
    "elu",
    "silu",
    "functions",
    "norm",
    "recurrent",
    "flow",
    "chunks",
    "around",
];

impl Image<'_> {
    /// Returns the features with which a build runs this image, and without which it refuses it with
    /// [`LeftOut`](crate::ImageError::LeftOut).
    pub fn features(&self) -> impl Iterator<Item = &'static str> {
        FEATURES.into_iter().filter(|feature| self.needs(feature))
    }

    fn needs(&self, feature: &str) -> bool {
        let matrices = || self.ops().filter_map(|op| op.matrix());
        match feature {
            "chunks" => self.needs_chunks(),
            "around" => self.has_around(),
            "groups" => matrices().any(|matrix| matrix.group != 0),
            _ => {
                self.ops().any(|op| op.kind.feature() == Some(feature))
                    || matrices().flat_map(|matrix| matrix.blocks()).any(|rows| {
                        let BlockShape { width, lanes, .. } = rows.block.shape();
                        width.feature() == feature || lanes.feature() == feature
                    })
            }
        }
    }
}
