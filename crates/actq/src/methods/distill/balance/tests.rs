use actq_kernels::math::Function;

use super::*;
use crate::graph::ops::{Add, Concat, Linear, Lstm, Pointwise, Span};
use crate::graph::{Evaluator, ValueId, WeightMatrix};
use crate::random::Random;

const COLS: usize = 6;
/// Enough rows that a balance takes a small share of the weights' bytes.
const ROWS: usize = 800;

/// Builds a linear layer after the nodes that `before` builds. `COLS` different powers of three scale the
/// observations, and powers of two scale the weights.
fn linear(before: impl FnOnce(&mut Graph) -> ValueId) -> Graph {
    let mut graph = Graph::new(COLS);
    let value = before(&mut graph);
    let mut random = Random::new(3);
    let data = (0..ROWS * COLS).map(|i| random.normal() * 2f32.powi((i % COLS) as i32)).collect();
    let matrix = graph.add_matrix(WeightMatrix { name: "w".into(), rows: ROWS, cols: COLS, data }).expect("a matrix");
    graph.add(Linear { matrix, bias: vec![0.5; ROWS] }, &[value]).expect("it fits");
    graph
}

/// Generates observations about a mean of 2; the last value but one never moves, and the last equals the first.
fn observations(count: usize) -> Vec<Vec<f32>> {
    let mut random = Random::new(4);
    let mut one = || {
        let mut x: Vec<f32> = (0..COLS).map(|c| 2.0 + random.normal() * 3f32.powi(c as i32 - 4)).collect();
        (x[4], x[5]) = (7.0, x[0]);
        x
    };
    (0..count).map(|_| one()).collect()
}

fn run(graph: &Graph, observation: &[f32], see: &mut dyn FnMut(usize, &[f32])) -> Vec<f32> {
    Evaluator::new(graph).step(observation, see)
}

/// Measures the moments of every matrix's input.
fn moments(graph: &Graph, observations: &[Vec<f32>]) -> Vec<Moments> {
    let zero = |m: &WeightMatrix| Moments { second: DMatrix::zeros(m.cols, m.cols), mean: vec![0.0; m.cols], count: 0 };
    let mut sums: Vec<Moments> = graph.matrices.iter().map(zero).collect();
    for observation in observations {
        run(graph, observation, &mut |m, x| {
            let x = DVector::from_iterator(x.len(), x.iter().map(|v| f64::from(*v)));
            sums[m].second += &x * x.transpose();
            sums[m].mean.iter_mut().zip(&x).for_each(|(sum, v)| *sum += v);
            sums[m].count += 1;
        });
    }
    for Moments { second, mean, count } in &mut sums {
        *second /= *count as f64;
        mean.iter_mut().for_each(|sum| *sum /= *count as f64);
    }
    sums
}

fn close(a: f64, b: f64, share: f64) -> bool {
    (a - b).abs() <= share * (1.0 + a.abs().max(b.abs()))
}

/// Balances a network, and checks that its outputs are those of `graph` and its moments those of its inputs.
fn balanced(graph: &Graph) -> (Graph, Vec<Moments>) {
    let observations = observations(400);
    let mut predicted = moments(graph, &observations);
    let outputs: Vec<Vec<f64>> = graph.matrices.iter().map(|m| vec![1.0; m.rows]).collect();
    let balanced = balance(graph, &mut predicted, &outputs).expect("balanced");
    for observation in &observations[..20] {
        let (a, b) = (run(graph, observation, &mut |_, _| {}), run(&balanced, observation, &mut |_, _| {}));
        assert!(a.iter().zip(&b).all(|(a, b)| close((*a).into(), (*b).into(), 1e-4)), "{a:?} {b:?}");
    }
    for (predicted, seen) in predicted.iter().zip(moments(&balanced, &observations)) {
        assert!(predicted.mean.iter().zip(&seen.mean).all(|(a, b)| close(*a, *b, 1e-4)));
        assert!(predicted.second.iter().zip(&seen.second).all(|(a, b)| close(*a, *b, 1e-3)));
    }
    (balanced, predicted)
}

fn added(graph: &Graph) -> usize {
    graph.nodes.iter().filter(|node| matches!(node.kind, NodeKind::Balance(_))).count()
}

fn unit(clip: f32) -> Normalize {
    Normalize { mean: vec![2.0; COLS], scale: vec![1.0; COLS], pre_clip: 9.0, clip }
}

