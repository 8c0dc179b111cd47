//! The measured images: many shapes of every operation.

use actq::around::{Around, OUTPUT};
use actq::contract::{Ensemble, Playback};
use actq::emit;
use actq::error::bail;
use actq::graph::lowering::{Buffer, Lifetime, Slice, Step, StepData};
use actq::graph::ops::{Add, Concat, Gru, Iterate, Lstm, Normalize, Span, Table};
use actq::graph::syntax::Keys;
use actq::graph::{Denoising, NodeKind, ValueId};
use actq::methods::{Activations, Outcome};
use actq::policy::Policy;
use actq_bench::networks::Builder;
use actq_kernels::Width;
use actq_kernels::image::{Cache, Kind, OpKind};
use actq_kernels::ops::denoise::Coefficients;
use anyhow::{Context as _, Result};

/// Rows and columns of the matrices: strips of all heights, runs of several strips, columns with and without a rest.
const SHAPES: [(usize, usize); 28] = [
    (4, 8),
    (8, 8),
    (8, 18),
    (12, 30),
    (16, 32),
    (3, 64),
    (20, 64),
    (64, 64),
    (128, 48),
    (33, 100),
    (96, 100),
    (16, 128),
    (48, 128),
    (72, 200),
    (30, 235),
    (8, 256),
    (64, 256),
    (128, 256),
    (20, 320),
    (40, 330),
    (6, 512),
    (24, 512),
    (12, 517),
    (16, 700),
    (40, 96),
    (100, 72),
    (320, 40),
    (288, 128),
];
/// Lengths of elementwise operations, and of the states of cells.
const LENGTHS: [usize; 5] = [8, 39, 64, 100, 256];
const HIDDEN: [usize; 4] = [8, 24, 64, 100];
/// Actions of chunks, and values of an action.
const CHUNKS: [(usize, usize); 5] = [(2, 3), (8, 7), (16, 2), (20, 14), (50, 6)];
/// Dimensions of heads, and slots of caches.
const ATTENTIONS: [(usize, usize); 12] =
    [(8, 16), (8, 40), (16, 64), (24, 8), (32, 16), (48, 16), (48, 50), (64, 32), (64, 64), (33, 10), (64, 4), (7, 2)];
/// Longest observation.
const OBSERVATION: usize = 700;
/// Images with their names.
pub(super) fn images() -> Result<Vec<(String, Vec<u8>)>> {
    let mut images = Vec::new();
    for (policy, outcomes) in policies()? {
        images.push((policy.name.clone(), emit::image(&policy, &outcomes)?));
    }
    let mut builder = Builder::new(OBSERVATION);
    for rows in LENGTHS {
        for _ in 0..2 {
            builder.linear((rows, 40), Activations::Int8, |_| Some(Width::W2), 0, true)?;
        }
    }
    let name = "added biases";
    images.push((name.to_owned(), builder.accumulating(name)?));
    images.push(around()?);
    images.push(rotary()?);
    for heads in [(1, 1), (4, 2)] {
        for shapes in ATTENTIONS.chunks(4) {
            images.push(attention(heads, shapes)?);
        }
    }
    Ok(images)
}

