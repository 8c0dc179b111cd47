//! What a step costs on a Cortex-M4 with FPU (thumbv7em-none-eabihf, zero-wait memory), from the image alone.
//!
//! An operation is described by [`Feature`]s that follow the loops of its code: how often a GEMV is called, strips, passes
//! through a kernel's loop, columns, values prepared, rows scaled, elements of a function. A feature's **rate** says what one of
//! it takes. Rates come from measurements alone: `cargo xtask fit` counts many operations under QEMU, solves for the rates, and
//! writes `cost/rates.rs`.
//!
//! Most code takes the same instructions whatever the values. Where it branches on values (elu, normalize and the action's
//! limits) the expected cost is that of standard normal values, and a third rate says what one element takes at most; pieces of
//! a step ([`crate::Head::poll`]) are measured by that.

#[allow(clippy::approx_constant, reason = "measured values, some of which happen to be near a constant")]
mod rates;

use core::fmt;

use crate::image::{Image, Op, OpKind};
use crate::layout::{BlockShape, Lanes, QUAD, STRIP, Width};
use crate::linear::{Matrix, RUN, RowBlock};
use crate::math::Function;
use crate::x::{Extent, Plan};

/// Instructions, and cycles as the project's model of the Cortex-M4 has them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Cost {
    /// Instructions.
    pub instructions: u64,
    /// Cycles.
    pub cycles: u64,
}

impl core::ops::Add for Cost {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self { instructions: self.instructions + other.instructions, cycles: self.cycles + other.cycles }
    }
}

impl core::iter::Sum for Cost {
    fn sum<I: Iterator<Item = Self>>(costs: I) -> Self {
        costs.fold(Self::default(), |sum, cost| sum + cost)
    }
}

/// Something that an operation has a number of; indexes the rates.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Feature(u16);

