//! llama.cpp's K-quants and IQ2_XS, simulated: the weights that a matrix has in them, at their true bits.
//!
//! This module computes only the weights that codes and scales represent, not the bytes in llama.cpp's order. A
//! super-block is 256 weights of a row. IQ2_XS has a file of its own. Of a K-quant it has sub-blocks of 16 or 32. A
//! weight is `d * scale * code - d_min * min`, where d and d_min are f16, and scale and min small integers of the
//! sub-block. Scales and mins are fitted by least squares, weighted by importance. The fit takes candidates for the
//! clipping point, then the neighbours of the rounded scales, then d and d_min for the chosen codes.

mod fit;
mod lattice;

use std::fmt;

use half::f16;

/// Weights of a super-block.
const SUPER_BLOCK: usize = 256;

/// A format.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// Eight weights as a point of a grid, with signs, and 4-bit scales.
    Iq2Xs,
    /// 2-bit codes with 4-bit scales and mins.
    Q2K,
    /// 3-bit codes around zero with 6-bit scales.
    Q3K,
    /// 4-bit codes with 6-bit scales and mins.
    Q4K,
    /// 6-bit codes around zero with 8-bit scales.
    Q6K,
}

/// The layout of a super-block.
#[derive(Clone, Copy, Debug)]
struct Layout {
    /// Bits per code.
    bits: u32,
    /// Weights per sub-block.
    sub_block: usize,
    /// Bits of a sub-block's scale, and of its min.
    scale_bits: u32,
    /// `true` with mins. Codes and scales are then at least 0; otherwise they are signed.
    mins: bool,
}

impl Layout {
    fn integers(self, bits: u32) -> (i32, i32) {
        if self.mins { (0, (1 << bits) - 1) } else { (-(1 << (bits - 1)), (1 << (bits - 1)) - 1) }
    }

    fn codes(self) -> (i32, i32) {
        self.integers(self.bits)
    }

    fn scales(self) -> (i32, i32) {
        self.integers(self.scale_bits)
    }
}

impl Format {
    /// From few bits to many.
    pub const ALL: [Self; 5] = [Self::Iq2Xs, Self::Q2K, Self::Q3K, Self::Q4K, Self::Q6K];
    /// The K-quants, from few bits to many.
    pub const K_QUANTS: [Self; 4] = [Self::Q2K, Self::Q3K, Self::Q4K, Self::Q6K];

    /// Returns the layout of a K-quant.
    const fn layout(self) -> Option<Layout> {
        let (bits, sub_block, scale_bits, mins) = match self {
            Self::Iq2Xs => return None,
            Self::Q2K => (2, 16, 4, true),
            Self::Q3K => (3, 16, 6, false),
            Self::Q4K => (4, 32, 6, true),
            Self::Q6K => (6, 16, 8, false),
        };
        Some(Layout { bits, sub_block, scale_bits, mins })
    }

    /// Returns the bits of a code. Those of a grid's point and its signs are 16 for 8 weights.
    pub fn bits(self) -> u32 {
        self.layout().map_or(2, |layout| layout.bits)
    }

    /// Returns the bits per weight in a whole super-block, everything counted.
    pub fn bits_per_weight(self) -> f64 {
        let Some(Layout { bits, sub_block, scale_bits, mins }) = self.layout() else { return lattice::BITS_PER_WEIGHT };
        // A scale, or a scale and a min; and the f16 of each.
        let kinds = if mins { 2 } else { 1 };
        let scales = kinds * (scale_bits * (SUPER_BLOCK / sub_block) as u32 + 16);
        f64::from(bits) + f64::from(scales) / SUPER_BLOCK as f64
    }

    /// Returns the bytes of this many weights. llama.cpp would pad rows that do not fill super-blocks; here the padding
    /// is not counted.
    pub fn bytes(self, weights: usize) -> usize {
        (self.bits_per_weight() * weights as f64 / 8.0).ceil() as usize
    }

    /// Returns the weights that codes and scales of a matrix represent. `importance` has an entry per weight.
    pub fn rounded(self, weights: &[f32], cols: usize, importance: &[f64]) -> Vec<f32> {
        let rows = weights.chunks(cols.max(1)).zip(importance.chunks(cols.max(1)));
        let blocks = rows.flat_map(|(w, h)| w.chunks(SUPER_BLOCK).zip(h.chunks(SUPER_BLOCK)));
        let layout = self.layout();
        let block = |(w, h): (&[f32], &[f64])| {
            layout.map_or_else(|| lattice::rounded(w, h), |layout| Block::fit(layout, w, h).weights())
        };
        blocks.flat_map(block).collect()
    }
}

impl fmt::Display for Format {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Iq2Xs => f.write_str("IQ2_XS"),
            _ => write!(f, "Q{}_K", self.bits()),
        }
    }
}

/// A super-block; the last of a row may be short, as if the missing weights were zeros of no importance.
struct Block {
    layout: Layout,
    d: f16,
    d_min: f16,
    /// One per sub-block.
    scales: Vec<i32>,
    mins: Vec<i32>,
    codes: Vec<i32>,
}

