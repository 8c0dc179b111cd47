//! The cost of a step on a core, from the image alone: a Cortex-M4 with FPU (thumbv7em-none-eabihf, zero-wait memory), or
//! for a writer any of [`Core::ALL`].
//!
//! [`CostItem`]s describe an operation by the loops of its code: calls of a GEMV, strips, passes through a kernel's
//! loop, columns, prepared values, scaled rows, elements of a function. An item's **rate** is the cost of one of it.
//! Rates come from measurements: `cargo xtask fit` counts the instructions of many operations in QEMU, solves for the
//! rates, and writes `rates.rs`.
//!
//! Most code takes the same instructions for all values. Some code branches on values (elu and the action's limits):
//! its expected cost is that of standard normal values. A third rate is the most that one element takes; slices
//! ([`crate::Head::poll`]) use it.
//!
//! Only this module knows costs: code that runs an image asks a `Meter` (`meter.rs`), and a program without slices
//! does not include them.

pub(crate) mod budget;
#[cfg(all(feature = "writer", feature = "scalar", feature = "helium"))]
mod cores;
mod item;
#[allow(clippy::approx_constant, reason = "measured values, some of which happen to be near a constant")]
mod rates;
#[cfg(all(feature = "writer", feature = "scalar"))]
mod scalar;

#[cfg(all(feature = "writer", feature = "scalar", feature = "helium"))]
pub use self::cores::{CORES, Core, rates_of};
#[cfg(feature = "attention")]
use self::item::Attention;
pub use self::item::CostItem;
use self::item::{Gemv, Prepare, Strips};
use self::rates::RATES;
use crate::activations::{Extent, Plan};
use crate::image::op;
use crate::image::{Image, Matrix, Op, OpKind};
use crate::layout::{BlockShape, QUAD, STRIP};
use crate::meter::{OutputStart, RUN};

/// Modelled instructions and cycles of a Cortex-M4.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(not(feature = "writer"), non_exhaustive)]
pub struct Cost {
    /// Modelled instructions.
    pub instructions: u64,
    /// Modelled cycles.
    pub cycles: u64,
}

impl core::ops::Add for Cost {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self { instructions: self.instructions + other.instructions, cycles: self.cycles + other.cycles }
    }
}

impl core::ops::Mul<u64> for Cost {
    type Output = Self;

    fn mul(self, times: u64) -> Self {
        Self { instructions: self.instructions * times, cycles: self.cycles * times }
    }
}

impl core::iter::Sum for Cost {
    fn sum<I: Iterator<Item = Self>>(costs: I) -> Self {
        costs.fold(Self::default(), |sum, cost| sum + cost)
    }
}

/// 1024ths of an instruction or a cycle.
const ONE: f64 = 1024.0;

/// Returns a column of the measured rates, in 1024ths. An item that has been added since the last fit costs nothing.
const fn column(which: usize) -> [u32; CostItem::COUNT] {
    let (mut column, mut rated) = ([0; CostItem::COUNT], [false; CostItem::COUNT]);
    let mut i = 0;
    while i < RATES.len() {
        let (item, rates, _) = RATES[i];
        i += 1;
        // A build without attention has none of its items.
        if item.index() >= CostItem::COUNT {
            continue;
        }
        assert!(!rated[item.index()], "rates.rs has an item twice");
        rated[item.index()] = true;
        column[item.index()] = in_1024ths(rates[which]);
    }
    column
}

/// Converts a rate to 1024ths; negative ones count as 0.
const fn in_1024ths(rate: f64) -> u32 {
    if rate < 0.0 { 0 } else { (rate * ONE + 0.5) as u32 }
}

/// Expected instructions of each item, in 1024ths.
static INSTRUCTIONS: [u32; CostItem::COUNT] = column(0);
static CYCLES: [u32; CostItem::COUNT] = column(1);
static MOST: [u32; CostItem::COUNT] = column(2);

impl CostItem {
    /// Returns the most instructions that one of this item takes, in 1024ths.
    pub(super) fn most(self) -> u32 {
        MOST.get(self.index()).copied().unwrap_or(0)
    }
}

/// Modelled costs of one of each item on a core.
#[derive(Clone, Copy, Debug)]
pub struct Rates {
    /// Instructions, in 1024ths.
    instructions: &'static [u32; CostItem::COUNT],
    /// Cycles, in 1024ths.
    cycles: &'static [u32; CostItem::COUNT],
}

