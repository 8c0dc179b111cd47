//! Conversions from and to f32, in assembler for the FPU of a Cortex-M4 or M7: the arithmetic of the portable backend,
//! operation for operation.

mod table;

use core::ops::Range;
use core::ptr::{self, NonNull};
use core::slice;

use self::table::quantizer;
use super::armv7em::copy;
use crate::activations::Plan;
use crate::layout::XLayout;
use crate::math::exp2::{EXP, QUARTER, exp2_constants};
use crate::round::ROUND;

assembler!("vector.s");
assembler!("cells.s");
assembler!("elementwise.s");

unsafe extern "C" {
    fn actq_sqrt(x: f32) -> f32;
    fn actq_lstm(gates: *const f32, row: usize, c: *mut f32, h: *mut f32, len: usize, cell: &[f32; 6]);
    fn actq_gru(a: *const f32, b: *const f32, row: usize, h: *mut f32, len: usize, cell: &[f32; 6]);
    fn actq_denoise(by: &[f32; 7], limit: f32, v: *const f32, z: *const f32, x: *mut f32, y: *mut f32, len: usize);
    fn actq_normalize(
        pre_clip: f32,
        clip: f32,
        x: *const f32,
        mean: *const u32,
        scale: *const u32,
        y: *mut f32,
        len: usize,
    );
    fn actq_sum(start: f32, x: *const f32, len: usize) -> f32;
    fn actq_sum_squares(start: f32, center: f32, x: *const f32, len: usize) -> f32;
    fn actq_standardize(mean: f32, inverse: f32, x: *mut f32, weight: *const u32, bias: *const u32, len: usize);
    fn actq_scale_add(x_scale: f32, sums: *const i32, scales: *const u32, start: *const f32, y: *mut f32, len: usize);
}

/// Quantizes `x` with the plan to the first words of `out`; `None`, with nothing written, if `out` is shorter than
/// [`Plan::room`]. Without `x`, the values are the first words of `out`, which fill all groups.
#[inline(always)]
pub(crate) fn quantize(x: Option<&mut [f32]>, inverse: f32, plan: &Plan, out: &mut [u32]) -> Option<()> {
    let room = out.get_mut(..x.as_ref().map_or(plan.padded.max(plan.words()), |x| plan.room(x.len())))?;
    let (out, words) = (room.as_mut_ptr(), room.len());
    let (x, inverse) = match x {
        None => (NonNull::new(out)?.cast(), inverse),
        Some(x) if x.len() == plan.padded => (NonNull::from(x).cast(), inverse),
        // SAFETY: the room has `words` words.
        Some(x) => unsafe { filled(x, inverse, plan, out, words)? },
    };
    let XLayout { shift, chunk, starts: [start, second], .. } = plan.layout.x;
    let (kernel, first, eights) = (quantizer(shift), plan.first / 8, chunk / 8);
    let (x, bias, factor, second) = (x.as_ptr(), start.bias, start.factor, second.factor);
    // SAFETY: x is the plan's padded columns, the caller's, the room's first words or a copy at the end of the room, and the
    // room has at least the plan's words. The written words never reach the unread part of the copy: after `n` of its columns
    // they are `n / 2` words, start words and sums, of which there are in all as many as words before the copy. Nor
    // that of the room's first words: chunks have eight columns or more, and at most two start words and a sum.
    // `of_valid` makes all counts 1 or more and all lengths multiples of 8 columns. The kernel reads eight columns
    // before it writes them. It writes as many start words and sums as the layout has, which `table` asserts, and if
    // it takes eight columns for a chunk, that is the layout's limit and so `first` and `eights`.
    unsafe {
        let (groups, chunks, group) = (plan.groups, plan.chunks, plan.shape.group);
        kernel(inverse, ROUND, x, out, groups, chunks, first, eights, bias, factor, second, group);
    }
    Some(())
}

/// Copies a vector that does not fill its groups to the end of the room, and fills it with zeros. (It returns `inverse`
/// unchanged, so that no register has to hold it during the call.)
///
/// # Safety
///
/// The room has `words` words.
#[cold]
#[inline(never)]
unsafe fn filled(x: &[f32], inverse: f32, plan: &Plan, room: *mut u32, words: usize) -> Option<(NonNull<f32>, f32)> {
    let at = words.checked_sub(plan.padded)?;
    // SAFETY: these are the last of the room's words.
    let (copied, padded) = unsafe {
        let copied = room.add(at);
        (copied, slice::from_raw_parts_mut(copied, plan.padded))
    };
    copy(bytemuck::must_cast_slice(x), padded);
    padded.iter_mut().skip(x.len()).for_each(|word| *word = 0);
    Some((NonNull::new(copied)?.cast(), inverse))
}

