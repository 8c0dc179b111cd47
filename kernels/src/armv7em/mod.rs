//! The GEMV in Armv7E-M assembler (Cortex-M4 and M7): SMLAD makes two MACs a cycle.
//!
//! `gemv.s` holds one loop nest, stamped over the four layouts, with and without group scales. Each computes exactly what
//! [`crate::portable`] computes; the tests run both on the same data.
//!
//! SMLAD sets the Q flag; the procedure call standard lets a call change it.

use core::arch::global_asm;

use crate::activations::Prepared;
use crate::format::{Block, QUAD, Width};

global_asm!(include_str!("gemv.s"), options(raw));

/// Reads `quads` quads at `weights` and the prepared vector from `x` up to `x_end`, writes four sums per quad at `acc`.
/// `group_bytes` is the length of one group in the prepared vector, its sum word included.
type Kernel = unsafe extern "C" fn(
    weights: *const u32,
    x: *const u32,
    acc: *mut [i32; QUAD],
    quads: usize,
    x_end: *const u32,
    group_bytes: usize,
);

macro_rules! kernels {
    ($($name:ident)*) => {
        unsafe extern "C" {
            $(fn $name(
                weights: *const u32,
                x: *const u32,
                acc: *mut [i32; QUAD],
                quads: usize,
                x_end: *const u32,
                group_bytes: usize,
            );)*
        }
    };
}
kernels!(actq_w2_row actq_w3_row actq_w4_row actq_w8_row actq_w2_group actq_w3_group actq_w4_group actq_w8_group);

/// As [`crate::gemv::gemv`].
pub fn gemv(block: &Block<'_>, x: &Prepared<'_>, first_quad: usize, acc: &mut [[i32; QUAD]]) {
    let shape = block.shape();
    let weights = block.quads_from(first_quad);
    let quads = acc.len().min(shape.quads().saturating_sub(first_quad));
    let kernel: Kernel = match (shape.width, shape.group) {
        (Width::W2, 0) => actq_w2_row,
        (Width::W3, 0) => actq_w3_row,
        (Width::W4, 0) => actq_w4_row,
        (Width::W8, 0) => actq_w8_row,
        (Width::W2, _) => actq_w2_group,
        (Width::W3, _) => actq_w3_group,
        (Width::W4, _) => actq_w4_group,
        (Width::W8, _) => actq_w8_group,
    };
    let unit_cols = shape.width.unit().cols;
    let x_words = shape.groups().max(1) + shape.units() * unit_cols / 2;
    let group_bytes = 4 * (1 + shape.units_per_group() * unit_cols / 2);
    if quads == 0 || weights.len() < quads * shape.quad_words() || x.words.len() < x_words {
        return;
    }
    // SAFETY: the lengths were compared just above: the kernel reads `quads * quad_words` words at `weights` and `x_words`
    // words at `x` (units divide PAD_COLS, so `x_words` never passes the padding), and writes `quads` elements of `acc`.
    // The slices are of u32 and i32, so every address is a multiple of 4, as LDM and LDRD demand.
    unsafe {
        kernel(weights.as_ptr(), x.words.as_ptr(), acc.as_mut_ptr(), quads, x.words.as_ptr().add(x_words), group_bytes);
    }
}
