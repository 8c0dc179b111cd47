//! A quantized matrix times a vector, from f32 to f32, in the order of operations of every machine.
//!
//! 1. `x` is quantized to integers `q` with one scale ([`crate::activations::Scale`]).
//! 2. Per row, the integer sum `acc = sum_g s_g * sum_c level * q` in int32 ([`crate::arch::gemv`]).
//! 3. `y = start + acc * (row_scale * x_scale)`, each operation rounded to f32. `start` is the bias; if the operation
//!    accumulates, it is the sum of the old `y` and the bias. Rows that no block holds (0 bits) keep `start`.

use core::ops::Range;

use super::elementwise::copy_le;
use crate::activations::{Plan, Prepared, Scale};
use crate::arch;
use crate::arch::gemv_with;
use crate::arch::{Mismatch, Tables};
use crate::arena::regions;
use crate::checksum::xor;
use crate::cursor::LinearCursor;
use crate::error::Fault;
use crate::image::header::BLOCK_WORDS;
use crate::image::{Matrix, Op, OpKind, Region, RowBlock, row_block};
use crate::layout::half::bf16;
use crate::layout::{QUAD, STRIP};
use crate::math::{Native, Real};
use crate::meter::{Meter, OutputStart, RUN, Work};

/// Borrows `len` outputs from `first` on, with their biases if `start` has any; `None` if there are too few.
#[inline(always)]
fn outputs<'y>(
    first: usize,
    len: usize,
    start: Option<&'y [u32]>,
    y: &'y mut [f32],
) -> Option<(Option<&'y [u32]>, &'y mut [f32])> {
    let start = match start {
        Some(start) => Some(start.get(first..)?.get(..len)?),
        None => None,
    };
    Some((start, y.get_mut(first..)?.get_mut(..len)?))
}