#[test]
fn balanced_columns_weigh_as_their_values() {
    let graph = linear(|_| 0);
    let (balanced, moments) = balanced(&graph);
    assert_eq!((added(&balanced), balance_bytes(&balanced)), (1, 4 * (2 * COLS + 2)));
    let of = |graph: &Graph, moments: &[Moments]| Columns::of(graph, &sites(graph)[0], moments, &[vec![1.0; ROWS]]);
    // Squares of weights and of deviations are in one proportion for values that move independently.
    let columns = of(&balanced, &moments);
    let share = |c: usize| columns.weights[c].sqrt() / columns.deviation[c];
    for c in 2..4 {
        assert!((share(c) / share(1) - 1.0).abs() < 0.2, "{c}: {} {}", share(c), share(1));
    }
    let before = of(&graph, &self::moments(&graph, &observations(400)));
    assert!(before.saved_bits() > 0.3, "{}", before.saved_bits());
    assert!(columns.saved_bits() < 0.2 * before.saved_bits(), "{}", columns.saved_bits());
    // A value that did not move reads 0, and its factor is within the range of the others.
    let NodeKind::Balance(balance) = &balanced.nodes[0].kind else { panic!("not before the matrix") };
    let Normalize { mean, scale, .. } = balance.normalize();
    assert_eq!((mean[4], columns.deviation[4]), (7.0, 0.0));
    let (least, most) = scale.iter().fold((f32::MAX, 0f32), |(a, b), v| (a.min(*v), b.max(*v)));
    assert!(least < scale[4] && scale[4] < most, "{scale:?}");
}

#[test]
fn own_unlimited_normalization_absorbs_the_factors() {
    let own = |clip| linear(|graph| graph.add(unit(clip), &[0]).expect("it fits"));
    let (free, _) = balanced(&own(f32::INFINITY));
    assert_eq!((added(&free), free.nodes.len()), (0, 2));
    assert!(
        matches!(&free.nodes[0].kind, NodeKind::Normalize(n) if n.scale.iter().any(|s| *s != 1.0) && n.pre_clip == 9.0)
    );
    // A normalization with a limit, or with other readers, is unchanged.
    let (limited, _) = balanced(&own(5.0));
    assert_eq!((added(&limited), limited.nodes[2].inputs[0]), (1, 2));
    let shared = linear(|graph| {
        let value = graph.add(unit(f32::INFINITY), &[0]).expect("it fits");
        graph.add(Add, &[value, value]).expect("it fits");
        value
    });
    let (shared, _) = balanced(&shared);
    assert_eq!((added(&shared), &shared.nodes[2].inputs[..]), (1, &[1, 1][..]));
}

/// The operation of the later value moves the node that reads the earlier one.
#[test]
fn two_values_are_balanced_by_two_operations() {
    let mut graph = linear(|graph| graph.add(unit(5.0), &[0]).expect("it fits"));
    let second = graph.matrices[0].clone();
    let second = graph.add_matrix(WeightMatrix { name: "second".into(), ..second }).expect("a matrix");
    let other = graph.add(Linear { matrix: second, bias: vec![0.1; ROWS] }, &[0]).expect("it fits");
    graph.add(Add, &[other, other - 1]).expect("it fits");
    let (balanced, _) = balanced(&graph);
    assert_eq!(added(&balanced), 2);
}

#[test]
fn balanced_or_unbalanceable_columns_are_unchanged() {
    // A balanced network gains nothing from balancing it again.
    let (once, _) = balanced(&linear(|_| 0));
    let (twice, _) = balanced(&once);
    assert_eq!(added(&twice), 1);
    // A matrix has one set of columns, and this one also reads another value.
    let mut shared = linear(|_| 0);
    let part = shared.add(Concat(vec![Span { from: 0, len: 4 }, Span { from: 0, len: 2 }]), &[1, 0]).expect("it fits");
    shared.add(Linear { matrix: 0, bias: vec![0.0; ROWS] }, &[part]).expect("it fits");
    assert_eq!(added(&balanced(&shared).0), 0);
}

fn set_column(graph: &mut Graph, column: usize, change: impl Fn(&mut f32)) {
    graph.matrices[0].data.iter_mut().skip(column).step_by(COLS).for_each(change);
}

#[test]
fn a_column_without_weights_leaves_the_others_balanced() {
    let mut graph = linear(|_| 0);
    set_column(&mut graph, 2, |w| *w = 0.0);
    let (balanced, moments) = balanced(&graph);
    let columns = Columns::of(&balanced, &sites(&balanced)[0], &moments, &[vec![1.0; ROWS]]);
    let share = |c: usize| columns.weights[c].sqrt() / columns.deviation[c];
    assert!((share(3) / share(1) - 1.0).abs() < 0.2, "{} {}", share(3), share(1));
}

