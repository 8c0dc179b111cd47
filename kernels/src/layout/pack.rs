//! The packer.

use core::fmt;

use super::block::BlockShape;
use super::format::Format;
use super::table::with_format;

/// Why [`pack`] refused its arguments.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum PackError {
    /// The shape is not valid ([`BlockShape::is_valid`]).
    Shape,
    /// The number of codes is not that of the shape.
    Codes {
        /// Codes of the shape.
        expected: usize,
        /// Codes given.
        given: usize,
    },
    /// The number of group scales is not that of the shape.
    Scales {
        /// Scales of the shape.
        expected: usize,
        /// Scales given.
        given: usize,
    },
    /// The output's length is not that of the packed block.
    Words {
        /// Words of the packed block.
        expected: usize,
        /// Words given.
        given: usize,
    },
}

impl fmt::Display for PackError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Shape => f.write_str("the block's shape is not valid"),
            Self::Codes { expected, given } => write!(f, "the block has {expected} codes; {given} were given"),
            Self::Scales { expected, given } => write!(f, "the block has {expected} group scales; {given} were given"),
            Self::Words { expected, given } => write!(f, "the packed block has {expected} words; {given} were given"),
        }
    }
}

impl core::error::Error for PackError {}

/// Packs a block.
///
/// `codes` is row-major, `rows * cols`; `scales` is row-major, `rows * groups()` (empty without groups); `out` holds
/// exactly [`BlockShape::words`] words and is overwritten.
///
/// # Errors
///
/// [`PackError`] if the shape is not valid or a slice has another length; `out` keeps its words.
pub fn pack(shape: BlockShape, codes: &[u8], scales: &[u8], out: &mut [u32]) -> Result<(), PackError> {
    if !shape.is_valid() {
        return Err(PackError::Shape);
    }
    let fits = |given: usize, expected: usize| if given == expected { Ok(()) } else { Err((expected, given)) };
    fits(codes.len(), shape.rows * shape.cols).map_err(|(expected, given)| PackError::Codes { expected, given })?;
    fits(scales.len(), shape.rows * shape.groups())
        .map_err(|(expected, given)| PackError::Scales { expected, given })?;
    fits(out.len(), shape.words()).map_err(|(expected, given)| PackError::Words { expected, given })?;
    out.fill(0);
    with_format!(shape, pack_codes::<_>(shape, codes, out));
    if shape.groups() > 0 {
        for (row, row_scales) in scales.chunks_exact(shape.groups()).enumerate() {
            for (group, &scale) in row_scales.iter().enumerate() {
                let (at, bit) = shape.scale_at(row, group);
                out[at] |= (scale as u32) << bit;
            }
        }
    }
    for word in out.iter_mut() {
        *word = word.to_le();
    }
    Ok(())
}

fn pack_codes<F: Format>(shape: BlockShape, codes: &[u8], out: &mut [u32]) {
    for first_row in (0..shape.padded_rows()).step_by(F::CELL.rows) {
        for unit in 0..shape.units() {
            // Padding has code 0, too; its field is not always zero.
            let mut words = [0u32; 3];
            for row in 0..F::CELL.rows {
                for col in 0..F::CELL.cols {
                    let at = unit * F::CELL.cols + col;
                    let code = if at < shape.cols { codes.get((first_row + row) * shape.cols + at) } else { None };
                    F::insert(&mut words, row, col, code.copied().unwrap_or(0));
                }
            }
            let (at, step) = shape.cell_at(first_row, unit);
            for (k, &word) in words.iter().enumerate().take(F::CELL.words) {
                out[at + k * step] = word;
            }
        }
    }
}