/// Attention of some shapes: of one query, and of two causal ones.
fn attention((heads, kv_heads): (usize, usize), shapes: &[(usize, usize)]) -> Result<(String, Vec<u8>)> {
    let name = format!("attention of {heads} heads of {kv_heads}, {shapes:?}");
    let mut builder = Builder::new(512);
    // Its work area is large enough for the scores, too.
    builder.linear((8, 8), Activations::Int8, |_| Some(Width::W2), 0, true)?;
    builder.linear((8, 512), Activations::Int8, |_| Some(Width::W2), 0, true)?;
    let (policy, outcomes) = builder.finish(name.clone(), false);
    let mut buffers = vec![Buffer { len: OBSERVATION, lifetime: Lifetime::Observation }];
    let mut before = Vec::new();
    let mut value = |len: usize| {
        buffers.push(Buffer { len, lifetime: Lifetime::Step });
        Slice { buffer: buffers.len() - 1, offset: 0, len }
    };
    let mut add = |kind, dst, src, third, data| before.push(Step { kind, dst, src, third, data });
    let pair = |low: usize, high: usize| (low | high << 16) as u32;
    for &(dim, slots) in shapes {
        let [keys, values] = [0, 1].map(|first| {
            let all = value(slots * kv_heads * dim);
            for offset in (0..all.len).step_by(OBSERVATION / 2) {
                let len = (all.len - offset).min(OBSERVATION / 2);
                let from = Slice { buffer: 0, offset: first * OBSERVATION / 2, len };
                add(OpKind::Copy, Slice { offset, len, ..all }, Some(from), None, StepData::None);
            }
            all
        });
        let cache = value(Cache { heads: kv_heads, dim, slots, own: 0 }.words());
        let sizes = StepData::Words(vec![pair(kv_heads, dim), pair(slots, 0)]);
        add(OpKind::Keep, cache, Some(keys), Some(values), sizes);
        for queries in 1..=slots.min(2) {
            let len = queries * heads * dim;
            let sizes =
                [pair(heads, kv_heads), pair(dim, slots), pair(queries - 1, 0), (dim as f32).sqrt().recip().to_bits()];
            let from = Slice { buffer: 0, offset: 3, len };
            add(OpKind::Attend, value(len), Some(from), Some(cache), StepData::Words(sizes.to_vec()));
        }
    }
    let [observation, action] = [512, 8].map(&mut value);
    add(OpKind::Copy, observation, Some(Slice { buffer: 0, offset: 0, len: 512 }), None, StepData::None);
    Ok((name, image_around(&policy, &outcomes, buffers, before, [observation, action])?))
}

/// Rotary positions of heads, dimensions and tokens.
fn rotary() -> Result<(String, Vec<u8>)> {
    let name = "Rotary positions of attention";
    let mut builder = Builder::new(8);
    builder.linear((8, 8), Activations::Int8, |_| Some(Width::W2), 0, true)?;
    let (policy, outcomes) = builder.finish(name.to_owned(), false);
    let mut buffers = vec![Buffer { len: OBSERVATION, lifetime: Lifetime::Observation }];
    let mut before = Vec::new();
    let mut value = |len: usize| {
        buffers.push(Buffer { len, lifetime: Lifetime::Step });
        Slice { buffer: buffers.len() - 1, offset: 0, len }
    };
    let mut copy = |before: &mut Vec<_>, len: usize| {
        let (dst, raw) = (value(len), Slice { buffer: 0, offset: 0, len });
        before.push(Step { kind: OpKind::Copy, dst, src: Some(raw), third: None, data: StepData::None });
        dst
    };
    for (heads, dim, tokens) in
        [(1, 2, 1), (1, 8, 1), (4, 12, 1), (8, 32, 1), (4, 48, 2), (2, 6, 8), (1, 64, 10), (16, 4, 4)]
    {
        let dst = copy(&mut before, heads * dim * tokens);
        let angles = vec![0.6f32.to_bits(); dim * tokens];
        let data = StepData::Words([vec![(heads | dim << 16) as u32], angles].concat());
        before.push(Step { kind: OpKind::Rotary, dst, src: None, third: None, data });
    }
    let [observation, action] = [8, 8].map(|len| copy(&mut before, len));
    Ok((name.to_owned(), image_around(&policy, &outcomes, buffers, before, [observation, action])?))
}

/// Makes an image of a network with operations before it, which give its `observation`; its output is copied to the
/// `action`.
fn image_around(
    policy: &Policy,
    outcomes: &[Outcome],
    buffers: Vec<Buffer>,
    before: Vec<Step<Slice>>,
    [observation, action]: [Slice; 2],
) -> Result<Vec<u8>> {
    let output = Slice { buffer: OUTPUT, ..action };
    let after = vec![Step { kind: OpKind::Copy, dst: action, src: Some(output), third: None, data: StepData::None }];
    let around = Around {
        buffers,
        before,
        observation: observation.buffer,
        after,
        action: action.buffer,
        limits: None,
        ports: Vec::new(),
    };
    Ok(emit::image_around(policy, outcomes, &around)?)
}

