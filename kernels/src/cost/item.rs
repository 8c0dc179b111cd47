//! Features that the cost model counts.

use core::fmt;

use crate::image::op;
use crate::layout::{BlockShape, Lanes, QUAD, STRIP, Width};
use crate::math::Function;

/// An item that the cost model counts. Its debug text is Rust source, as in `rates.rs`.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct CostItem(u16);

macro_rules! singles {
    ($($name:ident $text:literal)*) => {
        #[allow(non_camel_case_types, clippy::upper_case_acronyms, reason = "only counts the constants")]
        enum Order { $($name,)* END }
        /// Features that exist once.
        impl CostItem {
            $(#[doc = $text] pub const $name: Self = Self(Order::$name as u16);)*
        }
        /// Names and descriptions of these items.
        const SINGLES: [(&str, &str); Order::END as usize] = [$((stringify!($name), $text),)*];
    };
}
singles! {
    STEP "a step, without its operations and its action"
    OBSERVATION "a value of the observation"
    ACTION "an action"
    ACTION_VALUE "a value of the action"
    CONTRACT "a value of an array of the action contract"
    ENSEMBLE "an action that is an average"
    PREDICTED "an action of a chunk that is added to an average"
    PREDICTED_VALUE "a value of such an action, or of the average"
    KEPT "a chunk whose rest is kept for the next"
    KEPT_VALUE "a value of the kept rest"
    BLENDED "a value of an action that blends into a new chunk"
    LIMITED "a value of an iterate whose predicted sample has a limit"
    NOISY "a value of an iterate that noise is added to"
    DENOISED_REST "a value of an iterate after the last eight"
    NORMALIZED_REST "a value normalized after the last eight"
    FRAME "a frame of a history"
    SQUARED "a value of a norm that decides: whether the robot stands, or whether a quaternion is an orientation"
    POLL_OP "a call that runs one operation"
    POLL "a call that runs pieces"
    ENTERED "an operation that a poll enters"
    PIECE "a piece"
    RESUMED "a block of rows of a linear operation that a poll enters"
    MAGNITUDE_EIGHT "eight values compared by magnitude"
    MAGNITUDE_REST "a value compared by magnitude"
    BIASED "a linear operation that initializes its output before the rows are added"
    ZEROED "an output set to 0 before the rows are added"
    BIAS "an output set to its bias before the rows are added"
    ADDED "an output that its bias is added to before the rows are"
    IN_PLACE "a block of rows in order, whole strips"
    STACK "a block of rows with sums on the stack"
    RUN "a run of rows with sums on the stack"
    SCALED_EIGHT "eight rows scaled by the assembler"
    SCALED_REST "a row in order scaled"
    SCALED_STEPPED "a row with an output step scaled"
}

macro_rules! kinds {
    ($(#[$doc:meta])* $kind:ident { $($name:ident $text:literal)* }) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug)]
        pub(super) enum $kind { $(#[doc = $text] $name,)* }

        impl $kind {
            const ALL: &'static [(Self, &'static str)] = &[$((Self::$name, $text),)*];
        }
    };
}
kinds! {
    /// Items of an operation of each code. A linear operation also has the other items; a function has an item
    /// of its own for its values.
    Operation {
        Once "once"
        Value "a value"
    }
}
kinds! {
    /// Items of attention.
    Attention {
        Keep "keep: once"
        KeptHead "keep: a head of a token"
        KeptValue "keep: a value of a key or a value"
        Attend "attend: once"
        Head "attend: a head of a query"
        QueryWord "attend: four columns of a query"
        Output "attend: a value"
        Score "attend: a token that a head of a query sees"
        KeyWord "attend: four columns of a key"
        ValueRow "attend: two columns of values"
        ValueWord "attend: two columns of two values"
        Rotary "rotary: once"
        RotatedHead "rotary: a head of a token"
        RotatedPair "rotary: two elements"
    }
}
kinds! {
    /// Features of preparing a vector, for each layout.
    Prepare {
        Vector "a vector"
        Group "a group"
        Chunk "a chunk"
        Eight "eight values"
        Filled "a vector that zeros fill up"
        FilledValue "a value of such a vector"
    }
}
kinds! {
    /// Features of a GEMV, for each layout with strips of four and of eight rows.
    Gemv {
        Call "a call"
        Strip "a strip"
        Pass "a pass or group of a strip"
        Chunk "a chunk of a strip"
        Column "a column of a strip"
    }
}
kinds! {
    /// Kinds of scales.
    Scales {
        Rows "rows"
        Groups "groups"
    }
}
kinds! {
    /// Rows of a strip.
    Strips {
        Four "4 rows"
        Eight "8 rows"
    }
}

const _: () = assert!(QUAD == 4 && STRIP == 8);

const OPERATIONS: usize = SINGLES.len();
const FUNCTIONS: usize = OPERATIONS + BEFORE_ATTENTION * Operation::ALL.len();
/// Operations before those of attention, whose items are last: without these, a program has fewer rates.
const BEFORE_ATTENTION: usize = op::KEEP as usize - 1;
const PREPARES: usize = FUNCTIONS + Function::ALL.len();
const GEMVS: usize = PREPARES + LAYOUTS * Prepare::ALL.len();
const ATTENTION: usize = GEMVS + LAYOUTS * Strips::ALL.len() * Gemv::ALL.len();
/// Layouts, each with row scales and with group scales.
const LAYOUTS: usize = Width::ALL.len() * Lanes::DSP.len() * Scales::ALL.len();

impl CostItem {
    /// Number of items.
    pub const COUNT: usize = ATTENTION + if cfg!(feature = "attention") { Attention::ALL.len() } else { 0 };

    /// Iterates over all items.
    pub fn all() -> impl Iterator<Item = Self> {
        (0..Self::COUNT as u16).map(Self)
    }

    /// Returns the item of an operation of this code.
    pub const fn operation(code: u8) -> Self {
        Self::of_code(code, Operation::Once)
    }

    /// Returns the item of a value of an operation of this code.
    pub const fn value(code: u8) -> Self {
        Self::of_code(code, Operation::Value)
    }

    const fn of_code(code: u8, which: Operation) -> Self {
        Self((OPERATIONS + (code as usize).saturating_sub(1) * Operation::ALL.len() + which as usize) as u16)
    }

    pub(super) const fn attention(which: Attention) -> Self {
        Self((ATTENTION + which as usize) as u16)
    }

    /// Returns the item of an element of a function.
    pub const fn function(function: Function) -> Self {
        Self((FUNCTIONS + function as usize) as u16)
    }

    const fn layout(width: Width, lanes: Lanes, scales: Scales) -> usize {
        // Rates are those of a Cortex-M4, whose layouts have lanes.
        let lanes = if matches!(lanes, Lanes::Single) { Lanes::Single } else { Lanes::Paired };
        (width as usize * Lanes::DSP.len() + lanes as usize) * Scales::ALL.len() + scales as usize
    }

    pub(super) const fn prepare(width: Width, lanes: Lanes, scales: Scales, which: Prepare) -> Self {
        Self((PREPARES + Self::layout(width, lanes, scales) * Prepare::ALL.len() + which as usize) as u16)
    }

    pub(super) const fn gemv(width: Width, lanes: Lanes, scales: Scales, strips: Strips, which: Gemv) -> Self {
        let set = Self::layout(width, lanes, scales) * Strips::ALL.len() + strips as usize;
        Self((GEMVS + set * Gemv::ALL.len() + which as usize) as u16)
    }

    pub(super) const fn prepare_of(shape: BlockShape, which: Prepare) -> Self {
        Self::prepare(shape.width, shape.lanes, Scales::of(shape), which)
    }

    pub(super) const fn gemv_of(shape: BlockShape, strips: Strips, which: Gemv) -> Self {
        Self::gemv(shape.width, shape.lanes, Scales::of(shape), strips, which)
    }

    /// Returns the item's index among the rates.
    pub const fn index(self) -> usize {
        self.0 as usize
    }

    /// Returns the kind of the item.
    fn kind(self) -> Option<Kind> {
        let i = self.index();
        let layout = |i: usize| {
            let (lanes, scales) = (i / Scales::ALL.len(), i % Scales::ALL.len());
            let width = *Width::ALL.get(lanes / Lanes::DSP.len())?;
            Some((width, *Lanes::DSP.get(lanes % Lanes::DSP.len())?, Scales::ALL.get(scales)?))
        };
        Some(if let Some(single) = SINGLES.get(i) {
            Kind::Single(single)
        } else if i < FUNCTIONS {
            let (code, which) = ((i - OPERATIONS) / Operation::ALL.len(), (i - OPERATIONS) % Operation::ALL.len());
            Kind::Operation(op::NAMES.get(code)?, Operation::ALL.get(which)?)
        } else if let Some(function) = Function::ALL.get(i - FUNCTIONS) {
            Kind::Function(*function)
        } else if i < GEMVS {
            let i = i - PREPARES;
            Kind::Prepare(layout(i / Prepare::ALL.len())?, Prepare::ALL.get(i % Prepare::ALL.len())?)
        } else if i < ATTENTION {
            let (set, which) = ((i - GEMVS) / Gemv::ALL.len(), (i - GEMVS) % Gemv::ALL.len());
            let strips = Strips::ALL.get(set % Strips::ALL.len())?;
            Kind::Gemv(layout(set / Strips::ALL.len())?, strips, Gemv::ALL.get(which)?)
        } else {
            Kind::Attention(Attention::ALL.get(i - ATTENTION)?)
        })
    }
}

impl Scales {
    const fn of(shape: BlockShape) -> Self {
        if shape.group == 0 { Self::Rows } else { Self::Groups }
    }
}

/// Width, lanes, and scales with their text.
type Layout = (Width, Lanes, &'static (Scales, &'static str));

/// Kind of a [`CostItem`], with texts.
enum Kind {
    Single(&'static (&'static str, &'static str)),
    Operation(&'static str, &'static (Operation, &'static str)),
    Function(Function),
    Prepare(Layout, &'static (Prepare, &'static str)),
    Gemv(Layout, &'static (Strips, &'static str), &'static (Gemv, &'static str)),
    Attention(&'static (Attention, &'static str)),
}