impl Rates {
    /// Those of a Cortex-M4 with FPU.
    pub const M4F: Self = Self { instructions: &INSTRUCTIONS, cycles: &CYCLES };

    /// Computes the cost of the items that `list` counts.
    fn total(self, list: impl FnOnce(&mut dyn FnMut(CostItem, usize))) -> Cost {
        let mut sums = [0u64; 2];
        list(&mut |item, count| {
            for (sum, rates) in sums.iter_mut().zip([self.instructions, self.cycles]) {
                *sum += count as u64 * u64::from(rates.get(item.index()).copied().unwrap_or(0));
            }
        });
        let [instructions, cycles] = sums.map(|sum| (sum + ONE as u64 / 2) / ONE as u64);
        Cost { instructions, cycles }
    }

    /// Computes the cost of an operation in a step.
    pub fn of_op(self, op: &Op<'_>) -> Cost {
        self.total(|add| items(op, add))
    }

    /// Computes the cost of a linear operation with biases, from `cols` values to `rows`, whose blocks have these shapes,
    /// each of another width. `in_order` is `false` if they have output steps. If it accumulates, its output is added to,
    /// without biases.
    pub fn of_linear(
        self,
        [rows, cols]: [usize; 2],
        blocks: impl IntoIterator<Item = BlockShape>,
        in_order: bool,
        accumulate: bool,
    ) -> Cost {
        self.total(|add| {
            let in_place = in_order && !accumulate;
            begin_linear([rows, cols], (!in_place).then(|| OutputStart::of(accumulate, !accumulate)), add);
            for shape in blocks {
                prepare(shape, add);
                block(shape, in_order, in_place, add);
            }
        })
    }

    /// Computes the cost of the elements of an operation that has no matrix, or of the units of a cell.
    pub fn of_elements(self, kind: OpKind, len: usize) -> Cost {
        self.total(|add| {
            add(value(kind, kind.code()), len);
            rest(kind, len % EIGHT, add);
        })
    }

    /// Computes the cost of a step that evaluates the network. A step that continues a chunk costs the same without the
    /// operations.
    pub fn of_step(self, image: &Image<'_>) -> Cost {
        let times = |i: usize| if i < image.first_denoising_op() { 1 } else { image.denoising_steps() as u64 };
        self.of_frame(image) + image.ops().enumerate().map(|(i, op)| self.of_op(&op) * times(i)).sum()
    }

    /// Computes the cost of a step without the network's operations.
    pub fn of_frame(self, image: &Image<'_>) -> Cost {
        self.total(|add| frame(image, add))
    }
}

impl Image<'_> {
    /// Computes the expected cost of a step that evaluates the network, on a Cortex-M4 with FPU and zero-wait memory. A
    /// step that continues a chunk costs less.
    pub fn step_cost(&self) -> Cost {
        Rates::M4F.of_step(self)
    }
}

/// Computes the most that the items of `list` take, in 1024ths of an instruction.
pub(super) fn most(list: impl FnOnce(&mut dyn FnMut(CostItem, usize))) -> u32 {
    let mut sum = 0u32;
    list(&mut |item, count| sum = sum.saturating_add((count as u32).saturating_mul(item.most())));
    sum
}

/// Counts the items of a step without the network's operations.
pub fn frame(image: &Image<'_>, add: &mut dyn FnMut(CostItem, usize)) {
    begin(image, add);
    action(image, add);
}

/// Counts the items of taking the observation.
pub fn begin(image: &Image<'_>, add: &mut dyn FnMut(CostItem, usize)) {
    add(CostItem::STEP, 1);
    add(CostItem::OBSERVATION, image.obs_len());
    if image.overlap() > 0 {
        add(CostItem::KEPT, 1);
        add(CostItem::KEPT_VALUE, image.kept().len);
    }
}

/// Counts the items from the network's output to the action.
pub fn action(image: &Image<'_>, add: &mut dyn FnMut(CostItem, usize)) {
    add(CostItem::ACTION, 1);
    add(CostItem::ACTION_VALUE, image.act_len());
    add(CostItem::CONTRACT, image.contract_arrays().iter().map(|array| array.len()).sum::<usize>());
    // Predictions of a new chunk for the periods that an ensemble keeps.
    let predicted = image.horizon().min(image.chunk());
    if predicted > 0 {
        add(CostItem::ENSEMBLE, 1);
        add(CostItem::PREDICTED, predicted);
        add(CostItem::PREDICTED_VALUE, (predicted + 1) * image.act_len());
    }
    add(CostItem::BLENDED, image.overlap() * image.act_len());
}

