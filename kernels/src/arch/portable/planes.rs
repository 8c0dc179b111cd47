//! The GEMV of bit planes: it looks sums up in tables, and does not multiply.
//!
//! A level is `2*code - (2^b - 1)`, the sum over planes `p` of `±2^p` by bit `p` of the code. For eight columns, a table
//! has `±x0 ±x1 .. ±x7` for all 256 signs, and a plane's eight bits are an index: a load of the index, a load of the
//! entry and an addition for eight weight bits. One table serves all planes and all rows.
//!
//! Entries are halfwords with [`BIAS`], so none is negative, and one addition of a word builds two. Tables are built for
//! a tile of columns, used by all rows, and overwritten by those of the next tile; the sums wait in `acc`.

#[cfg(actq_loops)]
use crate::arch::loops::{add_strips, build};
use crate::arch::product::Product;
use crate::arch::tables::{TABLE_WORDS, Table};
#[cfg(not(actq_loops))]
use crate::layout::half::halves;
use crate::layout::{Format, QUAD, STRIP};

/// Columns of a table.
const COLS: usize = 8;

/// Added to each entry.
const BIAS: i32 = 128 * COLS as i32;

/// Computes a product as [`crate::arch::gemv`] does, with as many tables at a time as there is memory for.
#[inline(never)]
pub(super) fn gemv<F: Format>(mut product: Product<'_>) {
    match core::mem::take(&mut product.tables).words() {
        memory if memory.len() >= TABLE_WORDS => tiles::<F>(product, memory),
        _ => with_one_table::<F>(product),
    }
}

/// Computes a product with a table on the stack.
#[inline(never)]
fn with_one_table<F: Format>(product: Product<'_>) {
    tiles::<F>(product, &mut [0; TABLE_WORDS]);
}

fn tiles<F: Format>(product: Product<'_>, memory: &mut [u32]) {
    match F::CELL.words {
        2 => tiles_of_planes::<2>(product, memory),
        _ => tiles_of_planes::<3>(product, memory),
    }
}

/// Computes a product of `B` planes.
#[inline(always)]
fn tiles_of_planes<const B: usize>(Product { block, x, first_row, acc, .. }: Product<'_>, memory: &mut [u32]) {
    let shape = block.shape();
    let (units, stride) = (shape.units(), STRIP / QUAD * block.quad_words());
    let memory = memory.as_chunks_mut::<TABLE_WORDS>().0;
    let mut x = x.words().as_chunks::<{ COLS / 2 }>().0;
    let log = shape.has_groups().then(|| shape.units_per_group().trailing_zeros());
    let bias = ((1 << B) - 1) * BIAS;
    acc.fill(if log.is_none() { -bias * units as i32 } else { 0 });
    let mut first = 0;
    while first < units {
        let count = memory.len().min(units - first);
        let Some((now, rest)) = x.split_at_checked(count) else { return };
        x = rest;
        build(now, memory);
        let tables: &[Table] = bytemuck::must_cast_slice(memory);
        let tables = tables.get(..count).unwrap_or(&[]);
        let (strips, last) = acc.as_chunks_mut::<STRIP>();
        let words = block.rows_from(first_row);
        let after = words.get(strips.len() * stride..).unwrap_or(&[]);
        match log {
            None => {
                add_strips::<B>(words.get(first * B * 2..).unwrap_or(&[]), stride, tables, strips);
                if let Some(last) = last.first_chunk_mut() {
                    add_rows::<QUAD, B>(planes(after, first * B), tables, last);
                }
            }
            Some(log) => {
                let tile = Tile { tables, first, units, log };
                for (acc, words) in strips.iter_mut().zip(words.chunks(stride.max(1))) {
                    tile.groups::<STRIP>(words, B, acc, |words, tables, sums| {
                        sums.fill(-bias * tables.len() as i32);
                        add_strips::<B>(words, stride, tables, core::slice::from_mut(sums));
                    });
                }
                if let Some(last) = last.first_chunk_mut() {
                    tile.groups::<QUAD>(after, B, last, |words, tables, sums| {
                        sums.fill(-bias * tables.len() as i32);
                        add_rows::<QUAD, B>(planes(words, 0), tables, sums);
                    });
                }
            }
        }
        first += count;
    }
}

/// Tables of successive units of rows with group scales.
struct Tile<'t> {
    tables: &'t [Table],
    /// The first unit.
    first: usize,
    /// Units of a row.
    units: usize,
    /// Binary logarithm of the units of a group.
    log: u32,
}

