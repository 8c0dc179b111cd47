//! An image with the values of its network trained further: the same shapes, scales and layouts.

use std::collections::BTreeMap;

use actq_kernels::Image;
use actq_kernels::image::{Matrix, Op, OpKind, RowBlock, header as h};
use actq_kernels::layout::{Lanes, Width, pack};
use sha2::{Digest as _, Sha256};

use super::repack::unpacked;
use super::writer::{place_constants, sealed, self_test_actions};
use crate::error::{Context, Result, ensure};
use crate::runtime::ImageBuffer;

/// New values of an image, by the index of their operation. Values that are not given stay.
#[derive(Clone, Debug, Default)]
pub struct Trained {
    /// Levels of a linear operation's matrix [rows, cols]. Those of weights that are always zero do not count: of rows
    /// that the image does not have, and of scales of zero.
    pub levels: BTreeMap<usize, Vec<i16>>,
    /// Biases of a linear operation, one for each row.
    pub biases: BTreeMap<usize, Vec<f32>>,
    /// By operation and array: the weights (0) and biases (1) of a norm, the row of each denoising step of a table.
    pub arrays: BTreeMap<(usize, usize), Vec<f32>>,
}

/// Returns the image with these values. Its self-test has the observations of before and the new actions. Its digest is
/// the SHA-256 of the same image with the digest of before: no policy has it. Without a change the bytes stay.
///
/// # Errors
///
/// If the image is not valid or has operations around its network, if it has no place for a value, if a value is not
/// finite or a level not one of its width, or if sums leave int32 with int8 activations.
pub fn retrained(bytes: &[u8], trained: &Trained) -> Result<Vec<u8>> {
    let buffer = ImageBuffer::new(bytes);
    let image = Image::new_checked(buffer.bytes()).context("the image to train further")?;
    ensure!(!image.has_around(), "an image of raw values cannot be trained further; train one of its network");
    let old: Vec<u32> = bytes.as_chunks().0.iter().map(|word| u32::from_le_bytes(*word)).collect();
    trained.check(&image)?;
    let mut words = trained.words(&image, &old)?;
    renew_self_test(&image, &mut words)?;
    let renewed = sealed(&words)?;
    if renewed == bytes {
        return Ok(renewed);
    }
    let digest = Sha256::digest(&renewed);
    for (word, bytes) in words[h::W_DIGEST..].iter_mut().zip(digest.as_chunks().0) {
        *word = u32::from_le_bytes(*bytes);
    }
    sealed(&words)
}

impl Trained {
    /// Refuses values that the image has no place for, and values that are not finite.
    fn check(&self, image: &Image<'_>) -> Result<()> {
        let ops: Vec<Op<'_>> = image.ops().collect();
        let matrix = |i: usize| ops.get(i).and_then(Op::matrix);
        for (i, levels) in &self.levels {
            let len = matrix(*i).map_or(0, |matrix| matrix.rows * matrix.cols);
            ensure!(levels.len() == len, "operation {i} has {len} weights, but {} are given", levels.len());
        }
        for (i, biases) in &self.biases {
            let len = matrix(*i).map_or(0, |matrix| matrix.rows);
            ensure!(biases.len() == len, "operation {i} has {len} biases, but {} are given", biases.len());
        }
        for ((i, array), values) in &self.arrays {
            let (arrays, len) = ops.get(*i).map_or((0, 0), |op| (arrays(op, image), op.dst().len));
            ensure!(
                *array < arrays && values.len() == len,
                "operation {i} has {arrays} arrays of {len} values, but {} are given for array {array}",
                values.len()
            );
        }
        let floats = self.biases.iter().chain(self.arrays.iter().map(|((i, _), values)| (i, values)));
        for (i, values) in floats {
            ensure!(values.iter().all(|value| value.is_finite()), "a value of operation {i} is not finite");
        }
        Ok(())
    }