/// Counts the items of an operation.
pub fn items(op: &Op<'_>, add: &mut dyn FnMut(CostItem, usize)) {
    if let (OpKind::Linear { accumulate, .. }, Some(matrix)) = (op.kind, op.matrix()) {
        linear(&matrix, accumulate, add);
    } else {
        let (operation, _, len) = values(op);
        add(operation, 1);
        elements(op, len, add);
    }
}

/// Counts the items of `len` values of an operation. (It takes all denoising steps to be like the first.)
fn elements(op: &Op<'_>, len: usize, add: &mut dyn FnMut(CostItem, usize)) {
    #[cfg(feature = "attention")]
    if op.kind.is_attention() {
        return heads(op, op.units(), true, add);
    }
    add(values(op).1, len);
    rest(op.kind, len % EIGHT, add);
    if op.kind == OpKind::History {
        add(CostItem::FRAME, op.dst().len.checked_div(op.src().len).unwrap_or(0));
    }
    squared(op, add);
    if op.kind == OpKind::Denoise {
        let ([sample_x, sample_v, _, _, _, sigma, _], _) = op.coefficients(0);
        add(CostItem::LIMITED, if [sample_x, sample_v] == [0.0; 2] { 0 } else { len });
        add(CostItem::NOISY, if sigma == 0.0 { 0 } else { len });
    }
}

/// Counts the items of `units` heads of tokens. Of those that a query sees, `is_expected` takes all that a cache has room
/// for, fewer if the queries are causal; otherwise, always all.
#[cfg(feature = "attention")]
fn heads(op: &Op<'_>, units: usize, is_expected: bool, add: &mut dyn FnMut(CostItem, usize)) {
    let mut add = |which, count| add(CostItem::attention(which), count);
    if op.kind == OpKind::Rotary {
        add(Attention::RotatedHead, units);
        return add(Attention::RotatedPair, units * (op.rotated_heads()[1] / 2));
    }
    let cache = op.cache();
    if op.kind == OpKind::Keep {
        add(Attention::KeptHead, units);
        return add(Attention::KeptValue, 2 * units * cache.dim);
    }
    add(Attention::Head, units);
    add(Attention::QueryWord, units * cache.key_words());
    add(Attention::Output, units * cache.dim);
    add(Attention::ValueRow, units * cache.value_rows());
    let of_tokens = |add: &mut dyn FnMut(Attention, usize), heads: usize, seen: usize| {
        add(Attention::Score, heads * seen);
        // Kernels take two keys at a time, and the values of eight tokens.
        add(Attention::KeyWord, heads * seen.next_multiple_of(2) * cache.key_words());
        add(Attention::ValueWord, heads * cache.value_rows() * 4 * seen.div_ceil(8));
    };
    if op.is_causal() && is_expected {
        let tokens = units.checked_div(op.query_heads()).unwrap_or(0);
        (0..tokens).for_each(|later| of_tokens(&mut add, op.query_heads(), cache.slots.saturating_sub(later)));
    } else {
        of_tokens(&mut add, units, cache.slots);
    }
}

/// Values of a pass, in loops with a slower loop for the rest.
const EIGHT: usize = 8;

/// Counts the additional items of the last `len` values, fewer than [`EIGHT`].
fn rest(kind: OpKind, len: usize, add: &mut dyn FnMut(CostItem, usize)) {
    match kind {
        OpKind::Denoise => add(CostItem::DENOISED_REST, len),
        OpKind::Normalize { .. } => add(CostItem::NORMALIZED_REST, len),
        _ => {}
    }
}

/// Counts the values whose norm an operation computes, in each of its pieces.
fn squared(op: &Op<'_>, add: &mut dyn FnMut(CostItem, usize)) {
    if op.kind == OpKind::Standstill || op.kind == OpKind::Select && op.half(1) == 1 {
        add(CostItem::SQUARED, op.src().len);
    }
}

/// Counts the items of a piece of an operation's values, without those of each value.
pub(super) fn piece(op: &Op<'_>, add: &mut dyn FnMut(CostItem, usize)) {
    // Each piece of a norm computes the results of the sums again.
    if op.units() != op.dst().len {
        add(values(op).0, 1);
    }
    rest(op.kind, EIGHT - 1, add);
    squared(op, add);
}

