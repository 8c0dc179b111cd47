use std::ops::Range;

use actq_kernels::image::{Cache, MAX_DIM, MAX_SLOTS, OpKind};
use actq_kernels::math;
use ndarray::Array2;

use crate::error::{Result, bail, ensure};
use crate::graph::arrays::{contiguous, contiguous_mut, rounded, sum_of_products};
use crate::graph::lowering::{BufferId, Lifetime, Lowering, Slice, StepData};
use crate::graph::operation::{Backward, Elements, Forward, NodeState, Operation, Saved};
use crate::graph::syntax::{Keys, Syntax, required};
use crate::graph::values::{ValueId, WeightMatrix};
use crate::simd::wide;

/// The most heads of queries.
pub const MAX_HEADS: usize = 16;

/// Largest magnitudes of keys, values and queries, and of the weights of a query, as the image rounds them.
const TOKEN_MAX: u16 = 127;
const WEIGHT_MAX: u16 = 32767;

/// Scaled dot-product attention over three inputs: queries, keys and values, each `[token, head, element]`. Query head
/// `h` reads key and value head `h / (heads / kv_heads)`:
/// `softmax(factor q k') v`, with a softmax over the tokens that the query sees. Two more inputs are keys and values of a
/// prefix, whose tokens come before those.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Attention {
    /// Heads of the queries.
    pub heads: usize,
    /// Heads of the keys and values; a divisor of `heads`.
    pub kv_heads: usize,
    /// Elements of a head.
    pub dim: usize,
    /// Factor of the products of queries and keys, above 0.
    pub factor: f32,
    /// `true` if a query sees no token after its own; the last query is at the last token.
    pub causal: bool,
    /// 0: the tokens are those of one evaluation. Else an evaluation has one token, and its query sees this many of the
    /// last tokens, whose keys and values are the state.
    pub context: usize,
}

/// Tokens of one attention, `[token, head, element]`.
struct Tokens {
    queries: Vec<f32>,
    keys: Vec<f32>,
    values: Vec<f32>,
    /// Tokens before those of this pass.
    before: usize,
}

/// Derivatives by [`Tokens`].
struct Gradients {
    queries: Vec<f32>,
    keys: Vec<f32>,
    values: Vec<f32>,
}

impl Attention {
    /// Elements of a token's queries, and of its keys or values.
    fn widths(&self) -> [usize; 2] {
        [self.heads, self.kv_heads].map(|heads| heads * self.dim)
    }

    /// Returns the tokens that query `i` of `queries` sees among `tokens`.
    fn seen(&self, i: usize, queries: usize, tokens: usize) -> Range<usize> {
        let end = if self.causal || self.context > 0 { tokens + i + 1 - queries } else { tokens };
        let start = if self.context > 0 { end.saturating_sub(self.context) } else { 0 };
        start..end
    }

    /// Computes the softmax of a query over the keys that it sees; `weights` receives a value for each.
    #[inline(always)]
    fn softmax(&self, query: &[f32], keys: &[f32], kv_head: usize, weights: &mut Vec<f32>) {
        let width = self.kv_heads * self.dim;
        weights.clear();
        let key = |key: &[f32]| sum_of_products(query, &key[kv_head * self.dim..][..self.dim]) * self.factor;
        weights.extend(keys.chunks_exact(width).map(key));
        let most = weights.iter().copied().fold(f32::NEG_INFINITY, f32::max);
        weights.iter_mut().for_each(|weight| *weight = math::exp(*weight - most));
        let sum: f32 = weights.iter().sum();
        weights.iter_mut().for_each(|weight| *weight /= sum);
    }

