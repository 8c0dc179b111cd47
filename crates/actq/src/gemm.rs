//! Products of matrices, with the same bits on every processor.
//!
//! An element of `C + A B` is one chain of fused multiply-adds, `c = fma(a[i][k], b[k][j], c)` for k = 0, 1, ... It
//! does not depend on the number of threads, the length of vectors, or the other rows: a batch gives the bits of its
//! samples. Processors without the instruction compute it exactly by other means, slowly.
//!
//! Goto, van de Geijn: Anatomy of high-performance matrix multiplication, ACM TOMS 34 (2008), has the method: `B` lies
//! in panels that stay in the first cache, and a tile of `C` stays in registers.

use fearless_simd::prelude::*;
use fearless_simd::{Level, dispatch, f32x16, f64x8};
use ndarray::{Array2, ArrayView2, ArrayViewMut2, Axis, s};
use rayon::prelude::*;

/// Columns of a panel, and of a tile.
pub(crate) const COLS: usize = 16;
/// Rows of a tile of f32: with two registers a row, 12 accumulators. A tile of f64 has half as many.
const ROWS: usize = 6;
/// Rows of `B` that a tile takes at once: 16 KB of a panel.
const DEPTH: usize = 256;
/// Rows that a thread takes together.
const STRIP: usize = 8 * ROWS;

/// The right factor `B` of a product, `[k, n]`, in panels of 16 columns; the last one is filled up with zeros.
#[derive(Clone, Debug)]
pub(crate) struct Panels<T = f32> {
    depth: usize,
    cols: usize,
    /// `[panel][k][column]`
    values: Vec<[T; COLS]>,
}

/// Elements of a product.
pub(crate) trait Element: Copy + Default + Send + Sync {
    /// Computes `C += A B` with tiles whose sums stay in registers.
    fn add(level: Level, a: ArrayView2<'_, Self>, b: &Panels<Self>, c: ArrayViewMut2<'_, Self>);

    /// Multiplies a tile, over all k.
    fn multiply<S: Simd, const M: usize>(simd: S, a: &[[Self; M]], b: &[[Self; COLS]], sums: &mut [[Self; COLS]; M]);
}

impl<T: Element> Panels<T> {
    /// Packs `b`.
    pub(crate) fn of(b: ArrayView2<'_, T>) -> Self {
        let (depth, cols) = b.dim();
        let mut panels = Self { depth, cols, values: vec![[T::default(); COLS]; depth * cols.div_ceil(COLS)] };
        b.axis_chunks_iter(Axis(0), COLS).zip(panels.row_strips()).for_each(|(rows, mut strip)| strip.refill(rows));
        panels
    }

    /// Packs the transpose of `w`, on this thread alone: commands read policies before they start their threads.
    pub(crate) fn transposed(w: ArrayView2<'_, T>) -> Self {
        let (cols, depth) = w.dim();
        let mut panels = Self { depth, cols, values: vec![[T::default(); COLS]; depth * cols.div_ceil(COLS)] };
        let values = panels.values.chunks_exact_mut(depth.max(1));
        w.axis_chunks_iter(Axis(0), COLS).zip(values).for_each(|(strip, values)| transpose(strip, values));
        panels
    }

    /// Returns the parts that 16 rows of a transposed matrix at a time make.
    pub(crate) fn strips(&mut self) -> impl Iterator<Item = Strip<'_, T>> {
        self.values.chunks_exact_mut(self.depth.max(1)).map(|values| Strip { values })
    }

    /// Returns the parts that 16 rows of a matrix at a time make.
    pub(crate) fn row_strips(&mut self) -> impl Iterator<Item = RowStrip<'_, T>> {
        let mut strips: Vec<RowStrip<'_, T>> = Vec::new();
        strips.resize_with(self.depth.div_ceil(COLS), || RowStrip { of_panels: Vec::new() });
        for panel in self.values.chunks_exact_mut(self.depth.max(1)) {
            strips.iter_mut().zip(panel.chunks_mut(COLS)).for_each(|(strip, values)| strip.of_panels.push(values));
        }
        strips.into_iter()
    }
}

