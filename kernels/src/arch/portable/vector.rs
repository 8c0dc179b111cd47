//! Conversion of vectors between f32 and integers.

#[cfg(any(not(actq_fpu), feature = "scalar", feature = "helium"))]
use core::cell::Cell;

#[cfg(any(not(actq_fpu), feature = "scalar", feature = "helium"))]
use crate::activations::{Plan, cells, lay_out};
use crate::layout::half::{bf16, half_word};
use crate::math::{Native, Real};

/// Returns the exclusive or of words.
#[cfg(feature = "checksums")]
#[inline(never)]
pub fn xor(words: &[u32]) -> u32 {
    words.iter().fold(0, |sum, word| sum ^ word)
}

/// Returns the bits of the largest magnitude.
pub fn magnitude(x: &[f32]) -> u32 {
    x.iter().fold(0u32, |m, v| m.max(v.to_bits() & 0x7fff_ffff))
}

/// Copies `from` to `to`, up to the shorter length.
pub fn copy(from: &[u32], to: &mut [u32]) {
    to.iter_mut().zip(from).for_each(|(to, from)| *to = *from);
}

/// Quantizes `x` with the plan to the first words of `out`; `None`, with nothing written, if `out` is shorter than
/// [`Plan::room`]. Without `x`, the values are the first words of `out`, the plan's columns.
#[cfg(any(not(actq_fpu), feature = "scalar", feature = "helium"))]
pub(crate) fn quantize(x: Option<&mut [f32]>, inverse: f32, plan: &Plan, out: &mut [u32]) -> Option<()> {
    let room = x.as_ref().map_or(plan.shape.cols.max(plan.words()), |x| plan.room(x.len()));
    let out = cells(out.get_mut(..room)?);
    let x = match x {
        Some(x) => cells(bytemuck::must_cast_slice_mut(x)),
        None => out.get(..plan.shape.cols)?,
    };
    lay_out(x, plan, out, Cell::get, |bits| Native::of(f32::from_bits(bits)).rounded(inverse));
    Some(())
}

/// Computes `y[i] = start[i] + sum[i] * (scale[i] * x_scale)`, with two bf16 scales a word. If `sums` or `start` is
/// `None`, `y` holds them, the sums as their bits.
pub fn scale(sums: Option<&[i32]>, start: Option<&[u32]>, scales: &[u32], x_scale: f32, y: &mut [f32]) {
    let others = start.map(<[_]>::len).or(sums.map(<[_]>::len)).unwrap_or(0);
    for i in 0..y.len().min(others) {
        scale_one(i, sums, start, scales, x_scale, y);
    }
}

/// Computes a value of [`scale`]; none out of range.
#[inline(always)]
pub(crate) fn scale_one(
    i: usize,
    sums: Option<&[i32]>,
    start: Option<&[u32]>,
    scales: &[u32],
    x_scale: f32,
    y: &mut [f32],
) {
    let Some(y) = y.get_mut(i) else { return };
    let sum = sums.map_or(Some(y.to_bits() as i32), |sums| sums.get(i).copied());
    let start = start.map_or(Some(y.to_bits()), |start| start.get(i).copied().map(u32::from_le));
    if let (Some(sum), Some(start)) = (sum, start) {
        *y = f32::from_bits(start);
        Native::add_scaled(y, sum, bf16(half_word(scales, i)), x_scale);
    }
}

/// Computes the square root, correctly rounded as in IEEE 754.
#[inline(always)]
pub fn sqrt(x: f32) -> f32 {
    libm::sqrtf(x)
}
