//! The GEMV of the layouts for Helium, and conversions from and to f32, in assembler for Cortex-M55 and M85: the
//! arithmetic of the portable backend, with its bits. All other kernels of these cores are those of the DSP extension.
//!
//! The loops set LTPSIZE and VPR, which the procedure call standard allows a call to change.

use super::armv7em_fpu;
use super::product::Product;
use crate::activations::Plan;
use crate::layout::{BlockShape, QUAD, Width};
use crate::math::exp2::{EXP, QUARTER, exp2_constants};

core::arch::global_asm!(include_str!("gemv.s"), options(raw));
core::arch::global_asm!(include_str!("vector.s"), options(raw));

/// A kernel: it reads the strips at `weights` and the prepared vector at `x`, of `steps` steps, and writes the strips'
/// sums from `acc` up to `end`. A group has `group` steps; kernels for row scales ignore it.
type Kernel = unsafe extern "C" fn(
    weights: *const u32,
    x: *const u32,
    acc: *mut i32,
    end: *const i32,
    steps: usize,
    group: usize,
);

macro_rules! kernels {
    ($($name:ident)*) => {
        unsafe extern "C" {
            $(fn $name(
                weights: *const u32,
                x: *const u32,
                acc: *mut i32,
                end: *const i32,
                steps: usize,
                group: usize,
            );)*
        }
    };
}
kernels! {
    actq_helium_w2 actq_helium_w2_four actq_helium_w2_group actq_helium_w2_group_four
    actq_helium_w3 actq_helium_w3_group
    actq_helium_w4 actq_helium_w4_four actq_helium_w4_group actq_helium_w4_group_four
    actq_helium_w8 actq_helium_w8_four actq_helium_w8_group actq_helium_w8_group_four
}

unsafe extern "C" {
    fn actq_helium_magnitude(x: *const f32, len: usize) -> u32;
    fn actq_helium_quantize(x: *const f32, len: usize, out: *mut u32, inverse: u32) -> i32;
    fn actq_helium_scale(
        sums: *const i32,
        start: *const u32,
        scales: *const u32,
        y: *mut f32,
        eights: usize,
        x_scale: u32,
    ) -> usize;
    fn actq_helium_relu(x: *mut f32, len: usize);
    fn actq_helium_elu(x: *mut f32, len: usize, constants: &[f32; 5]);
}

/// Stands for the kernels that the build leaves out. It does nothing: `image::matrix` refuses such blocks.
unsafe extern "C" fn left_out(_: *const u32, _: *const u32, _: *mut i32, _: *const i32, _: usize, _: usize) {}

/// Returns the kernel for the layout's strips, and that for a last strip of four rows.
fn kernels(shape: BlockShape) -> [Kernel; 2] {
    let [row, group]: [[Kernel; 2]; 2] = match shape.width {
        Width::W2 if cfg!(feature = "w2") => {
            [[actq_helium_w2, actq_helium_w2_four], [actq_helium_w2_group, actq_helium_w2_group_four]]
        }
        Width::W3 if cfg!(feature = "w3") => [[actq_helium_w3; 2], [actq_helium_w3_group; 2]],
        Width::W4 if cfg!(feature = "w4") => {
            [[actq_helium_w4, actq_helium_w4_four], [actq_helium_w4_group, actq_helium_w4_group_four]]
        }
        Width::W8 if cfg!(feature = "w8") => {
            [[actq_helium_w8, actq_helium_w8_four], [actq_helium_w8_group, actq_helium_w8_group_four]]
        }
        _ => [[left_out; 2]; 2],
    };
    if shape.has_groups() { group } else { row }
}

/// Computes a product as [`crate::arch::gemv`] does.
#[inline(never)]
pub(super) fn gemv(Product { block, x, first_row, acc, .. }: Product<'_>) {
    let shape = block.shape();
    let (strip, step) = (shape.strip_rows(), x.plan().layout.step_log);
    let [kernel, four] = kernels(shape);
    let (steps, group) = (shape.padded_cols() >> step, shape.group >> step);
    let rows = acc.len() & !(strip - 1);
    let (strips, rest) = acc.split_at_mut(rows);
    let weights = block.rows_from(first_row);
    let x = x.words().as_ptr();
    // SAFETY: the rows from `first_row` on, as many as `acc` has, are rows of the block or of its padding: that is what
    // `Product::new` checks. It also checks that `first_row` is a multiple of 8, so that a strip starts there. A block
    // has the words of all of its rows (`Block::leading`), padded to whole steps, which are whole vectors. Each call
    // reads the words of its strips and writes as many sums, at least one strip's. Of the prepared vector it reads, for
    // each group, the sum and the steps of its columns, which a vector for a block of this shape has (`Plan::of`): all
    // groups in it are whole. The slices are of u32 and i32, so every address is a multiple of 4. A group has one step
    // or more: 32 columns are one or two.
    unsafe {
        if rows > 0 {
            let acc = strips.as_mut_ptr_range();
            kernel(weights.as_ptr(), x, acc.start, acc.end, steps, group);
        }
        if !rest.is_empty() {
            let acc = rest.as_mut_ptr_range();
            four(weights.as_ptr().add(rows / QUAD * block.quad_words()), x, acc.start, acc.end, steps, group);
        }
    }
}

