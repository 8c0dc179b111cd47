//! The errors of parsing, of construction and of a step.

use core::fmt;

use crate::activations::NotFinite;

/// Why [`crate::Image::new_checked`] refused an image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum ImageError {
    /// The bytes do not start at a multiple of 4 in memory.
    Misaligned,
    /// Fewer bytes than a header.
    TooShort,
    /// The first four bytes are not `ACTQ`.
    Magic,
    /// The image's format version is not the one that this crate reads.
    Version,
    /// The image was packed for kernels of another layout; quantize the policy again.
    Layout,
    /// The header's length differs from the number of bytes given.
    Length,
    /// The checksum does not match: the image is damaged.
    Checksum,
    /// A field that must be zero is not.
    Reserved,
    /// The policy kind is unknown.
    Kind,
    /// Chunk or execute length is zero, or execute exceeds chunk.
    Chunk,
    /// A section lies outside the image, shares words with another, or does not stand in its place in their order.
    Section,
    /// The scratch memory is not state, observation, what operations write, action and work area, one behind the other, in at
    /// most 65535 words; or the work area is too short.
    Arena,
    /// Regions of an operation overlap.
    Overlap,
    /// An operation, or the action, reads words that no operation of the step has written.
    Unwritten,
    /// An operation code is unknown.
    Op,
    /// A length is zero, or two lengths of an operation disagree.
    Shape,
    /// A linear operation names no matrix of the image.
    Matrix,
    /// A matrix block's width is not 2, 3, 4 or 8 bits.
    Width,
    /// A block's lanes are not those that follow from its matrix's activations and group.
    Lanes,
    /// A group size is not 0, 32, 64 or 128.
    Group,
    /// A row index lies outside the output or occurs twice.
    Index,
    /// A constant is NaN, infinite or of the wrong sign.
    Constant,
    /// A row's worst case exceeds the int32 accumulator.
    Overflow,
    /// A lower action limit exceeds the upper one.
    Limits,
    /// The policy's name is not UTF-8, or holds control characters.
    Name,
    /// The self-test vector has no steps.
    SelfTest,
}

impl fmt::Display for ImageError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Misaligned => "image is not aligned to 4 bytes",
            Self::TooShort => "image is shorter than its header",
            Self::Magic => "not an actq image (magic differs)",
            Self::Version => "image format version is not supported",
            Self::Layout => "image was packed for another kernel layout; quantize again",
            Self::Length => "image length differs from its header",
            Self::Checksum => "image checksum differs: the image is damaged",
            Self::Reserved => "a reserved field is not zero",
            Self::Kind => "unknown policy kind",
            Self::Chunk => "chunk and execute lengths do not fit",
            Self::Section => "a section lies outside the image, or overlaps or precedes one that stands before it",
            Self::Arena => "the scratch memory's regions do not follow each other, or the work area is too short",
            Self::Overlap => "regions of an operation overlap",
            Self::Unwritten => "an operation reads memory that nothing has written in its step",
            Self::Op => "unknown operation",
            Self::Shape => "lengths of an operation do not fit",
            Self::Matrix => "an operation names no matrix of the image",
            Self::Width => "weight width is not 2, 3, 4 or 8 bits",
            Self::Lanes => "lanes of a block do not follow from its matrix's activations and groups",
            Self::Group => "group size is not 0, 32, 64 or 128",
            Self::Index => "output index out of range or repeated",
            Self::Constant => "a constant is not finite or has the wrong sign",
            Self::Overflow => "a row can overflow its int32 accumulator",
            Self::Limits => "action limits are reversed",
            Self::Name => "policy name is not UTF-8 or holds control characters",
            Self::SelfTest => "the self-test vector has no steps",
        })
    }
}

impl core::error::Error for ImageError {}

/// Why [`crate::Head::new`] refused the scratch memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum HeadError {
    /// The scratch slice has fewer words than the image asks for.
    ScratchTooSmall {
        /// Words needed.
        needed: usize,
        /// Words given.
        given: usize,
    },
}

impl fmt::Display for HeadError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::ScratchTooSmall { needed, given } => {
                write!(f, "scratch memory has {given} words, the image needs {needed}")
            }
        }
    }
}

impl core::error::Error for HeadError {}

/// Why a step gave no action. The recurrent state and the chunk are as after a reset; the last action stays, so that the step
/// limit holds across the error. [`StepError::Budget`] and [`StepError::NotBegun`] change nothing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum StepError {
    /// The observation's length differs from the image's.
    ObservationLength {
        /// Values expected.
        expected: usize,
        /// Values given.
        given: usize,
    },
    /// An observation value is NaN or infinite.
    ObservationNotFinite {
        /// Its position.
        index: usize,
    },
    /// A value inside the network or an action left the range of f32.
    NotFinite,
    /// The image's memory no longer holds what was checked: flash that decays, or was rewritten.
    Damaged,
    /// The self-test vector gave other bits than the image records.
    SelfTest {
        /// The step of the vector that differed.
        step: usize,
    },
    /// The budget of a poll is smaller than the image's least.
    Budget {
        /// Instructions needed: [`crate::Image::least_budget`].
        needed: u32,
        /// Instructions given.
        given: u32,
    },
    /// A poll without a step that was begun.
    NotBegun,
}

impl From<Fault> for StepError {
    fn from(fault: Fault) -> Self {
        match fault {
            Fault::NotFinite => Self::NotFinite,
            Fault::Damaged => Self::Damaged,
        }
    }
}

/// What goes wrong inside an evaluation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Fault {
    /// See [`StepError::NotFinite`].
    NotFinite,
    /// See [`StepError::Damaged`].
    Damaged,
}

impl From<NotFinite> for Fault {
    fn from(_: NotFinite) -> Self {
        Self::NotFinite
    }
}

impl fmt::Display for StepError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::ObservationLength { expected, given } => {
                write!(f, "observation has {given} values, the policy takes {expected}")
            }
            Self::ObservationNotFinite { index } => write!(f, "observation value {index} is not finite"),
            Self::NotFinite => f.write_str("the network produced a value that is not finite"),
            Self::Damaged => f.write_str("the image's memory has changed since it was checked"),
            Self::SelfTest { step } => write!(f, "self-test step {step} gave other bits than the image records"),
            Self::Budget { needed, given } => {
                write!(f, "a poll has {given} instructions, the image needs at least {needed}")
            }
            Self::NotBegun => f.write_str("no step was begun: begin takes the observation, then poll"),
        }
    }
}

impl core::error::Error for StepError {}