impl RowBlock<'_> {
    /// Computes `y = start + acc * (row_scale * x_scale)` for the outputs of the block's rows, with a vector that was
    /// prepared for the block. `start` holds the bits of the whole output's biases. Without it, and for rows with
    /// output steps, `y` itself is the start.
    ///
    /// # Errors
    ///
    /// [`Mismatch`] if `x` was prepared for another shape, or if `start` or `y` is too short.
    pub fn apply(
        &self,
        x: &Prepared<'_>,
        x_scale: Scale,
        start: Option<&[u32]>,
        y: &mut [f32],
    ) -> Result<(), Mismatch> {
        self.apply_with(x, Tables::default(), x_scale, start, y)
    }

    /// Does the same as [`Self::apply`] with memory for tables.
    ///
    /// # Errors
    ///
    /// As [`Self::apply`].
    #[inline(always)]
    pub fn apply_with(
        &self,
        x: &Prepared<'_>,
        mut tables: Tables<'_>,
        x_scale: Scale,
        start: Option<&[u32]>,
        y: &mut [f32],
    ) -> Result<(), Mismatch> {
        self.apply_rows(0..self.block.shape().rows, &mut 0, x, &mut tables, x_scale, start, y).ok_or(Mismatch)
    }

    /// Computes successive rows of the block as `apply` does. They start at a multiple of [`STRIP`], and end at another
    /// or at the block's end. With output steps, `output` is the previous row's output (0 before the first row), and
    /// becomes the last row's. `None` if `start` or `y` is too short.
    #[inline(always)]
    #[expect(clippy::too_many_arguments, reason = "a piece of a product has no fewer")]
    pub(crate) fn apply_rows(
        &self,
        rows: Range<usize>,
        output: &mut usize,
        x: &Prepared<'_>,
        tables: &mut Tables<'_>,
        x_scale: Scale,
        start: Option<&[u32]>,
        y: &mut [f32],
    ) -> Option<()> {
        let x_scale = x_scale.get();
        if start.is_none() || !self.steps.is_empty() {
            #[cfg(feature = "scalar")]
            if let Some((sums, mut tables)) = tables.lend().with_sums(rows.len()) {
                return self.apply_runs(sums, rows, output, x, &mut tables, x_scale, start, y);
            }
            return self.apply_runs_of::<RUN>(rows, output, x, tables, x_scale, start, y);
        }
        // Sums of rows in order fit in y itself, except those of a last strip with padding.
        let whole = if rows.end.is_multiple_of(QUAD) { rows.end } else { rows.end & !(STRIP - 1) };
        if rows.start < whole {
            let first = self.first_row + rows.start;
            let (start, y) = outputs(first, whole - rows.start, start, y)?;
            gemv_with(&self.block, x, rows.start, bytemuck::must_cast_slice_mut(y), tables.lend()).ok()?;
            self.scale_in_order(rows.start, None, x_scale, start, y);
        }
        if whole < rows.end {
            self.apply_runs_of::<STRIP>(whole..rows.end, output, x, tables, x_scale, start, y)?;
        }
        Some(())
    }

    /// Computes rows as [`Self::apply_rows`] does, `N` at a time. (Not inlined: most products do not need
    /// its stack. Its parameters are those of the others, because a closure instead takes 16 bytes more of it.)
    #[inline(never)]
    #[expect(clippy::too_many_arguments, reason = "a piece of a product has no fewer")]
    fn apply_runs_of<const N: usize>(
        &self,
        rows: Range<usize>,
        output: &mut usize,
        x: &Prepared<'_>,
        tables: &mut Tables<'_>,
        x_scale: f32,
        start: Option<&[u32]>,
        y: &mut [f32],
    ) -> Option<()> {
        self.apply_runs(&mut [0; N], rows, output, x, tables, x_scale, start, y)
    }

    /// Computes rows as [`Self::apply_rows`] does, with their sums in `sums`, as many at a time as it holds.
    #[inline(never)]
    #[expect(clippy::too_many_arguments, reason = "a piece of a product has no fewer")]
    fn apply_runs(
        &self,
        sums: &mut [i32],
        rows: Range<usize>,
        output: &mut usize,
        x: &Prepared<'_>,
        tables: &mut Tables<'_>,
        x_scale: f32,
        start: Option<&[u32]>,
        y: &mut [f32],
    ) -> Option<()> {
        let mut first = rows.start;
        while first < rows.end {
            let run = sums.len().min(rows.end.next_multiple_of(QUAD) - first);
            let sums = sums.get_mut(..run)?;
            gemv_with(&self.block, x, first, sums, tables.lend()).ok()?;
            let sums = sums.get(..rows.end - first).unwrap_or(sums);
            if self.steps.is_empty() {
                let (start, y) = outputs(self.first_row + first, sums.len(), start, y)?;
                self.scale_in_order(first, Some(sums), x_scale, start, y);
            } else {
                self.scale_in_steps(first, sums, output, x_scale, y)?;
            }
            first += sums.len();
        }
        Some(())
    }

    /// Converts the sums of the rows from `first` on, as many as `y` has, to results. If `sums` or `start` is `None`,
    /// `y` holds them.
    fn scale_in_order(&self, first: usize, sums: Option<&[i32]>, x_scale: f32, start: Option<&[u32]>, y: &mut [f32]) {
        arch::scale(sums, start, self.scales.get(first / 2..).unwrap_or(&[]), x_scale, y);
    }

    /// Adds the scaled sums of the rows from `first` on to the rows' outputs; `None` if an output is out of range.
    #[inline(never)]
    fn scale_in_steps(
        &self,
        first: usize,
        sums: &[i32],
        output: &mut usize,
        x_scale: f32,
        y: &mut [f32],
    ) -> Option<()> {
        // Sections of a block have a value for each row.
        let scales = bytemuck::must_cast_slice::<u32, u16>(self.scales).get(first..)?;
        let steps = bytemuck::must_cast_slice::<u32, u8>(self.steps).get(first..)?;
        for ((sum, scale), step) in sums.iter().zip(scales).zip(steps) {
            *output += usize::from(*step);
            let scale = bf16(u16::from_le(*scale));
            Native::add_scaled(y.get_mut(*output)?, *sum, scale, x_scale);
        }
        Some(())
    }
}