/// Rounds of choosing integers and then d and d_min.
const ROUNDS: usize = 2;

impl Block {
    fn fit(layout: Layout, weights: &[f32], importance: &[f64]) -> Self {
        let sub_blocks = || weights.chunks(layout.sub_block).zip(importance.chunks(layout.sub_block));
        let fitted: Vec<(f64, f64)> = sub_blocks()
            .map(|(w, h)| {
                if layout.mins { fit::affine(w, h, layout.codes().1) } else { (fit::linear(w, h, layout.codes()), 0.0) }
            })
            .collect();
        // The largest integer goes to the largest magnitude; with signs that is a negative one.
        let (low, high) = layout.scales();
        let extreme = f64::from(if low.abs() > high { low } else { high });
        let largest = fitted.iter().map(|(s, _)| *s).fold(0.0, |m: f64, s| if s.abs() > m.abs() { s } else { m });
        let largest_min = fitted.iter().map(|(_, m)| *m).fold(0.0, f64::max);
        let mut block = Self {
            layout,
            d: f16::from_f64(largest / extreme),
            d_min: f16::from_f64(largest_min / extreme),
            scales: Vec::new(),
            mins: Vec::new(),
            codes: Vec::new(),
        };
        let over = |value: f64, unit: f16| if unit == f16::ZERO { 0 } else { (value / unit.to_f64()).round() as i32 };
        block.scales = fitted.iter().map(|(s, _)| over(*s, block.d).clamp(low, high)).collect();
        block.mins = fitted.iter().map(|(_, m)| over(*m, block.d_min).clamp(0, high)).collect();
        for _ in 0..ROUNDS {
            block.choose_integers(weights, importance);
            block.refit(weights, importance);
        }
        block
    }

    /// Chooses for every sub-block the scale and min, next to the present ones, and their codes, that come nearest to
    /// the weights.
    fn choose_integers(&mut self, weights: &[f32], importance: &[f64]) {
        let (low, high) = self.layout.scales();
        let size = self.layout.sub_block;
        self.codes.clear();
        for (i, (w, h)) in weights.chunks(size).zip(importance.chunks(size)).enumerate() {
            let near = |at: i32, low: i32| (at - 1).max(low)..=(at + 1).min(high);
            let mins = if self.layout.mins { near(self.mins[i], 0) } else { 0..=0 };
            let tries = near(self.scales[i], low).flat_map(|scale| mins.clone().map(move |min| (scale, min)));
            let measured = tries.map(|(scale, min)| {
                let (s, m) = (self.d.to_f64() * f64::from(scale), self.d_min.to_f64() * f64::from(min));
                let (codes, error) = fit::codes(w, h, (s, m), self.layout.codes());
                (error, scale, min, codes)
            });
            if let Some((_, scale, min, codes)) = measured.min_by(|a, b| a.0.total_cmp(&b.0)) {
                (self.scales[i], self.mins[i]) = (scale, min);
                self.codes.extend(codes);
            }
        }
    }

    /// Fits d and d_min by least squares to the present integers, if that is still better in f16.
    fn refit(&mut self, weights: &[f32], importance: &[f64]) {
        let size = self.layout.sub_block;
        let terms = (0..weights.len()).map(|i| fit::Term {
            importance: importance[i],
            weight: f64::from(weights[i]),
            a: f64::from(self.scales[i / size] * self.codes[i]),
            b: f64::from(self.mins[i / size]),
        });
        let (d, d_min) = fit::least_squares(terms);
        let known = (self.d, self.d_min);
        let before = self.error(weights, importance);
        (self.d, self.d_min) = (f16::from_f64(d), f16::from_f64(d_min));
        let after = self.error(weights, importance);
        // Also if the new values are not finite.
        if after.is_nan() || after > before {
            (self.d, self.d_min) = known;
        }
    }

    fn error(&self, weights: &[f32], importance: &[f64]) -> f64 {
        fit::error(weights, &self.weights(), importance)
    }

    fn weights(&self) -> Vec<f32> {
        let size = self.layout.sub_block;
        let (d, d_min) = (self.d.to_f32(), self.d_min.to_f32());
        let weight =
            |(i, &code): (usize, &i32)| d * (self.scales[i / size] * code) as f32 - d_min * self.mins[i / size] as f32;
        self.codes.iter().enumerate().map(weight).collect()
    }
}

#[cfg(test)]
mod tests {
    use actq::graph::WeightMatrix;
    use actq::methods::scale;
    use actq::random::Random;
    use actq_kernels::layout::Width;

    use super::fit::error;
    use super::*;

    #[test]
    fn bits_per_weight_match_the_formats() {
        assert_eq!(Format::ALL.map(Format::bits_per_weight), [2.3125, 2.625, 3.4375, 4.5, 6.5625]);
        assert_eq!(Format::ALL.map(|format| format.bytes(256)), [74, 84, 110, 144, 210]);
        assert_eq!(Format::Q2K.bytes(1), 1, "part of a byte is a byte");
        assert_eq!(Format::Q4K.to_string(), "Q4_K");
        assert_eq!(Format::Iq2Xs.to_string(), "IQ2_XS");
    }

