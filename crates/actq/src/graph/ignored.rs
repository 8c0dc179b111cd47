//! Removal of what a network ignores and of what never changes in it. The function stays the same.
//!
//! Widths of 2 to 4 bits have no code for 0, so a column of zeros would get weights, and an ignored value would move
//! the actions and take resolution from the others. Columns of zeros leave their matrix: it reads the other elements
//! through a concatenation. Hidden elements that nothing reads leave with their rows. Elements that are constant become
//! part of the biases of the matrices that read them. A recurrent state keeps its length, since recordings hold states:
//! a unit that nothing reads gets rows of zeros, which every width holds exactly.

use ndarray::Array2;

use super::denoising::Denoising;
use super::narrow::part;
use super::operation::Operand;
use super::ops::{Concat, Span};
use super::units::unit_rows;
use super::weights::zero_state;
use super::{Graph, Network, Node, NodeKind, ValueId, WeightMatrix, Weights};

/// A mark for each element of every value.
type Marks = Vec<Vec<bool>>;

/// Returns the network without what it ignores.
pub fn without_ignored(graph: &Graph) -> Graph {
    let mut graph = with_folded_constants(graph);
    let live = live(&graph, true);
    silence_dead_units(&mut graph, &live);
    let columns: Vec<Vec<usize>> = (0..graph.matrices.len()).map(|m| read_columns(&graph, m, &live)).collect();
    let kept: Vec<Vec<usize>> = (0..live.len()).map(|value| kept(&graph, value, &live[value])).collect();
    let is_whole = (0..live.len()).all(|value| kept[value].len() == graph.len_of(value))
        && graph.matrices.iter().zip(&columns).all(|(matrix, columns)| columns.len() == matrix.cols);
    if is_whole { graph } else { rebuilt(&graph, kept, &columns) }
}

/// Returns the values of the observation that no action depends on, and the actions that are the same for every
/// observation. Where a node mixes all its values, as a norm does, all of them count as read.
pub fn without_effect(graph: &Graph) -> [Vec<usize>; 2] {
    let graph = with_folded_constants(graph);
    let all = |marks: &[bool], mark: bool| (0..marks.len()).filter(|&e| marks[e] == mark).collect();
    [all(&live(&graph, false)[0], false), all(&constants(&graph)[graph.output()], true)]
}

/// Moves the contribution of constant elements to the biases. Matrices that several products share stay as they are.
fn with_folded_constants(graph: &Graph) -> Graph {
    let constant = constants(graph);
    let mut folded = graph.clone();
    if !constant.iter().flatten().any(|is_constant| *is_constant) {
        return folded;
    }
    let observation = Array2::zeros((1, graph.input_len()));
    let pass = Network::new(graph).forward(&Weights::of(graph), observation, &mut zero_state(graph, 1));
    for n in 0..graph.nodes.len() {
        let products = graph.nodes[n].kind.products();
        let of_input = products.iter().filter(|product| product.operand == Operand::Input);
        for product in of_input.filter(|product| makers(graph, product.matrix).len() == 1) {
            let input = graph.nodes[n].inputs[0];
            let WeightMatrix { cols, data, .. } = &mut folded.matrices[product.matrix];
            let bias = &mut folded.nodes[n].kind.vectors_mut()[product.bias];
            for c in (0..*cols).filter(|&c| constant[input][c] && pass.values[input][[0, c]].is_finite()) {
                let value = f64::from(pass.values[input][[0, c]]);
                for (row, bias) in data.chunks_exact_mut(*cols).zip(bias.iter_mut()) {
                    *bias = (f64::from(*bias) + f64::from(row[c]) * value) as f32;
                    row[c] = 0.0;
                }
            }
        }
    }
    folded
}

