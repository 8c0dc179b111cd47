//! Bytes and cycles as functions of the rows' widths, for the allocation, and the fewest bytes.

use actq_kernels::Width;
use actq_kernels::cost::Core;
use actq_kernels::image::{OpKind, block_bytes};
use actq_kernels::layout::{BlockShape, STRIP};
use actq_kernels::math::Function;

use super::balance::balance_bytes;
use super::dimension::{Dimension, Widths};
use crate::graph::copies::Steps;
use crate::graph::lowering::{Lowering, Slice, Step};
use crate::graph::operation::{Operand, Product};
use crate::graph::steps::{lower_nodes, readers};
use crate::graph::{Graph, NodeKind};
use crate::methods::packing::Packing;

/// Properties that determine the bytes of a network beside its rows' widths.
#[derive(Clone, Debug)]
pub struct Size<'a> {
    /// The network.
    pub graph: &'a Graph,
    /// Hidden vectors that may be pruned.
    pub dimensions: &'a [Dimension],
    /// Layouts of every matrix that room is reserved for.
    pub packings: Vec<Vec<Packing>>,
    /// Counted values of the vectors, with all rows.
    pub values: usize,
    /// Counted vectors after every matrix.
    pub biases: Vec<usize>,
    /// Runs of every matrix in a step.
    pub runs: Vec<usize>,
    /// `true` for every matrix that adds to the output of another: that of an LSTM's state.
    pub accumulates: Vec<bool>,
    /// The core whose cycles count.
    pub core: Core,
    /// Most modelled cycles of the rows ([`Self::cycles`]); `None`: time does not matter.
    pub cycles: Option<f64>,
    /// Price of a row, by which the allocation compares widths.
    pub price: Price,
}

/// Shares of a bit and of a cycle in the price of a row.
#[derive(Clone, Copy, Debug)]
pub struct Price {
    /// Of a bit.
    pub bit: f64,
    /// Of a cycle.
    pub cycle: f64,
}

impl<'a> Size<'a> {
    /// Counts bytes alone, of matrices whose layouts are still to be chosen.
    pub fn new(graph: &'a Graph, dimensions: &'a [Dimension], values: usize) -> Self {
        let runs = (0..graph.matrices.len()).map(|m| graph.runs(m)).collect();
        let price = Price { bit: 1.0, cycle: 0.0 };
        let cells = graph.nodes.iter().filter(|node| matches!(node.kind, NodeKind::Lstm(_)));
        let products: Vec<Product> = cells.flat_map(|node| node.kind.products()).collect();
        let of_state = |m: usize| products.iter().any(|p| p.matrix == m && p.operand == Operand::State);
        let accumulates = (0..graph.matrices.len()).map(of_state).collect();
        Self {
            graph,
            dimensions,
            packings: Vec::new(),
            values,
            biases: graph.biases(),
            runs,
            accumulates,
            core: Core::M4f,
            cycles: None,
            price,
        }
    }

    /// Returns `true` if the widths keep `limit`, in bytes, and the limit on cycles.
    pub fn fits(&self, widths: &Widths, limit: f64) -> bool {
        self.bytes(widths) as f64 <= limit && self.cycles.is_none_or(|most| self.cycles(widths) <= most)
    }

    /// Returns the price of the widths.
    pub fn price(&self, widths: &Widths) -> f64 {
        let Price { bit, cycle } = self.price;
        let cycles = if cycle > 0.0 { cycle * self.cycles(widths) } else { 0.0 };
        cycles + if bit > 0.0 { bit * 8.0 * self.bytes(widths) as f64 } else { 0.0 }
    }

    /// Returns the modelled cycles of the matrices' rows in a step, with those of the functions of dimensions.
    pub fn cycles(&self, widths: &Widths) -> f64 {
        let of_matrix = |m: usize| {
            let Some(&packing) = self.packings[m].first() else { return 0.0 };
            let (cols, sorted, blocks) = self.blocks(widths, m, packing);
            let kept = widths[m].iter().flatten().count();
            // A removed row of no dimension is an output of its bias alone.
            let rows = Dimension::made_by(self.dimensions, m).map_or(self.graph.matrices[m].rows, |_| kept);
            let blocks = blocks.map(|shape| packing.shape_on(self.core, shape));
            let in_order = sorted && kept == rows;
            let products = self.core.rates().of_linear([rows, cols], blocks, in_order, self.accumulates[m]);
            let functions =
                Dimension::made_by(self.dimensions, m).map_or(0.0, |d| self.of_functions(d, d.kept(widths)));
            self.runs[m] as f64 * (products.cycles as f64 + functions)
        };
        (0..self.packings.len()).map(of_matrix).sum()
    }

