//! Allocates a width for every row within a budget.
//!
//! Rows (output neurons) differ far more in their effect on the actions than columns do. Row `r` at width `b` is
//! predicted to cost `eps_b * g_r * sum_c w_rc^2 h_c` of squared action error. One Lagrange multiplier, found by
//! bisection, weighs that against bits. A row of 0 bits gives its bias only. If its output only feeds matrices through
//! elementwise functions, it disappears with the columns that it fed (see [`mod@super::compact`]). The contribution of
//! those columns is its error, and their bits count as its saving.

use actq_kernels::Width;

use super::dimension::{Dimension, Widths};
use super::size::{Price, Size};
use crate::budget::{BudgetTooSmall, MIN_USED_SHARE};
use crate::error::Result;
use crate::graph::WeightMatrix;
use crate::numbers::square;

/// Returns the predicted squared error of a row in units of its own energy: that of the mid-rise grid with error
/// feedback. The value at 8 bits is higher than the cost of rounding (0.00005). So 8 bits go only to rows for which 4
/// bits are far from enough. Learning compensates the difference.
fn epsilon(width: Width) -> f64 {
    match width {
        Width::W2 => 0.125,
        Width::W3 => 0.036,
        Width::W4 => 0.0102,
        Width::W8 => 0.0003,
    }
}

/// Permitted widths of a row.
const CHOICES: [Option<Width>; 5] = [None, Some(Width::W2), Some(Width::W3), Some(Width::W4), Some(Width::W8)];

/// Least gain per bit of a row that is widened with the rest, as a share of the gain elsewhere.
const WORTH: f64 = 0.1;
/// Most rows that are widened together: blocks are padded to this many.
const MAX_AT_ONCE: usize = 4;

/// Properties of a matrix's rows in the allocation.
#[derive(Clone, Debug)]
pub struct Rows {
    /// Energy `g_r * sum_c w_rc^2 h_c` of each row.
    pub energy: Vec<f64>,
    /// Error of each row without bits.
    pub removal: Vec<f64>,
    /// Factor on the error of rounding.
    pub rounding: f64,
    /// Forced width of all rows.
    pub forced: Option<Width>,
}

impl Rows {
    /// Returns the predicted error of row `r` at a width.
    pub fn expected(&self, r: usize, width: Option<Width>) -> f64 {
        width.map_or(self.removal[r], |width| self.rounding * epsilon(width) * self.energy[r])
    }
}

/// Returns the energies of a matrix's rows for the importances of its columns (`h`) and rows (`g`).
pub fn energies(matrix: &WeightMatrix, h: &[f64], g: &[f64]) -> Vec<f64> {
    let rows = matrix.data.chunks_exact(matrix.cols).zip(g);
    rows.map(|(row, g)| g * row.iter().zip(h).map(|(w, h)| square(f64::from(*w)) * h).sum::<f64>()).collect()
}

/// Returns the predicted error of all rows.
pub fn expected(rows: &[Rows], widths: &Widths) -> f64 {
    let of_matrix = |(rows, widths): (&Rows, &Vec<Option<Width>>)| -> f64 {
        widths.iter().enumerate().map(|(r, width)| rows.expected(r, *width)).sum()
    };
    rows.iter().zip(widths).map(of_matrix).sum()
}

/// Shares of time in the price, where both bytes and cycles are limited.
const SHARES: [f64; 5] = [0.0, 0.25, 0.5, 0.75, 1.0];

/// Chooses the widths so that [`Size::bytes`] stays within `limit`, and the cycles within their own limit. Of several
/// prices for bytes and cycles, it takes the one with the lowest expected error. If even the fewest rows take too many
/// cycles, those are chosen.
///
/// # Errors
///
/// [`BudgetTooSmall`] if [`Size::smallest`] takes more bytes.
pub fn allocate(size: &Size<'_>, rows: &[Rows], limit: f64) -> Result<Widths> {
    let Some(cycles) = size.cycles else { return at_price(size, rows, limit) };
    let of = |share: f64| {
        // Both limits are one.
        let bit = if limit.is_finite() { (1.0 - share) / (8.0 * limit) } else { 0.0 };
        at_price(&Size { price: Price { bit, cycle: share / cycles.max(1.0) }, ..size.clone() }, rows, limit)
    };
    let shares = if limit.is_finite() { &SHARES[..] } else { &[1.0] };
    let tried = shares.iter().map(|share| of(*share)).collect::<Result<Vec<Widths>>>()?;
    let best = tried.into_iter().min_by(|a, b| expected(rows, a).total_cmp(&expected(rows, b)));
    best.map_or_else(|| smallest(size, rows, limit), Ok)
}