    /// Returns the words of the image, without the actions of the self-test, length and checksum.
    fn words(&self, image: &Image<'_>, old: &[u32]) -> Result<Vec<u32>> {
        let ops_at = old[h::W_OPS] as usize;
        let after_ops = ops_at + h::OP_WORDS * image.ops().count();
        let mut shared = old[h::W_MATRICES] as usize + h::MATRIX_WORDS * image.matrices().count();
        let mut words = old[..shared].to_vec();
        let mut records = Vec::new();
        for (i, (op, record)) in image.ops().zip(old[ops_at..].as_chunks::<{ h::OP_WORDS }>().0).enumerate() {
            let mut record = *record;
            if let Some(matrix) = op.matrix() {
                if let Some(levels) = self.levels.get(&i) {
                    write_levels(&matrix, old, record[3] as usize, levels, &mut words)
                        .with_context(|| format!("operation {i}"))?;
                }
                let old = || (0..matrix.rows).map(|row| matrix.bias(row)).collect();
                let biases = self.biases.get(&i).cloned().unwrap_or_else(old);
                // Biases of zero stay: without them, no output may begin in the input.
                let has_bias = matrix.has_bias() || biases.iter().any(|bias| *bias != 0.0);
                record[2] = if has_bias { place_constants(&mut words, &mut shared, &biases) } else { 0 };
            } else {
                record[3] = self.place_data(i, &op, image, old, &mut words, &mut shared);
            }
            records.extend(record);
        }
        // The sections after the constants move by this much.
        let moved = (words.len() as u32).wrapping_sub(ops_at as u32);
        words.extend(records);
        words.extend(&old[after_ops..]);
        for at in [h::W_OPS, h::W_CONTRACT, h::W_SELF_TEST, h::W_NAME] {
            words[at] = words[at].wrapping_add(moved);
        }
        Ok(words)
    }

    /// Appends the constants of an operation that is not linear, and returns their offset; 0 if it has none.
    fn place_data(
        &self,
        i: usize,
        op: &Op<'_>,
        image: &Image<'_>,
        old: &[u32],
        words: &mut Vec<u32>,
        shared: &mut usize,
    ) -> u32 {
        let (n, at) = (op.dst().len, old[old[h::W_OPS] as usize + h::OP_WORDS * i + 3] as usize);
        let constants = op.constants().count();
        // Data whose first words are not only f32 constants: see the writer.
        let of_words = match op.kind {
            OpKind::Denoise => Some(h::COEFFICIENTS * image.denoising_steps()),
            OpKind::Rotary => Some(n / op.rotated_heads()[0]),
            OpKind::Keep | OpKind::Attend => Some(0),
            _ => None,
        };
        if let Some(more) = of_words {
            let offset = words.len() as u32;
            words.extend(&old[at..at + constants + more]);
            *shared = words.len();
            return offset;
        }
        let arrays = if matches!(op.kind, OpKind::Normalize { .. }) { 2 } else { arrays(op, image) };
        if arrays == 0 {
            return 0;
        }
        let mut values: Vec<f32> =
            old[at..][..constants + arrays * n].iter().map(|word| f32::from_bits(*word)).collect();
        for ((_, array), new) in self.arrays.range((i, 0)..(i + 1, 0)) {
            values[constants + array * n..][..n].copy_from_slice(new);
        }
        place_constants(words, shared, &values)
    }
}

/// Returns the number of an operation's arrays that can be trained.
fn arrays(op: &Op<'_>, image: &Image<'_>) -> usize {
    match op.kind {
        OpKind::LayerNorm => 2,
        OpKind::RmsNorm => 1,
        OpKind::Table => image.denoising_steps(),
        _ => 0,
    }
}

