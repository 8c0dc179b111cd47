//! Shape of the network to learn: its units, and the width of every row.

use actq_kernels::Width;
use rayon::prelude::*;

use super::activations::{allocated, least_bytes as least, packed};
use super::allocate::{Rows, energies, expected};
use super::cut::{Cut, Kept};
use super::dimension::{Dimension, Widths, dimensions};
use super::heads::HeadUnits;
use super::size::{Size, cycles_of_elements};
use super::statistics::RowStatistics;

use crate::budget::Rate;
use crate::calibrate::moments::Moments;
use crate::error::Result;
use crate::graph::{Graph, WeightMatrix};
use crate::methods::learning::Recipe;
use crate::methods::options::Options;

/// A network to quantize, by its statistics, and its budget.
#[derive(Clone, Copy, Debug)]
pub(super) struct Target<'a> {
    pub(super) statistics: &'a RowStatistics,
    pub(super) rate: Rate,
    pub(super) options: &'a Options,
}

/// Shape of the network to learn.
#[derive(Debug)]
pub(super) struct Shape {
    /// The network with the units that it keeps.
    pub(super) cut: Cut,
    /// Hidden vectors of its graph.
    pub(super) dimensions: Vec<Dimension>,
    /// Expected errors and widths of its rows.
    pub(super) rows: Vec<Rows>,
    pub(super) widths: Widths,
    /// Activation magnitude of every matrix.
    pub(super) limits: Vec<u16>,
    /// Cycles of its rows; removed units' savings elsewhere are subtracted. `None` without a time limit.
    pub(super) cycles: Option<f64>,
}

/// Shares of the units to choose from.
const SHARES: [f64; 11] = [1.0, 0.875, 0.75, 0.625, 0.5, 0.4375, 0.375, 0.3125, 0.25, 0.1875, 0.125];

/// Chooses the units, and the widths of all rows. Units are removed if the network learns and no width is forced: of
/// several shares of them, the one with the lowest expected error is kept. The recipe determines the expected errors.
pub(super) fn shape(Target { statistics, rate, options }: Target<'_>, recipe: Recipe) -> Result<Shape> {
    let Recipe { rounding, even, .. } = recipe;
    let RowStatistics { inputs, outputs, moments, .. } = statistics;
    let graph = statistics.graph();
    let (forced, allowed) = (forced(graph, rate, options), rate.bytes(graph.weights()));
    let of_inputs: Vec<&Moments> = moments.iter().map(|(input, _)| input).collect();
    let removals = statistics.removals(options.learns(), even);
    let of_elements = rate.cycles().map(|_| cycles_of_elements(graph, rate.core()));
    let of_cut = |cut: Cut| {
        let pick = |values: &[f64], of: &[usize]| of.iter().map(|&i| values[i]).collect::<Vec<f64>>();
        let of_matrix = |(m, matrix): (usize, &WeightMatrix)| {
            let (input, output) = (pick(&inputs[m], &cut.columns[m]), pick(&outputs[m], &cut.rows[m]));
            let energy = energies(matrix, &input, &output);
            let removal = removals[m].as_ref().map_or_else(|| energy.clone(), |of| pick(of, &cut.rows[m]));
            Rows { energy, removal, rounding, forced: forced[m] }
        };
        let rows: Vec<Rows> = cut.graph.matrices.iter().enumerate().map(of_matrix).collect();
        // Rows may take what the elements of removed units no longer take.
        let saved = of_elements.map_or(0.0, |of_all| of_all - cycles_of_elements(&cut.graph, rate.core()));
        let cycles = rate.cycles().map(|most| most + saved);
        let dimensions = dimensions(&cut.graph);
        let counted = Size::new(&cut.graph, &dimensions, values(&cut.graph, rate, options));
        let size = Size { cycles, core: rate.core(), ..counted };
        let (widths, limits) = allocated(size.clone(), &rows, options, allowed)?;
        let cycles = cycles.map(|_| Size { packings: packed(&limits, options), ..size }.cycles(&widths) - saved);
        Ok(Shape { cut, dimensions, rows, widths, limits, cycles })
    };
    if !loses_units(options, &forced) {
        return of_cut(Cut::nothing(graph));
    }
    let removable = statistics.removable(even);
    let most = rate.cycles();
    // The last error names the fewest bytes: those of the fewest units.
    let better = |best: &Result<Shape>, next: &Result<Shape>| match (best, next) {
        (Ok(best), Ok(next)) => next.is_better(best, most),
        (best, _) => best.is_err(),
    };
    let of_kept = |kept: &Kept| of_cut(Cut::keep_some(graph, &removable, kept, &of_inputs));
    let mut kept = Kept { share: 1.0, heads: removable.heads.iter().map(HeadUnits::sizes).collect() };
    let mut best = of_cut(Cut::nothing(graph));
    let mut choose = |kept: &mut Kept, all: Vec<Kept>| {
        let shapes: Vec<Result<Shape>> = all.par_iter().map(of_kept).collect();
        for (next, shape) in all.into_iter().zip(shapes) {
            if better(&best, &shape) {
                (*kept, best) = (next, shape);
            }
        }
    };
    if !removable.units.is_empty() {
        let all = SHARES[1..].iter().map(|&share| Kept { share, ..kept.clone() }).collect();
        choose(&mut kept, all);
    }
    for (i, heads) in removable.heads.iter().enumerate() {
        for which in [0, 1] {
            let of_size = |size: usize| {
                let mut next = kept.clone();
                next.heads[i][which] = size;
                next
            };
            let all = heads.shares(which, &SHARES[1..]).into_iter().map(of_size).collect();
            choose(&mut kept, all);
        }
    }
    best
}

