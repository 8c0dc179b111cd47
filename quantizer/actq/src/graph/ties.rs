//! Elements of hidden vectors that can only be removed together: those of vectors that are added or multiplied, of a
//! cell's gates and its state, of parts of concatenations, and the columns of the matrices that read them.

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
                Elements::Whole => vec![found.group(node.len, true)],
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
        let mut start = 0;
        let mut places = Vec::new();
        for &group in layout {
            places.extend(kept[group].iter().map(|element| start + element));
            start += self.lens[group];
        }
        places
    }

    /// Returns the kept rows of a matrix, as [`Self::places`].
    pub fn row_places(&self, matrix: usize, kept: &[Vec<usize>]) -> Vec<usize> {
        let (parts, layout) = &self.rows[matrix];
        let len: usize = layout.iter().map(|&group| self.lens[group]).sum();
        unit_rows(parts * len, len, &self.places(layout, kept))
    }

    /// Returns the places of a group's elements in a vector of this layout, once for each time that it has them.
    pub fn ranges(&self, layout: &Layout, group: usize) -> Vec<Range<usize>> {
        let mut start = 0;
        let mut ranges = Vec::new();
        for &of in layout {
            let end = start + self.lens[of];
            if of == group {
                ranges.push(start..end);
            }
            start = end;
        }
        ranges
    }

    /// Returns all elements of every group.
    pub fn whole(&self) -> Vec<Vec<usize>> {
        self.lens.iter().map(|&len| (0..len).collect()).collect()
    }
}

/// Returns the groups that make up a range of a vector; `None` if it begins or ends within one.
fn whole_groups(found: &Found, layout: &Layout, part: &Range<usize>) -> Option<Layout> {
    let mut start = 0;
    let mut groups = Layout::new();
    for &group in layout {
        let end = start + found.lens[group];
        match (start >= part.start && end <= part.end, end <= part.start || start >= part.end) {
            (true, _) => groups.push(group),
            (_, true) => {}
            _ => return None,
        }
        start = end;
    }
    Some(groups)
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
    use super::*;
    use crate::testing::{branches, lstm, mlp, residual};

    #[test]
    fn hidden_vectors_are_free() {
        for (graph, hidden) in [(mlp(), 4), (lstm(), 3)] {
            let ties = Ties::of(&graph);
            let free: Vec<usize> = ties.free.iter().map(|&group| ties.lens[group]).collect();
            assert_eq!(free, [hidden]);
        }
        assert_eq!(Ties::of(&lstm()).rows[0].0, 4, "an LSTM has four gates");
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
        }
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
