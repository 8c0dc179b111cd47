//! The elementwise parts of recurrent cells. The matrix products are ordinary linear operations of the image.

use crate::arch::{gru_elements, lstm_elements};

/// Computes an LSTM cell in torch's gate order: `gates = [i | f | g | o]`, each of the length of `h` and `c`.
/// `c = sigmoid(f) * c + sigmoid(i) * tanh(g)`, `h = sigmoid(o) * tanh(c)`. It does nothing if a length does not fit.
pub fn lstm_cell(gates: &[f32], c: &mut [f32], h: &mut [f32]) {
    lstm_elements(0..h.len(), gates, c, h);
}

/// Computes a GRU cell in torch's gate order: `a = W_ih x + b_ih`, `b = W_hh h + b_hh`, each `[r | z | n]`. `h = (1 -
/// z) * tanh(a_n + r * b_n) + z * h` with `r = sigmoid(a_r + b_r)`, `z = sigmoid(a_z + b_z)`. It does nothing if a
/// length does not fit.
pub fn gru_cell(a: &[f32], b: &[f32], h: &mut [f32]) {
    gru_elements(0..h.len(), a, b, h);
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
