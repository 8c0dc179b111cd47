//! Small networks and recordings of them, for the unit tests of this crate and, by path, of `actq-research`.

use actq::data::Dataset;
use actq::graph::ops::{Add, Attention, Concat, Gru, LayerNorm, Linear, Lstm, Pointwise, Rotary, Span};
use actq::graph::{Evaluator, Graph, NodeKind, WeightMatrix};
use actq::random::Random;
use actq_kernels::math::Function;
use ndarray::Array3;

fn matrix(name: &str, rows: usize, cols: usize, random: &mut Random) -> WeightMatrix {
    WeightMatrix { name: name.into(), rows, cols, data: (0..rows * cols).map(|_| 0.7 * random.unit()).collect() }
}

fn vector(len: usize, random: &mut Random) -> Vec<f32> {
    (0..len).map(|_| 0.3 * random.unit()).collect()
}

/// Makes a network 3 -> 4 tanh -> 2.
pub(crate) fn mlp() -> Graph {
    let mut random = Random::new(1);
    let mut graph = Graph::new(3);
    graph.matrices = vec![matrix("a", 4, 3, &mut random), matrix("b", 2, 4, &mut random)];
    graph.add(Linear { matrix: 0, bias: vector(4, &mut random) }, &[0]).expect("it fits");
    graph.add(Pointwise(Function::Tanh), &[1]).expect("it fits");
    graph.add(Linear { matrix: 1, bias: vector(2, &mut random) }, &[2]).expect("it fits");
    graph
}

/// Makes a network of linear layers with tanh between them.
pub(crate) fn layers(lens: &[usize]) -> Graph {
    let mut random = Random::new(3);
    let mut graph = Graph::new(lens[0]);
    for (i, of) in lens.windows(2).enumerate() {
        graph.matrices.push(matrix(&format!("m{i}"), of[1], of[0], &mut random));
        let input = match i {
            0 => 0,
            _ => graph.add(Pointwise(Function::Tanh), &[graph.nodes.len()]).expect("it fits"),
        };
        graph.add(Linear { matrix: i, bias: vector(of[1], &mut random) }, &[input]).expect("it fits");
    }
    graph
}

/// Makes a network LSTM 2 -> 3, then 3 -> 2.
pub(crate) fn lstm() -> Graph {
    let mut random = Random::new(2);
    let mut graph = Graph::new(2);
    graph.matrices =
        vec![matrix("w_ih", 12, 2, &mut random), matrix("w_hh", 12, 3, &mut random), matrix("out", 2, 3, &mut random)];
    let bias = vector(12, &mut random);
    graph.add(Lstm { hidden: 3, input: 0, state: 1, bias }, &[0]).expect("it fits");
    graph.add(Linear { matrix: 2, bias: vector(2, &mut random) }, &[1]).expect("it fits");
    graph
}

/// Makes a network GRU 2 -> `hidden`, then -> 2.
pub(crate) fn gru(hidden: usize) -> Graph {
    let mut random = Random::new(5);
    let mut graph = Graph::new(2);
    for (name, rows, cols) in [("w_ih", 3 * hidden, 2), ("w_hh", 3 * hidden, hidden), ("out", 2, hidden)] {
        graph.matrices.push(matrix(name, rows, cols, &mut random));
    }
    let (input_bias, state_bias) = (vector(3 * hidden, &mut random), vector(3 * hidden, &mut random));
    graph.add(Gru { hidden, input: 0, state: 1, input_bias, state_bias }, &[0]).expect("it fits");
    graph.add(Linear { matrix: 2, bias: vector(2, &mut random) }, &[1]).expect("it fits");
    graph
}

/// Makes a network 3 -> `len` relu, to which two blocks `len` -> `len` relu add, the second after a norm if wanted;
/// then -> 2.
pub(crate) fn residual(len: usize, normed: bool) -> Graph {
    let mut random = Random::new(7);
    let mut graph = Graph::new(3);
    for (i, (rows, cols)) in [(len, 3), (len, len), (len, len), (2, len)].into_iter().enumerate() {
        graph.matrices.push(matrix(&format!("m{i}"), rows, cols, &mut random));
    }
    let mut stream = 0;
    for matrix in 0..3 {
        let mut value = stream;
        if normed && matrix == 2 {
            let norm = LayerNorm { weight: vector(len, &mut random), bias: vector(len, &mut random), eps: 1e-5 };
            value = graph.add(norm, &[value]).expect("it fits");
        }
        value = graph.add(Linear { matrix, bias: vector(len, &mut random) }, &[value]).expect("it fits");
        value = graph.add(Pointwise(Function::Relu), &[value]).expect("it fits");
        stream = if stream == 0 { value } else { graph.add(Add, &[value, stream]).expect("it fits") };
    }
    graph.add(Linear { matrix: 3, bias: vector(2, &mut random) }, &[stream]).expect("it fits");
    graph
}

