//! The network as a list of nodes over values.

use super::denoising::Denoising;
use super::ops::NodeKind;
use super::tied::Tied;
use super::values::{ValueId, WeightMatrix};

/// A node: operation, inputs, and length of the output.
#[derive(Clone, Debug)]
pub struct Node {
    /// The operation.
    pub kind: NodeKind,
    /// Values that it reads.
    pub inputs: Vec<ValueId>,
    /// Length of its output.
    pub len: usize,
}

impl Node {
    /// Returns for each of its vectors whether quantization changes it.
    fn changed(&self, learns: bool) -> Vec<bool> {
        let follows_product = |i: usize| self.kind.products().iter().any(|product| product.bias == i);
        (0..self.kind.vectors().len()).map(|i| learns || follows_product(i)).collect()
    }
}

/// A network.
#[derive(Clone, Debug)]
pub struct Graph {
    /// Length of an observation, with the values of its prefix.
    pub obs_len: usize,
    /// Values at the end of an observation that are its prefix: keys and values of attentions, which an image gets apart.
    pub prefix_len: usize,
    /// Weight matrices; each is quantized once, however many nodes use it.
    pub matrices: Vec<WeightMatrix>,
    /// Nodes in the order of evaluation; the last one's output is the network's.
    pub nodes: Vec<Node>,
    /// Denoising steps, if the network is the head of a flow or a diffusion policy.
    pub denoising: Option<Denoising>,
}

impl Graph {
    /// Makes a network without nodes.
    pub fn new(obs_len: usize) -> Self {
        Self { obs_len, prefix_len: 0, matrices: Vec::new(), nodes: Vec::new(), denoising: None }
    }

    /// Returns the length of an observation without its prefix: that of an image.
    pub fn own_len(&self) -> usize {
        self.obs_len - self.prefix_len
    }

    /// Returns the noise values that an evaluation takes after the observation.
    pub fn noise_len(&self) -> usize {
        self.denoising.as_ref().map_or(0, Denoising::noise_len)
    }

    /// Returns the length of an observation with its noise.
    pub fn input_len(&self) -> usize {
        self.obs_len + self.noise_len()
    }

    /// Returns the evaluations of the network in a step.
    pub fn denoising_steps(&self) -> usize {
        self.denoising.as_ref().map_or(1, |denoising| denoising.steps.len())
    }

    /// Returns the value of the last node.
    pub fn output(&self) -> ValueId {
        self.nodes.len()
    }

    /// Returns the length of a value.
    pub fn len_of(&self, value: ValueId) -> usize {
        if value == 0 { self.obs_len } else { self.nodes[value - 1].len }
    }

    /// Returns the nodes that read a value.
    pub fn readers(&self, value: ValueId) -> Vec<usize> {
        (0..self.nodes.len()).filter(|&n| self.nodes[n].inputs.contains(&value)).collect()
    }

    /// Returns the values of the recurrent state: for each node in order its hidden state, then its cell state. An
    /// image keeps the same order.
    pub fn state_len(&self) -> usize {
        self.nodes.iter().flat_map(|node| node.kind.state_lens()).sum()
    }

    /// Returns `true` if attention keeps tokens of earlier steps.
    pub fn keeps_tokens(&self) -> bool {
        self.nodes.iter().any(|node| matches!(&node.kind, NodeKind::Attention(attention) if attention.context > 0))
    }

    /// Returns the number of trained values, as the f32 policy stores them: weights, biases, norms. Statistics that
    /// normalize the observation are not trained and do not count.
    pub fn parameters(&self) -> usize {
        self.nodes.iter().map(|node| node.kind.trained_values()).sum::<usize>() + self.weights()
    }

    /// Returns the vectors that quantization changes: those after matrices, which take constant errors, and all if it
    /// `learns`.
    pub fn changed_vectors(&mut self, learns: bool) -> impl Iterator<Item = &mut Vec<f32>> {
        self.nodes.iter_mut().flat_map(move |node| {
            let changed = node.changed(learns);
            let vectors = node.kind.vectors_mut().into_iter().zip(changed);
            vectors.filter(|(_, changed)| *changed).map(|(vector, _)| vector)
        })
    }

    /// Returns the number of values in [`Self::changed_vectors`], of which an image holds those that tokens have in common
    /// once.
    pub fn changed_values(&self, learns: bool) -> usize {
        let copies = Tied::of(self).copies();
        let vectors = self.nodes.iter().flat_map(|node| node.kind.vectors().into_iter().zip(node.changed(learns)));
        let counted = vectors.enumerate().filter(|(place, (_, changed))| *changed && !copies.contains(place));
        counted.map(|(_, (vector, _))| vector.len()).sum()
    }

    /// Returns for every matrix the number of vectors after it, as [`Self::changed_values`] counts them.
    pub fn biases(&self) -> Vec<usize> {
        let copies = Tied::of(self).copies();
        let mut biases = vec![0; self.matrices.len()];
        let mut first = 0;
        for node in &self.nodes {
            for product in node.kind.products().iter().filter(|product| !copies.contains(&(first + product.bias))) {
                biases[product.matrix] += 1;
            }
            first += node.kind.vectors().len();
        }
        biases
    }

    /// Returns how often a matrix is used in a step.
    pub fn runs(&self, matrix: usize) -> usize {
        let uses = |(node, of): (usize, &Node)| {
            let uses = of.kind.products().iter().filter(|product| product.matrix == matrix).count();
            let steps = |denoising: &Denoising| if node >= denoising.first { denoising.steps.len() } else { 1 };
            uses * self.denoising.as_ref().map_or(1, steps)
        };
        self.nodes.iter().enumerate().map(uses).sum()
    }

    /// Returns the number of elements of all weight matrices.
    pub fn weights(&self) -> usize {
        self.matrices.iter().map(|m| m.data.len()).sum()
    }
}