impl Op<'_> {
    /// Computes a linear operation, from `at` on and as far as the budget allows. Returns `true` when all is done.
    #[inline(never)]
    pub(crate) fn multiply(
        &self,
        arena: &mut [u32],
        at: &mut LinearCursor,
        budget: &mut impl Meter,
    ) -> Result<bool, Fault> {
        let OpKind::Linear { accumulate, in_place } = self.kind else { return Err(Fault::Damaged) };
        let matrix = &self.linear_matrix();
        let matrix = matrix.as_ref().map_err(|_| Fault::Damaged)?;
        let [dst, src, work] = self.regions;
        if src.len != matrix.cols || dst.len != matrix.rows {
            return Err(Fault::Damaged);
        }
        let x_scale = match at.scale {
            Some(scale) => scale,
            None if budget.take(1, Work::Magnitude(matrix.cols)) == 0 => return Ok(false),
            None => {
                let x = arena.get(src.range()).unwrap_or_default();
                *at.scale.insert(Scale::new(bytemuck::must_cast_slice(x), matrix.x_max)?)
            }
        };
        // One pass over the output is enough if every row has its bias and is written once, in order.
        let start = matrix.start_values(accumulate);
        if start.is_none() && at.started < dst.len {
            let work = Work::Start(OutputStart::of(accumulate, !matrix.bias.is_empty()));
            let end = at.started + budget.take(dst.len - at.started, work);
            let y = bytemuck::must_cast_slice_mut(arena.get_mut(dst.range()).unwrap_or_default());
            matrix.start(at.started..end, y, accumulate);
            at.started = end;
            if end < dst.len {
                return Ok(false);
            }
        }
        let mut first_row = 0;
        for (i, record) in matrix.records.as_chunks::<BLOCK_WORDS>().0.iter().enumerate() {
            let rows = row_block(matrix, record, first_row);
            let rows = rows.as_ref().map_err(|_| Fault::Damaged)?;
            let shape = rows.block.shape();
            first_row += shape.rows;
            if i < at.block {
                continue;
            }
            let plan = &Plan::of(&rows.block);
            // Prepared activations differ between layouts; the blocks of one width share them.
            let unprepared = at.prepared != Some(shape.width);
            if unprepared && budget.take(1, Work::Prepare(shape)) == 0 {
                return Ok(false);
            }
            if unprepared && in_place {
                // Before its words are two regions.
                let x = arena.get_mut(src.range()).unwrap_or_default();
                x_scale.quantize_to(None, plan, x).ok_or(Fault::Damaged)?;
            }
            let [y, x, work, _] = regions(arena, &[dst, self.input(), work], Region::default());
            let y = bytemuck::must_cast_slice_mut(y);
            if unprepared && !in_place {
                let x = Some(bytemuck::must_cast_slice_mut(x));
                x_scale.quantize_to(x, plan, work).ok_or(Fault::Damaged)?;
            }
            let (words, mut tables) = Tables::split(work, if in_place { 0 } else { plan.words() });
            let prepared = Prepared::new(if in_place { x } else { words }, plan).ok_or(Fault::Damaged)?;
            if unprepared {
                at.has_prepared(shape, prepared.words());
            }
            let first = first_row - shape.rows;
            if at.row < shape.rows {
                let work = Work::Strips { shape, in_order: rows.steps.is_empty(), start: start.is_some() };
                let strips = budget.take((shape.rows - at.row).div_ceil(STRIP), work);
                let end = shape.rows.min(at.row + strips * STRIP);
                rows.apply_rows(at.row..end, &mut at.output, &prepared, &mut tables, x_scale, start, y)
                    .ok_or(Fault::Damaged)?;
                // With a start, every row is written once, in order. Without slices, the last ones are done just before the
                // check.
                if at.quiet.is_set() && start.is_some() && (first + end < matrix.rows || budget.is_limited()) {
                    let rows = y.get(at.started..first + end).unwrap_or_default();
                    at.rows.add(|| xor(bytemuck::must_cast_slice(rows)));
                    at.started = first + end;
                }
                at.row = end;
                if end < shape.rows {
                    return Ok(false);
                }
            }
            if !at.input.holds(prepared.words(), budget)? {
                return Ok(false);
            }
            at.block += 1;
            (at.row, at.output) = (0, 0);
        }
        Ok(true)
    }
}

impl Matrix<'_> {
    /// Sets outputs to their biases, or adds the biases to `accumulate`.
    fn start(&self, outputs: Range<usize>, y: &mut [f32], accumulate: bool) {
        let bias = self.bias.get(outputs.clone()).unwrap_or(&[]);
        let Some(y) = y.get_mut(outputs) else { return };
        if accumulate {
            let bias = bias.iter().map(|bits| Native::of(f32::from_bits(u32::from_le(*bits))));
            y.iter_mut().zip(bias).for_each(|(y, bias)| *y = (Native::of(*y) + bias).get());
        } else if bias.is_empty() {
            y.fill(0.0);
        } else {
            copy_le(bias, bytemuck::must_cast_slice_mut(y));
        }
    }
}
