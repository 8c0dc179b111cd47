//! Records of operations, to read and to write, and the data that they name.

use core::ops::Range;

#[cfg(feature = "attention")]
use super::header::Words;
use super::header::{self as h, MATRIX_WORDS, OP_WORDS};
use super::matrix::{Matrix, matrix};
use super::op::{Around, FORMS, Form, IS_PARTIAL, OpKind, UNKNOWN};
use super::region::Region;
use super::view::Image;
use super::words::{TooLarge, halves};
use super::words::{high, low, record, section, word};
use crate::error::ImageError;
use crate::math::Function;

/// The fields of an operation's record, for a writer.
#[derive(Clone, Copy, Debug)]
pub struct OpRecord {
    /// Function of the operation.
    pub kind: OpKind,
    /// Arena region that it writes.
    pub dst: Region,
    /// Arena offset of the region that it reads; 0 if it reads none.
    pub src: usize,
    /// Arena offset of its third region; 0 for none and for a linear operation.
    pub third: usize,
    /// Offset of the biases of a linear operation; 0: none.
    pub bias: u32,
    /// Offset of the constants or of the matrix record; 0 for none.
    pub data: u32,
}

impl OpRecord {
    /// Returns the record's words, which [`Image::ops`] reads.
    ///
    /// # Errors
    ///
    /// [`TooLarge`] if a size does not fit its field.
    pub fn emit(&self) -> Result<[u32; OP_WORDS], TooLarge> {
        let code = self.kind.code();
        let detail = match self.kind {
            OpKind::Linear { accumulate, in_place } => u8::from(accumulate) | u8::from(in_place) << 1,
            OpKind::Normalize { added } => added.into(),
            OpKind::Function(function) => function as u8,
            _ => 0,
        };
        let head = halves(usize::from(code) | usize::from(detail) << 8, self.dst.len)?;
        Ok([head, halves(self.dst.offset, self.src)?, self.bias | halves(0, self.third)?, self.data])
    }
}

/// An operation of an image.
#[derive(Clone, Copy, Debug)]
pub struct Op<'a> {
    /// Function of the operation.
    pub kind: OpKind,
    /// [`Self::dst`], [`Self::src`], [`Self::third`].
    pub(crate) regions: [Region; 3],
    pub(super) record: &'a [u32; OP_WORDS],
    pub(super) form: &'static Form,
    /// The image's words.
    image: &'a [u32],
}

impl<'a> Op<'a> {
    /// Returns the region that it writes. Without [`Self::src`], it works in place.
    pub fn dst(&self) -> Region {
        self.regions[0]
    }

    /// Returns the region that it reads, or an empty one.
    pub fn src(&self) -> Region {
        self.regions[1]
    }

    /// Returns a recurrent cell's other region, the work area of a linear operation, or an empty region.
    pub fn third(&self) -> Region {
        self.regions[2]
    }

    /// Returns the words of [`Self::src`] before [`Self::dst`], or all if that does not begin among them: a linear operation
    /// that is `in_place` prepares its input there.
    pub(crate) fn input(&self) -> Region {
        let [dst, src, _] = self.regions;
        let before = dst.offset.wrapping_sub(src.offset);
        Region { len: before.min(src.len), ..src }
    }

    /// Returns the matrix of a linear operation.
    pub fn matrix(&self) -> Option<Matrix<'a>> {
        if self.is_linear() { self.linear_matrix().ok() } else { None }
    }

    /// Reads [`Self::matrix`] of a linear operation. (In a checked image there is no error.)
    pub(crate) fn linear_matrix(&self) -> Result<Matrix<'a>, ImageError> {
        matrix(self.image, self.data(), self.bias())
    }

    /// Returns the offset of the biases of a linear operation; 0: none.
    pub(super) fn bias(&self) -> usize {
        u32::from_le(self.record[2]) as usize
    }

    /// Returns single constant `i`: see [`OpKind`].
    pub fn constant(&self, i: usize) -> f32 {
        f32::from_bits(word(self.image, self.data().wrapping_add(i)))
    }

    /// Returns the single constants.
    pub fn constants(&self) -> impl Iterator<Item = f32> {
        (0..usize::from(self.form.uses.constants)).map(|i| self.constant(i))
    }

    /// Returns the coefficients of denoising step `step`, and the arena offset of its noise.
    pub fn coefficients(&self, step: usize) -> ([f32; h::COEFFICIENTS], usize) {
        let first = h::DENOISE_WORDS + step * h::COEFFICIENTS;
        let noise = word(self.image, self.data().wrapping_add(1)) as usize;
        (core::array::from_fn(|i| self.constant(first + i)), noise.wrapping_add(step * self.dst().len))
    }

    /// Returns array `i` of f32 bits, of the length of `dst`: see [`OpKind`].
    pub fn array(&self, i: usize) -> &'a [u32] {
        self.part(i, &(0..self.dst().len))
    }

    /// Returns the operation code.
    pub(crate) fn code(&self) -> u8 {
        self.form.code
    }

    /// Returns u16 `i` of the data of an operation around a network.
    pub(crate) fn half(&self, i: usize) -> usize {
        let word = word(self.image, self.data().wrapping_add(i / 2));
        if i.is_multiple_of(2) { low(word) } else { high(word) }
    }

    /// Returns the units that slices can cut the operation into: its elements, for each pass over them. A history also
    /// keeps those of the new frame. Attention is cut between the heads of tokens.
    pub(crate) fn units(&self) -> usize {
        #[cfg(feature = "attention")]
        if self.kind.is_attention() {
            let (len, dim) = match self.kind {
                OpKind::Rotary => (self.dst().len, self.rotated_heads()[1]),
                _ => (self.src().len, self.cache().dim),
            };
            // At least one, which a damaged image does not have: it fails.
            return len.checked_div(dim).unwrap_or(0).max(1);
        }
        let kept = if self.kind == OpKind::History { self.src().len } else { 0 };
        self.dst().len * usize::from(self.form.uses.passes) + kept
    }

    /// Returns a range of array `i`; empty if the image does not have it.
    pub(crate) fn part(&self, i: usize, range: &Range<usize>) -> &'a [u32] {
        let before = usize::from(self.form.uses.constants) + i * self.dst().len + range.start;
        section(self.image, self.data().wrapping_add(before), range.len()).unwrap_or_default()
    }

    /// Returns values of the data from word `i` on; empty if the image does not have them.
    #[cfg(feature = "attention")]
    pub(super) fn floats_at(&self, i: usize, len: usize) -> &'a [u32] {
        section(self.image, self.data().wrapping_add(i), len).unwrap_or_default()
    }

    /// Returns the offset of the constants or of the matrix record.
    pub(super) fn data(&self) -> usize {
        u32::from_le(self.record[3]) as usize
    }

    /// Returns `true` if the operation reads its destination.
    pub fn reads_dst(&self) -> bool {
        #[cfg(feature = "attention")]
        if self.kind == OpKind::Keep && self.is_ring() {
            return true;
        }
        self.form.uses.reads_dst || matches!(self.kind, OpKind::Linear { accumulate: true, .. })
    }

    /// Returns the arena region of the work area.
    #[cfg(feature = "attention")]
    pub(crate) fn work(&self) -> Region {
        let header = self.image.first_chunk().map(Words);
        header.map_or(Region::default(), |header| Region { offset: header.work(), len: header.work_len() })
    }

    pub(super) fn is_linear(&self) -> bool {
        matches!(self.kind, OpKind::Linear { .. })
    }
}

