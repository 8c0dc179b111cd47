//! Random images with every operation that the executor runs.

use actq::around::{Around, NamedPort, OUTPUT};
use actq::contract::{ActionContract, Binarise, Ensemble, Playback};
use actq::emit;
use actq::graph::Denoising;
use actq::graph::lowering::{Buffer, Lifetime, Slice, Step, StepData};
use actq::graph::ops::{Concat, Gru, Iterate, Pointwise, Span, Table};
use actq::methods::Activations;
use actq_bench::networks::{Builder, Draw};
use actq_kernels::image::{Kind, OpKind};
use actq_kernels::math::Function;
use actq_kernels::ops::denoise::Coefficients;
use actq_kernels::{PortKind, Width};
use anyhow::Result;

const OBSERVATION: usize = 150;

/// Largest magnitude of the raw values of [`around`].
pub(super) const RANGE: f32 = 10.0;

fn contract(draw: &mut Draw, len: usize, chunk: usize, execute: usize) -> ActionContract {
    let mut some = |value: f32| (draw.below(2) == 0).then(|| vec![value; len]);
    let [scale, offset, low, high] = [0.7, 0.1, -0.9, 0.8].map(&mut some);
    let [max_step, smoothing] = [0.25, 0.6].map(&mut some);
    let binarise = (draw.below(3) == 0).then(|| Binarise {
        on: vec![0.3; len],
        off: vec![-0.1; len],
        on_value: (0..len).map(|i| if i % 2 == 0 { 0.5 } else { 0.0 }).collect(),
        off_value: vec![0.0; len],
    });
    let playback = match draw.below(3) {
        0 if execute == 1 => {
            let horizon = 1 + draw.below(chunk);
            Playback { ensemble: Some(Ensemble { horizon, m: 0.1 }), ..Playback::default() }
        }
        1 => Playback { overlap: draw.below(chunk - execute + 1), ..Playback::default() },
        _ => Playback { deadline: Some(chunk), ..Playback::default() },
    };
    ActionContract { scale, offset, low, high, max_step, smoothing, binarise, playback }
}

/// An image with every operation inside a network, chunks and a contract.
pub(super) fn network(seed: u64) -> Result<Vec<u8>> {
    let mut draw = Draw::new(seed);
    let (mut policy, outcomes) = draw.network(OBSERVATION)?;
    policy.contract = contract(&mut draw, policy.act_len, policy.chunk, policy.execute);
    policy.check()?;
    Ok(emit::image(&policy, &outcomes)?)
}

/// An image of products of any shape, and functions.
pub(super) fn products(seed: u64) -> Result<Vec<u8>> {
    let mut draw = Draw::new(seed);
    let group = draw.group();
    let mut builder = Builder::new(1 + draw.below(OBSERVATION));
    let mut last = 0;
    for _ in 0..1 + draw.below(3) {
        let rows = 1 + draw.below(150);
        last = draw.linear(&mut builder, rows, last, group)?;
        last = builder.node(Pointwise(Function::ALL[draw.below(Function::ALL.len())]), &[last])?;
    }
    let (policy, mut outcomes) = builder.finish("products".to_owned(), false);
    if draw.below(4) == 0 {
        // No row of a matrix has weights.
        let at = draw.below(outcomes.len());
        outcomes[at].quantized.widths.fill(None);
    }
    Ok(emit::image(&policy, &outcomes)?)
}

/// An image with a recurrent state and a largest change of the action, which fails for an observation above 90.
pub(super) fn fragile() -> Result<Vec<u8>> {
    let mut draw = Draw::new(1);
    let mut builder = Builder::new(5);
    let exponential = builder.node(Pointwise(Function::Exp), &[0])?;
    let [input, state] = [5, 4].map(|cols| draw.matrix(&mut builder, 12, cols, 0));
    let [input_bias, state_bias] = [builder.values(12), builder.values(12)];
    let gru = Gru { hidden: 4, input: input?, state: state?, input_bias, state_bias };
    builder.node(gru, &[exponential])?;
    let (policy, outcomes) = builder.finish("fragile".to_owned(), true);
    Ok(emit::image(&policy, &outcomes)?)
}

/// An image with a linear operation that adds to its output.
pub(super) fn accumulating() -> Result<Vec<u8>> {
    let mut builder = Builder::new(OBSERVATION);
    for rows in [3, 70] {
        for _ in 0..2 {
            builder.linear((rows, 40), Activations::Int8, |_| Some(Width::W2), 0, true)?;
        }
    }
    builder.accumulating("accumulating")
}

