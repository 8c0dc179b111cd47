//! Elements of hidden vectors that can only be removed together. They are elements of vectors that are added or
//! multiplied, of a cell's gates and its state, of the same matrix's outputs for several tokens, and of queries and keys.
//! The columns of the matrices that read them belong to them.

use std::iter;
use std::mem;
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
    /// Groups whose elements can be removed, one by one.
    pub free: Vec<usize>,
    /// Heads whose elements can be removed, of all attentions alike.
    pub heads: Vec<Heads>,
    /// Groups of each value.
    pub values: Vec<Layout>,
    /// Parts of each matrix's rows (the gates of a cell, else 1), and the groups of each part.
    pub rows: Vec<(usize, Layout)>,
    /// Groups of each matrix's columns.
    pub cols: Vec<Layout>,
}

/// Heads of keys and values, with those of the queries that read them. An attention keeps equally many elements of
/// every key and value.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Heads {
    /// Group of each head's keys and queries. If positions rotate them, it has one element, which is all of the head's.
    pub keys: Vec<usize>,
    /// Group of each head's values.
    pub values: Vec<usize>,
}

/// Elements while their ties are found.
#[derive(Debug, Default)]
struct Found {
    /// An element that each is tied with; itself if none.
    parents: Vec<usize>,
    fixed: Vec<bool>,
    /// `true` for elements before which a group ends.
    begins: Vec<bool>,
    /// Elements of the keys and values of every attention, and those of a head.
    heads: Vec<([Vec<usize>; 2], usize)>,
}

impl Found {
    fn elements(&mut self, len: usize, fixed: bool) -> Vec<usize> {
        let from = self.parents.len();
        self.parents.extend(from..from + len);
        self.fixed.resize(from + len, fixed);
        self.begins.resize(from + len, false);
        (from..from + len).collect()
    }

    fn root(&mut self, mut element: usize) -> usize {
        while self.parents[element] != element {
            self.parents[element] = self.parents[self.parents[element]];
            element = self.parents[element];
        }
        element
    }

    fn fix(&mut self, elements: &[usize]) {
        for &element in elements {
            let root = self.root(element);
            self.fixed[root] = true;
        }
    }

    /// Ties the elements of two vectors of equal length.
    fn tie(&mut self, a: &[usize], b: &[usize]) {
        if a.len() != b.len() {
            self.fix(a);
            self.fix(b);
            return;
        }
        for (&a, &b) in a.iter().zip(b) {
            let (a, b) = (self.root(a), self.root(b));
            let (root, other) = (a.min(b), a.max(b));
            self.fixed[root] |= self.fixed[other];
            self.parents[other] = root;
        }
    }

    /// Ties a vector with one that may be known already.
    fn tie_known(&mut self, known: &mut Option<Vec<usize>>, elements: &[usize]) {
        if let Some(known) = known {
            self.tie(known, elements);
        } else {
            *known = Some(elements.to_vec());
        }
    }

    /// Ties queries `[token, head, element]` of `heads` with the keys that they are multiplied with, and the tokens of
    /// keys and values with each other; returns the elements of the outputs, those of the values. A prefix follows the
    /// keys and values.
    fn attend(&mut self, inputs: &[Vec<usize>], [heads, kv_heads, dim]: [usize; 3]) -> Vec<usize> {
        let width = kv_heads * dim;
        let of_head = |head: usize| head * kv_heads / heads * dim;
        let [keys, values] = [1, 2].map(|i| inputs[i][..width].to_vec());
        for head in 0..kv_heads {
            [&keys, &values].into_iter().for_each(|of| self.begins[of[head * dim]] = true);
        }
        for (i, input) in inputs.iter().enumerate().skip(1) {
            let first = if i % 2 == 1 { &keys } else { &values };
            input.chunks_exact(width).for_each(|token| self.tie(first, token));
        }
        let mut outputs = Vec::with_capacity(inputs[0].len());
        for (i, query) in inputs[0].chunks_exact(dim).enumerate() {
            let from = of_head(i % heads);
            self.tie(&keys[from..from + dim], query);
            outputs.extend_from_slice(&values[from..from + dim]);
        }
        self.heads.push(([keys, values], dim));
        outputs
    }
}