    #[test]
    fn integers_fit_their_bits_even_in_short_blocks() {
        let mut random = Random::new(1);
        for (format, layout) in Format::K_QUANTS.into_iter().filter_map(|format| Some((format, format.layout()?))) {
            for len in [256, 100, 1] {
                let weights: Vec<f32> = (0..len).map(|_| random.normal()).collect();
                let block = Block::fit(layout, &weights, &vec![1.0; len]);
                let within = |values: &[i32], (low, high): (i32, i32)| values.iter().all(|v| (low..=high).contains(v));
                assert!(within(&block.codes, layout.codes()), "{format}");
                assert!(within(&block.scales, layout.scales()), "{format}");
                assert!(within(&block.mins, layout.scales()), "{format}");
                assert_eq!(block.weights().len(), len);
            }
        }
    }

    #[test]
    fn representable_weights_are_recovered() {
        for (format, layout) in Format::K_QUANTS.into_iter().filter_map(|format| Some((format, format.layout()?))) {
            let ((low, high), (_, top)) = (layout.codes(), layout.scales());
            let d_min = if layout.mins { 0.25 } else { 0.0 };
            let block = Block {
                layout,
                d: f16::from_f64(0.5),
                d_min: f16::from_f64(d_min),
                scales: (0..256 / layout.sub_block).map(|i| top - (i as i32 % 3)).collect(),
                mins: (0..256 / layout.sub_block).map(|i| if layout.mins { top - (i as i32 % 2) } else { 0 }).collect(),
                codes: (0..256).map(|i| low + i % (high - low + 1)).collect(),
            };
            let weights = block.weights();
            let rounded = format.rounded(&weights, 256, &[1.0; 256]);
            let energy = error(&weights, &[0.0; 256], &[1.0; 256]);
            let off = error(&weights, &rounded, &[1.0; 256]) / energy;
            assert!(off < 5e-5, "{format}: {off:e}");
            // Nothing is lost the second time.
            let again = error(&rounded, &format.rounded(&rounded, 256, &[1.0; 256]), &[1.0; 256]) / energy;
            assert!(again < 5e-5, "{format}: {again:e}");
        }
    }

    #[test]
    fn more_bits_or_importance_reduce_the_error() {
        let mut random = Random::new(2);
        let weights: Vec<f32> = (0..4 * 300).map(|_| random.normal()).collect();
        let equal = vec![1.0; weights.len()];
        let uneven: Vec<f64> = (0..weights.len()).map(|i| if i % 3 == 0 { 1.0 } else { 1e-3 }).collect();
        let mut last = f64::INFINITY;
        for format in Format::ALL {
            let plain = format.rounded(&weights, 300, &equal);
            let found = error(&weights, &plain, &equal);
            // Q2_K has only 0.3 bits more than IQ2_XS.
            let share = if format == Format::Q2K { 1.0 } else { 0.5 };
            assert!(found < share * last, "{format}: {found} after {last}");
            last = found;
            let weighed = error(&weights, &format.rounded(&weights, 300, &uneven), &uneven);
            assert!(weighed < error(&weights, &plain, &uneven), "{format}");
            assert!(format.rounded(&[0.0; 300], 300, &[1.0; 300]).iter().all(|w| *w == 0.0));
        }
    }
    #[test]
    fn iq2_xs_nears_the_bound_on_gaussian_weights() {
        let mut random = Random::new(3);
        let weights: Vec<f32> = (0..64 * 256).map(|_| random.normal()).collect();
        let equal = vec![1.0; weights.len()];
        let energy = error(&weights, &vec![0.0; weights.len()], &equal);
        let relative = |rounded: &[f32]| error(&weights, rounded, &equal) / energy;
        let near = |found: f64, documented: f64| (found - documented).abs() < 5e-4;
        let found = relative(&Format::Iq2Xs.rounded(&weights, 256, &equal));
        // No code of these bits has less error: the Gaussian source's distortion at this rate.
        let bound = (-2.0 * Format::Iq2Xs.bits_per_weight()).exp2();
        assert!(near(found, 0.081) && near(bound, 0.041), "{found} with a bound of {bound}");
        // Round to nearest with 2 bits, a u8 scale for 32 columns and a bf16 scale for the row: the same bits.
        let matrix = WeightMatrix { name: "w".into(), rows: 64, cols: 256, data: weights.clone() };
        let rtn = relative(&scale::round_to_nearest(&matrix, Width::W2, 32).dequantized());
        assert!(near(rtn, 0.104), "{rtn}");
        // With 0.3 bits more.
        let q2_k = relative(&Format::Q2K.rounded(&weights, 256, &equal));
        assert!(near(q2_k, 0.066), "{q2_k}");
    }
}
