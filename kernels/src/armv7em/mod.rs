//! The GEMV in Armv7E-M assembler (Cortex-M4 and M7): SMLAD makes two MACs a cycle, four with paired lanes.
//!
//! `single.s` holds one loop nest, stamped over the four layouts of single lanes; the layouts of paired lanes have a file
//! each. Every kernel comes with and without group scales and computes exactly what [`crate::portable`] computes; the tests
//! run both on the same data.
//!
//! SMLAD sets the Q flag; the procedure call standard lets a call change it.

use core::arch::global_asm;

use crate::activations::Prepared;
use crate::format::{Block, BlockShape, Lanes, QUAD, STRIP, Width};

global_asm!(include_str!("single.s"), options(raw));
global_asm!(include_str!("paired_w2.s"), options(raw));
global_asm!(include_str!("paired_w3.s"), options(raw));
global_asm!(include_str!("paired_w4.s"), options(raw));
global_asm!(include_str!("paired_w8.s"), options(raw));
global_asm!(include_str!("vector.s"), options(raw));
#[cfg(actq_fpu)]
global_asm!(include_str!("vector_fpu.s"), options(raw));

/// Reads `strips` strips at `weights` and the prepared vector from `x` up to `x_end`, writes the strips' sums at `acc`. What
/// `extra` is, the kernel's file says.
type Kernel = unsafe extern "C" fn(
    weights: *const u32,
    x: *const u32,
    acc: *mut i32,
    strips: usize,
    x_end: *const u32,
    extra: usize,
);

macro_rules! kernels {
    ($($name:ident)*) => {
        unsafe extern "C" {
            $(fn $name(
                weights: *const u32,
                x: *const u32,
                acc: *mut i32,
                strips: usize,
                x_end: *const u32,
                extra: usize,
            );)*
        }
    };
}
kernels! {
    actq_w2_row actq_w3_row actq_w4_row actq_w8_row
    actq_w2_group actq_w3_group actq_w4_group actq_w8_group
    actq_w2_paired_row actq_w2_paired_row4 actq_w2_paired_group actq_w2_paired_group4
    actq_w3_paired_row actq_w3_paired_group
    actq_w4_paired_row actq_w4_paired_row4 actq_w4_paired_group actq_w4_paired_group4
    actq_w8_paired_row actq_w8_paired_group
}

/// The kernels for strips of eight rows, where the layout has them, and of four.
fn kernels(shape: BlockShape) -> (Option<Kernel>, Kernel) {
    let grouped = shape.group != 0;
    match (shape.width, shape.lanes, grouped) {
        (Width::W2, Lanes::Single, false) => (None, actq_w2_row),
        (Width::W3, Lanes::Single, false) => (None, actq_w3_row),
        (Width::W4, Lanes::Single, false) => (None, actq_w4_row),
        (Width::W8, Lanes::Single, false) => (None, actq_w8_row),
        (Width::W2, Lanes::Single, true) => (None, actq_w2_group),
        (Width::W3, Lanes::Single, true) => (None, actq_w3_group),
        (Width::W4, Lanes::Single, true) => (None, actq_w4_group),
        (Width::W8, Lanes::Single, true) => (None, actq_w8_group),
        (Width::W2, Lanes::Paired, false) => (Some(actq_w2_paired_row), actq_w2_paired_row4),
        (Width::W3, Lanes::Paired, false) => (None, actq_w3_paired_row),
        (Width::W4, Lanes::Paired, false) => (Some(actq_w4_paired_row), actq_w4_paired_row4),
        (Width::W8, Lanes::Paired, false) => (None, actq_w8_paired_row),
        (Width::W2, Lanes::Paired, true) => (Some(actq_w2_paired_group), actq_w2_paired_group4),
        (Width::W3, Lanes::Paired, true) => (None, actq_w3_paired_group),
        (Width::W4, Lanes::Paired, true) => (Some(actq_w4_paired_group), actq_w4_paired_group4),
        (Width::W8, Lanes::Paired, true) => (None, actq_w8_paired_group),
    }
}