macro_rules! singles {
    ($($name:ident $text:literal)*) => {
        #[allow(non_camel_case_types, clippy::upper_case_acronyms, reason = "only counts the constants")]
        enum Order { $($name,)* END }
        /// The features that exist once.
        impl Feature {
            $(#[doc = $text] pub const $name: Self = Self(Order::$name as u16);)*
        }
        const SINGLES: [&str; Order::END as usize] = [$($text,)*];
    };
}
singles! {
    STEP "a step, with its operations and its action aside"
    OBSERVATION "a value of the observation"
    ACTION "an action"
    ACTION_VALUE "a value of the action"
    CONTRACT "a value of an array of the action contract"
    POLL_OP "a call that runs one operation"
    POLL "a call that runs pieces"
    ENTERED "an operation that a poll comes to"
    PIECE "a piece"
    LINEAR "a linear operation"
    RESUMED "a block of rows of a linear operation that a poll comes to"
    MAGNITUDE_EIGHT "eight values compared by magnitude"
    MAGNITUDE_REST "a value compared by magnitude"
    CHECKED "a block of rows whose order is looked at"
    BIASED "a linear operation that sets its output up before the rows are added"
    ZEROED "an output set to 0 before the rows are added"
    BIAS "an output set to its bias before the rows are added"
    IN_PLACE "a block of rows in order, whole strips"
    STACK "a block of rows with sums on the stack"
    RUN "a run of rows with sums on the stack"
    SCALED_EIGHT "eight rows scaled by the assembler"
    SCALED_REST "a row in order scaled"
    SCALED_INDEXED "a row with an index scaled"
    NORMALIZE "a normalization"
    NORMALIZE_VALUE "a value normalized"
    LAYER_NORM "a layer norm"
    LAYER_NORM_VALUE "a value of a layer norm"
    RMS_NORM "an RMS norm"
    RMS_NORM_VALUE "a value of an RMS norm"
    ADD "an addition"
    ADD_VALUE "a value added"
    COPY "a copy"
    COPY_VALUE "a value copied"
    LSTM "an LSTM cell"
    LSTM_VALUE "an element of an LSTM cell"
    GRU "a GRU cell"
    GRU_VALUE "an element of a GRU cell"
    FUNCTION "a function's operation"
}

const FUNCTIONS: usize = SINGLES.len();
const PREPARES: usize = FUNCTIONS + Function::ALL.len();
const KERNELS: usize = PREPARES + LAYOUTS * PREPARE.len();
const LAYOUTS: usize = 16;
/// Features of preparing a vector, for each layout.
const PREPARE: [&str; 6] =
    ["a vector", "a group", "a chunk", "eight values", "a vector that zeros fill up", "a value of such a vector"];
/// Features of a GEMV, for each layout with strips of four and of eight rows.
const KERNEL: [&str; 5] =
    ["a call", "a strip", "a pass or group of a strip", "a chunk of a strip", "a column of a strip"];

impl Feature {
    /// How many there are.
    pub const COUNT: usize = KERNELS + 2 * LAYOUTS * KERNEL.len();

    /// All of them.
    pub fn all() -> impl Iterator<Item = Self> {
        (0..Self::COUNT as u16).map(Self)
    }

    /// An element of a function.
    pub const fn function(function: Function) -> Self {
        Self(FUNCTIONS as u16 + function as u16)
    }

    const fn layout(shape: BlockShape) -> u16 {
        (shape.width as u16 * 2 + shape.lanes as u16) * 2 + (shape.group != 0) as u16
    }

    const fn prepare(shape: BlockShape, which: u16) -> Self {
        Self(PREPARES as u16 + Self::layout(shape) * PREPARE.len() as u16 + which)
    }

    const fn kernel(shape: BlockShape, eight: bool, which: u16) -> Self {
        Self(KERNELS as u16 + (2 * Self::layout(shape) + eight as u16) * KERNEL.len() as u16 + which)
    }

    /// Its place among the rates.
    pub const fn index(self) -> usize {
        self.0 as usize
    }

    /// Instructions that one of it takes at most, in 1024ths.
    pub(crate) fn most(self) -> u32 {
        MOST.get(self.index()).copied().unwrap_or(0)
    }
}

impl fmt::Display for Feature {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let i = self.index();
        let layout = |f: &mut fmt::Formatter<'_>, layout: usize| {
            let [width, lanes] = [layout / 4, layout / 2 % 2];
            let bits = Width::ALL.get(width).map_or(0, |w| w.bits());
            let lanes = if lanes == Lanes::Paired as usize { "paired" } else { "single" };
            write!(f, "{bits} bits {lanes} {}", if layout % 2 == 1 { "groups" } else { "rows" })
        };
        if let Some(text) = SINGLES.get(i) {
            f.write_str(text)
        } else if let Some(function) = Function::ALL.get(i - FUNCTIONS) {
            write!(f, "an element of {}", function.name())
        } else if i < KERNELS {
            let i = i - PREPARES;
            layout(f, i / PREPARE.len())?;
            write!(f, " prepared: {}", PREPARE.get(i % PREPARE.len()).unwrap_or(&""))
        } else {
            let i = i - KERNELS;
            let set = i / KERNEL.len();
            layout(f, set / 2)?;
            let rows = [QUAD, STRIP][set % 2];
            write!(f, ", {rows} rows: {}", KERNEL.get(i % KERNEL.len()).unwrap_or(&""))
        }
    }
}

/// 1024ths of an instruction or a cycle.
const ONE: f64 = 1024.0;

/// A column of the measured rates, in 1024ths.
const fn column(which: usize) -> [u32; Feature::COUNT] {
    let mut column = [0; Feature::COUNT];
    let mut i = 0;
    // Features that were added since the last fit count nothing until the next.
    while i < rates::RATES.len() && i < Feature::COUNT {
        let rate = rates::RATES[i][which] * ONE;
        column[i] = if rate < 0.0 { 0 } else { (rate + 0.5) as u32 };
        i += 1;
    }
    column
}

/// Expected instructions, expected cycles, instructions at most.
static INSTRUCTIONS: [u32; Feature::COUNT] = column(0);
static CYCLES: [u32; Feature::COUNT] = column(1);
static MOST: [u32; Feature::COUNT] = column(2);

/// The cost of features, which `list` counts.
fn total(list: impl FnOnce(&mut dyn FnMut(Feature, usize))) -> Cost {
    let mut sums = [0u64; 2];
    list(&mut |feature, count| {
        for (sum, rates) in sums.iter_mut().zip([&INSTRUCTIONS, &CYCLES]) {
            *sum += count as u64 * u64::from(rates.get(feature.index()).copied().unwrap_or(0));
        }
    });
    let [instructions, cycles] = sums.map(|sum| (sum + ONE as u64 / 2) / ONE as u64);
    Cost { instructions, cycles }
}