/// Counts the items of one value of an operation, in the denoising step with the highest cost.
pub(super) fn most_expensive_element(op: &Op<'_>, add: &mut dyn FnMut(CostItem, usize)) {
    #[cfg(feature = "attention")]
    if op.kind.is_attention() {
        return heads(op, 1, false, add);
    }
    add(values(op).1, 1);
    if op.kind == OpKind::History {
        // A frame may be one value long.
        add(CostItem::FRAME, 1);
    }
    if op.kind == OpKind::Denoise {
        add(CostItem::LIMITED, 1);
        add(CostItem::NOISY, 1);
    }
}

/// Returns the item of an operation, the item of its values, and their number: 0 for a linear operation, whose
/// parts are counted one by one.
pub fn values(op: &Op<'_>) -> (CostItem, CostItem, usize) {
    #[cfg(feature = "attention")]
    if op.kind.is_attention() {
        return attention(op);
    }
    let values = match op.kind {
        OpKind::Linear { .. } => 0,
        OpKind::History => op.units(),
        _ => op.dst().len,
    };
    (CostItem::operation(op.code()), value(op.kind, op.code()), values)
}

/// Returns the items of an operation of attention, and the number of the values that it writes.
#[cfg(feature = "attention")]
fn attention(op: &Op<'_>) -> (CostItem, CostItem, usize) {
    let (once, value, len) = match op.kind {
        OpKind::Keep => (Attention::Keep, Attention::KeptValue, 2 * op.src().len),
        OpKind::Rotary => (Attention::Rotary, Attention::RotatedPair, op.dst().len / 2),
        _ => (Attention::Attend, Attention::Output, op.dst().len),
    };
    (CostItem::attention(once), CostItem::attention(value), len)
}

/// Returns the item of a value of an operation of this code.
fn value(kind: OpKind, code: u8) -> CostItem {
    match kind {
        OpKind::Function(function) => CostItem::function(function),
        _ => CostItem::value(code),
    }
}

fn linear(matrix: &Matrix<'_>, accumulate: bool, add: &mut dyn FnMut(CostItem, usize)) {
    let in_place = matrix.start_values(accumulate).is_some();
    let apart = (!in_place).then(|| OutputStart::of(accumulate, !matrix.bias.is_empty()));
    begin_linear([matrix.rows, matrix.cols], apart, add);
    let mut last = None;
    for rows in matrix.blocks() {
        let shape = rows.block.shape();
        if last != Some(shape.width) {
            prepare(shape, add);
            last = Some(shape.width);
        }
        block(shape, rows.steps.is_empty(), in_place, add);
    }
}

/// Counts the items of a linear operation before its blocks; `apart` says how outputs are initialized that the
/// blocks do not initialize themselves.
fn begin_linear([rows, cols]: [usize; 2], apart: Option<OutputStart>, add: &mut dyn FnMut(CostItem, usize)) {
    add(CostItem::operation(op::LINEAR), 1);
    magnitude(cols, add);
    if let Some(apart) = apart {
        add(CostItem::BIASED, 1);
        start(apart, rows, add);
    }
}

/// Counts the items of entering an operation, at its start or inside it.
pub(super) fn enter(op: &Op<'_>, add: &mut dyn FnMut(CostItem, usize)) {
    add(CostItem::ENTERED, 1);
    add(values(op).0, 1);
    if let Some(matrix) = op.matrix() {
        add(CostItem::RESUMED, matrix.block_count());
    }
}

/// Counts the items of initializing outputs before rows are added to them.
pub(super) fn start(start: OutputStart, outputs: usize, add: &mut dyn FnMut(CostItem, usize)) {
    match start {
        OutputStart::Zero => add(CostItem::ZEROED, outputs),
        OutputStart::Bias => add(CostItem::BIAS, outputs),
        OutputStart::Added => add(CostItem::ADDED, outputs),
        OutputStart::Kept => {}
    }
}

/// Counts the items of finding the scale of an input.
pub(super) fn magnitude(cols: usize, add: &mut dyn FnMut(CostItem, usize)) {
    add(CostItem::MAGNITUDE_EIGHT, cols / 8);
    add(CostItem::MAGNITUDE_REST, cols % 8);
}

/// Returns the extent of a prepared vector. Blocks in an image have valid shapes.
fn extent(shape: BlockShape) -> Extent {
    Plan::new(shape).map(|plan| plan.extent()).unwrap_or_default()
}