/// Operations around a network, each of every length.
fn around() -> Result<(String, Vec<u8>)> {
    let name = "operations around a network";
    let mut builder = Builder::new(8);
    builder.linear((8, 8), Activations::Int8, |_| Some(Width::W2), 0, true)?;
    let (policy, outcomes) = builder.finish(name.to_owned(), false);
    let mut buffers = vec![Buffer { len: OBSERVATION, lifetime: Lifetime::Observation }];
    let mut before = Vec::new();
    let mut value = |len: usize, lifetime| {
        buffers.push(Buffer { len, lifetime });
        Slice { buffer: buffers.len() - 1, offset: 0, len }
    };
    let mut add = |kind, dst, src, third, data| before.push(Step { kind, dst, src, third, data });
    let pair = |low: usize, high: usize| (low | high << 16) as u32;
    // Above the square of every vector's norm.
    let never_moves = 1e12f32.to_bits();
    for len in LENGTHS {
        let raw = Slice { buffer: 0, offset: 0, len };
        let dst = value(len, Lifetime::Step);
        let places = (0..len.div_ceil(2)).map(|i| pair(len - 1 - 2 * i, len.saturating_sub(2 * i + 2)));
        let data = [pair(len, 0)].into_iter().chain(places).collect();
        add(OpKind::Select, dst, Some(raw), None, StepData::Words(data));
        let limits = [-0.5, 0.5].map(|limit| {
            let dst = value(len, Lifetime::Step);
            add(OpKind::Constant, dst, None, None, StepData::Constants(vec![limit; len]));
            dst
        });
        add(OpKind::Clip, dst, Some(limits[0]), Some(limits[1]), StepData::None);
        let (kept, count) = (value(len, Lifetime::State), value(1, Lifetime::State));
        add(OpKind::Initial, kept, None, Some(count), StepData::Constants(vec![0.25; len]));
        let (row, count) = (value(len, Lifetime::Step), value(1, Lifetime::State));
        let rows = [pair(3, 0), pair(1, 0)].into_iter().chain((0..3 * len as u32).map(|i| (i as f32).to_bits()));
        add(OpKind::TableRow, row, None, Some(count), StepData::Words(rows.collect()));
        for read in [len, 8] {
            let at = [pair(read, 1), never_moves].into_iter().chain(vec![0; len]).chain([pair(read, 0)]);
            add(OpKind::Standstill, row, Some(Slice { len: read, ..raw }), Some(count), StepData::Words(at.collect()));
        }
        for (frame, length) in [(len, 3), (1, len), (len / 4, 8)] {
            let slots = 2 * (length - 1);
            let (frames, ring) = (value(frame * length, Lifetime::Step), value(frame * slots + 1, Lifetime::State));
            let sizes = [pair(frame, slots), pair(length, 2), pair(0, 0)];
            let newest = Slice { len: frame, ..raw };
            add(OpKind::History, frames, Some(newest), Some(ring), StepData::Words(sizes.to_vec()));
        }
    }
    let [observation, action] = [8, 8].map(|len| value(len, Lifetime::Step));
    add(OpKind::Copy, observation, Some(Slice { buffer: 0, offset: 0, len: 8 }), None, StepData::None);
    Ok((name.to_owned(), image_around(&policy, &outcomes, buffers, before, [observation, action])?))
}

/// Ops of policy.json with shapes of their own. All others are measured with [`LENGTHS`], so that a new one needs no
/// line here.
const WITH_SHAPES: [&str; 5] = ["attention", "linear", "lstm", "gru", "rotary"];

/// An op of policy.json with the same values for every key.
struct Filled<'b> {
    op: &'static str,
    len: usize,
    inputs: Vec<ValueId>,
    builder: &'b mut Builder,
}