/// Marks the elements that are the same for every input. Nodes of denoising steps have none.
fn constants(graph: &Graph) -> Marks {
    let once = graph.denoising.as_ref().map_or(graph.nodes.len(), |denoising| denoising.first);
    let mut constant: Marks = vec![vec![false; graph.obs_len]];
    for (n, node) in graph.nodes.iter().enumerate() {
        let all = |e: usize| node.inputs.iter().all(|&input| constant[input][e]);
        let is_constant: Vec<bool> = match &node.kind {
            _ if n >= once => vec![false; node.len],
            NodeKind::Linear(linear) => {
                let rows = graph.matrices[linear.matrix].data.chunks_exact(graph.matrices[linear.matrix].cols);
                rows.map(|row| row.iter().enumerate().all(|(c, w)| *w == 0.0 || all(c))).collect()
            }
            NodeKind::LayerNorm(norm) => norm.weight.iter().map(|w| *w == 0.0).collect(),
            NodeKind::RmsNorm(norm) => norm.weight.iter().map(|w| *w == 0.0).collect(),
            NodeKind::Normalize(by) => by.scale.iter().enumerate().map(|(e, s)| *s == 0.0 || all(e)).collect(),
            NodeKind::Concat(Concat(spans)) => {
                let parts = node.inputs.iter().zip(spans);
                parts.flat_map(|(&input, span)| constant[input][span.from..][..span.len].to_vec()).collect()
            }
            NodeKind::Pointwise(_) | NodeKind::Add(_) | NodeKind::Mul(_) | NodeKind::Balance(_) => {
                (0..node.len).map(all).collect()
            }
            NodeKind::Attention(_)
            | NodeKind::Rotary(_)
            | NodeKind::Lstm(_)
            | NodeKind::Gru(_)
            | NodeKind::Iterate(_)
            | NodeKind::Table(_) => vec![false; node.len],
        };
        constant.push(is_constant);
    }
    constant
}

/// Marks the elements that reach the output; with `keeps_one` at least one of each value and of each matrix's columns.
fn live(graph: &Graph, keeps_one: bool) -> Marks {
    let mut live: Marks = (0..=graph.nodes.len()).map(|value| vec![false; graph.len_of(value)]).collect();
    live[graph.output()].fill(true);
    loop {
        let before = live.clone();
        (0..graph.nodes.len()).rev().for_each(|n| mark_inputs(graph, n, &mut live, keeps_one));
        if live == before {
            let dead = live.iter_mut().find(|of_value| keeps_one && !of_value.contains(&true));
            let Some(dead) = dead else { return live };
            dead[0] = true;
        }
    }
}

/// Marks the elements that the marked ones of node `n` depend on, and those that stay because of them.
fn mark_inputs(graph: &Graph, n: usize, live: &mut Marks, keeps_one: bool) {
    let (node, value) = (&graph.nodes[n], n + 1);
    for product in node.kind.products() {
        for other in makers(graph, product.matrix) {
            let of_other = live[other + 1].clone();
            live[value].iter_mut().zip(of_other).for_each(|(mark, other)| *mark |= other);
        }
        let operand = if product.operand == Operand::State { value } else { node.inputs[0] };
        for c in read_columns_of(graph, product.matrix, node.len, &live[value], keeps_one) {
            live[operand][c] = true;
        }
    }
    match &node.kind {
        NodeKind::LayerNorm(_) | NodeKind::RmsNorm(_) => {
            let any = live[value].contains(&true);
            [value, node.inputs[0]].into_iter().for_each(|of| live[of].iter_mut().for_each(|mark| *mark |= any));
        }
        NodeKind::Attention(_) | NodeKind::Rotary(_) => {
            let any = live[value].contains(&true);
            let all = node.inputs.iter().copied().chain([value]);
            all.for_each(|of| live[of].iter_mut().for_each(|mark| *mark |= any));
        }
        NodeKind::Concat(Concat(spans)) => {
            let mut from = 0;
            for (&input, span) in node.inputs.iter().zip(spans) {
                (0..span.len).filter(|i| live[value][from + i]).collect::<Vec<_>>().into_iter().for_each(|i| {
                    live[input][span.from + i] = true;
                });
                from += span.len;
            }
        }
        NodeKind::Pointwise(_)
        | NodeKind::Normalize(_)
        | NodeKind::Balance(_)
        | NodeKind::Add(_)
        | NodeKind::Mul(_) => {
            let (inputs, made) = live.split_at_mut(value);
            for &input in &node.inputs {
                for (read, made) in inputs[input].iter_mut().zip(&mut made[0]) {
                    *read |= *made;
                    // An element that stays for another reader stays here, too: selecting it would cost a copy.
                    *made |= *read && can_narrow(graph, input);
                }
            }
        }
        NodeKind::Linear(_) | NodeKind::Lstm(_) | NodeKind::Gru(_) | NodeKind::Iterate(_) | NodeKind::Table(_) => (),
    }
}

