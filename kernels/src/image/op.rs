//! The operations, and a table of them: codes, names, the data that each needs, and the feature that has it.

use core::mem::discriminant;

use super::header as h;
use super::words::{high, low};
use crate::error::ImageError;
use crate::math::Function;

/// The function of an operation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OpKind {
    /// `dst = clamp((clamp(src, ±pre_clip) - mean) * scale, ±clip)`. Constants: `pre_clip`, `clip`, infinite for no
    /// limit; arrays: `mean`, `scale`, the reciprocals of the standard deviation.
    Normalize {
        /// `true` if the quantizer added it to balance the matrices that read it: then its constants count among their
        /// bytes. Nothing else depends on it.
        added: bool,
    },
    /// `dst = W src + b`
    Linear {
        /// `dst += W src + b` instead.
        accumulate: bool,
        /// The input is prepared in its own place, not in the work area: it is lost, and `dst` may begin in `src` after the
        /// prepared words.
        in_place: bool,
    },
    /// `dst = f(dst)`
    Function(Function),
    /// `dst = layer_norm(dst)`. Constant: the epsilon added to the variance; arrays: weights, biases.
    LayerNorm,
    /// `dst = rms_norm(dst)`. Constant: the epsilon added to the mean square; array: weights.
    RmsNorm,
    /// `dst += src`
    Add,
    /// `dst = src`
    Copy,
    /// An LSTM cell: `src` holds the four gates `[i f g o]`, `dst` is the hidden state, `third` the cell state.
    LstmCell,
    /// A GRU cell: `src` holds `W_ih x + b_ih`, `third` holds `W_hh h + b_hh`, each of gates `[r z n]`, `dst` is the
    /// state.
    GruCell,
    /// `dst *= src`
    Mul,
    /// `dst` = noise, from the caller or from the head's generator.
    Noise,
    /// `dst` = the array of this denoising step. Arrays: one for each denoising step.
    Table,
    /// A denoising step ([`crate::ops::denoise`]) of the iterate `dst` by the network's output `src`; `third` is the
    /// network's next input. Constants: the limit of the predicted sample, infinite for none; the arena offset of the
    /// first step's noise, or 0; the coefficients of each step.
    Denoise,
    /// `dst`, a cache ([`crate::ops::attention`]), takes the keys in `src` and the values in `third`. Data: its sizes.
    #[cfg(feature = "attention")]
    Keep,
    /// `dst` = the outputs of attention of the queries in `src` to the cache in `third`. Data: its sizes, the factor of the
    /// scores.
    #[cfg(feature = "attention")]
    Attend,
    /// `dst` = `dst` with rotary positions ([`crate::ops::attention`]). Data: heads and the dimension of a head, then for
    /// each token the cosines and the sines of its angles.
    #[cfg(feature = "attention")]
    Rotary,
    /// `dst[i] = src[index[i]]`. Data: the length of `src`, 1 if `src` is a quaternion whose length must be near 1, the
    /// indices.
    Select,
    /// `dst = clamp(dst, src, third)`, element by element.
    Clip,
    /// `dst` = an array of constants.
    Constant,
    /// `dst` = the array in the first step after a reset; in later ones it keeps its values. `third` is one word.
    Initial,
    /// `dst` = the next row of a table, once in each step. `third` is one word. Data: the rows, the one of the first
    /// step, the one after the last.
    TableRow,
    /// `dst` = an array if the norm of each group of `src` is below a limit. Then [`Self::TableRow`] with the same `third`
    /// continues at row 0. Data: the groups, the limit's square.
    Standstill,
    /// `dst` = frames of several steps, of which `src` is the newest; `third` keeps the others in a ring. Data: its
    /// sizes.
    History,
}

/// An operation around a network ([`crate::ops::around`]): see [`OpKind`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Around {
    Select,
    Clip,
    Constant,
    Initial,
    TableRow,
    Standstill,
    History,
}

impl OpKind {
    /// Returns `true` if the operation differs between denoising steps.
    pub(super) fn is_of_step(self) -> bool {
        cfg!(feature = "flow") && matches!(self, Self::Table | Self::Denoise)
    }

