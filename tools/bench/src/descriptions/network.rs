//! Random ONNX files.

use actq::random::Random;
use actq_testkit::onnx::{Node, shaped};

/// Operator, inputs, outputs and attributes of a node.
type Parts = (&'static str, Vec<String>, Vec<String>, Vec<(&'static str, usize)>);

/// A file under construction.
#[derive(Debug, Default)]
pub(super) struct File {
    nodes: Vec<Parts>,
    tensors: Vec<(String, Vec<usize>, Vec<f32>)>,
    inputs: Vec<(String, usize)>,
    outputs: Vec<(String, usize)>,
}

/// Outputs of a drawn file: names and lengths.
#[derive(Debug)]
pub(super) struct Outputs {
    /// Those that depend on weights.
    pub(super) weighted: Vec<(String, usize)>,
    /// Those that do not.
    pub(super) plain: Vec<(String, usize)>,
    /// Input and output of a state that the description keeps.
    pub(super) state: Option<(String, String)>,
}

impl File {
    fn node(&mut self, op: &'static str, reads: &[&str], to: &str) -> String {
        self.with(op, reads, to, &[])
    }

    fn with(&mut self, op: &'static str, reads: &[&str], to: &str, numbers: &[(&'static str, usize)]) -> String {
        let reads = reads.iter().map(|&name| name.to_owned()).collect();
        self.nodes.push((op, reads, vec![to.to_owned()], numbers.to_vec()));
        to.to_owned()
    }

    fn tensor(&mut self, name: &str, shape: &[usize], values: Vec<f32>) -> String {
        self.tensors.push((name.to_owned(), shape.to_vec(), values));
        name.to_owned()
    }

    /// Adds a product with random weights and biases.
    fn linear(&mut self, random: &mut Random, x: &str, [from, to]: [usize; 2], name: &str) -> String {
        let mut values = |n: usize, scale: f32| (0..n).map(|_| scale * random.unit()).collect();
        let (weights, biases) = (values(from * to, (3.0 / from as f32).sqrt()), values(to, 0.3));
        let w = self.tensor(&format!("{name}.w"), &[from, to], weights);
        let b = self.tensor(&format!("{name}.b"), &[to], biases);
        self.node("Gemm", &[x, &w, &b], name)
    }

    /// Adds what a network may end in: a function, limits, factors, or nothing.
    fn end(&mut self, random: &mut Random, x: &str, len: usize, name: &str) {
        match random.below(6) {
            0 => self.node("Tanh", &[x], name),
            1 => self.node("Sigmoid", &[x], name),
            2 => {
                let low = self.tensor(&format!("{name}.low"), &[], vec![-0.4 * random.share() - 0.1]);
                let high = self.tensor(&format!("{name}.high"), &[], vec![0.4 * random.share() + 0.1]);
                self.node("Clip", &[x, &low, &high], name)
            }
            3 => {
                let scale = self.tensor(&format!("{name}.scale"), &[len], (0..len).map(|_| random.unit()).collect());
                let tanh = self.node("Tanh", &[x], &format!("{name}.tanh"));
                self.node("Mul", &[&tanh, &scale], name)
            }
            4 => {
                let offset = self.tensor(&format!("{name}.offset"), &[len], (0..len).map(|_| random.unit()).collect());
                self.node("Add", &[x, &offset], name)
            }
            _ => self.node("Identity", &[x], name),
        };
    }

    /// Draws a file with these inputs, and perhaps one for a state.
    pub(super) fn draw(random: &mut Random, inputs: &[(String, usize)]) -> (Vec<u8>, Outputs) {
        let mut file = Self { inputs: inputs.to_vec(), ..Self::default() };
        let (mut weighted, mut plain, mut state) = (Vec::new(), Vec::new(), None);
        let kept = 1 + random.below(4);
        if random.below(4) == 0 {
            file.inputs.push(("kept".to_owned(), kept));
            state = Some(("kept".to_owned(), "next".to_owned()));
        }
        let names: Vec<String> = file.inputs.iter().map(|(name, _)| name.clone()).collect();
        let mut len: usize = file.inputs.iter().map(|(_, len)| len).sum();
        let names: Vec<&str> = names.iter().map(String::as_str).collect();
        let mut x = match names[..] {
            [one] => one.to_owned(),
            _ => file.with("Concat", &names, "all", &[("axis", 1)]),
        };
        if random.below(3) == 0 {
            let op = ["Tanh", "Neg", "Relu"][random.below(3)];
            file.node(op, &[&x], "plain");
            plain.push(("plain".to_owned(), len));
        }
        if state.is_some() {
            let next = file.linear(random, &x, [len, kept], "next.linear");
            file.node("Tanh", &[&next], "next");
            file.outputs.push(("next".to_owned(), kept));
        }
        for layer in 0..random.below(3) {
            let wide = 2 + random.below(10);
            let y = file.linear(random, &x, [len, wide], &format!("hidden{layer}"));
            let function = ["Relu", "Elu", "Tanh", "Sigmoid"][random.below(4)];
            x = file.node(function, &[&y], &format!("function{layer}"));
            len = wide;
        }
        for output in 0..1 + random.below(2) {
            let (name, to) = (format!("out{output}"), 1 + random.below(5));
            let y = file.linear(random, &x, [len, to], &format!("{name}.linear"));
            file.end(random, &y, to, &name);
            weighted.push((name, to));
        }
        file.outputs.extend(weighted.iter().chain(&plain).cloned());
        (file.bytes(), Outputs { weighted, plain, state })
    }

    fn bytes(&self) -> Vec<u8> {
        fn names(of: &[String]) -> Vec<&str> {
            of.iter().map(String::as_str).collect()
        }
        let texts: Vec<_> = self.nodes.iter().map(|(_, reads, gives, _)| [names(reads), names(gives)]).collect();
        let nodes: Vec<Node<'_>> = self
            .nodes
            .iter()
            .zip(&texts)
            .map(|((op, _, _, numbers), [reads, gives])| (*op, &reads[..], &gives[..], &numbers[..]))
            .collect();
        let tensors: Vec<_> =
            self.tensors.iter().map(|(name, shape, values)| (&**name, &shape[..], values.clone())).collect();
        let shapes = |ports: &[(String, usize)]| ports.iter().map(|(_, len)| [1, *len]).collect::<Vec<_>>();
        let [of_inputs, of_outputs] = [&self.inputs, &self.outputs].map(|ports| shapes(ports));
        let inputs: Vec<_> =
            self.inputs.iter().zip(&of_inputs).map(|((name, _), shape)| (&**name, &shape[..])).collect();
        let outputs: Vec<_> =
            self.outputs.iter().zip(&of_outputs).map(|((name, _), shape)| (&**name, &shape[..])).collect();
        shaped(&nodes, &tensors, &inputs, &outputs, &[])
    }
}