/// An image of a flow or diffusion policy, with noise in each step or at the start only.
pub(super) fn denoiser(seed: u64) -> Result<Vec<u8>> {
    let mut draw = Draw::new(seed);
    let (len, chunk, steps) = (1 + draw.below(4), 1 + draw.below(3), 1 + draw.below(4));
    let (execute, group) = (1 + draw.below(chunk), draw.group());
    let mut builder = Builder::new(1 + draw.below(20));
    let observed = draw.linear(&mut builder, 9, 0, group)?;
    let first = builder.graph.nodes.len();
    let iterate = builder.node(Iterate { len: chunk * len }, &[])?;
    let rows = builder.values(5 * steps);
    let time = builder.node(Table { rows, len: 5 }, &[])?;
    let whole = |len| Span { from: 0, len };
    let all = Concat(vec![whole(9), whole(chunk * len), whole(5)]);
    let mut last = builder.node(all, &[observed, iterate, time])?;
    last = draw.linear(&mut builder, 30, last, group)?;
    last = builder.node(Pointwise(Function::Silu), &[last])?;
    draw.linear(&mut builder, chunk * len, last, group)?;
    let sigma = [0.0, 0.1][draw.below(2)];
    let by = |step: usize| Coefficients {
        sample_x: 0.9,
        sample_v: -0.2,
        keep: 0.8,
        direct: 0.1,
        sample: 0.15,
        sigma: if step + 1 < steps { sigma } else { 0.0 },
        ahead: 0.0,
    };
    let steps = (0..steps).map(by).collect();
    builder.graph.denoising = Some(Denoising { first, len: chunk * len, limit: 1.5, steps });
    let (mut policy, outcomes) = builder.finish("denoiser".to_owned(), false);
    (policy.act_len, policy.chunk, policy.execute) = (len, chunk, execute);
    policy.kind = [Kind::Flow, Kind::Diffusion][draw.below(2)];
    policy.contract = contract(&mut draw, len, chunk, execute);
    policy.check()?;
    Ok(emit::image(&policy, &outcomes)?)
}

/// An image with every operation around its network.
pub(super) fn around(seed: u64) -> Result<Vec<u8>> {
    let mut draw = Draw::new(seed);
    let len = 1 + draw.below(20);
    let group = draw.group();
    let mut builder = Builder::new(3 * len);
    draw.linear(&mut builder, len, 0, group)?;
    let (policy, outcomes) = builder.finish("around".to_owned(), false);
    let mut buffers = vec![Buffer { len, lifetime: Lifetime::Observation }];
    let mut value = |len: usize, lifetime| {
        buffers.push(Buffer { len, lifetime });
        Slice { buffer: buffers.len() - 1, offset: 0, len }
    };
    let mut before = Vec::new();
    let mut add = |kind, dst, src, third, data| before.push(Step { kind, dst, src, third, data });
    let pair = |low: usize, high: usize| (low | high << 16) as u32;
    let raw = Slice { buffer: 0, offset: 0, len };
    let reversed = value(len, Lifetime::Step);
    let places = (0..len.div_ceil(2)).map(|i| pair(len - 1 - 2 * i, len.saturating_sub(2 * i + 2)));
    add(OpKind::Select, reversed, Some(raw), None, StepData::Words([pair(len, 0)].into_iter().chain(places).collect()));
    let limits = [-0.5, 0.5].map(|limit| {
        let dst = value(len, Lifetime::Step);
        add(OpKind::Constant, dst, None, None, StepData::Constants(vec![limit; len]));
        dst
    });
    add(OpKind::Clip, reversed, Some(limits[0]), Some(limits[1]), StepData::None);
    let (kept, count) = (value(len, Lifetime::State), value(1, Lifetime::State));
    add(OpKind::Initial, kept, None, Some(count), StepData::Constants(vec![0.25; len]));
    add(OpKind::Add, kept, Some(reversed), None, StepData::None);
    let (row, count) = (value(len, Lifetime::Step), value(1, Lifetime::State));
    let rows = [pair(3, 0), pair(1, 0)].into_iter().chain((0..3 * len as u32).map(|i| (i as f32).to_bits()));
    add(OpKind::TableRow, row, None, Some(count), StepData::Words(rows.collect()));
    let limit = len as f32;
    let at = [pair(len, 1), limit.to_bits()].into_iter().chain(vec![0; len]).chain([pair(len, 0)]);
    add(OpKind::Standstill, row, Some(raw), Some(count), StepData::Words(at.collect()));
    add(OpKind::Add, row, Some(kept), None, StepData::None);
    let (length, flags) = (3, draw.below(4));
    let slots = 2 * (length - 1);
    let (frames, ring) = (value(len * length, Lifetime::Step), value(len * slots + 1, Lifetime::State));
    let sizes = [pair(len, slots), pair(length, 2), pair(0, flags)];
    add(OpKind::History, frames, Some(row), Some(ring), StepData::Words(sizes.to_vec()));
    let action = value(len, Lifetime::Step);
    let output = Slice { buffer: OUTPUT, ..action };
    let after = vec![Step { kind: OpKind::Copy, dst: action, src: Some(output), third: None, data: StepData::None }];
    let (observation, action) = (frames.buffer, action.buffer);
    let port = |kind, name: &str, range| NamedPort { kind, name: name.to_owned(), names: Vec::new(), len, range };
    let ports = vec![
        port(PortKind::Input, "raw", [-RANGE, RANGE]),
        port(PortKind::Position, "target", [f32::NEG_INFINITY, f32::INFINITY]),
    ];
    let around = Around { buffers, before, observation, after, action, limits: None, ports };
    Ok(emit::image_around(&policy, &outcomes, &around)?)
}
