//! Lays an image out.

use std::path::Path;

use actq_kernels::image::{Kind, OpKind, Region, checksum, half_words, header as h, header::op};
use actq_kernels::layout::{self, LAYOUT_STAMP};
use anyhow::{Context, Result, ensure};

use super::lower::lower;
use crate::graph::lowering::{Step, StepData};
use crate::graph::{Graph, NodeKind};

use crate::methods::{Outcome, Quantized};
use crate::policy::Policy;
use crate::runtime::{ImageBuffer, with_head};

/// The image of a policy with its quantized matrices, one per matrix of the graph. The self-test vector is computed by the
/// executor itself.
pub fn image(policy: &Policy, matrices: &[Outcome]) -> Result<Vec<u8>> {
    let group = matrices.first().map_or(0, |m| m.quantized.group);
    let program = lower(&policy.graph, policy.act_len, group)?;
    let mut writer = Writer { words: vec![0; h::WORDS], matrices: 0 };
    let matrix_records = matrices.iter().map(|m| writer.matrix(m)).collect::<Result<Vec<_>>>()?;
    writer.matrices = writer.push(matrix_records.into_iter().flatten());
    let records = program.steps.iter().map(|step| writer.op(step)).collect::<Result<Vec<[u32; h::OP_WORDS]>>>()?;
    let ops = writer.push(records.into_iter().flatten());
    let contract = writer.words.len() as u32;
    let mut flags = 0;
    for (bit, (_, array)) in policy.contract.arrays().into_iter().enumerate() {
        if let Some(array) = array {
            flags |= 1 << bit;
            writer.push_floats(array);
        }
    }
    let name = writer.push_bytes(policy.name.as_bytes());
    let steps = policy.execute + 2;
    let observations = self_test_observations(&policy.graph, steps);
    let self_test = writer.words.len() as u32;
    for observation in &observations {
        writer.push_floats(observation);
        writer.push_floats(&vec![0.0; policy.act_len]);
    }
    let kind = match policy.kind {
        Kind::Step => 0,
        Kind::Chunk => 1,
    };
    let Writer { mut words, matrices: first_matrix } = writer;
    words[0] = h::MAGIC;
    words[h::W_VERSION] = halves(h::VERSION.into(), h::WORDS)?;
    words[h::W_LAYOUT] = LAYOUT_STAMP;
    words[h::W_KIND] = kind | halves(0, program.steps.len())?;
    words[h::W_OPS] = ops;
    words[h::W_SIZES] = halves(policy.graph.obs_len, policy.act_len)?;
    words[h::W_CHUNK] = halves(policy.chunk, policy.execute)?;
    words[h::W_SCRATCH] = program.words as u32;
    words[h::W_STATE] = halves(program.state.offset, program.state.len)?;
    words[h::W_OBS_OUT] = halves(program.observation.offset, program.output.offset)?;
    words[h::W_ACTION_WORK] = halves(program.action.offset, program.work.offset)?;
    words[h::W_WORK_FLAGS] = halves(program.work.len, flags)?;
    words[h::W_CONTRACT] = contract;
    words[h::W_RATE] = policy.rate_hz.to_bits();
    words[h::W_SELF_TEST] = self_test;
    words[h::W_STEPS_NAME] = halves(steps, policy.name.len())?;
    words[h::W_NAME] = name;
    words[h::W_WEIGHTS] = policy.weights as u32;
    words[h::W_MATRICES] = first_matrix;
    words[h::W_MATRIX_COUNT] = halves(matrices.len(), 0)?;
    for (word, bytes) in words[h::W_DIGEST..].iter_mut().zip(policy.digest.chunks_exact(4)) {
        *word = u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]);
    }
    let actions = self_test_actions(&seal(&words), &observations)?;
    for (step, action) in actions.iter().enumerate() {
        let at = self_test as usize + step * (policy.graph.obs_len + policy.act_len) + policy.graph.obs_len;
        for (word, value) in words[at..].iter_mut().zip(action) {
            *word = value.to_bits();
        }
    }
    Ok(seal(&words))
}

/// Fills in length and checksum and gives the bytes.
fn seal(words: &[u32]) -> Vec<u8> {
    let mut bytes: Vec<u8> = words.iter().flat_map(|w| w.to_le_bytes()).collect();
    let len = (bytes.len() as u32).to_le_bytes();
    bytes[4 * h::W_BYTES..][..4].copy_from_slice(&len);
    let crc = checksum(&bytes).to_le_bytes();
    bytes[4 * h::W_CRC..][..4].copy_from_slice(&crc);
    bytes
}

/// Observations that reach every input: spread over about two standard deviations where the policy normalizes, else over -1
/// to 1, from a fixed generator.
fn self_test_observations(graph: &Graph, steps: usize) -> Vec<Vec<f32>> {
    let mut state = 0x2545_f491u32;
    let mut noise = move || {
        state ^= state << 13;
        state ^= state >> 17;
        state ^= state << 5;
        state as i32 as f32 / i32::MAX as f32
    };
    let norm = graph.nodes.iter().find_map(|node| match &node.kind {
        NodeKind::Normalize(norm) if node.inputs == [0] => Some(norm),
        _ => None,
    });
    let mut value = |i: usize| match norm {
        Some(norm) if norm.scale[i].abs() > 1e-6 => norm.mean[i] + 2.0 * noise() / norm.scale[i],
        _ => noise(),
    };
    (0..steps).map(|_| (0..graph.obs_len).map(&mut value).collect()).collect()
}

