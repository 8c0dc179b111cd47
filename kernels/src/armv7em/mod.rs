//! The GEMV in Armv7E-M assembler (Cortex-M4 and M7): SMLAD makes two MACs a cycle, four with paired lanes.
//!
//! `single.s` holds one loop nest, stamped over the four layouts of single lanes; the layouts of paired lanes have a file
//! each, with a kernel for row scales and one for group scales. All compute exactly what [`crate::portable`] computes; the tests
//! run both on the same data.
//!
//! SMLAD sets the Q flag; the procedure call standard lets a call change it.

use core::arch::global_asm;
#[cfg(actq_fpu)]
use core::ops::Range;

use crate::activations::Prepared;
#[cfg(actq_fpu)]
use crate::activations::{Groups, ROUND};
#[cfg(actq_fpu)]
use crate::format::{self, Format, XFormat};
use crate::format::{Block, QUAD, STRIP};
use crate::gemv::Mismatch;
#[cfg(actq_fpu)]
use crate::math::CELL;

global_asm!(include_str!("single.s"), options(raw));
global_asm!(include_str!("paired_w2.s"), options(raw));
global_asm!(include_str!("paired_w3.s"), options(raw));
global_asm!(include_str!("paired_w4.s"), options(raw));
global_asm!(include_str!("paired_w8.s"), options(raw));
global_asm!(include_str!("vector.s"), options(raw));
#[cfg(actq_fpu)]
global_asm!(include_str!("vector_fpu.s"), options(raw));
#[cfg(actq_fpu)]
global_asm!(include_str!("cells_fpu.s"), options(raw));

/// Reads `strips` strips at `weights` and the prepared vector from `x` up to `x_end`, writes the strips' sums at `acc`. What
/// `extra` is, the kernel's file says; the first pass through the loop of a kernel for row scales leaves `skip` of the layout's
/// steps out.
type Kernel = unsafe extern "C" fn(
    weights: *const u32,
    x: *const u32,
    acc: *mut i32,
    strips: usize,
    x_end: *const u32,
    extra: usize,
    skip: usize,
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
                skip: usize,
            );)*
        }
    };
}
kernels! {
    actq_w2 actq_w3 actq_w4 actq_w8
    actq_w2_paired_row actq_w2_paired_row4 actq_w2_paired_group actq_w2_paired_group4
    actq_w3_paired_row actq_w3_paired_group
    actq_w4_paired_row actq_w4_paired_row4 actq_w4_paired_group actq_w4_paired_group4
    actq_w8_paired_row actq_w8_paired_group
}

/// The kernel for strips of eight rows, where the layout has them, and that for strips of four.
type Kernels = (Option<Kernel>, Kernel);

/// By width, lanes and whether there are group scales.
static KERNELS: [[[Kernels; 2]; 2]; 4] = [
    [
        [(None, actq_w2), (None, actq_w2)],
        [(Some(actq_w2_paired_row), actq_w2_paired_row4), (Some(actq_w2_paired_group), actq_w2_paired_group4)],
    ],
    [
        [(None, actq_w3), (None, actq_w3)], //
        [(None, actq_w3_paired_row), (None, actq_w3_paired_group)],
    ],
    [
        [(None, actq_w4), (None, actq_w4)],
        [(Some(actq_w4_paired_row), actq_w4_paired_row4), (Some(actq_w4_paired_group), actq_w4_paired_group4)],
    ],
    [
        [(None, actq_w8), (None, actq_w8)], //
        [(None, actq_w8_paired_row), (None, actq_w8_paired_group)],
    ],
];