impl Shape {
    /// Returns `true` if another shape has the same units, widths and activations.
    pub(super) fn equals(&self, other: &Self) -> bool {
        self.cut.rows == other.cut.rows && self.widths == other.widths && self.limits == other.limits
    }

    /// Returns `true` if this shape exceeds the limit on cycles by less than the other one, or equally and has a lower
    /// expected error.
    fn is_better(&self, other: &Self, most: Option<f64>) -> bool {
        let above = |shape: &Self| shape.cycles.zip(most).map_or(0.0, |(cycles, most)| (cycles - most).max(0.0));
        above(self).total_cmp(&above(other)).then(self.error().total_cmp(&other.error())).is_lt()
    }

    /// Returns the expected error.
    fn error(&self) -> f64 {
        self.cut.error + expected(&self.rows, &self.widths)
    }
}

/// Returns `true` if units may be removed: something is learned, and no width is forced.
fn loses_units(options: &Options, forced: &[Option<Width>]) -> bool {
    options.learns() && forced.iter().all(Option::is_none)
}

/// Returns the fewest bytes that meet a rate, without a balance.
pub(super) fn least_bytes(graph: &Graph, rate: Rate, options: &Options) -> usize {
    let forced = forced(graph, rate, options);
    let of = |graph: &Graph| {
        let dimensions = dimensions(graph);
        least(&Size::new(graph, &dimensions, values(graph, rate, options)), options, &forced)
    };
    match loses_units(options, &forced) {
        true => SHARES.iter().map(|share| of(&Cut::for_size(graph, *share).graph)).min().unwrap_or_default(),
        false => of(graph),
    }
}

/// Returns the width that is forced on every matrix, if any: its own, or that of all.
pub(super) fn forced(graph: &Graph, rate: Rate, options: &Options) -> Vec<Option<Width>> {
    let named = |matrix: &WeightMatrix| options.forced.iter().find(|(name, _)| *name == matrix.name).map(|(_, w)| *w);
    let of_matrix = |matrix: &WeightMatrix| match rate {
        Rate::Width(width) => named(matrix).or(Some(width)),
        Rate::BitsPerWeight(_) | Rate::Bytes(_) | Rate::Within { .. } => named(matrix),
    };
    graph.matrices.iter().map(of_matrix).collect()
}

/// Returns the number of values of the vectors that a rate counts.
pub(super) fn values(graph: &Graph, rate: Rate, options: &Options) -> usize {
    match rate {
        Rate::Bytes(_) | Rate::Within { bytes: Some(_), .. } => graph.changed_values(options.learns()),
        Rate::Width(_) | Rate::BitsPerWeight(_) | Rate::Within { bytes: None, .. } => 0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::budget::Budget;
    use crate::graph::NodeKind;
    use crate::methods::{Method, PreparedMethod};
    use crate::testing::{dataset, lstm, transformer};

    #[test]
    fn one_matrix_may_have_another_width() {
        let graph = lstm();
        let recording = dataset(&graph, 4, 60);
        let method = PreparedMethod::new(&graph, Method::Distill, Some(&recording), |_| {}).expect("statistics");
        let forced = vec![("out".to_owned(), Width::W8)];
        let options = Options { steps: Some(1), forced, ..Options::new(Method::Distill, Budget::Width(Width::W2)) };
        let made = method.quantize(Rate::Width(Width::W2), &options, |_| {}).expect("a network");
        let widths = made.outcomes.iter().map(|outcome| outcome.quantized.widths[0]);
        assert_eq!(widths.collect::<Vec<_>>(), [Width::W2, Width::W2, Width::W8].map(Some));
    }

    #[test]
    fn the_smallest_recurrent_image_has_the_fewest_units() {
        let graph = lstm();
        let recording = dataset(&graph, 4, 60);
        let method = PreparedMethod::new(&graph, Method::Distill, Some(&recording), |_| {}).expect("statistics");
        let options = |steps| Options { steps: Some(steps), ..Options::new(Method::Distill, Budget::Width(Width::W2)) };
        let least = |steps| least_bytes(&graph, Rate::Bytes(0), &options(steps));
        assert!(least(1) < least(0), "{} bytes, {} with all units", least(1), least(0));
        for steps in [0, 1] {
            let bytes = |bytes| method.quantize(Rate::Bytes(bytes), &options(steps), |_| {});
            assert!(bytes(least(steps)).is_ok());
            let error = bytes(least(steps) - 1).expect_err("one byte less");
            assert_eq!(error.budget().map(|small| small.bytes), Some(least(steps)));
        }
    }

    #[test]
    fn an_attention_that_adds_little_loses_heads_and_elements() {
        let mut graph = transformer(3);
        let of_attentions = |graph: &Graph| -> Vec<[usize; 2]> {
            let sizes = graph.nodes.iter().map(|node| match &node.kind {
                NodeKind::Attention(attention) => Some([attention.heads, attention.dim]),
                _ => None,
            });
            sizes.flatten().collect()
        };
        assert_eq!(of_attentions(&graph), [[4, 4]; 2]);
        // The layer that reads the second one; each block has six layers, after the first one of all.
        graph.matrices[10].data.iter_mut().for_each(|weight| *weight *= 1e-3);
        let recording = dataset(&graph, 4, 60);
        let method = PreparedMethod::new(&graph, Method::Distill, Some(&recording), |_| {}).expect("statistics");
        let options = Options { steps: Some(1), ..Options::new(Method::Distill, Budget::Width(Width::W2)) };
        let made = method.quantize(Rate::BitsPerWeight(4.0), &options, |_| {}).expect("a network");
        let [first, second] = of_attentions(&made.graph)[..] else { panic!("two attentions") };
        assert!(first[0] > 2 && second == [1, 4], "{first:?} {second:?}");
    }
}