/// Counts the items of preparing an input for blocks of this shape.
pub(super) fn prepare(shape: BlockShape, add: &mut dyn FnMut(CostItem, usize)) {
    let Extent { columns, groups, chunks, .. } = extent(shape);
    let filled = columns != shape.cols;
    for (which, count) in [
        (Prepare::Vector, 1),
        (Prepare::Group, groups),
        (Prepare::Chunk, chunks),
        (Prepare::Eight, columns / 8),
        (Prepare::Filled, usize::from(filled)),
        (Prepare::FilledValue, if filled { columns } else { 0 }),
    ] {
        add(CostItem::prepare_of(shape, which), count);
    }
}

/// Counts the items of a block's products and their scaling. With `start`, the output starts from the biases.
fn block(shape: BlockShape, in_order: bool, start: bool, add: &mut dyn FnMut(CostItem, usize)) {
    // Tiles of columns make no difference in slices, whose budgets are those of a Cortex-M4.
    #[cfg(all(feature = "writer", feature = "scalar"))]
    if shape.lanes == crate::layout::Lanes::Scalar {
        return scalar::block(shape, in_order, start, add);
    }
    let whole = if in_order && start { rows_in_place(shape) } else { 0 };
    if whole > 0 {
        add(CostItem::IN_PLACE, 1);
        scaled(whole, true, add);
        products(shape, whole, 1, add);
    }
    let left = shape.rows - whole;
    if left > 0 {
        let runs = left.div_ceil(RUN);
        add(CostItem::STACK, 1);
        add(CostItem::RUN, runs);
        products(shape, left, runs, add);
        scaled(left, in_order, add);
    }
}

/// Returns the rows whose sums fit in the output: all but those of a last strip with padding.
fn rows_in_place(shape: BlockShape) -> usize {
    if shape.rows.is_multiple_of(QUAD) { shape.rows } else { shape.rows & !(STRIP - 1) }
}

/// Counts the items of scaling the sums of rows.
fn scaled(rows: usize, in_order: bool, add: &mut dyn FnMut(CostItem, usize)) {
    if in_order {
        add(CostItem::SCALED_EIGHT, rows / STRIP);
        add(CostItem::SCALED_REST, rows % STRIP);
    } else {
        add(CostItem::SCALED_STEPPED, rows);
    }
}

/// Counts the items of GEMVs of `rows` rows in `calls` calls.
pub(super) fn products(shape: BlockShape, rows: usize, calls: usize, add: &mut dyn FnMut(CostItem, usize)) {
    let quads = rows.div_ceil(QUAD);
    let eights = if shape.strip_rows() == STRIP { quads / 2 } else { 0 };
    let extent = extent(shape);
    for (height, strips) in [(Strips::Eight, eights), (Strips::Four, quads - 2 * eights)] {
        if strips > 0 {
            // In a strip of four at the end of strips of eight, only the last call is one of its kind.
            let last_alone = matches!(height, Strips::Four) && eights > 0;
            let chunks = if shape.group == 0 { extent.chunks } else { 0 };
            let columns = shape.units() * shape.cell_cols();
            for (which, count) in [
                (Gemv::Call, if last_alone { 1 } else { calls }),
                (Gemv::Strip, strips),
                (Gemv::Pass, strips * extent.passes),
                (Gemv::Chunk, strips * chunks),
                (Gemv::Column, strips * columns),
            ] {
                add(CostItem::gemv_of(shape, height, which), count);
            }
        }
    }
}

/// Computes the most that a piece of a block's rows takes, first at any length, then for each [`STRIP`] of rows, in
/// 1024ths of an instruction.
pub(super) fn strips(shape: BlockShape, in_order: bool, start: bool) -> (u32, u32) {
    let row = if in_order { CostItem::SCALED_REST } else { CostItem::SCALED_STEPPED };
    let first = most(|add| {
        // The last piece may need a separate run for the rest of the rows.
        add(CostItem::IN_PLACE, 1);
        add(CostItem::STACK, 1);
        add(CostItem::RUN, 1);
        for height in [Strips::Eight, Strips::Four] {
            add(CostItem::gemv_of(shape, height, Gemv::Call), 1);
        }
        if in_order {
            add(row, STRIP - 1);
        }
    });
    let each = most(|add| {
        products(shape, STRIP, 0, add);
        match (in_order, start) {
            (true, true) => add(CostItem::SCALED_EIGHT, 1),
            (true, false) => {
                add(CostItem::SCALED_EIGHT, 1);
                add(CostItem::RUN, 1);
            }
            (false, _) => {
                add(row, STRIP);
                add(CostItem::RUN, 1);
            }
        }
    });
    (first, each)
}