/// Returns the nodes that use a matrix.
fn makers(graph: &Graph, matrix: usize) -> Vec<usize> {
    let uses = |n: &usize| graph.nodes[*n].kind.products().iter().any(|product| product.matrix == matrix);
    (0..graph.nodes.len()).filter(uses).collect()
}

/// `true` if elements of a value can be removed from it. The others can only be selected from it.
fn can_narrow(graph: &Graph, value: ValueId) -> bool {
    use NodeKind::{Add, Balance, Concat, Linear, Mul, Normalize, Pointwise, Table};
    let kind = value.checked_sub(1).map(|n| &graph.nodes[n].kind);
    let elementwise = matches!(kind, Some(Linear(_) | Pointwise(_) | Normalize(_) | Balance(_) | Add(_) | Mul(_)));
    value != graph.output() && (elementwise || matches!(kind, Some(Concat(_) | Table(_))))
}

/// Returns the elements of a value that stay in it.
fn kept(graph: &Graph, value: ValueId, live: &[bool]) -> Vec<usize> {
    (0..live.len()).filter(|&e| live[e] || !can_narrow(graph, value)).collect()
}

/// Returns the columns of a matrix that live rows read; of one that reads a state, or that nothing uses, all.
fn read_columns(graph: &Graph, matrix: usize, live: &Marks) -> Vec<usize> {
    let all = || (0..graph.matrices[matrix].cols).collect();
    let Some(&n) = makers(graph, matrix).first() else { return all() };
    let products = graph.nodes[n].kind.products();
    let of_state = products.iter().any(|product| product.matrix == matrix && product.operand == Operand::State);
    if of_state { all() } else { read_columns_of(graph, matrix, graph.nodes[n].len, &live[n + 1], true) }
}

/// Returns the columns of a matrix that the rows of these units read; with `keeps_one` at least one.
fn read_columns_of(graph: &Graph, matrix: usize, hidden: usize, live: &[bool], keeps_one: bool) -> Vec<usize> {
    let WeightMatrix { rows, cols, data, .. } = &graph.matrices[matrix];
    let units: Vec<usize> = (0..hidden).filter(|&unit| live[unit]).collect();
    let mut read = vec![false; *cols];
    for row in unit_rows(*rows, hidden, &units) {
        read.iter_mut().zip(&data[row * cols..]).for_each(|(read, w)| *read |= *w != 0.0);
    }
    read[0] |= keeps_one && !read.contains(&true);
    (0..*cols).filter(|&c| read[c]).collect()
}

/// Sets the rows and biases of recurrent units that nothing reads to zero: their state stays zero.
fn silence_dead_units(graph: &mut Graph, live: &Marks) {
    for n in 0..graph.nodes.len() {
        let (products, hidden) = (graph.nodes[n].kind.products(), graph.nodes[n].len);
        let dead: Vec<usize> = (0..hidden).filter(|&unit| !live[n + 1][unit]).collect();
        let is_alone = products.iter().all(|product| makers(graph, product.matrix).len() == 1);
        if dead.is_empty() || !is_alone || graph.nodes[n].kind.state_lens() == [0, 0] {
            continue;
        }
        for product in products {
            let WeightMatrix { rows, cols, data, .. } = &mut graph.matrices[product.matrix];
            let bias = &mut graph.nodes[n].kind.vectors_mut()[product.bias];
            for row in unit_rows(*rows, hidden, &dead) {
                data[row * *cols..][..*cols].fill(0.0);
                bias[row] = 0.0;
            }
        }
    }
}

/// Makes the network of the kept elements of each value and the read columns of each matrix.
fn rebuilt(graph: &Graph, kept: Vec<Vec<usize>>, columns: &[Vec<usize>]) -> Graph {
    let mut matrices = graph.matrices.clone();
    for (m, matrix) in matrices.iter_mut().enumerate() {
        let Some(&n) = makers(graph, m).first() else { continue };
        *matrix = part(matrix, &unit_rows(matrix.rows, graph.nodes[n].len, &kept[n + 1]), &columns[m]);
    }
    let mut to = Rebuilt {
        graph: Graph { matrices, nodes: Vec::new(), ..graph.clone() },
        places: vec![0],
        kept,
        selections: Vec::new(),
    };
    for (n, node) in graph.nodes.iter().enumerate() {
        if graph.denoising.as_ref().is_some_and(|denoising| denoising.first == n) {
            let first = to.graph.nodes.len();
            to.graph.denoising = graph.denoising.clone().map(|denoising| Denoising { first, ..denoising });
        }
        let place = to.copy(n, node, columns);
        to.places.push(place);
    }
    to.graph
}