/// A panel of a transposed matrix.
#[derive(Debug)]
pub(crate) struct Strip<'a, T = f32> {
    /// `[k][column]`
    values: &'a mut [[T; COLS]],
}

impl<T: Element> Strip<'_, T> {
    /// Packs the transpose of other rows.
    pub(crate) fn refill(&mut self, rows: ArrayView2<'_, T>) {
        transpose(rows, self.values);
    }
}

/// Rows of every panel of a matrix.
#[derive(Debug)]
pub(crate) struct RowStrip<'a, T = f32> {
    /// `[panel][k][column]`
    of_panels: Vec<&'a mut [[T; COLS]]>,
}

impl<T: Element> RowStrip<'_, T> {
    /// Packs other rows.
    pub(crate) fn refill(&mut self, rows: ArrayView2<'_, T>) {
        let cols = rows.ncols();
        for (panel, values) in self.of_panels.iter_mut().enumerate() {
            let (from, to) = (panel * COLS, cols.min((panel + 1) * COLS));
            for (row, values) in rows.rows().into_iter().zip(values.iter_mut()) {
                copy(row.as_slice().unwrap_or_default(), from, to, values);
            }
        }
    }
}

fn copy<T: Element>(row: &[T], from: usize, to: usize, values: &mut [T; COLS]) {
    match row[from..to].first_chunk() {
        Some(whole) => *values = *whole,
        None => values[..to - from].copy_from_slice(&row[from..to]),
    }
}

/// Writes the columns of up to 16 rows as rows. Tile by tile: the values of a tile lie in few cache lines.
fn transpose<T: Element>(strip: ArrayView2<'_, T>, values: &mut [[T; COLS]]) {
    const TILE: usize = 16;
    for (tile, values) in values.chunks_mut(TILE).enumerate() {
        for (c, row) in strip.rows().into_iter().enumerate() {
            let row = &row.as_slice().unwrap_or_default()[tile * TILE..][..values.len()];
            values.iter_mut().zip(row).for_each(|(values, w)| values[c] = *w);
        }
    }
}

impl Panels {
    /// Computes `A B`.
    pub(crate) fn product(&self, a: ArrayView2<'_, f32>) -> Array2<f32> {
        let mut c = Array2::zeros((a.nrows(), self.cols));
        add_product(a, self, c.view_mut());
        c
    }
}

/// Computes `C += A B`.
pub(crate) fn add_product<T: Element>(a: ArrayView2<'_, T>, b: &Panels<T>, c: ArrayViewMut2<'_, T>) {
    add_at(Level::new(), a, b, c);
}

/// Computes `C += A B`, on all threads.
pub(crate) fn add_product_parallel<T: Element>(a: ArrayView2<'_, T>, b: &Panels<T>, c: ArrayViewMut2<'_, T>) {
    add_products_parallel(vec![(vec![(a, b)], c)]);
}

/// A matrix `C` to which products are added, `A B` of each pair in turn.
pub(crate) type Sum<'a, T> = (Vec<(ArrayView2<'a, T>, &'a Panels<T>)>, ArrayViewMut2<'a, T>);

/// Computes several sums, on all threads.
pub(crate) fn add_products_parallel<T: Element>(mut sums: Vec<Sum<'_, T>>) {
    let level = Level::new();
    let mut strips = Vec::new();
    for (products, c) in &mut sums {
        let of_strip = c.axis_chunks_iter_mut(Axis(0), STRIP).enumerate();
        strips.extend(of_strip.map(|(i, c)| (&*products, i * STRIP, c)));
    }
    strips.into_par_iter().for_each(|(products, from, mut c)| {
        for (a, b) in products {
            add_at(level, a.slice(s![from..from + c.nrows(), ..]), b, c.view_mut());
        }
    });
}

