//! The codes that functions return.

use core::ffi::{CStr, c_char};
use core::num::NonZero;

use actq_kernels::{HeadError, ImageError, PrefixError, SavedError, StepError};

/// The status that a function returns: one of `actq_code`.
pub type ActqStatus = i32;

macro_rules! codes {
    ($($(#[$doc:meta])* $name:ident = $code:literal, $text:literal;)*) => {
        /// The status that a function returns, other than an image's error, which has the number and the text of the kernels'
        /// [`ImageError`]. The numbers of errors stay the same in all versions.
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
    /// Too few words of scratch memory.
    ScratchTooSmall = 64, c"scratch memory is too small for the image";
    /// The length differs from that of the image's prefix.
    PrefixLength = 65, c"prefix has another length than the image's";
    /// A cache of the prefix has no token, or more than its slots.
    PrefixTokens = 66, c"a cache of the prefix has no token, or more tokens than slots";
    /// A scale of the prefix is not finite, or negative.
    PrefixNotFinite = 67, c"a scale of the prefix is not finite, or negative";
    /// A step has begun and is not ready.
    PrefixBegun = 68, c"a step is being polled; poll it to its end, or reset, before it gets another prefix";
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
    /// The image's memory has changed since it was opened, or, with the feature `checksums`, scratch memory.
    Damaged = 83, c"the image or the scratch memory was changed by something else";
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
    /// The image reads a prefix, and the head has none.
    NoPrefix = 92, c"the policy reads a prefix, keys and values from a host, and none was set";
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

macro_rules! failures {
    ($($error:ident)*) => {
        $(impl From<$error> for Failure {
            fn from(error: $error) -> Self {
                Self::of(error.code().into())
            }
        })*
    };
}

failures!(ImageError HeadError PrefixError SavedError StepError);

pub(crate) fn status(outcome: Result<(), Failure>) -> ActqStatus {
    outcome.err().map_or(0, |failure| failure.0.get())
}

/// The texts of the errors of an image, by number, each with a zero at its end.
static IMAGE_TEXTS: [u8; IMAGE_TEXTS_LEN] = {
    let (mut texts, mut at, mut i) = ([0; IMAGE_TEXTS_LEN], 0, 0);
    while i < ImageError::ALL.len() {
        let text = ImageError::ALL[i].text().as_bytes();
        let mut j = 0;
        while j < text.len() {
            texts[at + j] = text[j];
            j += 1;
        }
        at += text.len() + 1;
        i += 1;
    }
    texts
};
const IMAGE_TEXTS_LEN: usize = {
    let (mut len, mut i) = (0, 0);
    while i < ImageError::ALL.len() {
        assert!(ImageError::ALL[i].code() as usize == i + 1, "numbers are successive");
        len += ImageError::ALL[i].text().len() + 1;
        i += 1;
    }
    len
};

/// Returns a text for a status, as a string that ends in a zero; "unknown status" for any other number.
#[unsafe(no_mangle)]
pub extern "C" fn actq_status_text(status: ActqStatus) -> *const c_char {
    let index = usize::try_from(status).unwrap_or(0).wrapping_sub(1);
    if let Some(text) = IMAGE_TEXTS.split_inclusive(|byte| *byte == 0).nth(index) {
        return text.as_ptr().cast();
    }
    let known = Code::ALL.iter().find(|code| **code as ActqStatus == status);
    known.map_or(c"unknown status", |code| code.text()).as_ptr()
}