    /// Computes the outputs `[query, head, element]`; `is_rounded` rounds as an image does.
    #[inline(always)]
    fn outputs(&self, tokens: &Tokens, is_rounded: bool) -> Vec<f32> {
        let [width, kv_width] = self.widths();
        let integers = |x: &[f32]| rounded(x, self.dim, if is_rounded { TOKEN_MAX } else { 0 });
        let [(queries, of_queries), (keys, of_keys), (values, scales)] =
            [&tokens.queries, &tokens.keys, &tokens.values].map(|x| integers(x));
        // Scaled back, as the scores are f32 in an image, too.
        let scaled = |x: Vec<f32>, scales: &[f32]| -> Vec<f32> {
            x.chunks(self.dim).zip(scales).flat_map(|(x, scale)| x.iter().map(move |v| v * scale)).collect()
        };
        let (queries, keys) = (scaled(queries, &of_queries), scaled(keys, &of_keys));
        let (count, all) = (queries.len() / width, keys.len() / kv_width);
        let mut outputs = vec![0.0; queries.len()];
        let mut weights = Vec::with_capacity(all);
        for (at, (query, output)) in queries.chunks_exact(self.dim).zip(outputs.chunks_exact_mut(self.dim)).enumerate()
        {
            let (i, head) = (at / self.heads, at % self.heads);
            let (seen, kv_head) = (self.seen(i, count, all), head * self.kv_heads / self.heads);
            self.softmax(query, &keys[seen.start * kv_width..seen.end * kv_width], kv_head, &mut weights);
            let place = |token: usize| (seen.start + token) * self.kv_heads + kv_head;
            weights.iter_mut().enumerate().for_each(|(token, weight)| *weight *= scales[place(token)]);
            if is_rounded {
                round_shares(&mut weights);
            }
            for (token, weight) in weights.iter().enumerate() {
                let value = &values[place(token) * self.dim..][..self.dim];
                output.iter_mut().zip(value).for_each(|(sum, value)| *sum += weight * value);
            }
        }
        outputs
    }

    /// Computes the outputs of queries over all these keys and values, without rounding.
    pub(crate) fn unrounded(&self, queries: &[f32], keys: &[f32], values: &[f32]) -> Vec<f32> {
        let [queries, keys, values] = [queries, keys, values].map(<[f32]>::to_vec);
        self.outputs(&Tokens { queries, keys, values, before: 0 }, false)
    }

    /// Returns the derivatives of the outputs without rounding; `dy` is the derivative by them.
    #[inline(always)]
    fn gradients(&self, tokens: &Tokens, dy: &[f32]) -> Gradients {
        let Tokens { queries, keys, values, .. } = tokens;
        let [width, kv_width] = self.widths();
        let (count, all) = (queries.len() / width, keys.len() / kv_width);
        let zeros = |of: &[f32]| vec![0.0; of.len()];
        let mut d = Gradients { queries: zeros(queries), keys: zeros(keys), values: zeros(values) };
        let (mut weights, mut d_weights) = (Vec::with_capacity(all), Vec::with_capacity(all));
        let heads = queries.chunks_exact(self.dim).zip(dy.chunks_exact(self.dim));
        for (at, ((query, dy), d_query)) in heads.zip(d.queries.chunks_exact_mut(self.dim)).enumerate() {
            let (i, head) = (at / self.heads, at % self.heads);
            let (seen, kv_head) = (self.seen(i, count, all), head * self.kv_heads / self.heads);
            self.softmax(query, &keys[seen.start * kv_width..seen.end * kv_width], kv_head, &mut weights);
            let place = |token: usize| ((seen.start + token) * self.kv_heads + kv_head) * self.dim;
            let of_value = |token: usize| sum_of_products(dy, &values[place(token)..][..self.dim]);
            d_weights.clear();
            d_weights.extend((0..weights.len()).map(of_value));
            let mean = sum_of_products(&weights, &d_weights);
            for (token, (weight, d_weight)) in weights.iter().zip(&d_weights).enumerate() {
                let at = place(token);
                let d_score = weight * (d_weight - mean) * self.factor;
                add(&mut d.values[at..][..self.dim], dy, *weight);
                add(&mut d.keys[at..][..self.dim], query, d_score);
                add(d_query, &keys[at..][..self.dim], d_score);
            }
        }
        d
    }