fn add_at<T: Element>(level: Level, a: ArrayView2<'_, T>, b: &Panels<T>, c: ArrayViewMut2<'_, T>) {
    assert_eq!((a.nrows(), a.ncols(), b.cols), (c.nrows(), b.depth, c.ncols()), "shapes of a product");
    T::add(level, a, b, c);
}

impl Element for f32 {
    fn add(level: Level, a: ArrayView2<'_, Self>, b: &Panels<Self>, c: ArrayViewMut2<'_, Self>) {
        match a.nrows() {
            1 => dispatch!(level, simd => add::<_, _, 1>(simd, a, b, c)),
            2 => dispatch!(level, simd => add::<_, _, 2>(simd, a, b, c)),
            3 | 4 | 8 | 16 => dispatch!(level, simd => add::<_, _, 4>(simd, a, b, c)),
            _ => dispatch!(level, simd => add::<_, _, ROWS>(simd, a, b, c)),
        }
    }

    #[inline(always)]
    fn multiply<S: Simd, const M: usize>(simd: S, a: &[[Self; M]], b: &[[Self; COLS]], sums: &mut [[Self; COLS]; M]) {
        let mut registers: [f32x16<S>; M] = sums.map(|sums| f32x16::from_slice(simd, &sums));
        for (a, b) in a.iter().zip(b) {
            let b = f32x16::from_slice(simd, b);
            for (sum, a) in registers.iter_mut().zip(a) {
                *sum = f32x16::splat(simd, *a).mul_add_precise(b, *sum);
            }
        }
        sums.iter_mut().zip(registers).for_each(|(sums, register)| register.store_slice(sums));
    }
}

impl Element for f64 {
    fn add(level: Level, a: ArrayView2<'_, Self>, b: &Panels<Self>, c: ArrayViewMut2<'_, Self>) {
        dispatch!(level, simd => add::<_, _, { ROWS / 2 }>(simd, a, b, c));
    }

    #[inline(always)]
    fn multiply<S: Simd, const M: usize>(simd: S, a: &[[Self; M]], b: &[[Self; COLS]], sums: &mut [[Self; COLS]; M]) {
        let load = |values: &[f64; COLS]| {
            let (low, high) = values.split_at(COLS / 2);
            [f64x8::from_slice(simd, low), f64x8::from_slice(simd, high)]
        };
        let mut registers: [[f64x8<S>; 2]; M] = sums.map(|sums| load(&sums));
        for (a, b) in a.iter().zip(b) {
            let b = load(b);
            for (sums, a) in registers.iter_mut().zip(a) {
                let a = f64x8::splat(simd, *a);
                sums.iter_mut().zip(b).for_each(|(sum, b)| *sum = a.mul_add_precise(b, *sum));
            }
        }
        for (sums, registers) in sums.iter_mut().zip(registers) {
            let (low, high) = sums.split_at_mut(COLS / 2);
            registers[0].store_slice(low);
            registers[1].store_slice(high);
        }
    }
}

/// Computes `C += A B` with tiles of `M` rows.
#[inline(always)]
fn add<S: Simd, T: Element, const M: usize>(simd: S, a: ArrayView2<'_, T>, b: &Panels<T>, mut c: ArrayViewMut2<'_, T>) {
    let (rows, cols) = c.dim();
    let mut tiles: Vec<[T; M]> = Vec::new();
    for from in (0..b.depth).step_by(DEPTH) {
        let depth = DEPTH.min(b.depth - from);
        pack(&a, from, depth, &mut tiles);
        for (panel, values) in b.values.chunks_exact(b.depth.max(1)).enumerate() {
            let values = &values[from..from + depth];
            let at = panel * COLS;
            let width = COLS.min(cols - at);
            for (tile, a) in tiles.chunks_exact(depth).enumerate() {
                let top = tile * M;
                let height = M.min(rows - top);
                let mut sums = [[T::default(); COLS]; M];
                for (r, sums) in sums.iter_mut().enumerate().take(height) {
                    let row = c.row(top + r);
                    copy(row.as_slice().unwrap_or_default(), at, at + width, sums);
                }
                simd.vectorize(
                    #[inline(always)]
                    || T::multiply(simd, a, values, &mut sums),
                );
                for (r, sums) in sums.iter().enumerate().take(height) {
                    let mut row = c.row_mut(top + r);
                    let row = &mut row.as_slice_mut().unwrap_or_default()[at..at + width];
                    match row.first_chunk_mut() {
                        Some(whole) => *whole = *sums,
                        None => row.copy_from_slice(&sums[..width]),
                    }
                }
            }
        }
    }
}