/// As [`crate::gemv::gemv`], for lengths that were checked there.
pub fn gemv(block: &Block<'_>, x: &Prepared<'_>, first_row: usize, acc: &mut [i32]) {
    let shape = block.shape();
    let weights = block.rows_from(first_row);
    let quads = acc.len() / QUAD;
    if weights.len() < quads * shape.quad_words() || !x.fits(shape) {
        return;
    }
    let (eight, four) = kernels(shape);
    let strips = if eight.is_some() { acc.len() / STRIP } else { 0 };
    let (first, last) = acc.split_at_mut(strips * STRIP);
    let x_end = x.chunks_end(shape);
    let extra = x.kernel_argument();
    if shape.lanes == Lanes::Paired {
        // The kernels for layouts whose rows may take several chunks add to the sums.
        first.fill(0);
        last.fill(0);
    }
    // SAFETY: `weights` holds the words of `acc.len()` rows from `first_row` on, which is a multiple of 8, so strips begin
    // there and after the strips of eight: each call reads the words of its strips and writes as many sums. It reads the
    // prepared vector from its begin to `x_end`, and the sum of x that stands there where the layout has row scales and a
    // sum; both are in the vector, because it was prepared for this shape. The slices are of u32 and i32, so every address
    // is a multiple of 4, as LDM and LDRD demand.
    unsafe {
        let x_words = x.words().as_ptr();
        if let (Some(kernel), 1..) = (eight, strips) {
            kernel(weights.as_ptr(), x_words, first.as_mut_ptr(), strips, x_words.add(x_end), extra);
        }
        if !last.is_empty() {
            let weights = weights.as_ptr().add(strips * STRIP / QUAD * shape.quad_words());
            four(weights, x_words, last.as_mut_ptr(), last.len() / QUAD, x_words.add(x_end), extra);
        }
    }
}

unsafe extern "C" {
    fn actq_magnitude(x: *const f32, len: usize) -> u32;
}

/// The bits of the largest magnitude.
pub fn magnitude_bits(x: &[f32]) -> u32 {
    let (eights, rest) = x.split_at(x.len() & !7);
    let largest = if eights.is_empty() {
        0
    } else {
        // SAFETY: the length is that of the slice, a multiple of 8 and not 0.
        unsafe { actq_magnitude(eights.as_ptr(), eights.len()) >> 1 }
    };
    rest.iter().fold(largest, |m, v| m.max(v.to_bits() & 0x7fff_ffff))
}

/// Quantizes as many values of `x` as the assembler takes; returns what is left of `x` and `out`, and the sum.
#[cfg(actq_fpu)]
pub fn quantize_pairs<'a, 'b>(
    x: &'a [f32],
    inverse: f32,
    shift: u32,
    out: &'b mut [u32],
) -> (&'a [f32], &'b mut [u32], i32) {
    let kernel = match shift {
        0 => actq_quantize0,
        1 => actq_quantize1,
        2 => actq_quantize2,
        3 => actq_quantize3,
        _ => return (x, out, 0),
    };
    let (eights, x) = x.split_at((x.len() & !7).min((2 * out.len()) & !7));
    let (pairs, out) = out.split_at_mut(eights.len() / 2);
    let sum = if eights.is_empty() {
        0
    } else {
        // SAFETY: the length is that of the slice, a multiple of 8 and not 0, and twice that of the pairs.
        unsafe { kernel(inverse, crate::activations::ROUND, eights.as_ptr(), pairs.as_mut_ptr(), eights.len()) }
    };
    (x, out, sum)
}

/// `y[i] += acc[i] * (scale[i] * x_scale)` for as many as the assembler takes, with two bf16 scales a word; returns how many
/// those are.
#[cfg(actq_fpu)]
pub fn scale_add(acc: &[i32], scales: &[u32], x_scale: f32, y: &mut [f32]) -> usize {
    let len = acc.len().min(2 * scales.len()).min(y.len()) & !3;
    if len > 0 {
        // SAFETY: all three slices hold at least `len` values, which is a multiple of 4 and not 0.
        unsafe { actq_scale_add(x_scale, acc.as_ptr(), scales.as_ptr(), y.as_mut_ptr(), len) }
    }
    len
}

#[cfg(actq_fpu)]
unsafe extern "C" {
    fn actq_quantize0(inverse: f32, round: f32, x: *const f32, out: *mut u32, len: usize) -> i32;
    fn actq_quantize1(inverse: f32, round: f32, x: *const f32, out: *mut u32, len: usize) -> i32;
    fn actq_quantize2(inverse: f32, round: f32, x: *const f32, out: *mut u32, len: usize) -> i32;
    fn actq_quantize3(inverse: f32, round: f32, x: *const f32, out: *mut u32, len: usize) -> i32;
    fn actq_scale_add(x_scale: f32, acc: *const i32, scales: *const u32, y: *mut f32, len: usize);
}
