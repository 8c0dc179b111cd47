//! Elements of hidden vectors that can only be removed together. They are elements of vectors that are added or
//! multiplied, of a cell's gates and its state, and of parts of concatenations. The columns of the matrices that read
//! them belong to them.

use std::ops::Range;

use super::Graph;
use super::operation::{Elements, Operand};
use super::units::unit_rows;

/// Groups of a vector's elements, in their order.
pub type Layout = Vec<usize>;

/// A network's vectors and matrices as groups of elements. Removing an element of a group removes it everywhere.
#[derive(Clone, Debug)]
pub struct Ties {
    /// Elements of each group.
    pub lens: Vec<usize>,
    /// Groups whose elements can be removed.
    pub free: Vec<usize>,
    /// Groups of each value.
    pub values: Vec<Layout>,
    /// Parts of each matrix's rows (the gates of a cell, else 1), and the groups of each part.
    pub rows: Vec<(usize, Layout)>,
    /// Groups of each matrix's columns.
    pub cols: Vec<Layout>,
}

/// Groups while they are found.
#[derive(Debug, Default)]
struct Found {
    lens: Vec<usize>,
    fixed: Vec<bool>,
    /// A group that each is part of; itself if none.
    parents: Vec<usize>,
}

impl Found {
    fn group(&mut self, len: usize, fixed: bool) -> usize {
        self.lens.push(len);
        self.fixed.push(fixed);
        self.parents.push(self.parents.len());
        self.parents.len() - 1
    }

    fn root(&self, mut group: usize) -> usize {
        while self.parents[group] != group {
            group = self.parents[group];
        }
        group
    }

    fn fix(&mut self, layout: &Layout) {
        for &group in layout {
            let root = self.root(group);
            self.fixed[root] = true;
        }
    }

    /// Ties the elements of two vectors of equal length.
    fn tie(&mut self, a: &Layout, b: &Layout) {
        let lens = |layout: &Layout| layout.iter().map(|&group| self.lens[group]).collect::<Vec<_>>();
        if lens(a) != lens(b) {
            self.fix(a);
            self.fix(b);
            return;
        }
        for (&a, &b) in a.iter().zip(b) {
            let (a, b) = (self.root(a), self.root(b));
            self.fixed[a] |= self.fixed[b];
            self.parents[b] = a;
        }
    }

    /// Ties a layout with one that may be known already.
    fn tie_known(&mut self, known: &mut Option<Layout>, layout: &Layout) {
        match known.take() {
            Some(known) => self.tie(&known, layout),
            None => *known = Some(layout.clone()),
        }
        known.get_or_insert_with(|| layout.clone());
    }
}

impl Ties {
    /// Finds the groups of a network. Observation, output and what a network iterates over stay whole.
    pub fn of(graph: &Graph) -> Self {
        let mut found = Found::default();
        let mut values: Vec<Layout> = vec![vec![found.group(graph.obs_len, true)]];
        let mut rows: Vec<Option<(usize, Layout)>> = vec![None; graph.matrices.len()];
        let mut cols: Vec<Option<Layout>> = vec![None; graph.matrices.len()];
        for node in &graph.nodes {
            let inputs: Vec<Layout> = node.inputs.iter().map(|&value| values[value].clone()).collect();
            let layout = match node.kind.elements() {
                Elements::Whole => {
                    inputs.iter().for_each(|input| found.fix(input));
                    vec![found.group(node.len, true)]
                }
                Elements::Inputs => {
                    inputs.iter().skip(1).for_each(|other| found.tie(&inputs[0], other));
                    inputs[0].clone()
                }
                Elements::Parts(parts) => {
                    let mut layout = Layout::new();
                    for (part, input) in parts.into_iter().zip(&inputs) {
                        layout.extend(whole_groups(&found, input, &part).unwrap_or_else(|| {
                            found.fix(input);
                            vec![found.group(part.len(), true)]
                        }));
                    }
                    layout
                }
                Elements::Own => {
                    let products = node.kind.products();
                    let known = products.iter().find_map(|product| rows[product.matrix].clone());
                    let layout = known.map_or_else(|| vec![found.group(node.len, false)], |(_, layout)| layout);
                    for product in products {
                        let operand = if product.operand == Operand::State { &layout } else { &inputs[0] };
                        found.tie_known(&mut cols[product.matrix], operand);
                        let parts = graph.matrices[product.matrix].rows / node.len.max(1);
                        match &rows[product.matrix] {
                            Some((_, known)) => found.tie(known, &layout),
                            None => rows[product.matrix] = Some((parts, layout.clone())),
                        }
                    }
                    layout
                }
            };
            values.push(layout);
        }
        found.fix(&values[graph.output()]);
        // A matrix that nothing uses stays as it is.
        for ((matrix, rows), cols) in graph.matrices.iter().zip(&mut rows).zip(&mut cols) {
            rows.get_or_insert_with(|| (1, vec![found.group(matrix.rows, true)]));
            cols.get_or_insert_with(|| vec![found.group(matrix.cols, true)]);
        }
        resolved(&found, values, rows, cols)
    }

    /// Returns the places of the kept elements in a vector of this layout; `kept` has those of each group, ascending.
    pub fn places(&self, layout: &Layout, kept: &[Vec<usize>]) -> Vec<usize> {
        let of_group = |(group, at): (usize, Range<usize>)| kept[group].iter().map(move |element| at.start + element);
        spans(&self.lens, layout).flat_map(of_group).collect()
    }

    /// Returns the kept rows of a matrix, as [`Self::places`].
    pub fn row_places(&self, matrix: usize, kept: &[Vec<usize>]) -> Vec<usize> {
        let (parts, layout) = &self.rows[matrix];
        let len: usize = layout.iter().map(|&group| self.lens[group]).sum();
        unit_rows(parts * len, len, &self.places(layout, kept))
    }

