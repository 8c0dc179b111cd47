//! The elementwise parts of recurrent cells. The matrix products are ordinary linear operations of the image.

#[cfg(actq_fpu)]
pub(crate) use crate::armv7em::{gru_elements, lstm_elements};
#[cfg(not(actq_fpu))]
pub(crate) use portable::{gru_elements, lstm_elements};

/// One LSTM cell in torch's gate order: `gates = [i | f | g | o]`, each of the length of `h` and `c`.
/// `c = sigmoid(f) * c + sigmoid(i) * tanh(g)`, `h = sigmoid(o) * tanh(c)`. Nothing is done where a length does not fit.
pub fn lstm_cell(gates: &[f32], c: &mut [f32], h: &mut [f32]) {
    lstm_elements(0..h.len(), gates, c, h);
}

/// One GRU cell in torch's gate order: `a = W_ih x + b_ih`, `b = W_hh h + b_hh`, each `[r | z | n]`.
/// `h = (1 - z) * tanh(a_n + r * b_n) + z * h` with `r = sigmoid(a_r + b_r)`, `z = sigmoid(a_z + b_z)`. Nothing is done where a
/// length does not fit.
pub fn gru_cell(a: &[f32], b: &[f32], h: &mut [f32]) {
    gru_elements(0..h.len(), a, b, h);
}

/// Cells without the assembler, for some of the elements.
#[cfg(not(actq_fpu))]
mod portable {
    use core::ops::Range;

    use crate::math::{exp_fraction, sigmoid, tanh_fraction};

    /// `sigmoid(gate) * tanh(x)`, by one division.
    #[inline(always)]
    fn gated(gate: f32, x: f32) -> f32 {
        let (on, off) = exp_fraction(gate);
        let (n, d) = tanh_fraction(x);
        (on * n) / ((on + off) * d)
    }

    #[inline(never)]
    pub(crate) fn lstm_elements(elements: Range<usize>, gates: &[f32], c: &mut [f32], h: &mut [f32]) -> Option<()> {
        let (i, gates) = gates.split_at_checked(h.len())?;
        let (f, gates) = gates.split_at_checked(h.len())?;
        let (g, o) = gates.split_at_checked(h.len())?;
        let of = |gate| <[f32]>::get(gate, elements.clone());
        let rows = of(i)?.iter().zip(of(f)?).zip(of(g)?).zip(of(o)?);
        let (c, h) = (c.get_mut(elements.clone())?, h.get_mut(elements.clone())?);
        for ((c, h), (((i, f), g), o)) in c.iter_mut().zip(h).zip(rows) {
            *c = sigmoid(*f) * *c + gated(*i, *g);
            *h = gated(*o, *c);
        }
        Some(())
    }

    #[inline(never)]
    pub(crate) fn gru_elements(elements: Range<usize>, a: &[f32], b: &[f32], h: &mut [f32]) -> Option<()> {
        let of = |gate| <[f32]>::get(gate, elements.clone());
        let (ar, az_an) = a.split_at_checked(h.len())?;
        let (az, an) = az_an.split_at_checked(h.len())?;
        let (br, bz_bn) = b.split_at_checked(h.len())?;
        let (bz, bn) = bz_bn.split_at_checked(h.len())?;
        let input = of(ar)?.iter().zip(of(az)?).zip(of(an)?);
        let hidden = of(br)?.iter().zip(of(bz)?).zip(of(bn)?);
        let h = h.get_mut(elements.clone())?;
        for (h, (((ar, az), an), ((br, bz), bn))) in h.iter_mut().zip(input.zip(hidden)) {
            let r = sigmoid(*ar + *br);
            // z = keep / (keep + renew), 1 - z = renew / (keep + renew).
            let (keep, renew) = exp_fraction(*az + *bz);
            let (n, d) = tanh_fraction(*an + r * *bn);
            *h = (renew * n + keep * *h * d) / ((keep + renew) * d);
        }
        Some(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gates_of_every_magnitude_keep_the_state_small() {
        for bits in (0..0x7f00_0000u32).step_by(4001) {
            for x in [f32::from_bits(bits), -f32::from_bits(bits)] {
                let (mut c, mut h) = ([0.5], [0.5]);
                lstm_cell(&[x; 4], &mut c, &mut h);
                assert!(c[0].abs() <= 1.5 && h[0].abs() <= 1.0, "{x}: {c:?} {h:?}");
                gru_cell(&[x; 3], &[0.5 * x; 3], &mut h);
                assert!(h[0].abs() <= 1.0, "{x}: {h:?}");
            }
        }
    }
}