fn at_price(size: &Size<'_>, rows: &[Rows], limit: f64) -> Result<Widths> {
    let (mut widths, multiplier) = match lowest_multiplier(size, rows, limit) {
        Some(multiplier) => (choose(size, rows, multiplier), multiplier),
        None => (smallest(size, rows, limit)?, 0.0),
    };
    fill(&mut widths, size, rows, limit, WORTH * multiplier);
    // Rows without effect on the actions may take bytes that are left, but no time.
    if size.cycles.is_none() && (size.bytes(&widths) as f64) < MIN_USED_SHARE * limit {
        fill(&mut widths, size, rows, limit, 0.0);
    }
    Ok(widths)
}

/// Returns the lowest multiplier, in units of error per price, whose widths fit. `None` if even the highest does not
/// fit: it keeps the most important rows, and others may take fewer bytes.
fn lowest_multiplier(size: &Size<'_>, rows: &[Rows], limit: f64) -> Option<f64> {
    let fits = |multiplier: f64| size.fits(&choose(size, rows, multiplier), limit);
    // The range covers everything from 8 bits to none for any scale of energies.
    let largest = rows.iter().flat_map(|r| r.energy.iter().chain(&r.removal)).fold(1e-300f64, |m, e| m.max(*e));
    let unit = if size.price.bit > 0.0 { size.price.bit } else { size.price.cycle };
    let (mut low, mut high) = (largest * 1e-18 / unit, largest * 10.0 / unit);
    if !fits(high) {
        return None;
    }
    for _ in 0..60 {
        // The geometric mean: the range covers many powers of ten.
        let middle = low.sqrt() * high.sqrt();
        if fits(middle) {
            high = middle;
        } else {
            low = middle;
        }
    }
    Some(high)
}

/// Returns the widths that take the fewest bytes, if they fit.
fn smallest(size: &Size<'_>, rows: &[Rows], limit: f64) -> Result<Widths> {
    let forced: Vec<Option<Width>> = rows.iter().map(|rows| rows.forced).collect();
    let widths = size.smallest(&forced);
    BudgetTooSmall::check(size.bytes(&widths), limit, size.graph.weights())?;
    Ok(widths)
}

/// Widens rows as long as bytes are left. Blocks of rows are padded, so one more row may take hundreds of bytes or
/// none, which no multiplier can predict. It repeatedly widens the rows with the largest fall of error per byte. These
/// are rows of one matrix and one width, at most as many as a block is padded to. Rows that gain less than `least` per
/// bit keep their width, since rows without effect on the actions should not take time.
fn fill(widths: &mut Widths, size: &Size<'_>, rows: &[Rows], limit: f64, least: f64) {
    if !size.fits(widths, limit) {
        return;
    }
    let mut taken = size.price(widths);
    // That of a byte.
    let least_price = (8.0 * size.price.bit).max(size.price.cycle);
    loop {
        let mut best: Option<(f64, Widths, f64)> = None;
        let free = (0..rows.len()).filter(|&m| rows[m].forced.is_none());
        for (m, (from, to)) in free.flat_map(|m| widenings().map(move |widening| (m, widening))) {
            let price = RowPrice::new(size, widths, m);
            let gain = |r: &usize| rows[m].expected(*r, from) - rows[m].expected(*r, to);
            let gained_at_least = least * (price.at(to) - price.at(from));
            let is_worth = |r: &usize| widths[m][*r] == from && gain(r) > gained_at_least;
            let mut candidates: Vec<usize> = (0..widths[m].len()).filter(is_worth).collect();
            candidates.sort_by(|a, b| gain(b).total_cmp(&gain(a)));
            let mut wider = widths.clone();
            let mut gained = 0.0;
            for &r in candidates.iter().take(MAX_AT_ONCE) {
                wider[m][r] = to;
                gained += gain(&r);
                let takes = size.price(&wider);
                let worth = gained / (takes - taken).max(least_price);
                let reached = Dimension::made_by(size.dimensions, m).is_some() || are_within_steps(&wider[m]);
                if reached && best.as_ref().is_none_or(|(best, ..)| worth > *best) && size.fits(&wider, limit) {
                    best = Some((worth, wider.clone(), takes));
                }
            }
        }
        let Some((_, wider, takes)) = best else { return };
        (*widths, taken) = (wider, takes);
    }
}