/// As [`crate::gemv::gemv`], for rows that were checked there.
#[inline(never)]
pub fn gemv(block: &Block<'_>, x: &Prepared<'_>, first_row: usize, acc: &mut [i32]) -> Result<(), Mismatch> {
    let shape = block.shape();
    let weights = block.rows_from(first_row);
    let quads = acc.len() / QUAD;
    if weights.len() < quads * block.quad_words() || !x.fits(shape) {
        return Err(Mismatch);
    }
    let (eight, four) = KERNELS[shape.width as usize][shape.lanes as usize][usize::from(shape.group != 0)];
    let strips = if eight.is_some() { acc.len() / STRIP } else { 0 };
    let Some((first, last)) = acc.split_at_mut_checked(strips * STRIP) else { return Err(Mismatch) };
    let (x_end, extra) = x.bounds();
    // SAFETY: `weights` holds the words of `acc.len()` rows from `first_row` on, which is a multiple of 8, so strips begin
    // there and after the strips of eight: each call reads the words of its strips and writes as many sums. It reads the
    // prepared vector from its begin to `x_end`, and the sum of x that stands there where the layout has row scales and a
    // sum; both are in the vector, because it was prepared for a block of this shape. The slices are of u32 and i32, so every address
    // is a multiple of 4, as LDM and LDRD demand.
    unsafe {
        let x_words = x.words().as_ptr();
        if let (Some(kernel), 1..) = (eight, strips) {
            kernel(weights.as_ptr(), x_words, first.as_mut_ptr(), strips, x_words.add(x_end), extra, x.skip());
        }
        if !last.is_empty() {
            let weights = weights.as_ptr().add(strips * STRIP / QUAD * block.quad_words());
            four(weights, x_words, last.as_mut_ptr(), last.len() / QUAD, x_words.add(x_end), extra, x.skip());
        }
    }
    Ok(())
}

unsafe extern "C" {
    fn actq_magnitude(x: *const f32, len: usize) -> u32;
    fn actq_copy(from: *const u32, to: *mut u32, len: usize);
}