/// Returns the bits of the largest magnitude.
pub(super) fn magnitude(x: &[f32]) -> u32 {
    if x.is_empty() {
        return 0;
    }
    // SAFETY: it reads the slice, which is not empty.
    unsafe { actq_helium_magnitude(x.as_ptr(), x.len()) >> 1 }
}

/// Quantizes `x` with the plan, of a layout for Helium, to the first words of `out`; `None` if `out` is shorter than
/// [`Plan::room`]. Without `x`, the values are the first words of `out`, the plan's columns.
#[inline(never)]
pub(super) fn quantize(x: Option<&mut [f32]>, inverse: f32, plan: &Plan, out: &mut [u32]) -> Option<()> {
    if inverse != 0.0 && !inverse.is_normal() {
        // Helium would take the factor for 0.
        return super::portable::quantize(x, inverse, plan, out);
    }
    let cols = plan.shape.cols;
    let room = out.get_mut(..x.as_ref().map_or(cols.max(plan.words()), |x| plan.room(x.len())))?;
    let columns = plan.padded.checked_div(plan.groups)?;
    let (group_words, to) = (1 + columns / 4, room.as_mut_ptr());
    let (from, mut left) = x.map_or((to.cast_const().cast(), cols), |x| (x.as_ptr(), x.len()));
    for group in 0..plan.groups.min(room.len() / group_words) {
        let (len, x) = (left.min(columns), from.wrapping_add(group * columns));
        left -= len;
        // SAFETY: the room has the group's words: a sum, and a word for four columns. The kernel reads `len` values, at least
        // one, and writes as many bytes; it leaves the last word's other bytes as they are. Where the values are the
        // room's words, it reads four before it writes their bytes, to words before the next four.
        unsafe {
            let sum = to.add(group * group_words);
            let bytes = sum.add(1);
            *sum = match len {
                0 => 0,
                _ => actq_helium_quantize(x, len, bytes, inverse.to_bits()) as u32,
            };
            if !len.is_multiple_of(4) {
                *bytes.add(len / 4) &= (1 << (8 * (len % 4))) - 1;
            }
            (len.div_ceil(4)..columns / 4).for_each(|word| bytes.add(word).write(0));
        }
    }
    Some(())
}

/// Computes the same as the FPU's assembler: eight values at a time by Helium, unless a number is subnormal or NaN.
#[inline(never)]
pub(crate) fn scale(sums: Option<&[i32]>, start: Option<&[u32]>, scales: &[u32], x_scale: f32, y: &mut [f32]) {
    // A result that is added to may be any NaN, and keeps its bits on the FPU.
    let Some(start) = start else { return armv7em_fpu::scale(sums, None, scales, x_scale, y) };
    let len = y.len().min(2 * scales.len()).min(start.len()).min(sums.map_or(usize::MAX, <[_]>::len));
    let mut done = 0;
    while let eights @ 1.. = (len - done) / 8 {
        let to = y.as_mut_ptr();
        let sums_at = sums.map_or(to.cast_const().cast(), <[_]>::as_ptr);
        // SAFETY: all operands hold at least `len` values, two a word of `scales`, and `done` is a multiple of 8. The
        // kernel reads up to eight values for each of `eights` and writes the results. The sums may be y itself: they
        // are read before it is written.
        let left = unsafe {
            let scales = scales.as_ptr().add(done / 2);
            let (sums, start, y) = (sums_at.add(done), start.as_ptr().add(done), to.add(done));
            actq_helium_scale(sums, start, scales, y, eights, x_scale.to_bits())
        };
        done += 8 * (eights - left.min(eights));
        if left == 0 {
            break;
        }
        part(done, 8, sums, start, scales, x_scale, y);
        done += 8;
    }
    part(done, len - done, sums, start, scales, x_scale, y);
}

/// Computes `len` values from `first` on, a multiple of 8, on the FPU.
fn part(first: usize, len: usize, sums: Option<&[i32]>, start: &[u32], scales: &[u32], x_scale: f32, y: &mut [f32]) {
    let sums = sums.map(|sums| sums.get(first..).unwrap_or(&[]));
    let (start, scales) = (start.get(first..).unwrap_or(&[]), scales.get(first / 2..).unwrap_or(&[]));
    if let Some(y) = y.get_mut(first..).and_then(|y| y.get_mut(..len))
        && len > 0
    {
        armv7em_fpu::scale(sums, Some(start), scales, x_scale, y);
    }
}

/// Applies [`crate::math::relu`] to every element.
pub(crate) fn relu(x: &mut [f32]) {
    if !x.is_empty() {
        // SAFETY: it reads and writes the elements of x, of which there is at least one.
        unsafe { actq_helium_relu(x.as_mut_ptr(), x.len()) }
    }
}

/// Applies [`crate::math::elu`] to every element.
pub(crate) fn elu(x: &mut [f32]) {
    static ELU: [f32; 5] = {
        let [round, p1, p0, q0] = exp2_constants(QUARTER);
        [EXP, round, p1, p0, q0]
    };
    if !x.is_empty() {
        // SAFETY: it reads and writes the elements of x, of which there is at least one.
        unsafe { actq_helium_elu(x.as_mut_ptr(), x.len(), &ELU) }
    }
}