/// Returns every width with every wider one.
fn widenings() -> impl Iterator<Item = (Option<Width>, Option<Width>)> {
    let wider = |from| CHOICES.into_iter().filter(move |to| *to > from).map(move |to| (from, to));
    CHOICES.into_iter().flat_map(wider)
}

/// Returns `true` if successive rows of every width are at most as far apart as an output step allows.
fn are_within_steps(widths: &[Option<Width>]) -> bool {
    Width::ALL.into_iter().all(|width| out_of_reach(widths, width).is_none())
}

/// Price of one more row of a matrix, without padding.
struct RowPrice {
    /// At each of [`Width::ALL`].
    rows: [f64; Width::ALL.len()],
    /// Saving by what a removed row takes with it: its column of the rows that read it, and its functions.
    saving: f64,
}

impl RowPrice {
    fn new(size: &Size<'_>, widths: &Widths, m: usize) -> Self {
        let Size { graph, dimensions, values, .. } = *size;
        let made = Dimension::made_by(dimensions, m);
        let cols = Dimension::feeding(dimensions, m).map_or(graph.matrices[m].cols, |d| d.kept(widths));
        // Scale, output step if present, and bias if it is removed with the row and counts.
        let overhead = match made {
            Some(_) if values > 0 => 48.0,
            Some(_) => 16.0,
            None => 24.0,
        };
        let Price { bit, cycle } = size.price;
        let row = |width: Width| {
            let cycles = if cycle > 0.0 { cycle * size.row_cycles(m, width, cols) } else { 0.0 };
            cycles + bit * (cols as f64 * f64::from(width.bits()) + overhead)
        };
        let column = |consumer: usize| -> f64 {
            let kept = made.map_or(1, |d| d.kept(widths).max(1));
            let price = |width: Width| {
                let cycles = if cycle > 0.0 { cycle * size.row_cycles(consumer, width, kept) } else { 0.0 };
                cycles / kept as f64 + bit * f64::from(width.bits())
            };
            let prices = Width::ALL.map(price);
            widths[consumer].iter().flatten().map(|width| prices[*width as usize]).sum()
        };
        Self {
            rows: Width::ALL.map(row),
            saving: made.map_or(0.0, |d| {
                let functions = if cycle > 0.0 { size.runs[m] as f64 * size.of_functions(d, 1) } else { 0.0 };
                d.consumers.iter().map(|&consumer| column(consumer)).sum::<f64>() + cycle * functions
            }),
        }
    }

    fn at(&self, width: Option<Width>) -> f64 {
        width.map_or(-self.saving, |width| self.rows[width as usize])
    }
}

/// Returns the widths that minimize error plus `multiplier` times their price. The saving of a removed row depends on
/// the other rows' widths, so the choice is repeated until it settles.
fn choose(size: &Size<'_>, rows: &[Rows], multiplier: f64) -> Widths {
    let Size { graph, dimensions, .. } = size;
    let mut widths: Widths = graph.matrices.iter().map(|m| vec![Some(Width::W2); m.rows]).collect();
    for _ in 0..4 {
        let next: Widths = (0..graph.matrices.len())
            .map(|m| {
                let price = RowPrice::new(size, &widths, m);
                let cost = |r: usize, width: Option<Width>| rows[m].expected(r, width) + multiplier * price.at(width);
                let best = |r: usize| {
                    let order = |a: &&Option<Width>, b: &&Option<Width>| cost(r, **a).total_cmp(&cost(r, **b));
                    rows[m].forced.or_else(|| CHOICES.iter().min_by(order).copied().flatten())
                };
                (0..rows[m].energy.len()).map(best).collect()
            })
            .collect();
        widths = next;
        // A matrix without rows would disconnect the actions from the observations.
        for (widths, rows) in widths.iter_mut().zip(rows) {
            if widths.iter().all(Option::is_none) {
                let most = (0..rows.energy.len()).max_by(|&a, &b| rows.energy[a].total_cmp(&rows.energy[b]));
                widths[most.unwrap_or(0)] = Some(Width::W2);
            }
        }
    }
    for (m, widths) in widths.iter_mut().enumerate() {
        if Dimension::made_by(dimensions, m).is_none() {
            within_steps(widths);
        }
    }
    widths
}

/// Widens rows until successive rows of every width are at most as far apart as an output step allows.
fn within_steps(widths: &mut [Option<Width>]) {
    // A widened row may separate those of its former width.
    while let Some((row, width)) = Width::ALL.into_iter().find_map(|width| out_of_reach(widths, width)) {
        widths[row] = width;
    }
}