    /// Returns `true` for an operation of attention (`crate::ops::attention`).
    #[inline(always)]
    pub(crate) fn is_attention(self) -> bool {
        #[cfg(feature = "attention")]
        return matches!(self, Self::Keep | Self::Attend | Self::Rotary);
        #[cfg(not(feature = "attention"))]
        false
    }

    /// Returns the operation around a network; `None` for all others, and in a build without these operations.
    #[inline(always)]
    pub(crate) fn around(self) -> Option<Around> {
        if !cfg!(feature = "around") {
            return None;
        }
        Some(match self {
            Self::Select => Around::Select,
            Self::Clip => Around::Clip,
            Self::Constant => Around::Constant,
            Self::Initial => Around::Initial,
            Self::TableRow => Around::TableRow,
            Self::Standstill => Around::Standstill,
            Self::History => Around::History,
            // No wildcard: a new operation is decided on here.
            Self::Normalize { .. }
            | Self::Linear { .. }
            | Self::Function(_)
            | Self::LayerNorm
            | Self::RmsNorm
            | Self::Add
            | Self::Copy
            | Self::LstmCell
            | Self::GruCell
            | Self::Mul
            | Self::Noise
            | Self::Table
            | Self::Denoise => return None,
            #[cfg(feature = "attention")]
            Self::Keep | Self::Attend | Self::Rotary => return None,
        })
    }

    fn form(self) -> Option<&'static Form> {
        FORMS.iter().find(|form| discriminant(&form.kind) == discriminant(&self))
    }

    /// Returns the operation code; 0 if the build leaves the operation out.
    pub(crate) fn code(self) -> u8 {
        self.form().map_or(0, |form| form.code)
    }

    fn texts(self) -> [&'static str; 2] {
        TEXTS.get(usize::from(self.code()).wrapping_sub(1)).copied().unwrap_or_default()
    }

    /// Returns a human-readable name; each function has its own.
    pub fn name(self) -> &'static str {
        match self {
            Self::Function(function) => function.name(),
            kind => kind.texts()[0],
        }
    }

    /// Returns a human-readable name of the single constants, or of the third region of an operation without
    /// constants; empty if a report need not show them.
    pub fn label(self) -> &'static str {
        self.texts()[1]
    }

    /// Returns `true` if the operation takes these bits as a single constant: above 0, and finite except for limits.
    #[inline(always)]
    pub(super) fn takes(self, constant: u32) -> bool {
        // Positive numbers have the order of their bits.
        let infinity = f32::INFINITY.to_bits() + u32::from(matches!(self, Self::Normalize { .. }));
        constant.wrapping_sub(1) < infinity - 1
    }
}

/// An operation's entry in the table. Its alignment makes it three words, which are quick to index and to read.
#[derive(Clone, Copy, Debug)]
#[repr(align(4))]
pub(super) struct Form {
    /// Operation code.
    pub(super) code: u8,
    /// Kind with the detail 0.
    pub(super) kind: OpKind,
    pub(super) uses: Uses,
    /// `false` if the build leaves the operation out.
    pub(super) built: bool,
}

/// The data of an operation, in lengths of `dst`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Uses {
    /// Highest detail. (For a function, [`Function::from_code`] decides.)
    pub(super) max_detail: u8,
    /// Lengths of `src` and of the third region; 0 for none. (Linear has its own length.)
    pub(super) src: u8,
    pub(super) third: u8,
    /// Single constants, and arrays after them. (A table has one array for each denoising step, a row one for each
    /// row.)
    pub(super) constants: u8,
    pub(super) arrays: u8,
    /// Passes over the elements; a slice may end inside each of them.
    pub(super) passes: u8,
    /// `true` if the operation reads `dst`. (For linear, the detail decides.)
    pub(super) reads_dst: bool,
}

impl Uses {
    /// Only the destination, in one pass.
    const NONE: Self = Self { max_detail: 0, src: 0, third: 0, constants: 0, arrays: 0, passes: 1, reads_dst: false };
}

