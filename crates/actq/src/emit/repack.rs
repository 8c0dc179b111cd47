//! The same weights in the layouts of another core.

use actq_kernels::activations::{Plan, max_prepared_words};
use actq_kernels::cost::Core;
use actq_kernels::image::{
    BlockRecord, Image, Matrix, MatrixRecord, Op, OpKind, Port, Records, RowBlock, header as h, op,
};
use actq_kernels::layout::{BlockShape, Lanes, pack};

use super::writer::sealed;
use crate::error::{Context, Result, ensure};
use crate::runtime::{ImageBuffer, with_head};

/// Returns the image with its weights in the layouts of `core`: the same codes and scales, the same actions. An image that
/// has them already stays as it is, byte for byte.
///
/// # Errors
///
/// If the image is not valid, or needs more scratch memory than the format has.
pub fn repack(bytes: &[u8], core: Core) -> Result<Vec<u8>> {
    let buffer = ImageBuffer::new(bytes);
    let image = Image::new_checked(buffer.bytes()).context("the image to repack")?;
    let old: Vec<u32> = bytes.as_chunks().0.iter().map(|word| u32::from_le_bytes(*word)).collect();
    if core.has_layouts_of(&image) {
        return Ok(bytes.to_vec());
    }
    let matrices = Repacked::of(&image, core)?;
    let packed = sealed(&matrices.image(&image, &old)?)?;
    let buffer = ImageBuffer::new(&packed);
    let image = Image::new_checked(buffer.bytes()).context("the repacked image")?;
    with_head(image, |head| head.self_test().context("self-test of the repacked image"))?;
    Ok(packed)
}

/// The matrices' sections in another layout.
struct Repacked {
    /// From the header to the end of the matrix records.
    words: Vec<u32>,
    /// Offset of the matrix records.
    records: usize,
    /// Words of the work area.
    work: usize,
}

impl Repacked {
    fn of(image: &Image<'_>, core: Core) -> Result<Self> {
        let (mut words, mut records) = (vec![0; h::WORDS], Vec::new());
        for matrix in image.matrices() {
            let mut blocks = Vec::new();
            for block in matrix.blocks() {
                let from = block.block.shape();
                let lanes = core.lanes(matrix.x_max, matrix.group);
                let shape = BlockShape { lanes, ..from };
                let (codes, scales) = unpacked(&block);
                let mut packed = vec![0; shape.words()];
                pack(shape, &codes, &scales, &mut packed)?;
                let weights = push(&mut words, packed.into_iter().map(u32::from_le));
                let scales = push(&mut words, little_endian(block.scales));
                let steps = if block.steps.is_empty() { 0 } else { push(&mut words, little_endian(block.steps)) };
                let record = BlockRecord { width: shape.width, lanes, rows: shape.rows, weights, scales, steps };
                blocks.extend(record.emit()?);
            }
            let blocks = Records { count: blocks.len() / h::BLOCK_WORDS, offset: push(&mut words, blocks) };
            let Matrix { rows, cols, group, x_max, .. } = matrix;
            records.extend(MatrixRecord { rows, cols, group, x_max, blocks }.emit()?);
        }
        let records = push(&mut words, records) as usize;
        let work = image.ops().map(|op| work_words(&op, core)).max().unwrap_or(0);
        Ok(Self { words, records, work })
    }

    /// Returns the words of the whole image, without length and checksum.
    fn image(self, image: &Image<'_>, old: &[u32]) -> Result<Vec<u32>> {
        let old_records = old[h::W_MATRICES] as usize;
        let after = old_records + h::MATRIX_WORDS * image.matrices().count();
        // The sections after the matrices move by this much.
        let moved = (self.words.len() as u32).wrapping_sub(after as u32);
        let mut words = self.words;
        words[..h::WORDS].copy_from_slice(&old[..h::WORDS]);
        words.extend(&old[after..]);
        let move_offset = |word: &mut u32| {
            if *word as usize >= after {
                *word = word.wrapping_add(moved);
            }
        };
        words[h::W_MATRICES] = self.records as u32;
        for at in [h::W_OPS, h::W_CONTRACT, h::W_SELF_TEST, h::W_NAME] {
            move_offset(&mut words[at]);
        }
        let ops = words[h::W_OPS] as usize;
        for record in words[ops..].as_chunks_mut::<{ h::OP_WORDS }>().0.iter_mut().take(image.ops().count()) {
            if (record[0] & 0xff) as u8 == op::LINEAR {
                move_offset(&mut record[2]);
                record[3] = (record[3] as usize - old_records + self.records) as u32;
            } else {
                move_offset(&mut record[3]);
            }
        }
        let ports = image.ports().count();
        if ports > 0 {
            let steps = image.self_test_steps() * (image.obs_len() + image.act_len());
            let records = words[h::W_SELF_TEST] as usize + steps + 1;
            for record in words[records..].as_chunks_mut::<{ Port::WORDS }>().0.iter_mut().take(ports) {
                record[3..].iter_mut().for_each(move_offset);
            }
        }
        let work = image.work();
        let scratch = work.offset + self.work;
        ensure!(
            scratch <= usize::from(u16::MAX),
            "the image needs {scratch} words of scratch memory for this core, but at most 65535 are supported"
        );
        words[h::W_SCRATCH] = scratch as u32;
        words[h::W_WORK_FLAGS] = words[h::W_WORK_FLAGS] & 0xffff_0000 | self.work as u32;
        Ok(words)
    }
}