#[test]
fn small_matrix_is_balanced_if_units_ruin_it() {
    const FEW: usize = 16;
    let small = |factor: f32| {
        let mut graph = linear(|_| 0);
        set_column(&mut graph, 0, |w| *w *= factor);
        graph.matrices[0].data.truncate(FEW * COLS);
        graph.matrices[0].rows = FEW;
        graph.nodes.clear();
        let data = (0..3000 * FEW).map(|i| (i as f32).sin()).collect();
        let large = WeightMatrix { name: "large".into(), rows: 3000, cols: FEW, data };
        let large = graph.add_matrix(large).expect("a matrix");
        let hidden = graph.add(Linear { matrix: 0, bias: vec![0.0; FEW] }, &[0]).expect("it fits");
        let hidden = graph.add(Pointwise(Function::Tanh), &[hidden]).expect("it fits");
        graph.add(Linear { matrix: large, bias: vec![0.0; 3000] }, &[hidden]).expect("it fits");
        balanced(&graph)
            .0
            .nodes
            .iter()
            .filter(|node| matches!(node.kind, NodeKind::Balance(_)) && node.inputs == [0])
            .count()
    };
    assert_eq!([small(1.0), small(1e4)], [0, 1]);
}

/// Builds [observation, relu of its product] -> product, and the nodes that `others` adds.
fn beside_a_hidden_vector(others: impl FnOnce(&mut Graph, ValueId)) -> Graph {
    let mut graph = linear(|_| 0);
    let hidden = graph.add(Pointwise(Function::Relu), &[1]).expect("it fits");
    let spans = vec![Span { from: 0, len: COLS }, Span { from: 0, len: ROWS }];
    let both = graph.add(Concat(spans), &[0, hidden]).expect("it fits");
    let data = (0..7 * (COLS + ROWS)).map(|i| (0.7 * i as f32).sin()).collect();
    let second = WeightMatrix { name: "second".into(), rows: 7, cols: COLS + ROWS, data };
    let second = graph.add_matrix(second).expect("a matrix");
    others(&mut graph, both);
    graph.add(Linear { matrix: second, bias: vec![0.1; 7] }, &[both]).expect("it fits");
    graph
}

#[test]
fn one_operation_balances_all_readers_of_the_observation() {
    let (all, _) = balanced(&beside_a_hidden_vector(|_, _| ()));
    assert_eq!((added(&all), &all.nodes[1].inputs[..], &all.nodes[3].inputs[..]), (1, &[1][..], &[1, 3][..]));
    // A value that other nodes read is unchanged.
    let read = |graph: &mut Graph, both| _ = graph.add(Add, &[both, both]).expect("it fits");
    let (part, _) = balanced(&beside_a_hidden_vector(read));
    assert_eq!((added(&part), &part.nodes[1].inputs[..], &part.nodes[3].inputs[..]), (1, &[1][..], &[0, 3][..]));
}

#[test]
fn a_hidden_vector_is_balanced_if_a_function_fixes_its_units() {
    let balances = |function: Function, factor: f32| {
        let mut graph = linear(|_| 0);
        let hidden = graph.add(Pointwise(function), &[1]).expect("it fits");
        let data = (0..200 * ROWS)
            .map(|i| (0.7 * i as f32).sin() * if i % ROWS < 9 { factor } else { 1.0 } / ROWS as f32)
            .collect();
        let second = WeightMatrix { name: "second".into(), rows: 200, cols: ROWS, data };
        let second = graph.add_matrix(second).expect("a matrix");
        graph.add(Linear { matrix: second, bias: vec![0.1; 200] }, &[hidden]).expect("it fits");
        let outputs: Vec<Vec<f64>> = graph.matrices.iter().map(|m| vec![1.0; m.rows]).collect();
        let balanced = balance(&graph, &mut moments(&graph, &observations(400)), &outputs).expect("balanced");
        let read = balanced.nodes.last().expect("a node").inputs[0];
        matches!(balanced.nodes[read - 1].kind, NodeKind::Balance(_))
    };
    for function in [Function::Elu, Function::Tanh, Function::Silu] {
        assert!(balances(function, 1e3), "{function:?}");
    }
    // Equalization has the same effect at no cost.
    assert!(!balances(Function::Relu, 1e3));
}