impl Form {
    /// Returns `true` if a record's last three words have bits that the operation does not use.
    pub(super) fn has_unused(&self, [places, lengths, data]: [u32; 3]) -> bool {
        let uses = &self.uses;
        let is_linear = matches!(self.kind, OpKind::Linear { .. });
        uses.src == 0 && high(places) != 0
            || !is_linear && (low(lengths) != 0 || uses.third == 0 && high(lengths) != 0)
            || !is_linear && uses.constants | uses.arrays == 0 && data != 0
    }
}

/// The kinds of attention. A build without it has no code for them, not even to refuse them: the others take their place
/// in the table.
#[cfg(feature = "attention")]
const ATTENTION: [OpKind; 3] = [OpKind::Keep, OpKind::Attend, OpKind::Rotary];
#[cfg(not(feature = "attention"))]
const ATTENTION: [OpKind; 3] = [OpKind::Copy; 3];

macro_rules! operations {
    ($($(#[$doc:meta])* $NAME:ident = $code:literal $text:literal $($label:literal)?: $kind:expr, $uses:expr $(, if $feature:literal)?;)*) => {
        $($(#[$doc])* pub const $NAME: u8 = $code;)*

        /// The names of the codes above, from code 1 on.
        pub(crate) const NAMES: &[&str] = &[$(stringify!($NAME)),*];

        /// Human-readable names, and what they call their constants and third region.
        static TEXTS: [[&str; 2]; NAMES.len()] = [$([$text, concat!($($label)?)]),*];

        /// Returns the feature of this crate with the operation of a code; empty if every build has it.
        pub(super) const fn feature(code: u8) -> &'static str {
            match code {
                $($NAME => concat!($($feature)?),)*
                _ => "",
            }
        }

        /// By operation code, from 1 up to the last that the build has.
        pub(super) static FORMS: [Form; BUILT] = {
            let all = [$(Form { code: $NAME, kind: $kind, uses: $uses, built: true $(&& cfg!(feature = $feature))? }),*];
            *all.split_at(BUILT).0.first_chunk().expect("all of them are more")
        };

        /// The last code of an operation that the build has.
        const BUILT: usize = {
            let built = [$(true $(&& cfg!(feature = $feature))?),*];
            let mut last = built.len();
            while !built[last - 1] {
                last -= 1;
            }
            last
        };

        /// The error of a code that the build does not know. A build without the last operations takes it for one of
        /// theirs.
        pub(super) const UNKNOWN: ImageError =
            if BUILT < NAMES.len() { ImageError::LeftOut } else { ImageError::Op };

        /// `true` if the build leaves an operation before its last one out.
        pub(super) const IS_PARTIAL: bool = {
            let (built, mut all, mut i) = ([$(true $(&& cfg!(feature = $feature))?),*], true, 0);
            while i < BUILT {
                all &= built[i];
                i += 1;
            }
            !all
        };

        const _: () = {
            let codes = [$($NAME),*];
            let mut i = 0;
            while i < codes.len() {
                assert!(codes[i] as usize == i + 1);
                i += 1;
            }
        };
    };
}
operations! {
    /// [`OpKind::Normalize`]
    NORMALIZE = 1 "normalize" "clip": OpKind::Normalize { added: false }, Uses { max_detail: 1, src: 1, constants: 2, arrays: 2, ..Uses::NONE };
    /// [`OpKind::Linear`]
    LINEAR = 2 "linear": OpKind::Linear { accumulate: false, in_place: false }, Uses { max_detail: 3, src: 1, ..Uses::NONE };
    /// [`OpKind::Function`]
    FUNCTION = 3 "function": OpKind::Function(Function::Relu), Uses { max_detail: u8::MAX, reads_dst: true, ..Uses::NONE };
    /// [`OpKind::LayerNorm`]
    LAYER_NORM = 4 "layernorm" "eps": OpKind::LayerNorm, Uses { constants: 1, arrays: 2, passes: 3, reads_dst: true, ..Uses::NONE }, if "norm";
    /// [`OpKind::RmsNorm`]
    RMS_NORM = 5 "rmsnorm" "eps": OpKind::RmsNorm, Uses { constants: 1, arrays: 1, passes: 2, reads_dst: true, ..Uses::NONE }, if "norm";
    /// [`OpKind::Add`]
    ADD = 6 "add": OpKind::Add, Uses { src: 1, reads_dst: true, ..Uses::NONE };
    /// [`OpKind::Copy`]
    COPY = 7 "copy": OpKind::Copy, Uses { src: 1, ..Uses::NONE };
    /// [`OpKind::LstmCell`]
    LSTM_CELL = 8 "lstm cell" "cell": OpKind::LstmCell, Uses { src: 4, third: 1, ..Uses::NONE }, if "recurrent";
    /// [`OpKind::GruCell`]
    GRU_CELL = 9 "gru cell" "gates": OpKind::GruCell, Uses { src: 3, third: 3, reads_dst: true, ..Uses::NONE }, if "recurrent";
    /// [`OpKind::Mul`]
    MUL = 10 "mul": OpKind::Mul, Uses { src: 1, reads_dst: true, ..Uses::NONE };
    /// [`OpKind::Noise`]
    NOISE = 11 "noise": OpKind::Noise, Uses::NONE, if "flow";
    /// [`OpKind::Table`]
    TABLE = 12 "table": OpKind::Table, Uses { arrays: 1, ..Uses::NONE }, if "flow";
    /// [`OpKind::Denoise`]
    DENOISE = 13 "denoise": OpKind::Denoise, Uses { src: 1, third: 1, constants: h::DENOISE_WORDS as u8, reads_dst: true, ..Uses::NONE }, if "flow";
    /// [`OpKind::Select`], whose data has the length of `src`.
    SELECT = 14 "select": OpKind::Select, Uses { src: 1, arrays: 1, ..Uses::NONE }, if "around";
    /// [`OpKind::Clip`]
    CLIP = 15 "clip" "high": OpKind::Clip, Uses { src: 1, third: 1, reads_dst: true, ..Uses::NONE }, if "around";
    /// [`OpKind::Constant`]
    CONSTANT = 16 "constant": OpKind::Constant, Uses { arrays: 1, ..Uses::NONE }, if "around";
    /// [`OpKind::Initial`], whose third region is one word.
    INITIAL = 17 "initial": OpKind::Initial, Uses { third: 1, arrays: 1, reads_dst: true, ..Uses::NONE }, if "around";
    /// [`OpKind::TableRow`], whose third region is one word.
    TABLE_ROW = 18 "table_row": OpKind::TableRow, Uses { third: 1, constants: 2, arrays: 1, ..Uses::NONE }, if "around";
    /// [`OpKind::Standstill`], whose data has the length of `src`, and whose third region is one word.
    STANDSTILL = 19 "standstill": OpKind::Standstill, Uses { src: 1, third: 1, constants: 2, arrays: 1, reads_dst: true, ..Uses::NONE }, if "around";
    /// [`OpKind::History`], whose data has the lengths of `src` and of the third region.
    HISTORY = 20 "history": OpKind::History, Uses { src: 1, third: 1, constants: 3, ..Uses::NONE }, if "around";
    /// `OpKind::Keep`, whose data has the lengths of `src` and of the third region.
    KEEP = 21 "keep" "values": ATTENTION[0], Uses { src: 1, third: 1, constants: 2, ..Uses::NONE }, if "attention";
    /// `OpKind::Attend`, whose data has the length of the third region.
    ATTEND = 22 "attend" "cache": ATTENTION[1], Uses { src: 1, third: 1, constants: 4, ..Uses::NONE }, if "attention";
    /// `OpKind::Rotary`, whose data has a word of sizes, then half a head of cosines and of sines for each token.
    ROTARY = 23 "rotary": ATTENTION[2], Uses { constants: 1, reads_dst: true, ..Uses::NONE }, if "attention";
}
