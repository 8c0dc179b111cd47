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
use crate::activations::{Plan, ROUND};
#[cfg(actq_fpu)]
use crate::format::XFormat;
use crate::format::{Block, Format, QUAD, Width};
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
pub(crate) type Kernel = unsafe extern "C" fn(
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

/// The kernel for the layout's strips, and that for a last strip of four rows; where strips have four rows, they are one.
pub(crate) type Kernels = [Kernel; 2];

/// The layout's kernels for row scales and for group scales.
pub(crate) const fn kernels<F: Format>() -> [Kernels; 2] {
    match (F::WIDTH, F::CELL.rows) {
        (Width::W2, 1) => [[actq_w2; 2]; 2],
        (Width::W3, 1) => [[actq_w3; 2]; 2],
        (Width::W4, 1) => [[actq_w4; 2]; 2],
        (Width::W8, 1) => [[actq_w8; 2]; 2],
        (Width::W2, _) => [[actq_w2_paired_row, actq_w2_paired_row4], [actq_w2_paired_group, actq_w2_paired_group4]],
        (Width::W3, _) => [[actq_w3_paired_row; 2], [actq_w3_paired_group; 2]],
        (Width::W4, _) => [[actq_w4_paired_row, actq_w4_paired_row4], [actq_w4_paired_group, actq_w4_paired_group4]],
        (Width::W8, _) => [[actq_w8_paired_row; 2], [actq_w8_paired_group; 2]],
    }
}

/// As [`crate::gemv::gemv`], for rows that were checked there.
#[inline(always)]
pub(crate) fn gemv(block: &Block<'_>, x: &Prepared<'_>, first_row: usize, acc: &mut [i32]) -> Result<(), Mismatch> {
    let shape = block.shape();
    if !x.plan().fits(shape) {
        return Err(Mismatch);
    }
    let layout = x.plan().layout;
    let [kernel, four] = layout.kernels[usize::from(shape.group != 0)];
    let strips = acc.len() >> layout.strip_log;
    let rows = strips << layout.strip_log;
    let rest = acc.len() - rows;
    let told = x.told();
    // SAFETY: the rows from `first_row` on, as many as `acc` has, are rows of the block or of its padding: that is checked before,
    // as is that `first_row` is a multiple of 8, so that a strip begins there. A block has the words of all of its rows
    // (`Block::leading`). Each call reads the words of its strips and writes as many sums. It reads the prepared vector from its
    // begin to `end`, and the sums of x that stand behind where the layout has sums; both are in the vector,
    // because it was prepared for a block of this shape (`Plan::of`). The slices are of u32 and i32, so every address is a
    // multiple of 4, as LDM and LDRD demand.
    unsafe {
        let weights = block.words().as_ptr().add(first_row / QUAD * block.quad_words());
        let (x, acc) = (x.words().as_ptr(), acc.as_mut_ptr());
        let end = x.add(told.end);
        if strips > 0 {
            kernel(weights, x, acc, strips, end, told.extra, told.skip);
        }
        if rest > 0 {
            let weights = weights.add(rows / QUAD * block.quad_words());
            four(weights, x, acc.add(rows), 1, end, told.extra, told.skip);
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

/// Quantizes `x` by the plan to the first words of `room`; nothing where that is shorter than [`Plan::room`].
#[cfg(actq_fpu)]
#[inline(always)]
pub(crate) fn quantize(x: &[f32], inverse: f32, plan: &Plan, room: &mut [u32]) {
    if x.len() != plan.padded {
        return quantize_filled(x, inverse, plan, room);
    }
    if plan.words() <= room.len() {
        // SAFETY: x has the plan's columns, and the room has its words.
        unsafe { quantize_padded(x.as_ptr(), inverse, plan, room.as_mut_ptr()) }
    }
}

/// As [`quantize`], of a vector that does not fill its groups: from a copy at the end of the room that does.
#[cfg(actq_fpu)]
#[cold]
#[inline(never)]
fn quantize_filled(x: &[f32], inverse: f32, plan: &Plan, room: &mut [u32]) {
    let Some(at) = plan.room(x.len()).checked_sub(plan.padded) else { return };
    let Some(padded) = room.get_mut(at..at + plan.padded) else { return };
    copy(bytemuck::must_cast_slice(x), padded);
    padded.iter_mut().skip(x.len()).for_each(|word| *word = 0);
    let out = room.as_mut_ptr();
    // SAFETY: the room holds the copy from `at` on, and so the plan's words, which are fewer. What is written never reaches what
    // is still to be read: behind `n` columns of the copy those are `n / 2` words and start words and sums, of which there are
    // `at` in all.
    unsafe { quantize_padded(out.add(at).cast_const().cast(), inverse, plan, out) }
}

/// Quantizes the plan's padded columns at `x` to its words at `out`.
///
/// # Safety
///
/// Both lie in memory of that length; where they overlap, `x` begins at least as many words behind `out` as the plan has start
/// words and sums.
#[cfg(actq_fpu)]
#[inline(always)]
unsafe fn quantize_padded(x: *const f32, inverse: f32, plan: &Plan, out: *mut u32) {
    let XFormat { chunk, starts: [start, second], .. } = plan.layout.x;
    let (first, chunk) = (plan.first / 8, chunk / 8);
    let kernel = plan.layout.quantize;
    // SAFETY: `of_valid` makes all counts 1 or more and all lengths multiples of 8 columns. The kernel reads eight columns before
    // it writes them. It writes as many start words and sums as the format has, which `quantizer` says of every layout, and where
    // it takes eight columns for a chunk, that is the format's limit and so `first` and `chunk`.
    unsafe {
        let (groups, chunks, group) = (plan.groups, plan.chunks, plan.shape.group);
        kernel(inverse, ROUND, x, out, groups, chunks, first, chunk, start.bias, start.factor, second.factor, group);
    }
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
        /// Writes `groups` groups of `chunks` chunks, the first of `first` times eight values and the others of `eights`. `group` is 0
        /// where there is but one, whose sum, if any, has a word of its own.
        pub(crate) type Quantize = unsafe extern "C" fn(
            inverse: f32, round: f32, x: *const f32, out: *mut u32,
            groups: usize, chunks: usize, first: usize, eights: usize, bias: i32, factor: i32, second_factor: i32, group: usize,
        );

        unsafe extern "C" {
            $(fn $name(
                inverse: f32, round: f32, x: *const f32, out: *mut u32,
                groups: usize, chunks: usize, first: usize, eights: usize, bias: i32, factor: i32, second_factor: i32, group: usize,
            );)*
        }
    };
}
#[cfg(actq_fpu)]
quantize_kernels!(actq_quantize0 actq_quantize1 actq_quantize2 actq_quantize3);

/// The kernel that writes what the layout asks for: two start words, the second without a bias, at shift 1; sums from 2 on,
/// those of pairs at 2; chunks of eight at 3.
#[cfg(actq_fpu)]
pub(crate) const fn quantizer<F: Format>() -> Quantize {
    let XFormat { shift, chunk, start_words, starts: [_, second], sum, pairs, .. } = F::X;
    assert!(shift <= 3 && start_words == if shift == 1 { 2 } else { 1 } && second.bias == 0);
    assert!(sum == (shift >= 2) && (chunk == 8) == (shift == 3) && chunk % 8 == 0 && pairs == (shift == 2));
    [actq_quantize0, actq_quantize1, actq_quantize2, actq_quantize3][shift as usize]
}

#[cfg(actq_fpu)]
unsafe extern "C" {
    fn actq_sqrt(x: f32) -> f32;
    fn actq_lstm(gates: *const f32, row: usize, c: *mut f32, h: *mut f32, len: usize, cell: &[f32; 6]);
    fn actq_gru(a: *const f32, b: *const f32, row: usize, h: *mut f32, len: usize, cell: &[f32; 6]);
    fn actq_scale_add(x_scale: f32, sums: *const i32, scales: *const u32, start: *const f32, y: *mut f32, len: usize);
}