    /// Returns the cycles of one more row of `cols` columns in every run of a matrix.
    pub fn row_cycles(&self, m: usize, width: Width, cols: usize) -> f64 {
        let Some(packing) = self.packings[m].first() else { return 0.0 };
        let of = |rows: usize| {
            let shape = packing.shape_on(self.core, packing.shape(width, rows, cols.max(1)));
            self.core.rates().of_linear([rows, cols.max(1)], [shape], true, self.accumulates[m]).cycles as f64
        };
        self.runs[m] as f64 * (of(2 * STRIP) - of(STRIP)) / STRIP as f64
    }

    /// Returns the cycles of the functions of a dimension of `len` elements.
    pub fn of_functions(&self, dimension: &Dimension, len: usize) -> f64 {
        let rates = self.core.rates();
        let of = |function: &Function| rates.of_elements(OpKind::Function(*function), len).cycles as f64;
        dimension.functions.iter().map(of).sum()
    }

    /// Returns all counted bytes: the balance, the vectors, and all matrices. Rows without bits and the columns that
    /// compaction removes do not count. Of a matrix's possible layouts, the largest counts.
    pub fn bytes(&self, widths: &Widths) -> usize {
        let of_matrix = |m: usize| -> usize {
            self.packings[m].iter().map(|&packing| self.matrix(widths, m, packing)).max().unwrap_or(0)
        };
        self.beside(widths) + (0..self.packings.len()).map(of_matrix).sum::<usize>()
    }

    /// Returns the bytes of the balance and the vectors.
    pub fn beside(&self, widths: &Widths) -> usize {
        let of_dimension = |d: &Dimension| self.biases[d.maker] * (widths[d.maker].len() - d.kept(widths));
        let removed: usize = self.dimensions.iter().map(of_dimension).sum();
        balance_bytes(self.graph) + 4 * self.values.saturating_sub(removed)
    }

    /// Returns the bytes of a matrix in one layout. Rows of a dimension are sorted by width; other matrices have output
    /// steps if their order is not that of the blocks.
    pub fn matrix(&self, widths: &Widths, m: usize, packing: Packing) -> usize {
        let (_, sorted, blocks) = self.blocks(widths, m, packing);
        blocks.map(|shape| block_bytes(shape, !sorted)).sum()
    }

    /// Returns a matrix's columns, and its blocks in one layout; `true` if its rows need no output steps.
    fn blocks(
        &self,
        widths: &Widths,
        m: usize,
        packing: Packing,
    ) -> (usize, bool, impl Iterator<Item = BlockShape> + use<>) {
        let fed = Dimension::feeding(self.dimensions, m);
        let cols = fed.map_or(self.graph.matrices[m].cols, |d| d.kept(widths).max(1));
        let sorted = Dimension::made_by(self.dimensions, m).is_some() || are_in_order(&widths[m]);
        let rows_of = Width::ALL.map(|width| (width, widths[m].iter().filter(|w| **w == Some(width)).count()));
        let used = rows_of.into_iter().filter(|(_, rows)| *rows > 0);
        (cols, sorted, used.map(move |(width, rows)| packing.shape(width, rows, cols)))
    }

    /// Returns the widths that take the fewest bytes. Every matrix keeps one row, since without any it would disconnect
    /// the actions from the observations; `forced` matrices keep all.
    pub fn smallest(&self, forced: &[Option<Width>]) -> Widths {
        let one_row = |rows: usize, width: Width| {
            let mut widths = vec![None; rows];
            widths[..1.min(rows)].fill(Some(width));
            widths
        };
        let all = self.graph.matrices.iter().zip(forced);
        let mut widths: Widths = all
            .map(|(m, forced)| forced.map_or(one_row(m.rows, Width::W2), |width| vec![Some(width); m.rows]))
            .collect();
        // A wider row can take fewer bytes if it pads less.
        for m in (0..forced.len()).filter(|&m| forced[m].is_none()) {
            let tries = Width::ALL.map(|width| {
                widths[m] = one_row(widths[m].len(), width);
                (self.bytes(&widths), width)
            });
            let least = tries.into_iter().min_by_key(|(bytes, _)| *bytes);
            widths[m] = one_row(widths[m].len(), least.map_or(Width::W2, |(_, width)| width));
        }
        widths
    }
}