/// Packs new codes into the places of the old ones; `record` is the offset of the matrix record. Activations get as many
/// levels less as the largest sum needs.
fn write_levels(matrix: &Matrix<'_>, old: &[u32], record: usize, levels: &[i16], words: &mut [u32]) -> Result<()> {
    let records = old[old[record + 3] as usize..].as_chunks::<{ h::BLOCK_WORDS }>().0;
    let mut largest = 1;
    for (rows, [_, weights, ..]) in matrix.blocks().zip(records) {
        let shape = rows.block.shape();
        let (mut codes, group_scales) = unpacked(&rows);
        for (i, output) in rows.outputs().enumerate() {
            let levels = &levels[output * matrix.cols..][..matrix.cols];
            let mut sum = 0;
            for (col, (code, level)) in codes[i * shape.cols..].iter_mut().zip(levels).enumerate() {
                if has_step(&rows, i, col) {
                    *code = code_of(shape.width, *level)
                        .with_context(|| format!("{level} is not a level of {} bits", shape.width.bits()))?;
                }
                sum += i64::from(shape.width.level(*code).abs()) * i64::from(rows.block.group_scale(i, col));
            }
            largest = largest.max(sum);
        }
        let mut packed = vec![0; shape.words()];
        pack(shape, &codes, &group_scales, &mut packed)?;
        for (word, packed) in words[*weights as usize..].iter_mut().zip(packed) {
            *word = u32::from_le(packed);
        }
    }
    let x_max = (i64::from(i32::MAX) / largest).min(matrix.x_max.into()) as u16;
    // Fewer would have the layouts of int8, or less than its precision.
    ensure!(
        x_max == matrix.x_max || x_max >= Lanes::PAIRED_X_MAX + u16::from(matrix.x_max > Lanes::PAIRED_X_MAX),
        "the sums of a row leave int32; train fewer steps, or with a smaller learning rate"
    );
    words[record + 1] = words[record + 1] & 0xffff | u32::from(x_max) << 16;
    Ok(())
}

/// Returns `true` if the weight depends on its code.
fn has_step(rows: &RowBlock<'_>, row: usize, col: usize) -> bool {
    rows.scale(row) != 0.0 && rows.block.group_scale(row, col) != 0
}

/// Returns the code of a level, if it is one of the width.
fn code_of(width: Width, level: i16) -> Option<u8> {
    let code = match width {
        Width::W8 => level as u8,
        _ => ((i32::from(level) + width.max_level()) / 2) as u8,
    };
    (width.level(code) == i32::from(level) && u32::from(code) >> width.bits() == 0).then_some(code)
}