/// What the features of `list` take at most, in 1024ths of an instruction.
pub(crate) fn most(list: impl FnOnce(&mut dyn FnMut(Feature, usize))) -> u32 {
    let mut sum = 0u32;
    list(&mut |feature, count| sum = sum.saturating_add((count as u32).saturating_mul(feature.most())));
    sum
}

/// The cost of an operation within a step.
pub fn of_op(op: &Op<'_>) -> Cost {
    total(|add| features(op, add))
}

/// The cost of a step that evaluates the network; steps that play on from a chunk cost the same without the operations.
pub fn of_step(image: &Image<'_>) -> Cost {
    of_frame(image) + image.ops().map(|op| of_op(&op)).sum()
}

/// The cost of a step without the network's operations.
pub fn of_frame(image: &Image<'_>) -> Cost {
    total(|add| frame(image, add))
}

/// The features of a step without the network's operations.
pub fn frame(image: &Image<'_>, add: &mut dyn FnMut(Feature, usize)) {
    begin(image, add);
    action(image, add);
}

/// The features of taking the observation.
pub fn begin(image: &Image<'_>, add: &mut dyn FnMut(Feature, usize)) {
    add(Feature::STEP, 1);
    add(Feature::OBSERVATION, image.obs_len());
}

/// The features of the way from the network's output to the action.
pub fn action(image: &Image<'_>, add: &mut dyn FnMut(Feature, usize)) {
    add(Feature::ACTION, 1);
    add(Feature::ACTION_VALUE, image.act_len());
    add(Feature::CONTRACT, image.contract_arrays().iter().map(|array| array.len()).sum());
}

/// The features of an operation.
pub fn features(op: &Op<'_>, add: &mut dyn FnMut(Feature, usize)) {
    if let (OpKind::Linear { accumulate }, Some(matrix)) = (op.kind, op.matrix()) {
        linear(&matrix, accumulate, add);
    } else {
        let (operation, value, len) = values(op);
        add(operation, 1);
        add(value, len);
    }
}

/// The features of an operation that is not linear: its own, that of its values, and how many those are.
pub fn values(op: &Op<'_>) -> (Feature, Feature, usize) {
    let (operation, value) = match op.kind {
        OpKind::Normalize => (Feature::NORMALIZE, Feature::NORMALIZE_VALUE),
        OpKind::Function(function) => (Feature::FUNCTION, Feature::function(function)),
        OpKind::LayerNorm => (Feature::LAYER_NORM, Feature::LAYER_NORM_VALUE),
        OpKind::RmsNorm => (Feature::RMS_NORM, Feature::RMS_NORM_VALUE),
        OpKind::Add => (Feature::ADD, Feature::ADD_VALUE),
        OpKind::Copy => (Feature::COPY, Feature::COPY_VALUE),
        OpKind::LstmCell => (Feature::LSTM, Feature::LSTM_VALUE),
        OpKind::GruCell => (Feature::GRU, Feature::GRU_VALUE),
        // Its parts are counted one by one.
        OpKind::Linear { .. } => return (Feature::LINEAR, Feature::LINEAR, 0),
    };
    (operation, value, op.dst().len)
}

fn linear(matrix: &Matrix<'_>, accumulate: bool, add: &mut dyn FnMut(Feature, usize)) {
    let start = matrix.start_values(accumulate).is_some();
    add(Feature::LINEAR, 1);
    magnitude(matrix.cols, add);
    if !(accumulate || matrix.bias.is_empty()) {
        let in_order = matrix.blocks().take_while(|rows| rows.index.is_empty()).count();
        add(Feature::CHECKED, matrix.block_count().min(in_order + 1));
    }
    if !start {
        add(Feature::BIASED, 1);
        add(Feature::ZEROED, if accumulate { 0 } else { matrix.rows });
        add(Feature::BIAS, matrix.bias.len());
    }
    let mut last = None;
    for rows in matrix.blocks() {
        let shape = rows.block.shape();
        if last != Some(shape.width) {
            prepare(shape, add);
            last = Some(shape.width);
        }
        block(&rows, start, add);
    }
}

/// Coming to an operation, at its start or in its midst.
pub(crate) fn enter(op: &Op<'_>, add: &mut dyn FnMut(Feature, usize)) {
    add(Feature::ENTERED, 1);
    add(values(op).0, 1);
    if let Some(matrix) = op.matrix() {
        add(Feature::RESUMED, matrix.block_count());
    }
}