impl fmt::Debug for CostItem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.kind() {
            Some(Kind::Single((name, _))) => write!(f, "CostItem::{name}"),
            Some(Kind::Operation(name, (Operation::Once, _))) => write!(f, "CostItem::operation(op::{name})"),
            Some(Kind::Operation(name, (Operation::Value, _))) => write!(f, "CostItem::value(op::{name})"),
            Some(Kind::Function(function)) => write!(f, "CostItem::function(Function::{function:?})"),
            Some(Kind::Prepare((width, lanes, (scales, _)), (which, _))) => {
                write!(f, "CostItem::prepare({width:?}, {lanes:?}, {scales:?}, Prepare::{which:?})")
            }
            Some(Kind::Gemv((width, lanes, (scales, _)), (strips, _), (which, _))) => {
                write!(f, "CostItem::gemv({width:?}, {lanes:?}, {scales:?}, {strips:?}, Gemv::{which:?})")
            }
            Some(Kind::Attention((which, _))) => write!(f, "CostItem::attention(Attention::{which:?})"),
            None => write!(f, "CostItem({})", self.0),
        }
    }
}

impl fmt::Display for CostItem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let layout = |f: &mut fmt::Formatter<'_>, (width, lanes, (_, scales)): Layout| {
            let lanes = if lanes == Lanes::Paired { "paired" } else { "single" };
            write!(f, "{} bits {lanes} {scales}", width.bits())
        };
        match self.kind() {
            Some(Kind::Single((_, text))) => f.write_str(text),
            Some(Kind::Operation(name, (_, which))) => write!(f, "{name}: {which}"),
            Some(Kind::Function(function)) => write!(f, "an element of {}", function.name()),
            Some(Kind::Prepare(of, (_, which))) => {
                layout(f, of)?;
                write!(f, " prepared: {which}")
            }
            Some(Kind::Gemv(of, (_, strips), (_, which))) => {
                layout(f, of)?;
                write!(f, ", {strips}: {which}")
            }
            Some(Kind::Attention((_, text))) => f.write_str(text),
            None => write!(f, "{self:?}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use std::collections::HashSet;

    use super::*;
    use crate::cost::rates::RATES;

    /// Without a rate, an operation's cost would be too low, and its polls too long.
    #[test]
    fn every_item_has_a_rate() {
        let rated: HashSet<CostItem> = RATES.iter().map(|(item, ..)| *item).collect();
        let missing: Vec<CostItem> = CostItem::all().filter(|item| !rated.contains(item)).collect();
        assert!(missing.is_empty(), "`cargo xtask fit` measures {missing:?}");
    }

    #[test]
    fn names_are_keys_of_the_rates() {
        let text = include_str!("rates.rs");
        for item in CostItem::all() {
            assert_eq!(text.matches(&format!("({item:?}, [")).count(), 1, "{item:?}, {item}");
        }
    }
}