/// Makes a network with two branches, 3 -> `a` relu and 3 -> `b` tanh, whose outputs with two values of the observation
/// between them are read together: `a` + 2 + `b` -> 2.
pub(crate) fn branches([a, b]: [usize; 2]) -> Graph {
    let mut random = Random::new(9);
    let mut graph = Graph::new(3);
    for (i, (rows, cols)) in [(a, 3), (b, 3), (2, a + 2 + b)].into_iter().enumerate() {
        graph.matrices.push(matrix(&format!("m{i}"), rows, cols, &mut random));
    }
    let mut branch = |matrix: usize, len: usize, function: Function| {
        let linear = graph.add(Linear { matrix, bias: vector(len, &mut random) }, &[0]).expect("it fits");
        graph.add(Pointwise(function), &[linear]).expect("it fits")
    };
    let (first, second) = (branch(0, a, Function::Relu), branch(1, b, Function::Tanh));
    let spans = [(0, a), (1, 2), (0, b)].map(|(from, len)| Span { from, len });
    let joined = graph.add(Concat(spans.to_vec()), &[first, 0, second]).expect("it fits");
    graph.add(Linear { matrix: 2, bias: vector(2, &mut random) }, &[joined]).expect("it fits");
    graph
}

/// Makes a transformer of two layers of 16 values and four heads, after which the last token gives 2 values: causal over
/// the four tokens of an observation of 12 values, or, with a `context`, over as many steps of 3 values.
pub(crate) fn transformer(context: usize) -> Graph {
    let mut random = Random::new(17);
    let (tokens, width) = (if context > 0 { 1 } else { 4 }, 16);
    let mut graph = Graph::new(3 * tokens);
    let mut layer = |graph: &mut Graph, inputs: &[usize], rows: usize| -> Vec<usize> {
        let cols = graph.len_of(inputs[0]);
        let index = graph.add_matrix(matrix("m", rows, cols, &mut random)).expect("a matrix");
        let mut of_token = |input: &usize| {
            graph.add(Linear { matrix: index, bias: vector(rows, &mut random) }, &[*input]).expect("it fits")
        };
        inputs.iter().map(&mut of_token).collect()
    };
    let cut = |graph: &mut Graph, value: usize, len: usize| -> Vec<usize> {
        let places = (0..graph.len_of(value)).step_by(len);
        places.map(|from| graph.join(vec![(value, Span { from, len })]).expect("a part")).collect()
    };
    let joined = |graph: &mut Graph, parts: &[usize]| {
        let parts = parts.iter().map(|part| (*part, Span { from: 0, len: graph.len_of(*part) })).collect();
        graph.join(parts).expect("parts")
    };
    let added = |graph: &mut Graph, to: &[usize], values: &[usize]| -> Vec<usize> {
        let norm = LayerNorm { weight: vec![1.0; width], bias: vec![0.0; width], eps: 1e-5 };
        let sums: Vec<usize> = to.iter().zip(values).map(|(x, y)| graph.add(Add, &[*x, *y]).expect("a sum")).collect();
        sums.into_iter().map(|sum| graph.add(norm.clone(), &[sum]).expect("a norm")).collect()
    };
    let observed = cut(&mut graph, 0, 3);
    let mut x = layer(&mut graph, &observed, width);
    for _ in 0..2 {
        let inputs = [0, 1, 2].map(|_| layer(&mut graph, &x, width)).map(|parts| joined(&mut graph, &parts));
        let attention = Attention { heads: 4, kv_heads: 4, dim: 4, factor: 0.5, causal: context == 0, context };
        let y = graph.add(attention, &inputs).expect("it fits");
        let y = cut(&mut graph, y, width);
        let y = layer(&mut graph, &y, width);
        x = added(&mut graph, &x, &y);
        let hidden = layer(&mut graph, &x, 2 * width);
        let active: Vec<usize> =
            hidden.iter().map(|h| graph.add(Pointwise(Function::Gelu), &[*h]).expect("it fits")).collect();
        let y = layer(&mut graph, &active, width);
        x = added(&mut graph, &x, &y);
    }
    layer(&mut graph, &x[tokens - 1..], 2);
    graph
}

/// As [`transformer`] of four tokens, whose layers have the same biases for every token.
pub(crate) fn transformer_of_modules() -> Graph {
    let mut graph = transformer(0);
    let mut biases = vec![None; graph.matrices.len()];
    for node in &mut graph.nodes {
        if let NodeKind::Linear(linear) = &mut node.kind {
            linear.bias.clone_from(biases[linear.matrix].get_or_insert(linear.bias.clone()));
        }
    }
    graph
}