/// Returns the modelled cycles of the elements of all operations without a matrix in a step, and of the units of cells.
pub(super) fn cycles_of_elements(graph: &Graph, core: Core) -> f64 {
    let mut lowering = Lowering::new(graph.own_len(), readers(graph));
    let first = graph.denoising.as_ref().map_or(graph.nodes.len(), |denoising| denoising.first);
    let (once, repeated) = graph.nodes.split_at(first);
    lower_nodes(once, &mut lowering);
    let first_denoising_op = lowering.steps.len();
    lower_nodes(repeated, &mut lowering);
    let Lowering { steps, buffers, .. } = lowering;
    let Steps { steps, first_denoising_op, .. } =
        Steps { steps, first_denoising_op, buffers: &buffers }.without_copies(&|_| false);
    let of_step = |(i, step): (usize, &Step<Slice>)| {
        let runs = if i < first_denoising_op { 1 } else { graph.denoising_steps() as u64 };
        runs * core.rates().of_elements(step.kind, step.dst.len).cycles
    };
    let elementwise = steps.iter().enumerate().filter(|(_, step)| !matches!(step.kind, OpKind::Linear { .. }));
    elementwise.map(of_step).sum::<u64>() as f64
}

/// Returns `true` if blocks, narrow to wide, hold the rows in their own order, with rows without bits last.
fn are_in_order(widths: &[Option<Width>]) -> bool {
    widths.is_sorted_by_key(|width| (width.is_none(), *width))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::graph::WeightMatrix;
    use crate::methods::distill::dimension::{dimensions, testing::graph};
    use crate::methods::quantized::{Outcome, Quantized};
    use crate::random::Random;
    use half::bf16;

    /// Makes the packer's matrix, without codes.
    fn outcome(matrix: &WeightMatrix, widths: &[Option<Width>], x_max: u16) -> Outcome {
        let (rows, cols) = (matrix.rows, matrix.cols);
        let (codes, scales) = (Vec::new(), vec![bf16::ONE; rows]);
        let quantized =
            Quantized { rows, cols, group: 0, widths: widths.to_vec(), scales, group_scales: Vec::new(), codes };
        Outcome { quantized, error: None, x_max, allocation: None }
    }

    #[test]
    fn matrix_bytes_equal_those_of_the_packer() {
        let mut random = Random::new(4);
        let mut graph = Graph::new(19);
        graph.matrices = vec![WeightMatrix { name: "m".into(), rows: 23, cols: 19, data: Vec::new() }];
        for x_max in [127, 32767] {
            let packing = Packing::of(x_max, 0);
            let size = Size { packings: vec![vec![packing]], ..Size::new(&graph, &[], 0) };
            for _ in 0..200 {
                let choices = [None, Some(Width::W2), Some(Width::W3), Some(Width::W4), Some(Width::W8)];
                let of = 1 + random.below(5);
                let mut widths: Vec<Option<Width>> = (0..23).map(|_| choices[random.below(of)]).collect();
                if random.below(2) == 0 {
                    widths.sort_by_key(|width| (width.is_none(), *width));
                }
                let found = outcome(&graph.matrices[0], &widths, x_max).bytes();
                assert_eq!(size.bytes(&vec![widths.clone()]), found, "{widths:?}");
            }
        }
    }

    #[test]
    fn smallest_widths_take_the_fewest_bytes() {
        let graph = graph();
        let dimensions = dimensions(&graph);
        let packings = vec![vec![Packing::of(127, 0)]; 3];
        let size = Size { packings, ..Size::new(&graph, &dimensions, 13) };
        let least = size.bytes(&size.smallest(&[None; 3]));
        let mut random = Random::new(5);
        for _ in 0..500 {
            let draw = |rows: usize, random: &mut Random| -> Vec<Option<Width>> {
                let kept = random.below(rows);
                let width = |r: usize, random: &mut Random| {
                    (r == kept || random.below(4) == 0).then(|| Width::ALL[random.below(4)])
                };
                (0..rows).map(|r| width(r, random)).collect()
            };
            let widths: Widths = graph.matrices.iter().map(|m| draw(m.rows, &mut random)).collect();
            assert!(size.bytes(&widths) >= least, "{widths:?}");
        }
        let forced = size.smallest(&[None, Some(Width::W4), None]);
        assert_eq!((forced[1].clone(), forced[0].iter().flatten().count()), (vec![Some(Width::W4); 4], 1));
    }
}