impl Keys for Filled<'_> {
    fn op(&self) -> &str {
        self.op
    }

    fn input_len(&self) -> usize {
        self.len
    }

    fn text(&self, _: &str) -> actq::error::Result<Option<&str>> {
        Ok(None)
    }

    fn number(&self, _: &str) -> actq::error::Result<Option<f64>> {
        Ok(Some(5.0))
    }

    fn count(&self, _: &str) -> actq::error::Result<Option<usize>> {
        Ok(None)
    }

    fn truth(&self, _: &str) -> actq::error::Result<Option<bool>> {
        Ok(None)
    }

    fn vector(&self, _: &str, len: usize) -> actq::error::Result<Option<Vec<f32>>> {
        Ok(Some(vec![1.5; len]))
    }

    fn matrix(&mut self, key: &str, _: Option<usize>, _: usize) -> actq::error::Result<(usize, usize)> {
        bail!("{} has the matrix {key:?}; measure it with shapes of its own", self.op)
    }

    fn add_prefix(&mut self, _: usize) -> actq::error::Result<()> {
        bail!("{} has a prefix; measure it with shapes of its own", self.op)
    }

    fn add_input(&mut self, _: &str) -> actq::error::Result<()> {
        let part = Concat(vec![Span { from: 0, len: self.len }]);
        self.inputs.push(self.builder.graph.add(part, &[0])?);
        Ok(())
    }
}

/// Adds an op of policy.json over `len` values.
fn filled(builder: &mut Builder, op: &'static str, len: usize) -> Result<()> {
    let mut keys = Filled { op, len, inputs: vec![builder.part(len)?], builder };
    let kind = NodeKind::read(&mut keys)?.context(op)?;
    let inputs = keys.inputs;
    builder.node(kind, &inputs)?;
    Ok(())
}