/// A network of the kept elements, as far as it is made.
struct Rebuilt {
    graph: Graph,
    /// Its value for each value of the former network, and the former elements of that.
    places: Vec<ValueId>,
    kept: Vec<Vec<usize>>,
    /// Former values with some of their elements, and the values that hold these.
    selections: Vec<(ValueId, Vec<usize>, ValueId)>,
}

impl Rebuilt {
    fn push(&mut self, kind: NodeKind, inputs: Vec<ValueId>, len: usize) -> ValueId {
        self.graph.nodes.push(Node { kind, inputs, len });
        self.graph.output()
    }

    /// Copies a node with its kept elements.
    fn copy(&mut self, n: usize, node: &Node, columns: &[Vec<usize>]) -> ValueId {
        let kept = self.kept[n + 1].clone();
        let mut kind = node.kind.clone();
        if let NodeKind::Concat(Concat(spans)) = &kind {
            let mut from = 0;
            let (mut inputs, mut runs) = (Vec::new(), Vec::new());
            for (&input, span) in node.inputs.iter().zip(spans) {
                let of_part =
                    kept.iter().filter(|e| (from..from + span.len).contains(*e)).map(|e| e - from + span.from);
                let spans = self.spans(input, &of_part.collect::<Vec<_>>());
                inputs.extend(vec![self.places[input]; spans.len()]);
                runs.extend(spans);
                from += span.len;
            }
            return self.push(Concat(runs).into(), inputs, kept.len());
        }
        let products = node.kind.products();
        let product = products.iter().find(|product| product.operand == Operand::Input);
        let inputs = node.inputs.iter().map(|&input| {
            let read = match (product, &node.kind) {
                (Some(product), _) => columns[product.matrix].clone(),
                (None, NodeKind::LayerNorm(_) | NodeKind::RmsNorm(_)) => (0..node.len).collect(),
                (None, NodeKind::Attention(_) | NodeKind::Rotary(_)) => self.kept[input].clone(),
                (None, _) => kept.clone(),
            };
            self.select(input, read)
        });
        let inputs = inputs.collect();
        if kept.len() < node.len {
            kind.keep_units(node.len, &kept);
        }
        self.push(kind, inputs, kept.len())
    }

    /// Returns a value that holds these elements of a former one.
    fn select(&mut self, value: ValueId, elements: Vec<usize>) -> ValueId {
        if self.kept[value] == elements {
            return self.places[value];
        }
        let known = self.selections.iter().find(|(of, some, _)| *of == value && *some == elements);
        if let Some((.., place)) = known {
            return *place;
        }
        let spans = self.spans(value, &elements);
        let inputs = vec![self.places[value]; spans.len()];
        let place = self.push(Concat(spans).into(), inputs, elements.len());
        self.selections.push((value, elements, place));
        place
    }

    /// Returns the runs of these former elements in the value that holds them.
    fn spans(&self, value: ValueId, elements: &[usize]) -> Vec<Span> {
        let held = &self.kept[value];
        let places: Vec<usize> = elements.iter().map(|element| held.partition_point(|of| of < element)).collect();
        places.chunk_by(|a, b| a + 1 == *b).map(|run| Span { from: run[0], len: run.len() }).collect()
    }
}

#[cfg(test)]
mod tests {
    use actq_kernels::Width;
    use actq_kernels::math::Function;

    use super::*;
    use crate::budget::Budget;
    use crate::data::Recordings;
    use crate::graph::ops::{LayerNorm, Linear, Normalize, Pointwise};
    use crate::graph::run::tests::iterative;
    use crate::graph::{Evaluator, Graph};
    use crate::methods::{Method, Options};
    use crate::pipeline::quantize;
    use crate::policy::Policy;
    use crate::runtime::with_head;
    use crate::testing::{branches, dataset, gru, layers, lstm, mlp, outputs, residual};

    /// Sets columns of a matrix to zero.
    fn clear(graph: &mut Graph, matrix: usize, columns: &[usize]) {
        let WeightMatrix { cols, data, .. } = &mut graph.matrices[matrix];
        data.chunks_exact_mut(*cols).for_each(|row| columns.iter().for_each(|&c| row[c] = 0.0));
    }