/// Returns the words of the work area that an operation needs in the layouts of `core`.
fn work_words(op: &Op<'_>, core: Core) -> usize {
    // Attention needs as much on every core.
    let attention = if op.kind == OpKind::Attend { op.cache().work_words() } else { 0 };
    let Some(matrix) = op.matrix() else { return attention };
    let in_place = matches!(op.kind, OpKind::Linear { in_place: true, .. });
    let lanes = core.lanes(matrix.x_max, matrix.group);
    let of_block = |block: RowBlock<'_>| {
        let plan = Plan::new(BlockShape { lanes, ..block.block.shape() })?;
        Some(match lanes {
            Lanes::Scalar | Lanes::Helium => plan.work(matrix.cols) - if in_place { plan.words() } else { 0 },
            Lanes::Single | Lanes::Paired if in_place => 0,
            Lanes::Single | Lanes::Paired => max_prepared_words(matrix.cols, matrix.group, lanes),
        })
    };
    matrix.blocks().filter_map(of_block).max().unwrap_or(0)
}

/// Returns the codes and the group scales of a block, row-major.
pub(super) fn unpacked(rows: &RowBlock<'_>) -> (Vec<u8>, Vec<u8>) {
    let (block, shape) = (&rows.block, rows.block.shape());
    let places = || (0..shape.rows).flat_map(|row| (0..shape.cols).map(move |col| (row, col)));
    let codes = places().map(|(row, col)| block.code(row, col)).collect();
    let scales = match shape.group {
        0 => Vec::new(),
        group => places().filter(|(_, col)| col % group == 0).map(|(row, col)| block.group_scale(row, col)).collect(),
    };
    (codes, scales)
}

/// Appends words and returns their offset.
fn push(words: &mut Vec<u32>, more: impl IntoIterator<Item = u32>) -> u32 {
    let offset = words.len() as u32;
    words.extend(more);
    offset
}

/// Returns the values of words in the image's order.
fn little_endian(words: &[u32]) -> impl Iterator<Item = u32> {
    words.iter().map(|word| u32::from_le(*word))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An image with every kind of section.
    const VALID: &[u8] = include_bytes!("../../../../kernels/tests/valid.actq");

    #[test]
    fn there_and_back_are_the_same_bytes() -> Result<()> {
        for (_, core) in Core::ALL {
            let packed = repack(VALID, core)?;
            assert_eq!(packed == VALID, core.has_default_layouts(), "{core:?}");
            assert_eq!(repack(&packed, core)?, packed, "{core:?}");
            assert_eq!(repack(&packed, Core::M4f)?, VALID, "{core:?}");
        }
        Ok(())
    }

    #[test]
    fn codes_scales_and_outputs_stay() -> Result<()> {
        for (core, lanes, feature) in [(Core::M3, Lanes::Scalar, "scalar"), (Core::M55, Lanes::Helium, "helium")] {
            stay_on(core, lanes, feature)?;
        }
        Ok(())
    }

    fn stay_on(core: Core, lanes: Lanes, feature: &str) -> Result<()> {
        let packed = repack(VALID, core)?;
        let buffers = [ImageBuffer::new(VALID), ImageBuffer::new(&packed)];
        let [old, new] = [0, 1].map(|i| Image::new_checked(buffers[i].bytes()).expect("the image is valid"));
        assert!(new.features().any(|needed| needed == feature));
        let mut rows = 0;
        for (old, new) in old.matrices().zip(new.matrices()) {
            for (old, new) in old.blocks().zip(new.blocks()) {
                let shape = old.block.shape();
                let is_int8 = new.block.shape().lanes == lanes;
                assert_eq!(BlockShape { lanes: shape.lanes, ..new.block.shape() }, shape);
                assert!(is_int8 || new.block.words() == old.block.words());
                let at = |block: &actq_kernels::Block<'_>, i: usize| {
                    let (row, col) = (i / shape.cols, i % shape.cols);
                    (block.code(row, col), block.group_scale(row, col))
                };
                for i in 0..shape.rows * shape.cols {
                    assert_eq!(at(&old.block, i), at(&new.block, i));
                }
                assert_eq!((old.scales, old.steps), (new.scales, new.steps));
                rows += shape.rows;
            }
        }
        assert!(rows > 0);
        Ok(())
    }

    #[test]
    fn what_is_not_an_image_is_refused() {
        assert!(repack(&VALID[..VALID.len() - 4], Core::M3).is_err());
    }
}