/// Finding the scale of an input.
pub(crate) fn magnitude(cols: usize, add: &mut dyn FnMut(Feature, usize)) {
    add(Feature::MAGNITUDE_EIGHT, cols / 8);
    add(Feature::MAGNITUDE_REST, cols % 8);
}

/// Blocks in an image have valid shapes.
fn extent(shape: BlockShape) -> Extent {
    Plan::new(shape).map(|plan| plan.extent()).unwrap_or_default()
}

/// Preparing an input for blocks of this shape.
pub(crate) fn prepare(shape: BlockShape, add: &mut dyn FnMut(Feature, usize)) {
    let Extent { columns, groups, chunks, .. } = extent(shape);
    let filled = columns != shape.cols;
    let counts: [usize; PREPARE.len()] =
        [1, groups, chunks, columns / 8, usize::from(filled), if filled { columns } else { 0 }];
    for (which, count) in (0..).zip(counts) {
        add(Feature::prepare(shape, which), count);
    }
}

/// The products of a block's rows, and their scaling. `start`: whether the output starts from the biases.
fn block(rows: &RowBlock<'_>, start: bool, add: &mut dyn FnMut(Feature, usize)) {
    let shape = rows.block.shape();
    let in_order = rows.index.is_empty();
    let whole = match (in_order && start, shape.rows.is_multiple_of(QUAD)) {
        (false, _) => 0,
        (true, true) => shape.rows,
        (true, false) => shape.rows & !(STRIP - 1),
    };
    if whole > 0 {
        add(Feature::IN_PLACE, 1);
        add(Feature::SCALED_EIGHT, whole / STRIP);
        add(Feature::SCALED_REST, whole % STRIP);
        products(shape, whole, 1, add);
    }
    let left = shape.rows - whole;
    if left > 0 {
        let runs = left.div_ceil(RUN);
        add(Feature::STACK, 1);
        add(Feature::RUN, runs);
        products(shape, left, runs, add);
        if in_order {
            add(Feature::SCALED_EIGHT, left / STRIP);
            add(Feature::SCALED_REST, left % STRIP);
        } else {
            add(Feature::SCALED_INDEXED, left);
        }
    }
}

/// GEMVs of so many rows in so many calls.
pub(crate) fn products(shape: BlockShape, rows: usize, calls: usize, add: &mut dyn FnMut(Feature, usize)) {
    let quads = rows.div_ceil(QUAD);
    let eights = if shape.strip_rows() == STRIP { quads / 2 } else { 0 };
    let extent = extent(shape);
    for (eight, strips) in [(true, eights), (false, quads - 2 * eights)] {
        if strips > 0 {
            // In a strip of four at the end of strips of eight, only the last call is one of its kind.
            let calls = if eight || eights == 0 { calls } else { 1 };
            let chunks = if shape.group == 0 { extent.chunks } else { 0 };
            let columns = shape.units() * shape.cell_cols();
            let counts: [usize; KERNEL.len()] =
                [calls, strips, strips * extent.passes, strips * chunks, strips * columns];
            for (which, count) in (0..).zip(counts) {
                add(Feature::kernel(shape, eight, which), count);
            }
        }
    }
}

/// What a strip's worth of a block's rows ([`STRIP`]) takes at most, and what its rows take once in every piece, in 1024ths of
/// an instruction.
pub(crate) fn strips(rows: &RowBlock<'_>, start: bool) -> (u32, u32) {
    let shape = rows.block.shape();
    let in_order = rows.index.is_empty();
    let row = if in_order { Feature::SCALED_REST } else { Feature::SCALED_INDEXED };
    let first = most(|add| {
        // The last piece may end with a run of its own for the rest of the rows.
        add(Feature::IN_PLACE, 1);
        add(Feature::STACK, 1);
        add(Feature::RUN, 1);
        for eight in [true, false] {
            add(Feature::kernel(shape, eight, 0), 1);
        }
        if in_order {
            add(row, STRIP - 1);
        }
    });
    let each = most(|add| {
        products(shape, STRIP, 0, add);
        match (in_order, start) {
            (true, true) => add(Feature::SCALED_EIGHT, 1),
            (true, false) => {
                add(Feature::SCALED_EIGHT, 1);
                add(Feature::RUN, 1);
            }
            (false, _) => {
                add(row, STRIP);
                add(Feature::RUN, 1);
            }
        }
    });
    (first, each)
}
