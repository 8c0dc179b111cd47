//! The errors of an image's check, of construction and of a step. Each has a number, for C, for a frame of a few bytes
//! and for a register that survives a reset. 0 is no error.

use core::fmt;

/// A value is NaN or infinite.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct NotFinite;

impl fmt::Display for NotFinite {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a value is not finite")
    }
}

impl core::error::Error for NotFinite {}

macro_rules! image_errors {
    ($($(#[$doc:meta])* $name:ident = $code:literal, $text:literal;)*) => {
        /// Why [`crate::Image::new_checked`] refused an image.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        #[cfg_attr(feature = "defmt", derive(defmt::Format))]
        #[non_exhaustive]
        #[repr(u8)]
        pub enum ImageError {
            $($(#[$doc])* $name = $code,)*
        }

        impl ImageError {
            /// All errors, by number.
            pub const ALL: &[Self] = &[$(Self::$name,)*];

            /// Returns the text that [`Display`](fmt::Display) writes, for programs without `core::fmt`.
            pub const fn text(self) -> &'static str {
                match self {
                    $(Self::$name => $text,)*
                }
            }
        }

        impl fmt::Display for ImageError {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str(self.text())
            }
        }
    };
}

image_errors! {
    /// The bytes do not start at a multiple of 4 in memory; [`crate::include_image!`] aligns a file.
    Misaligned = 1, "image is not aligned to 4 bytes";
    /// Fewer bytes than a header.
    TooShort = 2, "image is shorter than its header";
    /// The first four bytes are not `ACTQ`.
    Magic = 3, "not an actq image (magic differs)";
    /// The image's format version is not the one that this crate reads.
    Version = 4, "image format version is not supported";
    /// The image was packed for kernels of another layout; quantize the policy again.
    Layout = 5, "image was packed for another kernel layout; quantize again";
    /// The header's length differs from the number of bytes given.
    Length = 6, "image length differs from its header";
    /// The checksum does not match: the image is damaged.
    Checksum = 7, "image checksum differs: the image is damaged";
    /// A field that must be zero is not.
    Reserved = 8, "a reserved field is not zero";
    /// The policy kind is unknown.
    Kind = 9, "unknown policy kind";
    /// Chunk or execute length is zero, or execute exceeds chunk.
    Chunk = 10, "chunk and execute lengths disagree";
    /// A section lies outside the image, shares words with another, or is out of order.
    Section = 11, "a section lies outside the image, overlaps another or is out of order";
    /// The arena is not state, observation, operation outputs, action and work area, in this order and without gaps, in
    /// at most 65535 words; or the work area is too short.
    Arena = 12, "regions of the arena do not follow each other, or the work area is too short";
    /// Regions of an operation overlap.
    Overlap = 13, "regions of an operation overlap";
    /// An operation, or the action, reads words that no operation of the step has written.
    Unwritten = 14, "an operation reads words that its step has not written";
    /// An operation code is unknown.
    Op = 15, "unknown operation";
    /// A length is zero, or two lengths of an operation disagree.
    Shape = 16, "lengths of an operation disagree";
    /// A linear operation names no matrix of the image.
    Matrix = 17, "an operation names no matrix of the image";
    /// A matrix block's width is not 2, 3, 4 or 8 bits.
    Width = 18, "weight width is not 2, 3, 4 or 8 bits";
    /// A block's lanes are not those of its matrix's activations and group size, or the build lacks another core's layouts.
    Lanes = 19, "a block's layout is another core's (actq repack), or not its matrix's";
    /// A group size is not 0, 32, 64 or 128.
    Group = 20, "group size is not 0, 32, 64 or 128";
    /// The output of a row is out of range or belongs to another row, too.
    Index = 21, "the output of a row is out of range or belongs to two rows";
    /// A constant is NaN, infinite or of the wrong sign.
    Constant = 22, "a constant is not finite or has the wrong sign";
    /// The largest sum of a row exceeds its int32 accumulator.
    Overflow = 23, "a row can overflow its int32 accumulator";
    /// A lower action limit exceeds the upper one.
    Limits = 24, "action limits are reversed";
    /// The policy's name is not UTF-8, or holds control characters.
    Name = 25, "policy name is not UTF-8 or holds control characters";
    /// The self-test vector has no steps.
    SelfTest = 26, "the self-test vector has no steps";
    /// Denoising steps without operations, denoising operations in another kind of policy, or noise at a wrong place.
    Denoising = 27, "denoising steps, their operations and their noise disagree";
    /// One of these: the horizon exceeds the chunk, or goes with several executed actions or an overlap; the overlap
    /// exceeds the actions that remain of a chunk; the deadline is before the last executed action.
    Playback = 28, "horizon, overlap, deadline, chunk and execute lengths disagree";
    /// Only some of the four binarization arrays are present, or an upper threshold is below the lower one.
    Binarise = 29, "binarization lacks one of its four arrays, or its thresholds are reversed";
    /// A smoothing coefficient is not above 0 and at most 1.
    Smoothing = 30, "a smoothing coefficient is not above 0 and at most 1";
    /// Sizes, indices, rows or limits of an operation around the network do not fit each other.
    Around = 31, "sizes, indices or limits of an operation around the network do not fit";
    /// The lengths of raw inputs and targets are not those of observation and action, or a name, a kind or a range is
    /// impossible.
    Ports = 32, "raw inputs or targets have impossible lengths, names, kinds or ranges";
    /// This build lacks what the image needs: a width, an operation, chunks. `actq inspect` lists the features.
    LeftOut = 33, "the image needs a feature of the kernels that this build leaves out; actq inspect lists them";
}

impl ImageError {
    /// Returns the error's number, the same in all versions: 1 to 63.
    pub const fn code(self) -> u8 {
        self as u8
    }
}

impl core::error::Error for ImageError {}

/// Declares an error with fields, each variant with its number and its text.
macro_rules! errors {
    ($(#[$doc:meta])* $error:ident, $numbers:literal {
        $($(#[$variant_doc:meta])* $variant:ident $({ $($(#[$field_doc:meta])* $field:ident: $type:ty,)* })? = $code:literal, $text:literal;)*
    }) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        #[cfg_attr(feature = "defmt", derive(defmt::Format))]
        #[non_exhaustive]
        pub enum $error {
            $($(#[$variant_doc])* $variant $({ $($(#[$field_doc])* $field: $type,)* })?,)*
        }

        impl $error {
            #[doc = concat!("Returns the error's number, the same in all versions: ", $numbers, ".")]
            pub const fn code(self) -> u8 {
                match self {
                    $(Self::$variant { .. } => $code,)*
                }
            }
        }

        impl fmt::Display for $error {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                match self {
                    $(Self::$variant $({ $($field),* })? => write!(f, $text),)*
                }
            }
        }

        impl core::error::Error for $error {}
    };
}

errors! {
    /// Why [`crate::Head::new`] refused the scratch memory.
    HeadError, "64" {
        /// The scratch memory has fewer words than the image needs.
        ScratchTooSmall {
            /// Words needed.
            needed: usize,
            /// Words given.
            given: usize,
        } = 64, "scratch memory has {given} words; the image needs {needed}";
    }
}

errors! {
    /// Why a head did not take a prefix, or a cache of it no keys and values. The head keeps its prefix.
    PrefixError, "65 to 69" {
        /// The length differs from that of the image's prefix, or keys and values are not whole tokens of the cache.
        Length {
            /// Bytes needed ([`crate::Image::prefix_bytes`]), or values of the keys that have room.
            needed: usize,
            /// Bytes or values given.
            given: usize,
        } = 65, "prefix has the length {given}; the image's has {needed}";
        /// A cache has no token, or more than its slots.
        Tokens = 66, "a cache of the prefix has no token, or more tokens than slots";
        /// A key, a value or a scale is not finite, or a scale is negative.
        NotFinite = 67, "a value or a scale of the prefix is not finite, or a scale is negative";
        /// A step has begun and is not ready: poll it to its end, or reset.
        Begun = 68, "a step is being polled; poll it to its end, or reset, before it gets another prefix";
    }
}

errors! {
    /// Why the state of a head was not saved or restored. The head is unchanged.
    SavedError, "70 to 79" {
        /// The length differs from that of the image's state.
        Length {
            /// Bytes needed: [`crate::Head::saved_len`].
            needed: usize,
            /// Bytes given.
            given: usize,
        } = 70, "saved state has {given} bytes; the image's has {needed}";
        /// The bytes are not a saved state of this version.
        Version = 71, "not a saved state of this version; reset instead";
        /// The state belongs to another image.
        Image = 72, "saved state belongs to another image; reset instead";
        /// The checksum differs, or a number is impossible: the bytes are damaged.
        Damaged = 73, "saved state is damaged; reset instead";
        /// A step has begun and is not ready: poll it to its end, or reset.
        Begun = 74, "a step is being polled; poll it to its end, or reset, before saving or restoring";
    }
}

errors! {
    /// Why a step gave no action. The recurrent state and the chunk are reset; the last action stays, so that the step
    /// limit holds across the error. [`StepError::Budget`], [`StepError::NotBegun`] and the
    /// [`StepError::Stale`] of [`crate::Head::play`] change nothing; [`StepError::SelfTest`] resets the last action,
    /// too.
    StepError, "80 to 127" {
        /// The observation's length differs from the image's.
        ObservationLength {
            /// Values expected.
            expected: usize,
            /// Values given.
            given: usize,
        } = 80, "observation has {given} values; the policy takes {expected}";
        /// An observation value is NaN or infinite.
        ObservationNotFinite {
            /// Its position.
            index: usize,
        } = 81, "observation value {index} is not finite";
        /// A value inside the network or an action exceeded the range of f32.
        NotFinite = 82, "the network produced a value that is not finite";
        /// The image has changed since its check: the flash decayed or was rewritten. Or, with the feature `checksums`,
        /// scratch memory changed during a long product or between two steps.
        Damaged = 83, "the image or the scratch memory was changed by something else";
        /// A self-test step gave other bits than the image records.
        SelfTest {
            /// The self-test step that differed, from 0.
            step: usize,
        } = 84, "self-test step {step} gave other bits than the image records";
        /// The slice budget is below the image's least budget.
        Budget {
            /// Modelled instructions needed: [`crate::Image::least_budget`].
            needed: u32,
            /// Modelled instructions given.
            given: u32,
        } = 85, "a poll has {given} instructions; the image needs at least {needed}";
        /// A poll without a step that has begun, and without an action since the start, a reset or an error.
        NotBegun = 86, "no step has begun; call begin with an observation, then poll";
        /// The noise's length differs from the image's.
        NoiseLength {
            /// Values expected: [`crate::Image::noise_len`].
            expected: usize,
            /// Values given.
            given: usize,
        } = 87, "noise has {given} values; the policy takes {expected}";
        /// A value of the noise is NaN or infinite.
        NoiseNotFinite {
            /// Its position.
            index: usize,
        } = 88, "noise value {index} is not finite";
        /// Every action is older than its deadline, or its period has passed.
        Stale = 89, "no action is young enough to play";
        /// A value of the observation is outside the range of its raw input ([`crate::Image::ports`]).
        ObservationRange {
            /// Its position.
            index: usize,
        } = 90, "observation value {index} is outside the range of its raw input";
        /// A quaternion of the observation is not an orientation: its length is not near 1 (`docs/DEPLOY.md`).
        Orientation = 91, "a quaternion's length is not near 1, so it is not an orientation";
        /// The image reads a prefix, and the head has none ([`crate::Head`]'s `set_prefix`, with the feature `attention`).
        NoPrefix = 92, "the policy reads a prefix, keys and values from a host, and none was set";
    }
}

impl From<Fault> for StepError {
    fn from(fault: Fault) -> Self {
        match fault {
            Fault::NotFinite => Self::NotFinite,
            Fault::Damaged => Self::Damaged,
            Fault::Stale => Self::Stale,
            Fault::Orientation => Self::Orientation,
        }
    }
}

/// An error inside an evaluation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Fault {
    /// See [`StepError::NotFinite`].
    NotFinite,
    /// See [`StepError::Damaged`].
    Damaged,
    /// See [`StepError::Stale`].
    Stale,
    /// See [`StepError::Orientation`].
    Orientation,
}

impl From<NotFinite> for Fault {
    fn from(_: NotFinite) -> Self {
        Self::NotFinite
    }
}

/// Any error of this crate, for functions that open an image and run it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum Error {
    /// See [`ImageError`].
    Image(ImageError),
    /// See [`HeadError`].
    Head(HeadError),
    /// See [`PrefixError`].
    Prefix(PrefixError),
    /// See [`SavedError`].
    Saved(SavedError),
    /// See [`StepError`].
    Step(StepError),
}

impl Error {
    /// Returns the error's number, the same in all versions.
    pub const fn code(self) -> u8 {
        match self {
            Self::Image(error) => error as u8,
            Self::Head(error) => error.code(),
            Self::Prefix(error) => error.code(),
            Self::Saved(error) => error.code(),
            Self::Step(error) => error.code(),
        }
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Image(error) => error.fmt(f),
            Self::Head(error) => error.fmt(f),
            Self::Prefix(error) => error.fmt(f),
            Self::Saved(error) => error.fmt(f),
            Self::Step(error) => error.fmt(f),
        }
    }
}

impl core::error::Error for Error {}

macro_rules! any_error {
    ($($variant:ident $error:ident)*) => {
        $(impl From<$error> for Error {
            fn from(error: $error) -> Self {
                Self::$variant(error)
            }
        })*
    };
}

any_error! { Image ImageError Head HeadError Prefix PrefixError Saved SavedError Step StepError }

#[cfg(test)]
mod tests {
    use std::format;

    use super::*;

    /// Other programs depend on the numbers.
    #[test]
    fn error_codes_stay_the_same() {
        let codes: std::vec::Vec<_> = ImageError::ALL.iter().map(|e| (e.code(), format!("{e:?}"))).collect();
        let expected = [
            "Misaligned",
            "TooShort",
            "Magic",
            "Version",
            "Layout",
            "Length",
            "Checksum",
            "Reserved",
            "Kind",
            "Chunk",
            "Section",
            "Arena",
            "Overlap",
            "Unwritten",
            "Op",
            "Shape",
            "Matrix",
            "Width",
            "Lanes",
            "Group",
            "Index",
            "Constant",
            "Overflow",
            "Limits",
            "Name",
            "SelfTest",
            "Denoising",
            "Playback",
            "Binarise",
            "Smoothing",
            "Around",
            "Ports",
            "LeftOut",
        ];
        assert_eq!(codes, (1..).zip(expected.map(Into::into)).collect::<std::vec::Vec<_>>());
        assert_eq!(HeadError::ScratchTooSmall { needed: 1, given: 0 }.code(), 64);
        let steps = [
            StepError::ObservationLength { expected: 1, given: 0 },
            StepError::ObservationNotFinite { index: 0 },
            StepError::NotFinite,
            StepError::Damaged,
            StepError::SelfTest { step: 0 },
            StepError::Budget { needed: 1, given: 0 },
            StepError::NotBegun,
            StepError::NoiseLength { expected: 1, given: 0 },
            StepError::NoiseNotFinite { index: 0 },
            StepError::Stale,
            StepError::ObservationRange { index: 0 },
            StepError::Orientation,
            StepError::NoPrefix,
        ];
        assert_eq!(steps.map(StepError::code), [80, 81, 82, 83, 84, 85, 86, 87, 88, 89, 90, 91, 92]);
        let prefix = [
            PrefixError::Length { needed: 1, given: 0 },
            PrefixError::Tokens,
            PrefixError::NotFinite,
            PrefixError::Begun,
        ];
        assert_eq!(prefix.map(PrefixError::code), [65, 66, 67, 68]);
        let saved = [
            SavedError::Length { needed: 1, given: 0 },
            SavedError::Version,
            SavedError::Image,
            SavedError::Damaged,
            SavedError::Begun,
        ];
        assert_eq!(saved.map(SavedError::code), [70, 71, 72, 73, 74]);
    }
}