fn self_test_actions(bytes: &[u8], observations: &[Vec<f32>]) -> Result<Vec<Vec<f32>>> {
    let buffer = ImageBuffer::new(bytes);
    let image = buffer.image(Path::new("the new image"))?;
    with_head(image, |head| {
        observations.iter().map(|obs| Ok(head.step(obs).context("self-test of the new image")?.to_vec())).collect()
    })
}

/// Two u16 in a word.
fn halves(low: usize, high: usize) -> Result<u32> {
    let fits = low <= 0xffff && high <= 0xffff;
    ensure!(fits, "a size of the policy ({}) exceeds the format's limit of 65535", low.max(high));
    Ok(low as u32 | (high as u32) << 16)
}

struct Writer {
    words: Vec<u32>,
    /// Offset of the matrix records.
    matrices: u32,
}

impl Writer {
    /// Appends words and gives their offset.
    fn push(&mut self, words: impl IntoIterator<Item = u32>) -> u32 {
        let offset = self.words.len() as u32;
        self.words.extend(words);
        offset
    }

    fn push_floats(&mut self, values: &[f32]) -> u32 {
        self.push(values.iter().map(|v| v.to_bits()))
    }

    fn push_bytes(&mut self, bytes: &[u8]) -> u32 {
        self.push(bytes.chunks(4).map(|c| c.iter().rev().fold(0, |word, b| word << 8 | u32::from(*b))))
    }

    /// Packs a matrix's blocks, and gives its record.
    fn matrix(&mut self, outcome: &Outcome) -> Result<[u32; h::MATRIX_WORDS]> {
        let matrix = &outcome.quantized;
        ensure!(matrix.rows <= h::MAX_ROWS, "a matrix has {} rows, {} are supported", matrix.rows, h::MAX_ROWS);
        let blocks = outcome.blocks();
        let in_order = Quantized::in_order(&blocks);
        let mut records = Vec::new();
        for (shape, rows) in &blocks {
            let codes: Vec<u8> =
                rows.iter().flat_map(|r| &matrix.codes[r * matrix.cols..][..matrix.cols]).copied().collect();
            let groups = matrix.groups();
            let group_scales: Vec<u8> =
                rows.iter().flat_map(|r| &matrix.group_scales[r * groups..][..groups]).copied().collect();
            let mut words = vec![0; shape.words()];
            layout::pack(*shape, &codes, &group_scales, &mut words).with_context(|| {
                format!("{shape:?} cannot be packed; docs/FORMAT.md says how many columns may have group scales")
            })?;
            let weights = self.push(words.into_iter().map(u32::from_le));
            let scales: Vec<u16> = rows.iter().map(|&r| matrix.scales[r].to_bits()).collect();
            let scales = self.push(half_words(&scales));
            let index = if in_order {
                0
            } else {
                let index = rows.iter().map(|&r| u16::try_from(r)).collect::<Result<Vec<_>, _>>()?;
                self.push(half_words(&index))
            };
            records.extend([
                shape.width.bits() | u32::from(shape.lanes.code()) << 8 | halves(0, shape.rows)?,
                weights,
                scales,
                index,
            ]);
        }
        Ok([
            halves(matrix.rows, matrix.cols)?,
            halves(matrix.group, outcome.x_max.into())?,
            halves(blocks.len(), 0)?,
            self.push(records),
        ])
    }

    fn op(&mut self, step: &Step<Region>) -> Result<[u32; h::OP_WORDS]> {
        let (code, detail) = match step.kind {
            OpKind::Normalize => (op::NORMALIZE, 0),
            OpKind::Linear { accumulate } => (op::LINEAR, u8::from(accumulate)),
            OpKind::Function(function) => (op::FUNCTION, function as u8),
            OpKind::LayerNorm => (op::LAYER_NORM, 0),
            OpKind::RmsNorm => (op::RMS_NORM, 0),
            OpKind::Add => (op::ADD, 0),
            OpKind::Copy => (op::COPY, 0),
            OpKind::LstmCell => (op::LSTM_CELL, 0),
            OpKind::GruCell => (op::GRU_CELL, 0),
        };
        let (bias, data) = match &step.data {
            StepData::None => (0, 0),
            StepData::Constants(values) => (0, self.push_floats(values)),
            StepData::Product { matrix, bias } => {
                let bias = if bias.iter().all(|b| *b == 0.0) { 0 } else { self.push_floats(bias) };
                (bias, self.matrices + (matrix * h::MATRIX_WORDS) as u32)
            }
        };
        let offset = |region: Option<Region>| region.map_or(0, |r| r.offset);
        Ok([
            u32::from(code) | u32::from(detail) << 8 | halves(0, step.dst.len)?,
            halves(step.dst.offset, offset(step.src))?,
            bias | halves(0, offset(step.third))?,
            data,
        ])
    }
}