    /// Returns the buffer of the cache of the keys and values, and its sizes. Emits the operation that writes it, unless one
    /// has.
    fn cache(&self, to: &mut Lowering, inputs: &[ValueId], lifetime: Lifetime) -> (BufferId, Cache) {
        let (keys, values) = (to.place(inputs[1]), to.place(inputs[2]));
        let tokens = |place: Slice| place.len / (self.kv_heads * self.dim);
        let prefix = inputs.get(3).map(|value| tokens(to.place(*value)));
        let own = if prefix.is_some() { tokens(keys) } else { 0 };
        let slots = if self.context > 0 { self.context } else { prefix.unwrap_or(0) + tokens(keys) };
        let sizes = Cache { heads: self.kv_heads, dim: self.dim, slots, own };
        let of = [inputs[1], inputs[2], self.kv_heads];
        if let Some(cache) = to.cache(of).filter(|_| own == 0) {
            return (cache, sizes);
        }
        if to.buffers[keys.buffer].lifetime == Lifetime::Outside {
            let cache = to.buffer(sizes.words(), Lifetime::Prefix);
            to.add_cache(of, cache);
            return (cache, sizes);
        }
        // An operation's regions do not overlap.
        let values = if inputs[1] == inputs[2] {
            let copy = to.buffer(values.len, Lifetime::Step);
            to.emit(OpKind::Copy, to.whole(copy), Some(values), None, StepData::None);
            to.whole(copy)
        } else {
            values
        };
        let cache = to.buffer(sizes.words(), if own > 0 { Lifetime::Prefix } else { lifetime });
        let data = vec![pair(self.kv_heads, self.dim), pair(slots, usize::from(self.context > 0) | own << 1)];
        to.emit(OpKind::Keep, to.whole(cache), Some(keys), Some(values), StepData::Words(data));
        if self.context == 0 && own == 0 {
            to.add_cache(of, cache);
        }
        (cache, sizes)
    }

    /// Returns the tokens of a row of each input, those of a prefix first.
    fn of_row(inputs: &[&Array2<f32>], row: usize) -> Tokens {
        let of = |i: usize| {
            let parts = [inputs.get(i + 2).filter(|_| i > 0), inputs.get(i)];
            let mut all = Vec::new();
            parts.into_iter().flatten().for_each(|x| all.extend_from_slice(contiguous(&x.row(row))));
            all
        };
        let [queries, keys, values] = [0, 1, 2].map(of);
        Tokens { queries, keys, values, before: 0 }
    }

    /// Returns the tokens of a sample of a sequence, those of its state first.
    fn of_sequence(&self, inputs: [&Array2<f32>; 3], state: &NodeState, sample: usize) -> Tokens {
        let [of_keys, of_values] = state.each_ref().map(|array| array.row(sample));
        let (of_keys, of_values) = (contiguous(&of_keys), contiguous(&of_values));
        let (count, width) = (of_keys[0] as usize, self.kv_heads * self.dim);
        let before = count.min(self.context);
        let in_order = |ring: &[f32]| -> Vec<f32> {
            (count - before..count).flat_map(|token| &ring[token % self.context * width..][..width]).copied().collect()
        };
        let (mut keys, mut values) = (in_order(&of_keys[1..]), in_order(of_values));
        let mut queries = Vec::new();
        for row in (sample..inputs[0].nrows()).step_by(state[0].nrows()) {
            queries.extend_from_slice(contiguous(&inputs[0].row(row)));
            keys.extend_from_slice(contiguous(&inputs[1].row(row)));
            values.extend_from_slice(contiguous(&inputs[2].row(row)));
        }
        Tokens { queries, keys, values, before }
    }

    /// Stores the last tokens of a sequence in a sample's state.
    fn store(&self, tokens: &Tokens, state: &mut NodeState, sample: usize) {
        let width = self.kv_heads * self.dim;
        let [of_keys, of_values] = state;
        let (mut of_keys, mut of_values) = (of_keys.row_mut(sample), of_values.row_mut(sample));
        let (of_keys, of_values) = (contiguous_mut(&mut of_keys), contiguous_mut(&mut of_values));
        let all = tokens.keys.len() / width;
        // Token 0 of `tokens` is this one since the reset.
        let first = of_keys[0] as usize - tokens.before;
        for token in all.saturating_sub(self.context)..all {
            let slot = (first + token) % self.context * width;
            of_keys[1 + slot..][..width].copy_from_slice(&tokens.keys[token * width..][..width]);
            of_values[slot..][..width].copy_from_slice(&tokens.values[token * width..][..width]);
        }
        of_keys[0] = self.counted(first + all) as f32;
    }

    /// Returns a count of tokens below twice the context that has the same slots.
    fn counted(&self, count: usize) -> usize {
        if count < 2 * self.context { count } else { self.context + count % self.context }
    }

