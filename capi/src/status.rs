//! The codes that functions return.

use core::ffi::{CStr, c_char};
use core::num::NonZero;

use actq_kernels::{HeadError, ImageError, SavedError, StepError};

/// The status that a function returns: one of `actq_code`.
pub type ActqStatus = i32;

macro_rules! codes {
    ($($(#[$doc:meta])* $name:ident = $code:literal, $text:literal;)*) => {
        /// The status that a function returns. The numbers of errors stay the same in all versions.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        #[repr(i32)]
        pub enum Code {
            $($(#[$doc])* $name = $code,)*
        }

        impl Code {
            /// All codes.
            pub const ALL: &[Self] = &[$(Self::$name,)*];

            /// Returns what it says.
            pub const fn text(self) -> &'static CStr {
                match self {
                    $(Self::$name => $text,)*
                }
            }
        }
    };
}

codes! {
    /// Done.
    Ok = 0, c"done";
    /// Not an error: the step is not ready; poll again.
    Pending = -1, c"the step is not ready; poll again";
    /// The image: image is not aligned to 4 bytes.
    ImageMisaligned = 1, c"image is not aligned to 4 bytes";
    /// The image: image is shorter than its header.
    ImageTooShort = 2, c"image is shorter than its header";
    /// The image: not an actq image (magic differs).
    ImageMagic = 3, c"not an actq image (magic differs)";
    /// The image: image format version is not supported.
    ImageVersion = 4, c"image format version is not supported";
    /// The image: image was packed for another kernel layout; quantize again.
    ImageLayout = 5, c"image was packed for another kernel layout; quantize again";
    /// The image: image length differs from its header.
    ImageLength = 6, c"image length differs from its header";
    /// The image: image checksum differs: the image is damaged.
    ImageChecksum = 7, c"image checksum differs: the image is damaged";
    /// The image: a reserved field is not zero.
    ImageReserved = 8, c"a reserved field is not zero";
    /// The image: unknown policy kind.
    ImageKind = 9, c"unknown policy kind";
    /// The image: chunk and execute lengths disagree.
    ImageChunk = 10, c"chunk and execute lengths disagree";
    /// The image: a section lies outside the image, overlaps another or is out of order.
    ImageSection = 11, c"a section lies outside the image, overlaps another or is out of order";
    /// The image: regions of the arena do not follow each other, or the work area is too short.
    ImageArena = 12, c"regions of the arena do not follow each other, or the work area is too short";
    /// The image: regions of an operation overlap.
    ImageOverlap = 13, c"regions of an operation overlap";
    /// The image: an operation reads words that its step has not written.
    ImageUnwritten = 14, c"an operation reads words that its step has not written";
    /// The image: unknown operation.
    ImageOp = 15, c"unknown operation";
    /// The image: lengths of an operation disagree.
    ImageShape = 16, c"lengths of an operation disagree";
    /// The image: an operation names no matrix of the image.
    ImageMatrix = 17, c"an operation names no matrix of the image";
    /// The image: weight width is not 2, 3, 4 or 8 bits.
    ImageWidth = 18, c"weight width is not 2, 3, 4 or 8 bits";
    /// The image: lanes of a block differ from those of its matrix's activations and group size.
    ImageLanes = 19, c"lanes of a block differ from those of its matrix's activations and group size";
    /// The image: group size is not 0, 32, 64 or 128.
    ImageGroup = 20, c"group size is not 0, 32, 64 or 128";
    /// The image: the output of a row is out of range or belongs to two rows.
    ImageIndex = 21, c"the output of a row is out of range or belongs to two rows";
    /// The image: a constant is not finite or has the wrong sign.
    ImageConstant = 22, c"a constant is not finite or has the wrong sign";
    /// The image: a row can overflow its int32 accumulator.
    ImageOverflow = 23, c"a row can overflow its int32 accumulator";
    /// The image: action limits are reversed.
    ImageLimits = 24, c"action limits are reversed";
    /// The image: policy name is not UTF-8 or holds control characters.
    ImageName = 25, c"policy name is not UTF-8 or holds control characters";
    /// The image: the self-test vector has no steps.
    ImageSelfTest = 26, c"the self-test vector has no steps";
    /// The image: denoising steps, their operations and their noise disagree.
    ImageDenoising = 27, c"denoising steps, their operations and their noise disagree";
    /// The image: horizon, overlap, deadline, chunk and execute lengths disagree.
    ImagePlayback = 28, c"horizon, overlap, deadline, chunk and execute lengths disagree";
    /// The image: binarization lacks one of its four arrays, or its thresholds are reversed.
    ImageBinarise = 29, c"binarization lacks one of its four arrays, or its thresholds are reversed";
    /// The image: a smoothing coefficient is not above 0 and at most 1.
    ImageSmoothing = 30, c"a smoothing coefficient is not above 0 and at most 1";
    /// The image: sizes, indices or limits of an operation around the network do not fit.
    ImageAround = 31, c"sizes, indices or limits of an operation around the network do not fit";
    /// The image: raw inputs or targets have impossible lengths, names, kinds or ranges.
    ImagePorts = 32, c"raw inputs or targets have impossible lengths, names, kinds or ranges";
    /// The image: it needs a feature of the kernels that this build leaves out.
    ImageLeftOut = 33, c"the image needs a feature of the kernels that this build leaves out; actq inspect lists them";
    /// Too few words of scratch memory.
    ScratchTooSmall = 64, c"scratch memory is too small for the image";
    /// The length differs from that of the image's state.
    SavedLength = 70, c"saved state has another length than the image's";
    /// Not a saved state of this version.
    SavedVersion = 71, c"not a saved state of this version; reset instead";
    /// The state belongs to another image.
    SavedImage = 72, c"saved state belongs to another image; reset instead";
    /// The saved state is damaged.
    SavedDamaged = 73, c"saved state is damaged; reset instead";
    /// A step has begun and is not ready.
    SavedBegun = 74, c"a step is being polled; poll it to its end, or reset, before saving or restoring";
    /// The observation's length differs from the image's.
    ObservationLength = 80, c"observation has another length than the policy takes";
    /// A value of the observation is NaN or infinite.
    ObservationNotFinite = 81, c"a value of the observation is not finite";
    /// A value inside the network exceeded the range of float.
    NotFinite = 82, c"the network produced a value that is not finite";
    /// The image's memory has changed since it was opened.
    Damaged = 83, c"the image's memory has changed since it was checked";
    /// The self-test gave other bits than the image records.
    SelfTest = 84, c"the self-test gave other bits than the image records";
    /// The budget is below the image's least budget.
    Budget = 85, c"the budget of a poll is below the image's least budget";
    /// No step has begun.
    NotBegun = 86, c"no step has begun; call actq_begin, then actq_poll";
    /// No action is young enough to play.
    Stale = 89, c"no action is young enough to play";
    /// A value of the observation is outside the range of its raw input.
    ObservationRange = 90, c"a value of the observation is outside the range of its raw input";
    /// A quaternion's length is not near 1.
    Orientation = 91, c"a quaternion's length is not near 1, so it is not an orientation";
    /// A pointer is null.
    Null = 128, c"a pointer is null";
    /// A pointer is not aligned for its type.
    Alignment = 129, c"a pointer is not aligned for its type";
    /// A length does not fit: a short buffer, or more bytes than memory has.
    Length = 130, c"a length does not fit its buffer";
    /// The structure was not opened or initialized, was copied, or is damaged.
    NotInitialized = 131, c"the structure was not initialized, or is a copy of one";
    /// Buffers overlap.
    Overlap = 132, c"buffers overlap";
    /// A step is being polled: poll it to its end, or reset.
    Polling = 133, c"a step is being polled; poll it to its end, or reset";
    /// The image has no raw input or target of this name or number.
    NoSuchPort = 134, c"the image has no raw input or target of this name or number";
    /// The header is that of another library. (Only `actq.hpp` returns it.)
    AbiDiffers = 135, c"the header and the library are of different versions";
    /// Another head has taken the scratch memory.
    ScratchTaken = 136, c"another head has taken the scratch memory; give each head its own";
}

/// The status of a call that failed: a [`Code`], or the number of the kernels' error, which a code has, too.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Failure(NonZero<ActqStatus>);

impl Failure {
    const fn of(status: ActqStatus) -> Self {
        match NonZero::new(status) {
            Some(status) => Self(status),
            // No error has this number.
            None => Self(NonZero::<ActqStatus>::MIN),
        }
    }
}

impl From<Code> for Failure {
    fn from(code: Code) -> Self {
        Self::of(code as ActqStatus)
    }
}

impl From<ImageError> for Failure {
    fn from(error: ImageError) -> Self {
        Self::of(error.code().into())
    }
}

impl From<HeadError> for Failure {
    fn from(error: HeadError) -> Self {
        Self::of(error.code().into())
    }
}

impl From<SavedError> for Failure {
    fn from(error: SavedError) -> Self {
        Self::of(error.code().into())
    }
}

impl From<StepError> for Failure {
    fn from(error: StepError) -> Self {
        Self::of(error.code().into())
    }
}

/// Returns the status of an outcome.
pub(crate) fn status(outcome: Result<(), Failure>) -> ActqStatus {
    outcome.err().map_or(0, |failure| failure.0.get())
}

/// Returns a text for a status, as a string that ends in a zero; "unknown status" for any other number.
#[unsafe(no_mangle)]
pub extern "C" fn actq_status_text(status: ActqStatus) -> *const c_char {
    let known = Code::ALL.iter().find(|code| **code as ActqStatus == status);
    known.map_or(c"unknown status", |code| code.text()).as_ptr()
}