fn policies() -> Result<Vec<(Policy, Vec<Outcome>)>> {
    let mut policies = Vec::new();
    for activations in [Activations::Int8, Activations::Int16] {
        for group in [0, 32, 64, 128] {
            for width in Width::ALL {
                let mut builder = Builder::new(OBSERVATION);
                for shape in SHAPES {
                    builder.linear(shape, activations, |_| Some(width), group, true)?;
                }
                policies.push(builder.finish(format!("{width:?} {activations:?} group {group}"), false));
            }
        }
        // Blocks of several widths in order, by index, and outputs without biases.
        type Widths = fn(usize, usize) -> usize;
        let in_order: Widths = |row, rows| 4 * row / rows;
        let mixed: Widths = |row, _| row * 7 % 4;
        // Two of three rows have no bits.
        let pruned: Widths = |row, _| [3, 4, 4][row % 3];
        for (name, which, bias) in [
            ("in order", in_order, true),
            ("in order, no bias", in_order, false),
            ("mixed", mixed, true),
            ("pruned", pruned, true),
            ("pruned, no bias", pruned, false),
        ] {
            let mut builder = Builder::new(OBSERVATION);
            for (rows, cols) in SHAPES {
                let width = |row| Width::ALL.get(which(row, rows)).copied();
                builder.linear((rows, cols), activations, width, 0, bias)?;
            }
            policies.push(builder.finish(format!("blocks {name}, {activations:?}"), false));
        }
    }
    // Steps with hardly any work.
    for (observation, action, contract) in
        [(8, 8, false), (40, 2, true), (256, 30, false), (256, 30, true), (40, 12, true)]
    {
        let mut builder = Builder::new(observation);
        builder.part(action)?;
        policies.push(builder.finish(format!("{observation} to {action}, contract {contract}"), contract));
    }
    for (name, contract) in [("functions", false), ("functions with contract", true)] {
        let mut builder = Builder::new(if contract { OBSERVATION } else { 256 });
        for len in LENGTHS {
            for (op, _) in NodeKind::syntax().into_iter().filter(|(op, _)| !WITH_SHAPES.contains(op)) {
                filled(&mut builder, op, len)?;
            }
            let [mean, scale] = [builder.values(len), vec![1.5; len]];
            let limitless = f32::INFINITY;
            builder.node_of_part(len, Normalize { mean, scale, pre_clip: limitless, clip: limitless })?;
        }
        for hidden in HIDDEN {
            for width in [Width::W2, Width::W4] {
                let cols = 40;
                let all = vec![Some(width); 4 * hidden];
                let input = builder.matrix(4 * hidden, cols, Activations::Int8, &all, 0)?;
                let state = builder.matrix(4 * hidden, hidden, Activations::Int8, &all, 0)?;
                let bias = builder.values(4 * hidden);
                builder.node_of_part(cols, Lstm { hidden, input, state, bias })?;
                let all = vec![Some(width); 3 * hidden];
                let input = builder.matrix(3 * hidden, cols, Activations::Int8, &all, 0)?;
                let state = builder.matrix(3 * hidden, hidden, Activations::Int8, &all, 0)?;
                let (input_bias, state_bias) = (builder.values(3 * hidden), builder.values(3 * hidden));
                builder.node_of_part(cols, Gru { hidden, input, state, input_bias, state_bias })?;
            }
        }
        builder.part(12)?;
        policies.push(builder.finish(name.to_owned(), contract));
    }
    // Chunks that are averaged, and chunks that blend into the next.
    for (chunk, act_len) in CHUNKS {
        for (horizon, overlap) in [(chunk, 0), (chunk / 2, 0), (0, chunk - 1), (0, chunk / 2)] {
            let mut builder = Builder::new(chunk * act_len);
            builder.part(chunk * act_len)?;
            let name = format!("chunks of {chunk} by {act_len}, horizon {horizon}, overlap {overlap}");
            let (mut policy, outcomes) = builder.finish(name, false);
            (policy.kind, policy.chunk, policy.act_len) = (Kind::Chunk, chunk, act_len);
            let ensemble = (horizon > 0).then_some(Ensemble { horizon, m: 0.01 });
            policy.contract.playback = Playback { ensemble, overlap, deadline: None };
            policies.push((policy, outcomes));
        }
    }
    // A denoising step, with and without limit and noise.
    for (limit, sigma) in [(f32::INFINITY, 0.0), (f32::INFINITY, 0.1), (1.0, 0.0), (1.0, 0.1)] {
        for len in LENGTHS {
            let mut builder = Builder::new(8);
            let rows = builder.values(len);
            let (iterate, table) = (builder.node(Iterate { len }, &[])?, builder.node(Table { rows, len }, &[])?);
            builder.node(Add, &[iterate, table])?;
            let sample = if limit.is_finite() { 0.3 } else { 0.0 };
            let steps = vec![Coefficients::from_array([sample, -sample, 0.5, 0.1, sample, sigma, 0.0])];
            builder.graph.denoising = Some(Denoising { first: 0, len, limit, steps });
            let (mut policy, outcomes) =
                builder.finish(format!("a denoising step, limit {limit}, sigma {sigma}"), false);
            policy.kind = Kind::Flow;
            policies.push((policy, outcomes));
        }
    }
    Ok(policies)
}

#[cfg(test)]
mod tests {
    use std::collections::HashSet;
    use std::path::Path;

    use actq::runtime::ImageBuffer;
    use actq_kernels::cost::{CostItem, values};

    use super::*;

    #[test]
    fn every_operation_is_measured() -> Result<()> {
        let mut measured = HashSet::new();
        for (name, bytes) in images()? {
            let buffer = ImageBuffer::new(&bytes);
            let ops = buffer.image(Path::new(&name))?.ops().map(|op| values(&op));
            measured.extend(ops.flat_map(|(operation, value, _)| [operation, value]));
        }
        let name = |item: &CostItem| format!("{item:?}");
        let expected = CostItem::all().filter(|f| {
            ["operation(", "function(", "Attention::Attend)", "Attention::Keep)", "Attention::Rotary)"]
                .iter()
                .any(|kind| name(f).contains(kind))
        });
        let missing: Vec<CostItem> = expected.filter(|item| !measured.contains(item)).collect();
        assert!(missing.is_empty(), "no image has {missing:?}");
        Ok(())
    }
}
