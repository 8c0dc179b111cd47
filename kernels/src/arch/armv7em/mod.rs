//! The GEMV in Armv7E-M assembler (Cortex-M4 and M7): SMLAD computes two MACs a cycle, four with paired lanes. Armv8-M
//! with the DSP extension (Cortex-M33) has the same instructions.
//!
//! `single.s` has one loop nest for the four layouts of single lanes. Each layout of paired lanes has a file, with a
//! kernel for row scales and one for group scales. All compute the same bits as the portable backend; the tests run
//! both on the same data.
//!
//! SMLAD sets the Q flag; the procedure call standard allows a call to change it.

#[cfg(feature = "attention")]
mod attention;
mod table;

#[cfg(feature = "attention")]
pub(crate) use self::attention::{query_keys, weigh_values};
use self::table::kernels;
use super::product::Product;
use crate::layout::QUAD;

assembler!("single.s");
assembler!("paired_w2.s");
assembler!("paired_w3.s");
assembler!("paired_w4.s");
assembler!("paired_w8.s");
assembler!("vector.s");

/// Computes a product as [`crate::arch::gemv`] does.
#[inline(always)]
pub(crate) fn gemv(product: Product<'_>) {
    #[cfg(feature = "scalar")]
    if product.block.shape().lanes == crate::layout::Lanes::Scalar {
        return super::portable::gemv(product);
    }
    #[cfg(feature = "helium")]
    if product.block.shape().lanes == crate::layout::Lanes::Helium {
        #[cfg(actq_helium)]
        return super::helium::gemv(product);
        #[cfg(not(actq_helium))]
        return super::portable::gemv(product);
    }
    let Product { block, x, first_row, acc, .. } = product;
    let [kernel, four] = kernels(block.shape());
    let layout = x.plan().layout;
    let strip_log = layout.strip_log as u8;
    let strips = acc.len() >> strip_log;
    let rows = strips << strip_log;
    let rest = acc.len() - rows;
    let arguments = x.plan().arguments();
    // SAFETY: the rows from `first_row` on, as many as `acc` has, are rows of the block or of its padding: that is what
    // `Product::new` checks. It also checks that `first_row` is a multiple of 8, so that a strip starts there. A block
    // has the words of all of its rows (`Block::leading`). Each call reads the words of its strips and writes as many
    // sums. It reads the prepared vector from its start to `end`, and the sums of x after it if the layout has sums;
    // both are in the vector, because it was prepared for a block of this shape (`Plan::of`). The slices are of u32 and
    // i32, so every address is a multiple of 4, as LDM and LDRD demand.
    unsafe {
        let weights = block.words().as_ptr().add(first_row / QUAD * block.quad_words());
        let (x, acc) = (x.words().as_ptr(), acc.as_mut_ptr());
        let end = x.add(arguments.end);
        if strips > 0 {
            kernel(weights, x, acc, strips, end, arguments.extra, arguments.skip);
        }
        if rest > 0 {
            let weights = weights.add(rows / QUAD * block.quad_words());
            four(weights, x, acc.add(rows), 1, end, arguments.extra, arguments.skip);
        }
    }
}

unsafe extern "C" {
    #[cfg(not(actq_helium))]
    fn actq_magnitude(x: *const f32, len: usize) -> u32;
    #[cfg(feature = "checksums")]
    fn actq_xor(words: *const u32, len: usize) -> u32;
    fn actq_copy(from: *const u32, to: *mut u32, len: usize);
}

/// Copies `from` to `to`, up to the shorter length.
#[inline(always)]
pub(crate) fn copy(from: &[u32], to: &mut [u32]) {
    let len = from.len().min(to.len());
    if len > 0 {
        // SAFETY: both hold at least `len` words, and do not overlap, because one of them is borrowed mutably.
        unsafe { actq_copy(from.as_ptr(), to.as_mut_ptr(), len) }
    }
}

/// Returns the exclusive or of words.
#[cfg(feature = "checksums")]
#[inline(never)]
pub(crate) fn xor(words: &[u32]) -> u32 {
    let (most, rest) = words.split_at(words.len() & !15);
    // SAFETY: the length is that of the slice, a multiple of 16 and not 0.
    let sum = if most.is_empty() { 0 } else { unsafe { actq_xor(most.as_ptr(), most.len()) } };
    rest.iter().fold(sum, |sum, word| sum ^ word)
}

/// Returns the bits of the largest magnitude.
#[cfg(not(actq_helium))]
pub(crate) fn magnitude(x: &[f32]) -> u32 {
    let (eights, rest) = x.split_at(x.len() & !7);
    let largest = if eights.is_empty() {
        0
    } else {
        // SAFETY: the length is that of the slice, a multiple of 8 and not 0.
        unsafe { actq_magnitude(eights.as_ptr(), eights.len()) >> 1 }
    };
    rest.iter().fold(largest, |m, v| m.max(v.to_bits() & 0x7fff_ffff))
}