impl Ties {
    /// Finds the groups of a network. Observation, output and what a network iterates over stay whole.
    pub fn of(graph: &Graph) -> Self {
        let mut found = Found::default();
        let mut values: Vec<Vec<usize>> = vec![found.elements(graph.obs_len, true)];
        let mut rows: Vec<Option<(usize, Vec<usize>)>> = vec![None; graph.matrices.len()];
        let mut cols: Vec<Option<Vec<usize>>> = vec![None; graph.matrices.len()];
        for node in &graph.nodes {
            let inputs: Vec<Vec<usize>> = node.inputs.iter().map(|&value| values[value].clone()).collect();
            let elements = match node.kind.elements() {
                Elements::Whole => {
                    inputs.iter().for_each(|input| found.fix(input));
                    found.elements(node.len, true)
                }
                Elements::Inputs => {
                    inputs.iter().skip(1).for_each(|other| found.tie(&inputs[0], other));
                    inputs[0].clone()
                }
                Elements::Parts(parts) => {
                    parts.into_iter().zip(&inputs).flat_map(|(part, input)| input[part].to_vec()).collect()
                }
                Elements::Heads(dim) => {
                    for head in inputs[0].chunks_exact(dim) {
                        found.tie(&head[..dim - 1], &head[1..]);
                    }
                    inputs[0].clone()
                }
                Elements::Attention(sizes) => found.attend(&inputs, sizes),
                Elements::Own => {
                    let products = node.kind.products();
                    let known = products.iter().find_map(|product| rows[product.matrix].clone());
                    let own = known.map_or_else(|| found.elements(node.len, false), |(_, known)| known);
                    for product in products {
                        let operand = if product.operand == Operand::State { &own } else { &inputs[0] };
                        found.tie_known(&mut cols[product.matrix], operand);
                        let parts = graph.matrices[product.matrix].rows / node.len.max(1);
                        match &rows[product.matrix] {
                            Some((_, known)) => found.tie(known, &own),
                            None => rows[product.matrix] = Some((parts, own.clone())),
                        }
                    }
                    own
                }
            };
            values.push(elements);
        }
        found.fix(&values[graph.output()]);
        // A matrix that nothing uses stays as it is.
        for ((matrix, rows), cols) in graph.matrices.iter().zip(&mut rows).zip(&mut cols) {
            rows.get_or_insert_with(|| (1, found.elements(matrix.rows, true)));
            cols.get_or_insert_with(|| found.elements(matrix.cols, true));
        }
        resolved(found, values, rows.into_iter().flatten().collect(), cols.into_iter().flatten().collect())
    }