    /// Sets rows of a matrix to zero.
    fn clear_rows(graph: &mut Graph, matrix: usize, rows: &[usize]) {
        let WeightMatrix { cols, data, .. } = &mut graph.matrices[matrix];
        rows.iter().for_each(|row| data[row * *cols..][..*cols].fill(0.0));
    }

    /// Makes a network that normalizes its observation.
    fn normalizing() -> Graph {
        let mut graph = Graph::new(4);
        graph.matrices = layers(&[4, 6, 2]).matrices;
        let by = Normalize { mean: vec![0.1; 4], scale: vec![1.5; 4], pre_clip: f32::INFINITY, clip: 5.0 };
        let value = graph.add(by, &[0]).expect("it fits");
        let value = graph.add(Linear { matrix: 0, bias: vec![0.1; 6] }, &[value]).expect("it fits");
        let value = graph.add(Pointwise(Function::Elu), &[value]).expect("it fits");
        graph.add(Linear { matrix: 1, bias: vec![0.1; 2] }, &[value]).expect("it fits");
        graph
    }

    /// Networks that ignore the observation's value 1.
    fn ignoring() -> Vec<Graph> {
        let mut graphs = vec![mlp(), lstm(), gru(4), residual(4, true), normalizing(), layers(&[5, 6, 6, 3])];
        graphs.iter_mut().for_each(|graph| clear(graph, 0, &[1]));
        let mut joined = branches([4, 3]);
        [0, 1].into_iter().for_each(|matrix| clear(&mut joined, matrix, &[1]));
        clear(&mut joined, 2, &[4]);
        graphs.push(joined);
        graphs
    }

    fn assert_close(a: &Graph, b: &Graph) {
        for (a, b) in outputs(a).iter().flatten().zip(outputs(b).iter().flatten()) {
            assert!((a - b).abs() < 1e-6, "{a} and {b}");
        }
    }

    #[test]
    fn ignored_values_leave_the_matrices() {
        for graph in ignoring() {
            let without = without_ignored(&graph);
            assert_eq!([&graph, &without].map(without_effect), [[vec![1], vec![]], [vec![1], vec![]]]);
            assert_eq!(outputs(&graph), outputs(&without));
            assert_eq!((without.obs_len, without.state_len()), (graph.obs_len, graph.state_len()));
            let is_zero = |matrix: &WeightMatrix, c: usize| matrix.data.chunks(matrix.cols).all(|row| row[c] == 0.0);
            assert!(without.matrices.iter().all(|matrix| !(0..matrix.cols).any(|c| is_zero(matrix, c))));
            assert!(without.weights() < graph.weights());
        }
    }

    #[test]
    fn networks_that_read_everything_stay_as_they_are() {
        for graph in [mlp(), lstm(), gru(4), residual(4, true), branches([4, 3]), iterative()] {
            let same = without_ignored(&graph);
            assert!(without_effect(&graph).iter().all(Vec::is_empty));
            assert_eq!(same.matrices, graph.matrices);
            assert_eq!(same.nodes.len(), graph.nodes.len());
        }
    }

    #[test]
    fn images_do_not_depend_on_ignored_values() {
        for graph in ignoring() {
            let calib = Some(dataset(&graph, 8, 30));
            let (policy, recordings) =
                (Policy::of("ignoring", without_ignored(&graph)), Recordings { calib, heldout: None });
            for method in [Method::Rtn, Method::Gptq, Method::Distill] {
                for width in Width::ALL {
                    let options = Options { steps: Some(4), ..Options::new(method.clone(), Budget::Width(width)) };
                    let buffer = quantize(&policy, &recordings, &options, ()).expect("an image").buffer();
                    let image = buffer.image("memory".as_ref()).expect("an image");
                    let actions = |ignored: f32| {
                        with_head::<Vec<Vec<f32>>, crate::error::Error>(image, |head| {
                            let obs =
                                |t: usize, i: usize| if i == 1 { ignored } else { (0.7 * (t + 3 * i) as f32).sin() };
                            let frame = |t| (0..policy.graph.obs_len).map(|i| obs(t, i)).collect::<Vec<_>>();
                            (0..9).map(|t| Ok(head.infer(&frame(t))?.to_vec())).collect()
                        })
                    };
                    let usual = actions(0.0).expect("actions");
                    for ignored in [0.3, -40.0, 1e6] {
                        assert_eq!(actions(ignored).expect("actions"), usual, "{method} {width:?} {ignored}");
                    }
                }
            }
        }
    }