/// Packs columns of `A` as `[tile][k][row]`; missing rows are zero.
#[inline(always)]
fn pack<T: Element, const M: usize>(a: &ArrayView2<'_, T>, from: usize, depth: usize, tiles: &mut Vec<[T; M]>) {
    tiles.clear();
    tiles.resize(a.nrows().div_ceil(M) * depth, [T::default(); M]);
    for (tile, values) in tiles.chunks_exact_mut(depth).enumerate() {
        for (r, row) in a.rows().into_iter().skip(tile * M).take(M).enumerate() {
            match row.as_slice() {
                Some(row) => values.iter_mut().zip(&row[from..]).for_each(|(values, a)| values[r] = *a),
                None => values.iter_mut().zip(row.iter().skip(from)).for_each(|(values, a)| values[r] = *a),
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;

    fn matrix(rows: usize, cols: usize, random: &mut Random) -> Array2<f32> {
        Array2::from_shape_fn((rows, cols), |_| random.normal())
    }

    fn levels() -> Vec<Level> {
        let best = Level::new();
        let all = [Some(best), best.as_sse2().map(Level::Sse2), best.as_sse4_2().map(Level::Sse4_2)];
        all.into_iter().chain([best.as_avx2().map(Level::Avx2)]).flatten().collect()
    }

    /// Every element is the chain of fused multiply-adds that the module promises, on every level of instructions.
    #[test]
    fn all_levels_give_the_bits_of_the_chain() {
        let mut random = Random::new(1);
        for (m, k, n) in [(1, 1, 1), (1, 300, 17), (2, 5, 16), (4, 257, 33), (5, 48, 12), (64, 530, 40), (7, 0, 3)] {
            let (a, w, c) = (matrix(m, k, &mut random), matrix(n, k, &mut random), matrix(m, n, &mut random));
            let expected = Array2::from_shape_fn((m, n), |(i, j)| {
                (0..k).fold(c[[i, j]], |sum, k| a[[i, k]].mul_add(w[[j, k]], sum))
            });
            let columns = w.t().as_standard_layout().into_owned();
            for panels in [Panels::transposed(w.view()), Panels::of(columns.view())] {
                for level in levels() {
                    for a in [a.view(), a.t().as_standard_layout().t()] {
                        let mut found = c.clone();
                        add_at(level, a, &panels, found.view_mut());
                        assert_eq!(found, expected, "{m} x {k} x {n}");
                    }
                }
                let mut found = c.clone();
                add_product_parallel(a.view(), &panels, found.view_mut());
                assert_eq!(found, expected);
            }
            let [a, columns, c] = [&a, &columns, &c].map(|matrix| matrix.mapv(f64::from));
            for level in levels() {
                let mut found = c.clone();
                add_at(level, a.view(), &Panels::of(columns.view()), found.view_mut());
                let chain = |(i, j)| (0..k).fold(c[[i, j]], |sum, k| a[[i, k]].mul_add(columns[[k, j]], sum));
                assert_eq!(found, Array2::from_shape_fn((m, n), chain), "{m} x {k} x {n} of f64");
            }
        }
    }
}