impl<'a> Image<'a> {
    writer_methods! {
        /// Returns the number of operations.
        fn op_count(&self) -> usize {
            self.header.op_count()
        }

        /// Iterates over the operations in order.
        fn ops(&self) -> impl Iterator<Item = Op<'a>> + use<'a> {
            let image = *self;
            (0..self.op_count()).filter_map(move |i| image.op(i).ok())
        }
    }

    /// Returns `true` if the image has operations or ports around its network: then firmware needs the crate's feature
    /// `around`.
    pub fn has_around(&self) -> bool {
        self.header.kind() >> 8 != 0
            || (0..self.op_count()).any(|i| self.op(i).is_ok_and(|op| op.kind.around().is_some()))
    }

    /// Returns the values of noise that an evaluation takes; 0 for a policy without noise.
    pub fn noise_len(&self) -> usize {
        self.noise().len
    }

    /// Returns the arena region of the noise, which the first operation fills; empty without noise.
    pub(crate) fn noise(&self) -> Region {
        self.op(0).ok().filter(|op| op.kind == OpKind::Noise).map_or(Region::default(), |op| op.dst())
    }

    /// Reads operation `i`; refuses an impossible record. (In a checked image every record parses.)
    pub(crate) fn op(&self, i: usize) -> Result<Op<'a>, ImageError> {
        let op = record(self.words, self.header.ops().wrapping_add(i * OP_WORDS))?;
        let [head, places, lengths, data] = op.map(u32::from_le);
        let (code, detail, len) = (head as u8, (head >> 8) as u8, high(head));
        let index = usize::from(code).wrapping_sub(1);
        let form = FORMS.get(index).ok_or(UNKNOWN)?;
        if IS_PARTIAL && !form.built {
            return Err(ImageError::LeftOut);
        }
        let mut src = len * usize::from(form.uses.src);
        let mut third = Region { offset: high(lengths), len: len * usize::from(form.uses.third) };
        let kind = match form.kind {
            OpKind::Linear { .. } => {
                (src, third) = (high(self.word(data as usize)), self.work());
                OpKind::Linear { accumulate: detail & 1 != 0, in_place: detail & 2 != 0 }
            }
            OpKind::Normalize { .. } => OpKind::Normalize { added: detail == 1 },
            OpKind::Function(_) => {
                let function = Function::from_code(detail).ok_or(UNKNOWN)?;
                if !function.is_built() {
                    return Err(ImageError::LeftOut);
                }
                OpKind::Function(function)
            }
            kind if kind.around().is_some_and(|kind| kind != Around::Clip) => {
                // Lengths in the data's first word: of a frame, or of all of `src`; of a history's slots.
                let sizes = self.word(data as usize);
                src = if src > 0 { low(sizes) } else { 0 };
                third.len = match kind {
                    OpKind::History => low(sizes) * high(sizes) + 1,
                    _ => usize::from(form.uses.third),
                };
                kind
            }
            kind => kind,
        };
        let dst = Region { offset: low(places), len };
        let src = Region { offset: high(places), len: src };
        let op = Op { kind, regions: [dst, src, third], record: op, form, image: self.words };
        #[cfg(feature = "attention")]
        let op = op.with_lengths();
        Ok(op)
    }

    /// Iterates over the matrices in the order of their records, without biases.
    #[cfg(feature = "writer")]
    pub fn matrices(&self) -> impl Iterator<Item = Matrix<'a>> + use<'a> {
        let image = *self;
        (0..self.matrix_count()).filter_map(move |i| matrix(image.words, image.matrix_at(i), 0).ok())
    }

    /// Returns the number of matrices.
    pub(super) fn matrix_count(&self) -> usize {
        self.header.matrix_count()
    }

    /// Returns the offset of matrix record `i`.
    pub(super) fn matrix_at(&self, i: usize) -> usize {
        self.header.matrices().wrapping_add(i * MATRIX_WORDS)
    }
}