    /// Adds the derivative by the state after a sequence to that by its tokens, and replaces it by that by the state
    /// before.
    fn pass_back(&self, tokens: &Tokens, d: &mut Gradients, count: usize, d_state: &mut NodeState, sample: usize) {
        let width = self.kv_heads * self.dim;
        let (all, first) = (tokens.keys.len() / width, count - tokens.before);
        for (array, start, d) in [(0, 1, &mut d.keys), (1, 0, &mut d.values)] {
            let mut row = d_state[array].row_mut(sample);
            let ring = &mut contiguous_mut(&mut row)[start..];
            let slot = |token: usize| (first + token) % self.context * width;
            for token in all.saturating_sub(self.context)..all {
                add(&mut d[token * width..][..width], &ring[slot(token)..][..width], 1.0);
            }
            ring.fill(0.0);
            for token in 0..tokens.before {
                ring[slot(token)..][..width].copy_from_slice(&d[token * width..][..width]);
            }
        }
    }
}

impl Operation for Attention {
    fn output_len(&self, _: &[WeightMatrix], inputs: &[usize]) -> Result<usize> {
        let (queries, keys, values, prefix) = match *inputs {
            [queries, keys, values] => (queries, keys, values, None),
            [queries, keys, values, of_keys, of_values] => (queries, keys, values, Some([of_keys, of_values])),
            _ => bail!("takes queries, keys and values, and those of a prefix, not {} inputs", inputs.len()),
        };
        let Self { heads, kv_heads, dim, factor, causal, context } = *self;
        ensure!((1..=MAX_HEADS).contains(&heads), "has {heads} heads; 1 to {MAX_HEADS} are supported");
        ensure!(
            kv_heads > 0 && heads.is_multiple_of(kv_heads),
            "has {kv_heads} heads of keys for {heads} of queries; it must be a divisor"
        );
        ensure!((1..=MAX_DIM).contains(&dim), "has heads of {dim} values; 1 to {MAX_DIM} are supported");
        ensure!(factor > 0.0 && factor.is_finite(), "has the factor {factor}; it must be above 0 and finite");
        let [width, kv_width] = self.widths();
        ensure!(
            queries > 0 && queries.is_multiple_of(width),
            "its {queries} queries are not tokens of {heads} heads of {dim} values"
        );
        ensure!(
            keys > 0 && keys.is_multiple_of(kv_width) && values == keys,
            "its {keys} keys and {values} values are not tokens of {kv_heads} heads of {dim} values"
        );
        let (of_queries, tokens) = (queries / width, keys / kv_width);
        ensure!(!causal || of_queries <= tokens, "has {of_queries} queries for {tokens} causal keys");
        if let Some([of_keys, of_values]) = prefix {
            ensure!(
                of_keys > 0 && of_keys.is_multiple_of(kv_width) && of_values == of_keys,
                "the {of_keys} keys and {of_values} values of its prefix are not tokens of {kv_heads} heads of {dim} values"
            );
            ensure!(context == 0, "keeps tokens from step to step, and reads a prefix; it can do one of both");
        }
        let most = (tokens + prefix.map_or(0, |[of_keys, _]| of_keys / kv_width)).max(context);
        ensure!(most <= MAX_SLOTS, "reads {most} tokens; at most {MAX_SLOTS} are supported");
        ensure!(
            context == 0 || (of_queries, tokens) == (1, 1),
            "keeps tokens from step to step, and reads {of_queries} queries and {tokens} keys in a step; it must be one"
        );
        Ok(queries)
    }

    fn syntax() -> Vec<Syntax<Self>> {
        let read = |op: &mut dyn Keys| {
            let heads = required(op.count("heads")?, "heads")?;
            let dim = required(op.count("dim")?, "dim")?;
            let kv_heads = op.count("kv_heads")?.unwrap_or(heads);
            let (causal, context) = (op.truth("causal")?.unwrap_or(false), op.count("context")?.unwrap_or(0));
            let prefix = op.count("prefix")?;
            let is_alone = prefix.is_some() && op.text("keys")?.is_none() && op.text("values")?.is_none();
            if !is_alone {
                op.add_input("keys")?;
                op.add_input("values")?;
            }
            if let Some(tokens) = prefix {
                ensure!(
                    context == 0 && !(is_alone && causal),
                    "reads a prefix, whose tokens every query sees; leave context out, and causal unless it names keys and values \
                     of its own"
                );
                let len = tokens.saturating_mul(kv_heads).saturating_mul(dim);
                op.add_prefix(len)?;
                op.add_prefix(len)?;
            }
            let factor = op.number("factor")?.map_or(1.0 / (dim as f32).sqrt(), |factor| factor as f32);
            Ok(Self { heads, kv_heads, dim, factor, causal, context })
        };
        let keys = &["keys", "values", "prefix", "heads", "kv_heads", "dim", "factor", "causal", "context"];
        vec![Syntax { name: "attention", keys, read }]
    }