/// Computes the actions of the self-test again.
fn renew_self_test(image: &Image<'_>, words: &mut [u32]) -> Result<()> {
    let (obs_len, act_len) = (image.obs_len(), image.act_len());
    let at = words[h::W_SELF_TEST] as usize;
    let steps = at..at + image.self_test_steps() * (obs_len + act_len);
    let floats = |words: &[u32]| words.iter().map(|word| f32::from_bits(*word)).collect();
    let observations: Vec<Vec<f32>> =
        words[steps.clone()].chunks(obs_len + act_len).map(|step| floats(&step[..obs_len])).collect();
    let unfit = "no image can hold the trained values; train fewer steps, or with a smaller learning rate";
    let actions = self_test_actions(&sealed(words)?, &observations, unfit)?;
    for (step, action) in words[steps].chunks_mut(obs_len + act_len).zip(&actions) {
        step[obs_len..].iter_mut().zip(action).for_each(|(word, value)| *word = value.to_bits());
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::budget::Budget;
    use crate::data::Recordings;
    use crate::emit::{Core, repack};
    use crate::graph::ops::{Attention, Linear, Rotary};
    use crate::graph::{Graph, WeightMatrix};
    use crate::methods::{Method, Options};
    use crate::pipeline::quantize;
    use crate::policy::Policy;
    use crate::runtime::with_head;
    use crate::testing;

    fn image_of(graph: Graph, width: Width, group: usize, core: Core) -> Vec<u8> {
        let options = Options { group, ..Options::new(Method::Rtn, Budget::Width(width)) };
        let recordings = Recordings { calib: Some(testing::dataset(&graph, 2, 20)), heldout: None };
        let made = quantize(&Policy::of("trained", graph), &recordings, &options, ()).expect("an image");
        repack(&made.image, core).expect("layouts of the core")
    }

    /// Returns all values of an image.
    fn values_of(bytes: &[u8]) -> Trained {
        let buffer = ImageBuffer::new(bytes);
        let image = buffer.image(Path::new("an image")).expect("it is valid");
        let mut trained = Trained::default();
        for (i, op) in image.ops().enumerate() {
            for array in 0..arrays(&op, &image) {
                let values = op.array(array).iter().map(|word| f32::from_bits(u32::from_le(*word)));
                trained.arrays.insert((i, array), values.collect());
            }
            let Some(matrix) = op.matrix() else { continue };
            let mut levels = vec![0; matrix.rows * matrix.cols];
            for rows in matrix.blocks() {
                for (row, output) in rows.outputs().enumerate() {
                    for col in 0..matrix.cols {
                        levels[output * matrix.cols + col] = rows.block.level(row, col) as i16;
                    }
                }
            }
            trained.levels.insert(i, levels);
            trained.biases.insert(i, (0..matrix.rows).map(|row| matrix.bias(row)).collect());
        }
        trained
    }

    /// Makes a network of attention to one token with a rotary position.
    fn attentive() -> Graph {
        let mut graph = Graph::new(8);
        let rotary = Rotary { heads: 2, dim: 4, cos: vec![0.8, 0.6], sin: vec![0.6, 0.8] };
        let rotated = graph.add(rotary, &[0]).expect("it fits");
        let attention = Attention { heads: 2, kv_heads: 2, dim: 4, factor: 0.5, causal: false, context: 0 };
        let attended = graph.add(attention, &[rotated, 0, 0]).expect("it fits");
        let matrix = WeightMatrix { name: "m".into(), rows: 2, cols: 8, data: (1..17).map(|i| i as f32).collect() };
        let matrix = graph.add_matrix(matrix).expect("a matrix");
        graph.add(Linear { matrix, bias: vec![0.1; 2] }, &[attended]).expect("it fits");
        graph
    }

    #[test]
    fn trained_values_are_those_of_the_new_image() -> Result<()> {
        let lstm = testing::lstm;
        let graphs = [
            (lstm(), Core::M4f),
            (lstm(), Core::M3),
            (testing::mlp(), Core::M0),
            (attentive(), Core::M4f),
            (testing::transformer(100), Core::M3),
        ];
        for (graph, core) in graphs {
            for (width, group) in [(Width::W2, 32), (Width::W3, 0), (Width::W4, 32), (Width::W8, 0)] {
                let bytes = image_of(graph.clone(), width, group, core);
                let mut values = values_of(&bytes);
                assert_eq!(retrained(&bytes, &values)?, bytes, "without a change, {width:?} {core:?}");
                for levels in values.levels.values_mut() {
                    levels[0] = if levels[0] == 1 { -1 } else { 1 };
                }
                values.biases.values_mut().for_each(|biases| biases[0] += 0.125);
                let new = retrained(&bytes, &values)?;
                let found = values_of(&new);
                assert_eq!((found.levels, found.biases, found.arrays), (values.levels, values.biases, values.arrays));
                let buffers = [ImageBuffer::new(&bytes), ImageBuffer::new(&new)];
                let [old, new] = [0, 1].map(|i| buffers[i].image(Path::new("an image")).expect("it is valid"));
                assert_ne!(old.digest(), new.digest());
                with_head(new, |head| head.self_test().context("self-test"))?;
            }
        }
        Ok(())
    }

    #[test]
    fn values_without_a_place_are_refused() {
        let bytes = image_of(testing::mlp(), Width::W2, 0, Core::M4f);
        let linear = *values_of(&bytes).biases.keys().next().expect("a linear operation");
        let refusal = |change: &dyn Fn(&mut Trained)| {
            let mut values = values_of(&bytes);
            change(&mut values);
            format!("{:#}", retrained(&bytes, &values).expect_err("it is refused"))
        };
        let is_nan = refusal(&|values| values.biases.values_mut().for_each(|biases| biases[0] = f32::NAN));
        assert!(is_nan.contains("is not finite"), "{is_nan}");
        for level in [0, 5, -2] {
            let level = refusal(&|values| values.levels.values_mut().for_each(|levels| levels[0] = level));
            assert!(level.contains("is not a level of 2 bits"), "{level}");
        }
        let short = refusal(&|values| values.levels.values_mut().for_each(|levels| levels.truncate(1)));
        assert!(short.contains("weights, but"), "{short}");
        let other = refusal(&|values| drop(values.arrays.insert((linear, 0), vec![1.0])));
        assert!(other.contains("has 0 arrays"), "{other}");
        assert!(refusal(&|values| drop(values.biases.insert(999, vec![1.0]))).contains("has 0 biases"));
    }
}