#[test]
fn unbalanceable_matrix_is_reported() {
    let shared = |factor: f32| {
        let mut graph = linear(|_| 0);
        set_column(&mut graph, 0, |w| *w *= factor);
        let turned = Concat(vec![Span { from: 3, len: 3 }, Span { from: 0, len: 3 }]);
        let turned = graph.add(turned, &[0, 0]).expect("it fits");
        graph.add(Linear { matrix: 0, bias: vec![0.5; ROWS] }, &[turned]).expect("it fits");
        let (balanced, moments) = balanced(&graph);
        assert_eq!(added(&balanced), 0);
        mixed_units(&balanced, &moments)
    };
    assert_eq!(shared(1.0), []);
    let [MixedUnits { matrix, observations, bits }] = &shared(1e9)[..] else { panic!("one matrix") };
    assert!(matrix == "w" && observations.contains(&0) && *bits > 3.0, "{observations:?} {bits}");
}

/// Builds a linear layer of `rows` that undoes the units of the observation. `mean` is in these units.
fn small(rows: usize, units: [f32; COLS], mean: f32) -> (Graph, Vec<Moments>) {
    let mut random = Random::new(6);
    let mut graph = Graph::new(COLS);
    let data = (0..rows * COLS).map(|i| random.normal() / units[i % COLS]).collect();
    let matrix = graph.add_matrix(WeightMatrix { name: "w".into(), rows, cols: COLS, data }).expect("a matrix");
    graph.add(Linear { matrix, bias: vec![0.5; rows] }, &[0]).expect("it fits");
    let mut one = || units.map(|unit| unit * (mean + random.normal())).to_vec();
    let observations: Vec<Vec<f32>> = (0..400).map(|_| one()).collect();
    let moments = moments(&graph, &observations);
    (graph, moments)
}

/// Returns the factors of an operation in a layer of `rows`, and the bytes of its constants.
fn scaled(rows: usize, units: [f32; COLS], mean: f32) -> Option<(Vec<f32>, usize)> {
    let (graph, mut moments) = small(rows, units, mean);
    let balanced = balance(&graph, &mut moments, &[vec![1.0; rows]]).expect("balanced");
    let NodeKind::Balance(balance) = &balanced.nodes[0].kind else { return None };
    Some((balance.normalize().scale.clone(), balance.constant_bytes()))
}

#[test]
fn only_columns_in_other_units_are_scaled() {
    for (unit, rows) in [(1e3, 500), (1e-5, 500), (1e3, 1000)] {
        let (scale, bytes) = scaled(rows, [1.0, 1.0, unit, 1.0, 1.0, 1.0], 0.0).expect("one unit differs");
        assert_eq!((scale[1], scale[3], bytes), (1.0, 1.0, Balance::bytes(1)), "{unit}");
        assert!((scale[2] * unit - 1.0).abs() < 0.2, "{unit}: {scale:?}");
    }
    // Of two units, only the one that fewer columns have is scaled.
    let (scale, bytes) = scaled(500, [1e4, 1.0, 1e4, 1e4, 1e4, 1e4], 0.0).expect("one unit differs");
    assert!((scale[1] / 1e4 - 1.0).abs() < 0.2 && scale[0] == 1.0 && bytes == Balance::bytes(1), "{scale:?}");
    assert_eq!(scaled(500, [1e4; COLS], 0.0), None);
}

#[test]
fn means_are_stored_if_cheap_or_important() {
    let units = [1.0, 1e3, 1e6, 1e-3, 1e2, 1e-5];
    let bytes = |rows, mean| scaled(rows, units, mean).map(|(_, bytes)| bytes);
    assert_eq!(bytes(50, 0.0), Some(Balance::bytes_without_means(COLS)));
    assert_eq!(bytes(20_000, 0.0), Some(Balance::bytes(COLS)));
    assert_eq!(bytes(50, 1000.0), Some(Balance::bytes(COLS)));
}

#[test]
fn lstm_gates_read_balanced_columns() {
    let mut graph = linear(|_| 0);
    let mut random = Random::new(5);
    let data = (0..ROWS * ROWS / 4).map(|_| 0.1 * random.normal()).collect();
    let state =
        graph.add_matrix(WeightMatrix { name: "s".into(), rows: ROWS, cols: ROWS / 4, data }).expect("a matrix");
    graph.matrices[0].data.iter_mut().for_each(|w| *w *= 0.01);
    graph.nodes.clear();
    graph.add(Lstm { hidden: ROWS / 4, input: 0, state, bias: vec![0.1; ROWS] }, &[0]).expect("it fits");
    let (balanced, _) = balanced(&graph);
    assert_eq!((added(&balanced), &balanced.nodes[1].inputs[..]), (1, &[1][..]));
}
