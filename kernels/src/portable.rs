//! The GEMV in plain Rust, for any target: the algorithm of the assembler backend, instruction for instruction where it can be.

use crate::activations::Prepared;
use crate::format::{Block, Format, QUAD, Width, w2, w3, w4, w8};

/// As [`crate::gemv::gemv`].
pub fn gemv(block: &Block<'_>, x: &Prepared<'_>, first_quad: usize, acc: &mut [[i32; QUAD]]) {
    match block.shape().width {
        Width::W2 => gemv_of::<w2::W2>(block, x, first_quad, acc),
        Width::W3 => gemv_of::<w3::W3>(block, x, first_quad, acc),
        Width::W4 => gemv_of::<w4::W4>(block, x, first_quad, acc),
        Width::W8 => gemv_of::<w8::W8>(block, x, first_quad, acc),
    }
}

/// The start value of a group's sums: what the codes' offset adds to every row, taken back.
#[inline(always)]
fn start(width: Width, sum: u32) -> i32 {
    match width {
        Width::W8 => 0,
        // -(2^b - 1) * sum
        _ => (sum as i32).wrapping_sub((sum as i32) << width.bits()),
    }
}

fn gemv_of<F: Format>(block: &Block<'_>, x: &Prepared<'_>, first_quad: usize, acc: &mut [[i32; QUAD]]) {
    let shape = block.shape();
    let quads = block.quads_from(first_quad).chunks_exact(shape.quad_words());
    let unit_words = F::UNIT.words * QUAD;
    let group_units = shape.units_per_group();
    // A group's part of the prepared vector and of the quad; the last group may be shorter.
    let group_x = 1 + group_units * F::UNIT.cols / 2;
    let group_words = group_units * unit_words + usize::from(shape.group != 0);
    for (quad, sums) in quads.zip(acc) {
        *sums = [0; QUAD];
        let x_groups = match shape.group {
            0 => x.words.chunks(x.words.len().max(1)),
            _ => x.words.chunks(group_x),
        };
        for (words, x) in quad.chunks(group_words).zip(x_groups) {
            let Some((&sum, x)) = x.split_first() else { continue };
            let mut t = [start(F::WIDTH, sum); QUAD];
            for (words, x) in words.chunks_exact(unit_words).zip(x.chunks_exact(F::UNIT.cols / 2)) {
                F::mac_quad(words, x, &mut t);
            }
            match (shape.group, words.last()) {
                (0, _) | (_, None) => *sums = t,
                (_, Some(&scales)) => {
                    for (r, (sum, t)) in sums.iter_mut().zip(t).enumerate() {
                        let scale = i32::from((u32::from_le(scales) >> (8 * r)) as u8);
                        *sum = sum.wrapping_add(t.wrapping_mul(scale));
                    }
                }
            }
        }
    }
}