/// Computes `y[i] = start[i] + sum[i] * (scale[i] * x_scale)`, up to the shortest length, with two bf16 scales a word.
/// If `sums` or `start` is `None`, `y` holds them, the sums as their bits.
#[inline(never)]
pub(crate) fn scale(sums: Option<&[i32]>, start: Option<&[u32]>, scales: &[u32], x_scale: f32, y: &mut [f32]) {
    let len = y.len().min(2 * scales.len());
    let len = len.min(sums.map_or(len, <[_]>::len)).min(start.map_or(len, <[_]>::len));
    let to = y.as_mut_ptr();
    let sums = sums.map_or(to.cast_const().cast(), <[_]>::as_ptr);
    let start = start.map_or(to.cast_const(), |start| start.as_ptr().cast());
    // SAFETY: all operands hold at least `len` values; no value in `y` is written before it is read.
    unsafe { actq_scale_add(x_scale, sums, scales.as_ptr(), start, to, len) }
}

/// Constants of the cells: the factors of x for `e^x` and `e^(2 x)`, the number that rounds in these units, p1, p0 and
/// q0.
static CELL: [f32; 6] = {
    let [round, p1, p0, q0] = exp2_constants(QUARTER);
    [EXP, 2.0 * EXP, round, p1, p0, q0]
};

/// Computes some elements of an LSTM cell (`ops::cells`).
pub(crate) fn lstm_elements(elements: Range<usize>, gates: &[f32], c: &mut [f32], h: &mut [f32]) {
    let (Range { start, end }, n) = (elements, h.len());
    if start >= end || end > n || end > c.len() || gates.len() < 3 * n + end {
        return;
    }
    // SAFETY: of `gates`, the kernel reads the elements of four rows of n values, the last up to `3 n + end`, which is
    // no more than there are (n values take less than half of the memory: 4 n is no overflow). Of `c` and `h` it reads
    // and writes the elements, which both have. There is at least one.
    unsafe {
        let (c, h) = (c.as_mut_ptr().add(start), h.as_mut_ptr().add(start));
        actq_lstm(gates.as_ptr().add(start), size_of::<f32>() * n, c, h, end - start, &CELL);
    }
}

/// Computes some elements of a GRU cell (`ops::cells`).
pub(crate) fn gru_elements(elements: Range<usize>, a: &[f32], b: &[f32], h: &mut [f32]) {
    let (Range { start, end }, n) = (elements, h.len());
    if start >= end || end > n || a.len().min(b.len()) < 2 * n + end {
        return;
    }
    // SAFETY: as for `lstm_elements`, with three rows of `a` and of `b`.
    unsafe {
        let (a, b, h) = (a.as_ptr().add(start), b.as_ptr().add(start), h.as_mut_ptr().add(start));
        actq_gru(a, b, size_of::<f32>() * n, h, end - start, &CELL);
    }
}

/// Computes [`crate::ops::denoise::denoise`]; `by` holds its coefficients in their order.
#[inline(always)]
pub(crate) fn denoise(by: &[f32; 7], limit: f32, v: &[f32], z: &[f32], x: &mut [f32], y: &mut [f32]) {
    let len = x.len().min(y.len()).min(v.len());
    let (z, len) = if z.is_empty() { (ptr::null(), len) } else { (z.as_ptr(), len.min(z.len())) };
    // SAFETY: all operands hold at least `len` values, except empty noise; the kernel reads and writes no others. It
    // reads noise only if there is any.
    unsafe { actq_denoise(by, limit, v.as_ptr(), z, x.as_mut_ptr(), y.as_mut_ptr(), len) }
}

/// Computes [`crate::ops::elementwise::normalize`].
#[inline(always)]
pub(crate) fn normalize(x: &[f32], mean: &[u32], scale: &[u32], pre_clip: f32, clip: f32, y: &mut [f32]) {
    let len = y.len().min(x.len()).min(mean.len()).min(scale.len());
    // SAFETY: all operands hold at least `len` values, and the kernel reads and writes no others.
    unsafe { actq_normalize(pre_clip, clip, x.as_ptr(), mean.as_ptr(), scale.as_ptr(), y.as_mut_ptr(), len) }
}

/// Adds the elements of `x` to `start`, in order.
#[inline(always)]
pub(crate) fn sum(start: f32, x: &[f32]) -> f32 {
    // SAFETY: the kernel reads the elements of `x`.
    unsafe { actq_sum(start, x.as_ptr(), x.len()) }
}

/// Adds the squared differences of `x` from `center` to `start`, in order.
#[inline(always)]
pub(crate) fn sum_squares(start: f32, center: f32, x: &[f32]) -> f32 {
    // SAFETY: the kernel reads the elements of `x`.
    unsafe { actq_sum_squares(start, center, x.as_ptr(), x.len()) }
}

/// Computes in place `(x - mean) * inverse * weight + bias`, up to the shortest length.
#[inline(always)]
pub(crate) fn standardize(mean: f32, inverse: f32, x: &mut [f32], weight: &[u32], bias: &[u32]) {
    let len = x.len().min(weight.len()).min(bias.len());
    // SAFETY: all operands hold at least `len` values; the kernel reads and writes no others.
    unsafe { actq_standardize(mean, inverse, x.as_mut_ptr(), weight.as_ptr(), bias.as_ptr(), len) }
}

/// Computes the FPU's square root, correctly rounded as in IEEE 754.
#[inline(always)]
pub(crate) fn sqrt(x: f32) -> f32 {
    // SAFETY: a function of one register.
    unsafe { actq_sqrt(x) }
}
