//! The features of this crate that an image needs: from its bytes, at compile time, too.

use super::header::{self as h, Words};
use super::info::header;
use super::view::Image;
use super::words::{high, low};
use crate::image::op;
use crate::layout::{Lanes, Width};
use crate::math::Function;

/// A feature that leaves something out when it is off.
struct Feature {
    name: &'static str,
    /// `true` if this build has it.
    is_built: bool,
    /// Why an image that needs it is refused at compile time.
    refusal: &'static str,
}

macro_rules! features {
    ($($name:literal $(or $remedy:literal)?)*) => {
        [$(Feature {
            name: $name,
            is_built: cfg!(feature = $name),
            refusal: concat!(
                "the image needs the feature `", $name, "` of actq-kernels, which this build leaves out; add it in Cargo.toml"
                $(, ", or ", $remedy)?
            ),
        }),*]
    };
}
/// The codes of blocks without lanes and for Helium, which a build without them knows, too.
const SCALAR: u8 = 2;
const HELIUM: u8 = 3;

/// The features in the order of Cargo.toml.
const FEATURES: [Feature; 18] = features! {
    "w2" "w3" "w4" "w8" "single" "paired" "groups" "elu" "silu" "functions" "norm" "recurrent" "flow" "chunks" "around"
    "attention"
    "scalar" or "convert the image to the layouts of this core with `actq repack`"
    "helium" or "convert the image to the layouts of this core with `actq repack`"
};

/// The features of this build, each a bit.
const BUILT: u32 = {
    let (mut built, mut i) = (0, 0);
    while i < FEATURES.len() {
        built |= (FEATURES[i].is_built as u32) << i;
        i += 1;
    }
    built
};

#[cfg(feature = "writer")]
impl Image<'_> {
    /// Returns the features with which a build runs this image, and without which it refuses it with
    /// [`LeftOut`](crate::ImageError::LeftOut).
    pub fn features(&self) -> impl Iterator<Item = &'static str> {
        let needed = needed(bytemuck::must_cast_slice(self.words));
        (0..).zip(FEATURES.iter()).filter(move |(i, _)| needed >> i & 1 == 1).map(|(_, feature)| feature.name)
    }
}

/// Returns why this build does not run an image that [`ImageInfo::read`](super::ImageInfo::read) accepts: the first
/// feature that it lacks.
pub(crate) const fn refusal(bytes: &[u8]) -> Option<&'static str> {
    refusal_of(needed(bytes), BUILT)
}

const fn refusal_of(needed: u32, built: u32) -> Option<&'static str> {
    match (needed & !built).trailing_zeros() as usize {
        i if i < FEATURES.len() => Some(FEATURES[i].refusal),
        _ => None,
    }
}

/// Returns the bit of a feature; 0 for the name of none.
const fn bit(name: &str) -> u32 {
    let mut i = 0;
    while i < FEATURES.len() {
        if is_same(FEATURES[i].name.as_bytes(), name.as_bytes()) {
            return 1 << i;
        }
        i += 1;
    }
    0
}

const fn is_same(a: &[u8], b: &[u8]) -> bool {
    let mut i = 0;
    while i < a.len() && i < b.len() && a[i] == b[i] {
        i += 1;
    }
    i == a.len() && i == b.len()
}

/// Returns the bits of the features that an image needs. Records outside the image need none.
const fn needed(bytes: &[u8]) -> u32 {
    let Some(words) = header(bytes) else { return 0 };
    let header = Words(&words);
    let mut needed = if header.kind() >> 8 == 0 { 0 } else { bit("around") };
    if header.chunk() > 1 || header.horizon() > 0 {
        needed |= bit("chunks");
    }
    let mut i = 0;
    while i < header.op_count() {
        let head = word(bytes, header.ops().wrapping_add(i * h::OP_WORDS));
        needed |= match (head & 0xff) as u8 {
            op::FUNCTION => match Function::from_code((head >> 8) as u8) {
                Some(function) => bit(function.feature()),
                None => 0,
            },
            code => bit(op::feature(code)),
        };
        i += 1;
    }
    let mut i = 0;
    while i < header.matrix_count() {
        needed |= of_matrix(bytes, header.matrices().wrapping_add(i * h::MATRIX_WORDS));
        i += 1;
    }
    needed
}

/// Returns the bits of the features that the matrix of the record at `at` needs.
const fn of_matrix(bytes: &[u8], at: usize) -> u32 {
    let [levels, count, blocks] =
        [word(bytes, at.wrapping_add(1)), word(bytes, at.wrapping_add(2)), word(bytes, at.wrapping_add(3))];
    let group = low(levels);
    let mut needed = if group == 0 { 0 } else { bit("groups") };
    let mut i = 0;
    while i < low(count) {
        let head = word(bytes, (blocks as usize).wrapping_add(i * h::BLOCK_WORDS));
        needed |= match (head >> 8) as u8 {
            SCALAR => bit("scalar"),
            HELIUM => bit("helium"),
            _ => bit(Lanes::of(high(levels) as u16, group).feature()),
        };
        if let Some(width) = Width::from_bits(head & 0xff) {
            needed |= bit(width.feature());
        }
        i += 1;
    }
    needed
}

/// Returns word `i` of an image at any alignment; 0 after the end.
const fn word(bytes: &[u8], i: usize) -> u32 {
    if i >= bytes.len() / 4 {
        return 0;
    }
    u32::from_le_bytes([bytes[4 * i], bytes[4 * i + 1], bytes[4 * i + 2], bytes[4 * i + 3]])
}

#[cfg(test)]
mod tests {
    use super::*;

    const VALID: &[u8] = include_bytes!("../../tests/valid.actq");

    #[test]
    fn images_name_the_feature_they_lack() {
        let names = ["w2", "w3", "w4", "w8", "single", "paired", "groups", "elu", "norm", "recurrent", "chunks"];
        let all = (1 << FEATURES.len()) - 1;
        for feature in &FEATURES {
            let refusal = refusal_of(needed(VALID), all & !bit(feature.name));
            assert_eq!(refusal.is_some(), names.contains(&feature.name), "{}", feature.name);
            assert!(refusal.is_none_or(|text| text.contains(&std::format!("`{}`", feature.name))), "{refusal:?}");
        }
        assert_eq!(refusal_of(needed(VALID), all), None);
        assert_eq!(refusal_of(all, all & !bit("around")), Some(FEATURES[14].refusal));
        assert!(FEATURES[16..].iter().all(|feature| feature.refusal.contains("actq repack")));
    }

    #[test]
    fn compile_time_and_run_time_agree() {
        let words: std::vec::Vec<u32> = VALID.as_chunks().0.iter().map(|word| u32::from_ne_bytes(*word)).collect();
        let checked = crate::Image::new_checked(bytemuck::cast_slice(&words));
        assert_eq!(refusal(VALID).is_none(), checked.is_ok());
    }
}