/// `to = from`, as far as both go.
#[inline(always)]
pub(crate) fn copy(from: &[u32], to: &mut [u32]) {
    let len = from.len().min(to.len());
    if len > 0 {
        // SAFETY: both hold at least `len` words, and do not overlap, because one of them is borrowed mutably.
        unsafe { actq_copy(from.as_ptr(), to.as_mut_ptr(), len) }
    }
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

/// As [`crate::activations`] describes it; `None`, with nothing written, where the lengths do not fit.
#[cfg(actq_fpu)]
#[inline(never)]
pub(crate) fn quantize(x: &[f32], inverse: f32, format: &XFormat, run: Groups, out: &mut [u32]) -> Option<i32> {
    let Groups { groups, chunks, first, chunk } = run;
    if groups == 0
        || chunks == 0
        || first < 8
        || chunk < 8
        || (first | chunk) % 8 != 0
        || first.max(chunk) > format.chunk
    {
        return None;
    }
    let [start, more @ ..] = format.starts else { return None };
    let kernel = *QUANTIZE.get(format.shift as usize)?;
    let second = more.first().map_or(0, |start| start.factor);
    let cols = first + (chunks - 1) * chunk;
    let words = chunks * format.starts.len() + cols / 2 + usize::from(format.sum);
    if x.len() < groups * cols || out.len() < groups * words {
        return None;
    }
    let (x, out) = (x.as_ptr(), out.as_mut_ptr());
    let (first, chunk) = (first / 8, chunk / 8);
    // SAFETY: all counts are 1 or more. The kernel reads the columns of all groups and writes their words; both lengths were
    // compared above. It writes as many start words and sums as `format` has, which `has_quantizer` says of every layout, and
    // where it takes eight columns for a chunk, that is the format's limit and so `first` and `chunk`.
    Some(unsafe { kernel(inverse, ROUND, x, out, groups, chunks, first, chunk, start.bias, start.factor, second) })
}

/// `y[i] = start[i] + sum[i] * (scale[i] * x_scale)`, with two bf16 scales a word; what is `None` stands in y, the sums with
/// their bits. As far as the shortest goes.
#[cfg(actq_fpu)]
#[inline(never)]
pub(crate) fn scale(sums: Option<&[i32]>, start: Option<&[u32]>, scales: &[u32], x_scale: f32, y: &mut [f32]) {
    let len = y.len().min(2 * scales.len());
    let len = len.min(sums.map_or(len, <[_]>::len)).min(start.map_or(len, <[_]>::len));
    let to = y.as_mut_ptr();
    let sums = sums.map_or(to.cast_const().cast(), <[_]>::as_ptr);
    let start = start.map_or(to.cast_const(), |start| start.as_ptr().cast());
    // SAFETY: all operands hold at least `len` values; no place in `y` is written before what stands there was read.
    unsafe { actq_scale_add(x_scale, sums, scales.as_ptr(), start, to, len) }
}

/// Some elements of [`crate::recurrent::lstm_cell`].
#[cfg(actq_fpu)]
pub(crate) fn lstm_elements(elements: Range<usize>, gates: &[f32], c: &mut [f32], h: &mut [f32]) {
    let (Range { start, end }, n) = (elements, h.len());
    if start >= end || end > n || end > c.len() || gates.len() < 3 * n + end {
        return;
    }
    // SAFETY: of `gates`, the kernel reads the elements of four rows of n values, the last up to `3 n + end`, which is no more
    // than there are (n values take less than half of the memory: 4 n is no overflow). Of `c` and `h` it reads and writes the
    // elements, which both have. There is at least one.
    unsafe {
        let (c, h) = (c.as_mut_ptr().add(start), h.as_mut_ptr().add(start));
        actq_lstm(gates.as_ptr().add(start), size_of::<f32>() * n, c, h, end - start, &CELL);
    }
}

/// Some elements of [`crate::recurrent::gru_cell`].
#[cfg(actq_fpu)]
pub(crate) fn gru_elements(elements: Range<usize>, a: &[f32], b: &[f32], h: &mut [f32]) {
    let (Range { start, end }, n) = (elements, h.len());
    if start >= end || end > n || a.len().min(b.len()) < 2 * n + end {
        return;
    }
    // SAFETY: as for [`lstm_elements`], with three rows of `a` and of `b`.
    unsafe {
        let (a, b, h) = (a.as_ptr().add(start), b.as_ptr().add(start), h.as_mut_ptr().add(start));
        actq_gru(a, b, size_of::<f32>() * n, h, end - start, &CELL);
    }
}

/// The FPU's square root, which is correctly rounded as IEEE 754 has it.
#[cfg(actq_fpu)]
#[inline(always)]
pub(crate) fn sqrt(x: f32) -> f32 {
    // SAFETY: a function of one register.
    unsafe { actq_sqrt(x) }
}

#[cfg(actq_fpu)]
macro_rules! quantize_kernels {
    ($($name:ident)*) => {
        /// Writes `groups` groups of `chunks` chunks, the first of `first` times eight values and the others of `eights`.
        type Quantize = unsafe extern "C" fn(
            inverse: f32, round: f32, x: *const f32, out: *mut u32,
            groups: usize, chunks: usize, first: usize, eights: usize, bias: i32, factor: i32, second_factor: i32,
        ) -> i32;

        unsafe extern "C" {
            $(fn $name(
                inverse: f32, round: f32, x: *const f32, out: *mut u32,
                groups: usize, chunks: usize, first: usize, eights: usize, bias: i32, factor: i32, second_factor: i32,
            ) -> i32;)*
        }
    };
}
#[cfg(actq_fpu)]
quantize_kernels!(actq_quantize0 actq_quantize1 actq_quantize2 actq_quantize3);

/// By shift.
#[cfg(actq_fpu)]
static QUANTIZE: [Quantize; 4] = [actq_quantize0, actq_quantize1, actq_quantize2, actq_quantize3];

/// Whether the kernel of the layout's shift writes what the layout asks for: two start words, the second without a bias, at
/// shift 1; sums from 2 on; chunks of eight at 3.
#[cfg(actq_fpu)]
const fn has_quantizer<F: Format>() -> bool {
    let starts = match F::X.starts {
        [_] => F::X.shift != 1,
        [_, second] => F::X.shift == 1 && second.bias == 0,
        _ => false,
    };
    starts && F::X.sum == (F::X.shift >= 2) && (F::X.shift == 3) == (F::X.chunk == 8) && F::X.shift <= 3
}

#[cfg(actq_fpu)]
const _: () = {
    assert!(has_quantizer::<format::w2::W2>() && has_quantizer::<format::w2_paired::W2Paired>());
    assert!(has_quantizer::<format::w3::W3>() && has_quantizer::<format::w3_paired::W3Paired>());
    assert!(has_quantizer::<format::w4::W4>() && has_quantizer::<format::w4_paired::W4Paired>());
    assert!(has_quantizer::<format::w8::W8>() && has_quantizer::<format::w8_paired::W8Paired>());
};

#[cfg(actq_fpu)]
unsafe extern "C" {
    fn actq_sqrt(x: f32) -> f32;
    fn actq_lstm(gates: *const f32, row: usize, c: *mut f32, h: *mut f32, len: usize, cell: &[f32; 6]);
    fn actq_gru(a: *const f32, b: *const f32, row: usize, h: *mut f32, len: usize, cell: &[f32; 6]);
    fn actq_scale_add(x_scale: f32, sums: *const i32, scales: *const u32, start: *const f32, y: *mut f32, len: usize);
}