    fn elements(&self) -> Elements {
        Elements::Attention([self.heads, self.kv_heads, self.dim])
    }

    fn keep_units(&mut self, _: usize, units: &[usize]) {
        let [width, _] = self.widths();
        let of_token: Vec<usize> = units.iter().copied().take_while(|unit| *unit < width).collect();
        let heads = of_token.chunk_by(|a, b| a / self.dim == b / self.dim).count();
        *self = Self { heads, kv_heads: heads * self.kv_heads / self.heads, dim: of_token.len() / heads, ..*self };
    }

    /// Keys with the number of tokens since the reset before them, and values: rings of `context` tokens.
    fn state_lens(&self) -> [usize; 2] {
        let ring = self.context * self.kv_heads * self.dim;
        [if self.context > 0 { 1 + ring } else { 0 }, ring]
    }

    fn forward(&self, run: &Forward<'_>, state: &mut NodeState) -> (Array2<f32>, Saved) {
        let inputs = [run.input(0), run.input(1), run.input(2)];
        let mut y = Array2::zeros(inputs[0].raw_dim());
        let outputs = |tokens: &Tokens| {
            wide(
                #[inline(always)]
                || self.outputs(tokens, run.is_rounded()),
            )
        };
        if self.context == 0 {
            let inputs: Vec<_> = run.inputs().collect();
            for (row, mut y) in y.rows_mut().into_iter().enumerate() {
                contiguous_mut(&mut y).copy_from_slice(&outputs(&Self::of_row(&inputs, row)));
            }
            return (y, Saved::default());
        }
        let start = state.clone();
        let batch = state[0].nrows();
        for sample in 0..batch {
            let tokens = self.of_sequence(inputs, &start, sample);
            let steps = outputs(&tokens);
            for (row, step) in (sample..y.nrows()).step_by(batch).zip(steps.chunks_exact(inputs[0].ncols())) {
                contiguous_mut(&mut y.row_mut(row)).copy_from_slice(step);
            }
            self.store(&tokens, state, sample);
        }
        (y, Saved { inner: start.into(), ..Saved::default() })
    }

    fn backward(&self, run: &mut Backward<'_>, saved: Saved, dy: Array2<f32>, d_state: &mut NodeState) {
        let inputs: Vec<_> = run.inputs().collect();
        let mut d_inputs: Vec<_> = inputs.iter().map(|x| Array2::zeros(x.raw_dim())).collect();
        let gradients = |tokens: &Tokens, dy: &[f32]| {
            wide(
                #[inline(always)]
                || self.gradients(tokens, dy),
            )
        };
        let mut give = |row: usize, parts: &[&[f32]]| {
            for (d, part) in d_inputs.iter_mut().zip(parts) {
                contiguous_mut(&mut d.row_mut(row)).copy_from_slice(part);
            }
        };
        if self.context == 0 {
            let of_prefix = inputs.get(3).map_or(0, |keys| keys.ncols());
            for (row, dy) in dy.rows().into_iter().enumerate() {
                let d = gradients(&Self::of_row(&inputs, row), contiguous(&dy));
                let [(before_keys, keys), (before_values, values)] =
                    [&d.keys, &d.values].map(|d| d.split_at(of_prefix));
                give(row, &[&d.queries, keys, values, before_keys, before_values]);
            }
        } else if let (Ok(start), &[queries, keys, values]) = (NodeState::try_from(saved.inner), &inputs[..]) {
            let [width, kv_width] = self.widths();
            let batch = start[0].nrows();
            for sample in 0..batch {
                let tokens = self.of_sequence([queries, keys, values], &start, sample);
                let of_sample: Vec<f32> =
                    (sample..dy.nrows()).step_by(batch).flat_map(|row| dy.row(row).to_vec()).collect();
                let mut d = gradients(&tokens, &of_sample);
                self.pass_back(&tokens, &mut d, start[0][[sample, 0]] as usize, d_state, sample);
                for (step, row) in (sample..dy.nrows()).step_by(batch).enumerate() {
                    let token = (tokens.before + step) * kv_width;
                    let of_token = |d: &'_ Vec<f32>| d[token..token + kv_width].to_vec();
                    give(row, &[&d.queries[step * width..][..width], &of_token(&d.keys), &of_token(&d.values)]);
                }
            }
        }
        for (i, d) in d_inputs.into_iter().enumerate() {
            run.give(i, d);
        }
    }

