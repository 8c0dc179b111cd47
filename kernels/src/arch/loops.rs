//! Loops of the scalar layouts in assembler, for ARMv6-M, ARMv7-M and RV32IM: the arithmetic of the portable backend,
//! which calls them.
//!
//! The compiler takes more instructions for a lookup, and keeps fewer of the sums in registers.

use super::tables::{TABLE_WORDS, Table};
use crate::layout::{QUAD, STRIP};

/// The symbol `ZBA` in a file: 1 where RISC-V adds a shifted index to an address in one instruction.
#[cfg(actq_zba)]
macro_rules! zba {
    () => {
        ".set ZBA, 1"
    };
}
#[cfg(not(actq_zba))]
macro_rules! zba {
    () => {
        ".set ZBA, 0"
    };
}

/// Assembles the files of an architecture.
macro_rules! assembler {
    ($folder:literal) => {
        core::arch::global_asm!(zba!(), include_str!(concat!($folder, "/planes.s")), options(raw));
        core::arch::global_asm!(include_str!(concat!($folder, "/pairs.s")), options(raw));
        core::arch::global_asm!(include_str!(concat!($folder, "/bytes.s")), options(raw));
    };
}

#[cfg(actq_armv6m)]
assembler!("armv6m");
#[cfg(actq_armv7m)]
assembler!("armv7m");
#[cfg(actq_rv32im)]
assembler!("rv32im");

unsafe extern "C" {
    fn actq_bytes_w8(weights: *const u32, tile: *const i32, acc: *mut i32, end: *const i32, skip: usize, pairs: usize);
    fn actq_pairs_w4(
        weights: *const u32,
        chunk: *const u32,
        acc: *mut i32,
        end: *const i32,
        skip: usize,
        eights: usize,
    );
    fn actq_planes_build(x: *const u32, tables: *mut u32, count: usize);
    fn actq_planes_w2(
        weights: *const u32,
        tables: *const u16,
        acc: *mut i32,
        end: *const i32,
        skip: usize,
        count: usize,
    );
    fn actq_planes_w3(
        weights: *const u32,
        tables: *const u16,
        acc: *mut i32,
        end: *const i32,
        skip: usize,
        count: usize,
    );
}

/// Builds the tables of successive units, up to the shorter length.
pub(super) fn build(x: &[[u32; 4]], tables: &mut [[u32; TABLE_WORDS]]) {
    let count = x.len().min(tables.len());
    if count > 0 {
        // SAFETY: it reads four words of x and writes a table for each of `count` units, which is not 0.
        unsafe { actq_planes_build(x.as_ptr().cast(), tables.as_mut_ptr().cast(), count) }
    }
}

/// Adds the entries of successive units to the sums of strips, whose weights are `stride` words apart.
pub(super) fn add_strips<const B: usize>(
    weights: &[u32],
    stride: usize,
    tables: &[Table],
    strips: &mut [[i32; STRIP]],
) {
    let (count, unit) = (tables.len(), 2 * B);
    let needed = strips.len().saturating_sub(1) * stride + count * unit;
    if count == 0 || strips.is_empty() || weights.len() < needed || stride < count * unit {
        return;
    }
    let kernel = if B == 2 { actq_planes_w2 } else { actq_planes_w3 };
    let acc = strips.as_flattened_mut().as_mut_ptr_range();
    // SAFETY: both lengths are at least 1. For each strip it reads two words a plane and unit, then skips to the next
    // strip: `weights` has all of them. It reads entries of `count` tables, each by a byte, and adds to eight sums for
    // each strip, up to the end.
    unsafe { kernel(weights.as_ptr(), tables.as_ptr().cast(), acc.start, acc.end, 4 * (stride - count * unit), count) }
}

/// Adds a chunk's products to the sums of strips, whose weights are `stride` words apart. A chunk is two start words and
/// whole eights of columns.
pub(super) fn add_pairs(weights: &[u32], stride: usize, chunk: &[u32], strips: &mut [[i32; STRIP]]) {
    let eights = chunk.len().saturating_sub(2) / 4;
    let words = 8 * eights;
    let needed = strips.len().saturating_sub(1) * stride + words;
    if eights == 0 || strips.is_empty() || weights.len() < needed || stride < words {
        return;
    }
    let acc = strips.as_flattened_mut().as_mut_ptr_range();
    // SAFETY: both lengths are at least 1. For each strip it reads eight words for eight columns, then skips to the next
    // strip: `weights` has all of them. It reads two words of the chunk and four for eight columns, and adds to eight
    // sums for each strip, up to the end.
    unsafe { actq_pairs_w4(weights.as_ptr(), chunk.as_ptr(), acc.start, acc.end, 4 * (stride - words), eights) }
}

/// Adds the products of a tile, whole fours of pairs of columns with `N` words each, to the sums of strips, whose weights
/// are `stride` words apart.
pub(super) fn add_bytes<const N: usize>(weights: &[u32], stride: usize, tile: &[[i32; N]], strips: &mut [[i32; QUAD]]) {
    const { assert!(N == if cfg!(actq_armv6m) { 2 } else { 4 }) }
    let pairs = tile.len() & !3;
    let words = 2 * pairs;
    let needed = strips.len().saturating_sub(1) * stride + words;
    if pairs == 0 || strips.is_empty() || weights.len() < needed || stride < words {
        return;
    }
    let acc = strips.as_flattened_mut().as_mut_ptr_range();
    // SAFETY: both lengths are at least 1, and the pairs are a multiple of 4. For each strip it reads two words a pair,
    // then skips to the next strip: `weights` has all of them. It reads N words of the tile a pair, and adds to four
    // sums for each strip, up to the end.
    unsafe { actq_bytes_w8(weights.as_ptr(), tile.as_ptr().cast(), acc.start, acc.end, 4 * (stride - words), pairs) }
}