/// Returns a row to widen and its new width, if a row of this width is too far from the previous one.
fn out_of_reach(widths: &[Option<Width>], width: Width) -> Option<(usize, Option<Width>)> {
    const REACH: usize = u8::MAX as usize;
    let mut last = 0;
    for row in (0..widths.len()).filter(|&row| widths[row] == Some(width)) {
        if row - last > REACH {
            let between = (last..=last + REACH).rev().find(|&row| widths[row] < Some(width));
            // Between wider rows only, it gets their width.
            return Some(between.map_or((row, widths[last + REACH]), |between| (between, Some(width))));
        }
        last = row;
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::graph::Graph;
    use crate::methods::packing::Packing;
    use crate::random::Random;

    #[test]
    fn remaining_bytes_cannot_widen_any_row() {
        let mut random = Random::new(1);
        let mut graph = Graph::new(18);
        for (rows, cols) in [(70, 18), (33, 70)] {
            let data = (0..rows * cols).map(|_| random.normal()).collect();
            graph.matrices.push(WeightMatrix { name: "m".into(), rows, cols, data });
        }
        let rows = |matrix: &WeightMatrix| {
            let energy = energies(matrix, &vec![1.0; matrix.cols], &vec![1.0; matrix.rows]);
            Rows { removal: energy.clone(), energy, rounding: 1.0, forced: None }
        };
        let rows: Vec<Rows> = graph.matrices.iter().map(rows).collect();
        let packings = vec![vec![Packing::of(127, 0), Packing::of(32767, 0)]; 2];
        let size = Size { packings, ..Size::new(&graph, &[], 0) };
        for limit in (1000..4000).step_by(97).map(f64::from) {
            let widths = allocate(&size, &rows, limit).expect("it fits");
            let taken = size.bytes(&widths);
            assert!(taken as f64 <= limit);
            for (m, r) in (0..2).flat_map(|m| (0..widths[m].len()).map(move |r| (m, r))) {
                for to in CHOICES.into_iter().filter(|to| *to > widths[m][r]) {
                    let mut wider = widths.clone();
                    wider[m][r] = to;
                    let takes = size.bytes(&wider);
                    assert!(
                        takes as f64 > limit,
                        "{limit}: row {r} of {m} to {to:?} takes {takes} bytes, {taken} before"
                    );
                }
            }
        }
    }

    #[test]
    fn one_byte_below_the_smallest_widths_is_refused() {
        let mut graph = Graph::new(8);
        graph.matrices = vec![WeightMatrix { name: "m".into(), rows: 300, cols: 8, data: vec![0.0; 2400] }];
        let packings = vec![vec![Packing::of(127, 0)]];
        let size = Size { packings, ..Size::new(&graph, &[], 0) };
        // The row that matters is beyond the reach of a step.
        let energy: Vec<f64> = (0..300).map(|r| if r == 299 { 1.0 } else { 1e-9 }).collect();
        let rows = [Rows { removal: energy.clone(), energy, rounding: 1.0, forced: None }];
        let least = size.bytes(&size.smallest(&[None]));
        assert!(allocate(&size, &rows, least as f64).is_ok());
        let error = allocate(&size, &rows, least as f64 - 1.0).expect_err("too small");
        assert_eq!(error.budget().map(|small| small.bytes), Some(least));
    }

    #[test]
    fn rows_are_widened_only_as_steps_require() {
        let mut random = Random::new(1);
        for case in 0..200 {
            // Mostly one width, so that the other rows are far apart.
            let most = [None, Some(Width::W2), Some(Width::W4)][case % 3];
            let others = [None, Some(Width::W2), Some(Width::W3), Some(Width::W8)];
            let row = |_| if random.below(300) < case { others[random.below(4)] } else { most };
            let before: Widths = vec![(0..100 * case % 4097 + 1).map(row).collect()];
            let mut after = before[0].clone();
            within_steps(&mut after);
            assert!(before[0].iter().zip(&after).all(|(before, after)| before <= after), "case {case}");
            for width in Width::ALL {
                let rows: Vec<usize> = (0..after.len()).filter(|&r| after[r] == Some(width)).collect();
                let apart = rows.iter().scan(0, |last, &row| Some(row - std::mem::replace(last, row)));
                assert!(apart.max().unwrap_or(0) <= 255, "case {case}");
            }
        }
    }
}