    /// Returns the places of a group's elements in a vector of this layout, once for each time that it has them.
    pub fn ranges(&self, layout: &Layout, group: usize) -> Vec<Range<usize>> {
        spans(&self.lens, layout).filter(|(of, _)| *of == group).map(|(_, at)| at).collect()
    }

    /// Returns all elements of every group.
    pub fn whole(&self) -> Vec<Vec<usize>> {
        self.lens.iter().map(|&len| (0..len).collect()).collect()
    }
}

/// Returns the groups of a layout with the places of their elements; `lens` has the elements of each group.
fn spans<'a>(lens: &'a [usize], layout: &'a Layout) -> impl Iterator<Item = (usize, Range<usize>)> + use<'a> {
    layout.iter().scan(0, |end, &group| {
        let start = *end;
        *end += lens[group];
        Some((group, start..*end))
    })
}

/// Returns the groups that make up a range of a vector; `None` if it begins or ends within one.
fn whole_groups(found: &Found, layout: &Layout, part: &Range<usize>) -> Option<Layout> {
    let touched = spans(&found.lens, layout).filter(|(_, at)| at.end > part.start && at.start < part.end);
    touched.map(|(group, at)| (at.start >= part.start && at.end <= part.end).then_some(group)).collect()
}

/// Numbers the groups that are left from 0 on.
fn resolved(found: &Found, values: Vec<Layout>, rows: Vec<Option<(usize, Layout)>>, cols: Vec<Option<Layout>>) -> Ties {
    let roots: Vec<usize> = (0..found.lens.len()).filter(|&group| found.root(group) == group).collect();
    let number = |group: &usize| roots.iter().position(|root| *root == found.root(*group)).unwrap_or(0);
    let layout = |layout: Layout| -> Layout { layout.iter().map(number).collect() };
    Ties {
        lens: roots.iter().map(|&root| found.lens[root]).collect(),
        free: (0..roots.len()).filter(|&i| !found.fixed[roots[i]]).collect(),
        values: values.into_iter().map(layout).collect(),
        rows: rows.into_iter().flatten().map(|(parts, groups)| (parts, layout(groups))).collect(),
        cols: cols.into_iter().flatten().map(layout).collect(),
    }
}

#[cfg(test)]
mod tests {
    use actq_kernels::math::Function;

    use super::*;
    use crate::graph::WeightMatrix;
    use crate::graph::ops::{Add, LayerNorm, Linear, Pointwise};
    use crate::testing::{branches, lstm, mlp, residual};

    #[test]
    fn hidden_vectors_are_free() {
        for (graph, hidden) in [(mlp(), 4), (lstm(), 3)] {
            let ties = Ties::of(&graph);
            let free: Vec<usize> = ties.free.iter().map(|&group| ties.lens[group]).collect();
            assert_eq!(free, [hidden]);
        }
        let ties = Ties::of(&lstm());
        assert_eq!(ties.rows[0].0, 4, "an LSTM has four gates");
        assert_eq!(ties.rows[1], ties.rows[0], "both matrices of a cell make its units");
    }

    #[test]
    fn residual_vectors_are_narrowed_together() {
        for normed in [false, true] {
            let graph = residual(4, normed);
            let ties = Ties::of(&graph);
            assert_eq!(ties.free.len(), 1);
            let stream = &ties.values[1];
            assert!((1..graph.nodes.len()).all(|value| ties.values[value] == *stream));
            assert!(ties.cols[1..].iter().all(|cols| cols == stream));
            assert!(ties.rows[..3].iter().all(|(parts, rows)| (*parts, rows) == (1, stream)));
        }
    }

    #[test]
    fn vectors_inside_blocks_are_free_of_streams() {
        let mut graph = Graph::new(3);
        for (rows, cols) in [(6, 3), (5, 6), (6, 5), (2, 6)] {
            let data = vec![0.1; rows * cols];
            graph.add_matrix(WeightMatrix { name: "m".into(), rows, cols, data }).expect("a matrix");
        }
        let mut linear = |matrix: usize, rows: usize, input: usize| {
            graph.add(Linear { matrix, bias: vec![0.0; rows] }, &[input]).expect("it fits")
        };
        let first = linear(0, 6, 0);
        let inner = linear(1, 5, first);
        let outer = linear(2, 6, inner);
        let sum = graph.add(Add, &[outer, first]).expect("it fits");
        let norm = LayerNorm { weight: vec![1.0; 6], bias: vec![0.0; 6], eps: 1e-5 };
        let norm = graph.add(norm, &[sum]).expect("it fits");
        let active = graph.add(Pointwise(Function::Relu), &[norm]).expect("it fits");
        graph.add(Linear { matrix: 3, bias: vec![0.0; 2] }, &[active]).expect("it fits");
        let ties = Ties::of(&graph);
        assert_eq!(ties.free.len(), 2);
        assert_eq!(ties.values[first], ties.values[norm]);
        assert_eq!(ties.cols[3], ties.rows[0].1);
        assert_ne!(ties.values[inner], ties.values[first]);
    }

    #[test]
    fn parts_of_a_concatenation_are_free_alone() {
        let graph = branches([4, 3]);
        let ties = Ties::of(&graph);
        assert_eq!(ties.free.iter().map(|&group| ties.lens[group]).collect::<Vec<_>>(), [4, 3]);
        let last = &ties.cols[2];
        assert_eq!((last.len(), last[0], last[2]), (3, ties.free[0], ties.free[1]));
        assert_eq!(ties.ranges(last, ties.free[1])[0], 6..9);
    }
}