    #[test]
    fn units_that_nothing_reads_leave_with_their_rows() {
        for (mut graph, reader) in [(mlp(), 1), (layers(&[3, 6, 5, 2]), 1), (branches([4, 3]), 2)] {
            clear(&mut graph, reader, &[2]);
            let without = without_ignored(&graph);
            assert_eq!(outputs(&graph), outputs(&without));
            assert_eq!(without.matrices[0].rows, graph.matrices[0].rows - 1);
            assert_eq!(without.matrices[reader].cols, graph.matrices[reader].cols - 1);
        }
        // Of a chain of units, the whole chain.
        let mut graph = layers(&[3, 6, 5, 2]);
        clear(&mut graph, 2, &[0, 1, 2, 3]);
        for row in graph.matrices[1].data.chunks_mut(6).skip(4) {
            row[3..].fill(0.0);
        }
        let without = without_ignored(&graph);
        let shapes: Vec<(usize, usize)> = without.matrices.iter().map(|m| (m.rows, m.cols)).collect();
        assert_eq!(shapes, [(3, 3), (1, 3), (2, 1)]);
        assert_eq!(outputs(&graph), outputs(&without));
    }

    #[test]
    fn recurrent_units_that_nothing_reads_stay_zero() {
        for mut graph in [lstm(), gru(3)] {
            [1, 2].into_iter().for_each(|matrix| clear(&mut graph, matrix, &[1]));
            let without = without_ignored(&graph);
            assert_eq!(outputs(&graph), outputs(&without));
            let WeightMatrix { rows, cols, data, .. } = &without.matrices[0];
            let gates = unit_rows(*rows, 3, &[1]);
            assert!(gates.into_iter().all(|row| data[row * cols..][..*cols].iter().all(|w| *w == 0.0)));
            assert_eq!((without.state_len(), without.matrices[2].cols), (graph.state_len(), 2));
        }
    }

    #[test]
    fn constant_units_become_biases() {
        for mut graph in [mlp(), layers(&[3, 6, 5, 2]), branches([4, 3])] {
            clear_rows(&mut graph, 0, &[0, 2]);
            let without = without_ignored(&graph);
            assert_close(&graph, &without);
            assert_eq!(without.matrices[0].rows, graph.matrices[0].rows - 2);
        }
        // A norm without weights is its bias.
        let mut graph = residual(4, true);
        let norm = |graph: &mut Graph, weight: Vec<f32>| {
            let of = graph.nodes.iter_mut().find_map(|node| match &mut node.kind {
                NodeKind::LayerNorm(norm) => Some(norm),
                _ => None,
            });
            of.into_iter().for_each(|of: &mut LayerNorm| of.weight.clone_from(&weight));
        };
        norm(&mut graph, vec![1.0, 0.0, 0.5, 0.0]);
        let without = without_ignored(&graph);
        assert_close(&graph, &without);
        assert_eq!(without.matrices[2].cols, 2);
        norm(&mut graph, vec![0.0; 4]);
        assert_close(&graph, &without_ignored(&graph));
    }

    #[test]
    fn iterative_heads_lose_what_they_ignore() {
        let mut graph = iterative();
        let input: Vec<f32> = (0..graph.input_len()).map(|i| 0.3 * i as f32 - 0.5).collect();
        let first = graph.nodes.iter().find_map(|node| match &node.kind {
            NodeKind::Linear(linear) if node.inputs == [0] => Some(linear.matrix),
            _ => None,
        });
        clear(&mut graph, first.expect("a matrix reads the observation"), &[1]);
        let without = without_ignored(&graph);
        assert!(without.weights() < graph.weights());
        let outputs = [&graph, &without].map(|graph| Evaluator::new(graph).step(&input, &mut |_, _| {}));
        assert_eq!(outputs[0], outputs[1]);
    }

    #[test]
    fn networks_without_weights_keep_their_function() {
        let mut graph = layers(&[3, 4, 2]);
        graph.matrices.iter_mut().for_each(|matrix| matrix.data.fill(0.0));
        assert_close(&graph, &without_ignored(&graph));
    }
}