/// Makes attention over two tokens of three values, whose four heads of eight values read these heads of keys: one layer
/// makes queries, keys and values, of which the first two are rotated or not, and one reads the outputs, 2 for each token.
pub(crate) fn attention(kv_heads: usize, is_rotated: bool) -> Graph {
    let mut random = Random::new(23);
    let (dim, widths) = (8, [4, kv_heads, kv_heads].map(|heads| 8 * heads));
    let mut graph = Graph::new(6);
    let part = |from: usize, len: usize| Span { from, len };
    let rows = widths.iter().sum();
    graph.matrices.extend([matrix("qkv", rows, 3, &mut random), matrix("out", 2, widths[0], &mut random)]);
    let bias = vector(rows, &mut random);
    let tokens = [0, 3].map(|from| {
        let token = graph.join(vec![(0, part(from, 3))]).expect("a part");
        graph.add(Linear { matrix: 0, bias: bias.clone() }, &[token]).expect("it fits")
    });
    let from = [0, widths[0], widths[0] + widths[1]];
    let mut inputs = [0, 1, 2].map(|i| {
        let parts = tokens.iter().map(|token| (*token, part(from[i], widths[i]))).collect();
        graph.join(parts).expect("parts")
    });
    if is_rotated {
        for (i, input) in inputs.iter_mut().take(2).enumerate() {
            let angles: Vec<f32> = (0..dim).map(|j| 0.3 * j as f32).collect();
            let [cos, sin] = [f32::cos, f32::sin].map(|of| angles.iter().map(|angle| of(*angle)).collect());
            *input = graph.add(Rotary { heads: widths[i] / dim, dim, cos, sin }, &[*input]).expect("it fits");
        }
    }
    let of = Attention { heads: 4, kv_heads, dim, factor: 0.5, causal: false, context: 0 };
    let y = graph.add(of, &inputs).expect("it fits");
    let outputs = [0, 1].map(|token| {
        let token = graph.join(vec![(y, part(token * widths[0], widths[0]))]).expect("a part");
        graph.add(Linear { matrix: 1, bias: vec![0.1; 2] }, &[token]).expect("it fits")
    });
    graph.join(outputs.map(|token| (token, part(0, 2))).to_vec()).expect("parts");
    graph
}

/// Runs a network over some observations.
pub(crate) fn outputs(graph: &Graph) -> Vec<Vec<f32>> {
    let mut evaluator = Evaluator::new(graph);
    let obs = |t: usize| (0..graph.obs_len).map(|i| (0.7 * (t + 3 * i) as f32).sin()).collect::<Vec<_>>();
    (0..20).map(|t| evaluator.step(&obs(t), &mut |_, _| {})).collect()
}

/// Makes random observations with the network's own actions.
pub(crate) fn dataset(graph: &Graph, episodes: usize, steps: usize) -> Dataset {
    let mut random = Random::new(3);
    recorded(graph, episodes, steps, |_, _| (0..graph.obs_len).map(|_| random.unit()).collect())
}

/// Records a robot that the network drives: every value of the observation follows an action slowly, but the last one
/// is the first one of the step before.
pub(crate) fn driven(graph: &Graph, episodes: usize, steps: usize) -> Dataset {
    let mut random = Random::new(4);
    let last = graph.obs_len - 1;
    recorded(graph, episodes, steps, |before, action| {
        let Some(before) = before else { return (0..graph.obs_len).map(|_| random.normal()).collect() };
        let mut next: Vec<f32> = before.iter().map(|x| 0.9 * x + 0.1 * random.normal()).collect();
        next.iter_mut().zip(action.iter().cycle()).for_each(|(x, action)| *x += 0.2 * action);
        next[last] = before[0];
        next
    })
}

/// Records the network's actions on episodes of observations: `next` gives the first one, and the one after an
/// observation and its action.
fn recorded(
    graph: &Graph,
    episodes: usize,
    steps: usize,
    mut next: impl FnMut(Option<&[f32]>, &[f32]) -> Vec<f32>,
) -> Dataset {
    let mut obs = Array3::zeros((episodes, steps, graph.obs_len));
    let mut action = Array3::zeros((episodes, steps, graph.len_of(graph.output())));
    let mut evaluator = Evaluator::new(graph);
    for episode in 0..episodes {
        evaluator.reset();
        let (mut x, mut y) = (Vec::new(), Vec::new());
        for step in 0..steps {
            x = next((step > 0).then_some(&x[..]), &y);
            y = evaluator.step(&x, &mut |_, _| {});
            x.iter().enumerate().for_each(|(i, x)| obs[(episode, step, i)] = *x);
            y.iter().enumerate().for_each(|(i, y)| action[(episode, step, i)] = *y);
        }
    }
    Dataset { path: "test".into(), obs, action: Some(action), length: vec![steps; episodes], state: None }
}