    /// Returns the places of the kept elements in a vector of this layout; `kept` has those of each group.
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

/// Makes groups of elements that are neighbours in every vector, and finds the heads among them.
fn resolved(mut found: Found, values: Vec<Vec<usize>>, rows: Vec<(usize, Vec<usize>)>, cols: Vec<Vec<usize>>) -> Ties {
    let count = found.parents.len();
    let mut begins = vec![false; count + 1];
    for element in 0..count {
        begins[found.root(element)] |= found.begins[element];
    }
    let heads = mem::take(&mut found.heads);
    let mut roots = |vector: Vec<usize>| -> Vec<usize> { vector.into_iter().map(|e| found.root(e)).collect() };
    let values: Vec<Vec<usize>> = values.into_iter().map(&mut roots).collect();
    let rows: Vec<(usize, Vec<usize>)> = rows.into_iter().map(|(parts, of_part)| (parts, roots(of_part))).collect();
    let cols: Vec<Vec<usize>> = cols.into_iter().map(&mut roots).collect();
    let heads: Vec<([Vec<usize>; 2], usize)> = heads.into_iter().map(|(of, dim)| (of.map(&mut roots), dim)).collect();
    let fixed = |element: usize| found.fixed.get(element).copied();
    // Neighbours of every element; `count` is beyond a vector's ends.
    let (mut before, mut after) = (vec![None; count + 1], vec![None; count + 1]);
    for vector in values.iter().chain(rows.iter().map(|(_, rows)| rows)).chain(&cols) {
        let mut last = count;
        for &next in vector.iter().chain([&count]) {
            let neighbours = (*after[last].get_or_insert(next), *before[next].get_or_insert(last));
            if neighbours != (next, last) || fixed(last) != fixed(next) {
                begins[next] = true;
                begins[neighbours.0] = true;
            }
            last = next;
        }
    }
    let (mut numbers, mut lens, mut free) = (vec![0; count], Vec::new(), Vec::new());
    for first in (0..count).filter(|&element| found.parents[element] == element && begins[element]) {
        let rest = iter::successors(Some(first), |&element| after[element].filter(|next| !begins[*next]));
        numbers[first] = lens.len();
        if !found.fixed[first] {
            free.push(lens.len());
        }
        lens.push(rest.count());
    }
    let layout = |vector: &Vec<usize>| -> Layout {
        vector.iter().filter(|element| begins[**element]).map(|&element| numbers[element]).collect()
    };
    // The group of a head's elements, if it has no others.
    let of_head = |head: &[usize]| {
        let group = numbers[head[0]];
        let is_whole = lens[group] == head.len() || head.iter().all(|element| *element == head[0]);
        (is_whole && begins[head[0]] && free.contains(&group)).then_some(group)
    };
    let mut attentions: Vec<(Layout, Option<Heads>)> = Vec::new();
    for (keys_and_values, dim) in &heads {
        let of_all =
            keys_and_values.each_ref().map(|of| of.chunks_exact(*dim).map(of_head).collect::<Option<Layout>>());
        let attention = match of_all {
            [Some(keys), Some(values)] => ([&keys[..], &values].concat(), Some(Heads { keys, values })),
            _ => (keys_and_values.each_ref().map(layout).concat(), None),
        };
        if !attentions.contains(&attention) {
            attentions.push(attention);
        }
    }
    free.retain(|group| attentions.iter().all(|(groups, _)| !groups.contains(group)));
    // Groups of several attentions, or of keys that are values, would lose elements twice.
    let is_alone =
        |group: &usize| attentions.iter().flat_map(|(groups, _)| groups).filter(|of| *of == group).count() == 1;
    let heads = attentions.iter().filter(|(groups, _)| groups.iter().all(is_alone));
    Ties {
        heads: heads.filter_map(|(_, heads)| heads.clone()).collect(),
        values: values.iter().map(layout).collect(),
        rows: rows.iter().map(|(parts, of_part)| (*parts, layout(of_part))).collect(),
        cols: cols.iter().map(layout).collect(),
        free,
        lens,
    }
}

#[cfg(test)]
mod tests {
    use actq_kernels::math::Function;

    use super::*;
    use crate::graph::ops::{Add, LayerNorm, Linear, Pointwise};
    use crate::graph::{NodeKind, WeightMatrix};
    use crate::testing::{attention, branches, lstm, mlp, residual};

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

    #[test]
    fn heads_are_groups_of_queries_keys_and_values() {
        for (kv_heads, is_rotated) in [(4, false), (2, false), (1, false), (2, true)] {
            let ties = Ties::of(&attention(kv_heads, is_rotated));
            let [Heads { keys, values }] = &ties.heads[..] else { panic!("{:?}", ties.heads) };
            assert_eq!((keys.len(), values.len(), ties.free.len()), (kv_heads, kv_heads, 0));
            let lens = |groups: &[usize]| groups.iter().map(|&group| ties.lens[group]).collect::<Vec<_>>();
            assert_eq!(lens(keys), vec![if is_rotated { 1 } else { 8 }; kv_heads]);
            assert_eq!(lens(values), vec![8; kv_heads]);
            for (head, (key, value)) in keys.iter().zip(values).enumerate() {
                // The queries of the head, and its key; a value is read by each of the queries.
                let queries = 4 / kv_heads;
                let made = ties.ranges(&ties.rows[0].1, *key).len() * lens(&[*key])[0];
                assert_eq!(made, 8 * (queries + 1));
                let read = ties.ranges(&ties.cols[1], *value);
                assert_eq!((read.len(), read[0].start), (queries, 8 * head * queries));
            }
        }
    }

    #[test]
    fn heads_with_fixed_places_stay_whole() {
        // The outputs of attention are those of the network.
        let mut graph = attention(2, false);
        let attention = graph.nodes.iter().position(|node| matches!(node.kind, NodeKind::Attention(_)));
        graph.nodes.truncate(attention.expect("attention") + 1);
        let ties = Ties::of(&graph);
        assert!(ties.heads.is_empty() && ties.free.is_empty());
    }
}