    fn prepare(&self, to: &mut Lowering, inputs: &[ValueId], last: ValueId) -> Vec<ValueId> {
        // Own tokens follow those of the prefix right before they are read.
        if self.context > 0 || inputs.len() > 3 || inputs[1].max(inputs[2]) > last {
            return inputs.to_vec();
        }
        let (cache, _) = self.cache(to, inputs, Lifetime::Output);
        if to.buffers[cache].lifetime == Lifetime::Step {
            to.buffers[cache].lifetime = Lifetime::Output;
        }
        vec![inputs[0]]
    }

    fn lower(&self, to: &mut Lowering, inputs: &[ValueId], len: usize) -> BufferId {
        let lifetime = if self.context > 0 { Lifetime::State } else { Lifetime::Step };
        let (cache, sizes) = self.cache(to, inputs, lifetime);
        let dst = to.buffer(len, Lifetime::Step);
        to.work_words = to.work_words.max(sizes.work_words());
        let [heads, shared] = [pair(self.heads, self.kv_heads), pair(self.dim, sizes.slots)];
        let flags = pair(usize::from(self.causal) | sizes.own << 1, 0);
        let data = vec![heads, shared, flags, self.factor.to_bits()];
        to.emit(OpKind::Attend, to.whole(dst), Some(to.place(inputs[0])), Some(to.whole(cache)), StepData::Words(data));
        dst
    }
}

/// Returns two values of 16 bits as a word.
fn pair(low: usize, high: usize) -> u32 {
    (low | high << 16) as u32
}

/// Adds `factor x` to `sum`.
#[inline(always)]
fn add(sum: &mut [f32], x: &[f32], factor: f32) {
    sum.iter_mut().zip(x).for_each(|(sum, x)| *sum += factor * x);
}

