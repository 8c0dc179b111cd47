//! The packer.

use super::block::BlockShape;
use super::format::Format;
use super::table::with_format;

/// Packs a block.
///
/// `codes` is row-major, `rows * cols`; `scales` is row-major, `rows * groups()` (empty without groups); `out` holds
/// exactly [`BlockShape::words`] words and is overwritten. Returns `None` where a length or the shape does not fit.
pub fn pack(shape: BlockShape, codes: &[u8], scales: &[u8], out: &mut [u32]) -> Option<()> {
    if !shape.is_valid()
        || codes.len() != shape.rows * shape.cols
        || scales.len() != shape.rows * shape.groups()
        || out.len() != shape.words()
    {
        return None;
    }
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
    Some(())
}

fn pack_codes<F: Format>(shape: BlockShape, codes: &[u8], out: &mut [u32]) {
    for first_row in (0..shape.padded_rows()).step_by(F::CELL.rows) {
        for unit in 0..shape.units() {
            // Padding has code 0, too, which is not always a field of zeros.
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