impl Tile<'_> {
    /// Adds the tile's products to the sums of a strip of `R` rows, which has `words`, group by group. `sum` computes
    /// the sums of a group without its scales.
    #[inline(always)]
    fn groups<const R: usize>(
        &self,
        words: &[u32],
        planes: usize,
        acc: &mut [i32; R],
        sum: impl Fn(&[u32], &[Table], &mut [i32; R]),
    ) {
        let quads = R / QUAD;
        let (mut unit, mut tables) = (self.first, self.tables);
        while !tables.is_empty() {
            let group = unit >> self.log;
            let end = (group + 1) << self.log;
            let (now, rest) = tables.split_at((end - unit).min(tables.len()));
            let mut sums = [0; R];
            sum(words.get((unit * planes + group) * quads..).unwrap_or(&[]), now, &mut sums);
            let scales = (end.min(self.units) * planes + group) * quads;
            let scales: &[u8] = bytemuck::must_cast_slice(words.get(scales..).unwrap_or(&[]));
            for ((acc, sum), scale) in acc.iter_mut().zip(sums).zip(scales) {
                *acc = acc.wrapping_add(sum.wrapping_mul(i32::from(*scale)));
            }
            (unit, tables) = (unit + now.len(), rest);
        }
    }
}

/// Returns the planes of successive units, `R` rows each, from a word of a strip on.
#[inline(always)]
fn planes<const R: usize, const B: usize>(words: &[u32], at: usize) -> &[[[u8; R]; B]] {
    let bytes: &[u8] = bytemuck::must_cast_slice(words.get(at..).unwrap_or(&[]));
    bytes.as_chunks().0.as_chunks().0
}

/// Adds the entries of successive units to the sums of `R` rows.
#[inline(always)]
fn add_rows<const R: usize, const B: usize>(planes: &[[[u8; R]; B]], tables: &[Table], sums: &mut [i32; R]) {
    let mut totals = *sums;
    for (unit, table) in planes.iter().zip(tables) {
        for (r, total) in totals.iter_mut().enumerate() {
            for (p, plane) in unit.iter().enumerate() {
                *total = total.wrapping_add(i32::from(table[usize::from(plane[r])]) << p);
            }
        }
    }
    *sums = totals;
}

/// Adds the entries of successive units to the sums of strips, whose weights are `stride` words apart.
#[cfg(not(actq_loops))]
fn add_strips<const B: usize>(words: &[u32], stride: usize, tables: &[Table], strips: &mut [[i32; STRIP]]) {
    for (sums, words) in strips.iter_mut().zip(words.chunks(stride.max(1))) {
        add_rows::<STRIP, B>(planes(words, 0), tables, sums);
    }
}

/// Builds the tables of successive units.
#[cfg(not(actq_loops))]
fn build(x: &[[u32; COLS / 2]], tables: &mut [[u32; TABLE_WORDS]]) {
    x.iter().zip(tables).for_each(|(x, table)| build_one(x, table));
}

/// Builds the table of eight columns, in pairs.
#[cfg(not(actq_loops))]
#[inline(never)]
fn build_one(x: &[u32; COLS / 2], table: &mut [u32; TABLE_WORDS]) {
    let mut columns = [0i32; COLS];
    for (columns, pair) in columns.as_chunks_mut::<2>().0.iter_mut().zip(x) {
        (columns[0], columns[1]) = halves(*pair);
    }
    let first = BIAS - columns.iter().sum::<i32>();
    // Twice a column, in both halves: what its bit adds to two entries. Column 0 is inside a word.
    let steps = columns.map(|x| (x * 2 * 0x1_0001) as u32);
    let word = (first * 0x1_0001 + (columns[0] << 17)) as u32;
    let mut block = [word; 8];
    for (i, word) in block.iter_mut().enumerate() {
        for bit in 0..3 {
            if i >> bit & 1 == 1 {
                *word = word.wrapping_add(steps[1 + bit]);
            }
        }
    }
    // From a block to the next, bit `t` of its number rises, and all bits below it fall.
    let [.., a, b, c, d] = steps;
    let (ab, abc) = (a.wrapping_add(b), a.wrapping_add(b).wrapping_add(c));
    let steps = [a, b.wrapping_sub(a), c.wrapping_sub(ab), d.wrapping_sub(abc)];
    for (i, out) in table.as_chunks_mut::<8>().0.iter_mut().enumerate() {
        if i > 0 {
            let step = steps[i.trailing_zeros() as usize & 3];
            block.iter_mut().for_each(|word| *word = word.wrapping_add(step));
        }
        *out = block;
    }
}