/// Rounds weights to multiples of a share of their sum, as an image does.
fn round_shares(weights: &mut [f32]) {
    let step = weights.iter().sum::<f32>() / f32::from(WEIGHT_MAX);
    if step > 0.0 {
        weights.iter_mut().for_each(|weight| *weight = (*weight / step).round_ties_even() * step);
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use actq_kernels::Width;

    use super::*;
    use crate::budget::{Budget, Rate};
    use crate::emit;
    use crate::graph::ops::{Add, Concat, Iterate, Linear, Span};
    use crate::graph::run::tests::attentive;
    use crate::graph::weights::zero_state;
    use crate::graph::{Denoising, Graph, Network, Weights};
    use crate::methods::{Activations, Method, Options, quantize};
    use crate::policy::Policy;
    use crate::random::Random;
    use crate::runtime::{ImageBuffer, take_prefix, with_head};

    /// Returns the largest difference between the steps of an image and of its rounded network, and the largest output.
    fn off_image(graph: &Graph, policy: impl Fn(Graph) -> Policy) -> (f32, f32) {
        let options = Options { activations: Activations::Int8, ..Options::new(Method::Rtn, Budget::Width(Width::W8)) };
        let (mut graph, outcomes) = quantize(graph, None, Rate::Width(Width::W8), &options).expect("outcomes");
        let bytes = emit::image(&policy(graph.clone()), &outcomes).expect("an image");
        for (matrix, outcome) in graph.matrices.iter_mut().zip(&outcomes) {
            matrix.data = outcome.quantized.dequantized();
        }
        let x_max: Vec<u16> = outcomes.iter().map(|outcome| outcome.x_max).collect();
        let (weights, mut state) = (Weights::of(&graph), zero_state(&graph, 1));
        let network = Network::rounded(&graph, &x_max);
        let buffer = ImageBuffer::new(&bytes);
        let mut random = Random::new(6);
        let (mut off, mut most) = (0f32, 0f32);
        with_head::<_, crate::error::Error>(buffer.image(Path::new("memory")).expect("an image"), |head| {
            for _ in 0..5 {
                let obs: Vec<f32> = (0..graph.input_len()).map(|_| random.unit()).collect();
                let expected = network.forward_one(&weights, &obs, &mut state);
                let (obs, noise) = take_prefix(head, &obs)?;
                let output = if noise.is_empty() { head.infer(obs)? } else { head.infer_with_noise(obs, noise)? };
                for (a, b) in output.iter().zip(&expected) {
                    (off, most) = (off.max((a - b).abs()), most.max(b.abs()));
                }
            }
            Ok(())
        })
        .expect("the executor");
        (off, most)
    }

    #[test]
    fn an_image_computes_what_the_rounded_network_does() {
        let (off, most) = off_image(&attentive(), |graph| Policy::of("attention", graph));
        assert!(off < 1e-5 * most, "{off} of {most}");
    }

    /// Returns a function that adds a product with random weights, to this number of rows.
    fn linears(seed: u64) -> impl FnMut(&mut Graph, usize, ValueId) -> ValueId {
        let mut random = Random::new(seed);
        move |graph, rows, input| {
            let cols = graph.len_of(input);
            let data = (0..rows * cols).map(|_| random.unit()).collect();
            let matrix = WeightMatrix { name: "m".into(), rows, cols, data };
            let matrix = graph.add_matrix(matrix).expect("a matrix");
            graph.add(Linear { matrix, bias: vec![0.1; rows] }, &[input]).expect("it fits")
        }
    }

    #[test]
    fn keys_that_do_not_depend_on_the_iterate_are_kept_once() {
        let mut graph = Graph::new(3);
        let mut linear = linears(8);
        let (keys, values) = (linear(&mut graph, 8, 0), linear(&mut graph, 8, 0));
        let first = graph.nodes.len();
        let x = graph.add(Iterate { len: 2 }, &[]).expect("it fits");
        let queries = linear(&mut graph, 4, x);
        let attention = Attention { heads: 2, kv_heads: 2, dim: 2, factor: 0.7, causal: false, context: 0 };
        let y = graph.add(attention, &[queries, keys, values]).expect("it fits");
        linear(&mut graph, 2, y);
        let steps = vec![actq_kernels::ops::denoise::Coefficients::from_array([0.0, 0.0, 1.0, 0.5, 0.0, 0.0, 0.0]); 2];
        graph.denoising = Some(Denoising { first, len: 2, limit: 10.0, steps });
        let policy = |graph: Graph| {
            let kind = actq_kernels::image::Kind::Flow;
            Policy { kind, chunk: 1, execute: 1, act_len: 2, ..Policy::of("flow", graph) }
        };
        let program = emit::lower(&policy(graph.clone()), None, &[]).expect("a program");
        let keep = program.steps.iter().position(|step| step.kind == OpKind::Keep);
        assert!(keep.is_some_and(|keep| keep < program.first_denoising_op), "{keep:?}");
        let (off, most) = off_image(&graph, policy);
        assert!(off < 1e-5 * most, "{off} of {most}");
    }

    /// Makes a network of three values and a prefix of four tokens for each of two attentions, of which the second has two
    /// tokens of its own; with `is_iterative`, they are in the denoising steps of a flow.
    fn prefixed(is_iterative: bool) -> Graph {
        let of = Attention { heads: 4, kv_heads: 2, dim: 2, factor: 0.7, causal: false, context: 0 };
        let mut graph = Graph { prefix_len: 4 * 16, ..Graph::new(3 + 4 * 16) };
        let mut linear = linears(9);
        let part = |graph: &mut Graph, from: usize, len: usize| {
            graph.add(Concat(vec![Span { from, len }]), &[0]).expect("it fits")
        };
        let obs = part(&mut graph, 0, 3);
        let prefix = [0, 1, 2, 3].map(|i| part(&mut graph, 3 + 16 * i, 16));
        let condition = linear(&mut graph, 16, obs);
        let first = graph.nodes.len();
        let mut queries = condition;
        if is_iterative {
            let x = graph.add(Iterate { len: 2 }, &[]).expect("it fits");
            let x = linear(&mut graph, 16, x);
            queries = graph.add(Add, &[x, condition]).expect("it fits");
        }
        let attended = graph.add(of, &[queries, prefix[0], prefix[1]]).expect("it fits");
        let [keys, values] = [0; 2].map(|_| linear(&mut graph, 8, attended));
        queries = linear(&mut graph, 16, attended);
        let of = Attention { causal: true, ..of };
        let attended = graph.add(of, &[queries, keys, values, prefix[2], prefix[3]]).expect("it fits");
        queries = linear(&mut graph, 16, attended);
        linear(&mut graph, 2, queries);
        if is_iterative {
            let step = actq_kernels::ops::denoise::Coefficients::from_array([0.0, 0.0, 1.0, 0.5, 0.0, 0.0, 0.0]);
            graph.denoising = Some(Denoising { first, len: 2, limit: 10.0, steps: vec![step; 2] });
        }
        graph
    }

    #[test]
    fn a_prefix_comes_from_the_host() {
        for is_iterative in [false, true] {
            let graph = prefixed(is_iterative);
            let policy = |graph: Graph| match is_iterative {
                false => Policy::of("prefix", graph),
                true => {
                    let kind = actq_kernels::image::Kind::Flow;
                    Policy { kind, chunk: 1, execute: 1, act_len: 2, ..Policy::of("prefix", graph) }
                }
            };
            let program = emit::lower(&policy(graph.clone()), None, &[]).expect("a program");
            assert_eq!(program.steps.iter().filter(|step| step.kind == OpKind::Keep).count(), 1);
            let cache = Cache { heads: 2, dim: 2, slots: 4, own: 0 };
            assert_eq!(program.observation.offset, cache.words() + Cache { slots: 6, own: 2, ..cache }.words());
            assert_eq!(program.observation.len, 3);
            let (off, most) = off_image(&graph, policy);
            assert!(off < 1e-5 * most, "{off} of {most}");
        }
    }

    #[test]
    fn only_attention_reads_a_prefix() {
        let mut graph = Graph { prefix_len: 2, ..Graph::new(5) };
        graph.add(Concat(vec![Span { from: 3, len: 2 }]), &[0]).expect("it fits");
        let matrix = WeightMatrix { name: "m".into(), rows: 1, cols: 2, data: vec![1.0; 2] };
        let matrix = graph.add_matrix(matrix).expect("a matrix");
        graph.add(Linear { matrix, bias: vec![0.0] }, &[1]).expect("it fits");
        let error = emit::lower(&Policy::of("wrong", graph), None, &[]).expect_err("it has no keys").to_string();
        assert!(error.contains("only attention can read them"), "{error}");
    }

    #[test]
    fn sizes_that_do_not_fit_are_refused() {
        let plain = Attention { heads: 4, kv_heads: 2, dim: 8, factor: 0.5, causal: true, context: 0 };
        let cases = [
            (plain, vec![32, 16], "takes queries, keys and values, and those of a prefix, not 2 inputs"),
            (
                Attention { kv_heads: 3, ..plain },
                vec![32; 3],
                "has 3 heads of keys for 4 of queries; it must be a divisor",
            ),
            (Attention { heads: 17, ..plain }, vec![32; 3], "has 17 heads; 1 to 16 are supported"),
            (plain, vec![30, 16, 16], "its 30 queries are not tokens of 4 heads of 8 values"),
            (plain, vec![32, 16, 32], "its 16 keys and 32 values are not tokens of 2 heads of 8 values"),
            (plain, vec![64, 16, 16], "has 2 queries for 1 causal keys"),
            (Attention { context: 513, ..plain }, vec![32, 16, 16], "reads 513 tokens; at most 512 are supported"),
            (Attention { factor: 0.0, ..plain }, vec![32, 16, 16], "has the factor 0; it must be above 0 and finite"),
            (
                Attention { context: 4, ..plain },
                vec![64, 32, 32],
                "keeps tokens from step to step, and reads 2 queries and 2 keys in a step; it must be one",
            ),
        ];
        for (attention, inputs, expected) in cases {
            assert_eq!(attention.output_len(&[], &inputs).expect_err(expected).to_string(), expected);
        }
        assert_eq!(plain.output_len(&[], &[32, 48, 48]).expect("it fits"), 32);
    }
}
