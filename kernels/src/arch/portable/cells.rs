//! The recurrent cells of `ops::cells`.

use core::ops::Range;

use crate::math::exp2::{exp_fraction, tanh_fraction};
use crate::math::{Native, Real, sigmoid};

/// Computes some elements of an LSTM cell (`ops::cells`). It does nothing if a length does not fit.
#[inline(never)]
pub fn lstm_elements(elements: Range<usize>, gates: &[f32], c: &mut [f32], h: &mut [f32]) {
    let _ = lstm(elements, gates, c, h);
}

fn lstm(elements: Range<usize>, gates: &[f32], c: &mut [f32], h: &mut [f32]) -> Option<()> {
    let (i, gates) = gates.split_at_checked(h.len())?;
    let (f, gates) = gates.split_at_checked(h.len())?;
    let (g, o) = gates.split_at_checked(h.len())?;
    let of = |gate| <[f32]>::get(gate, elements.clone());
    let rows = of(i)?.iter().zip(of(f)?).zip(of(g)?).zip(of(o)?);
    let (c, h) = (c.get_mut(elements.clone())?, h.get_mut(elements.clone())?);
    for ((c, h), (((i, f), g), o)) in c.iter_mut().zip(h).zip(rows) {
        let [i, f, g, o] = [i, f, g, o].map(|gate| Native::of(*gate));
        let new = sigmoid(f) * Native::of(*c) + i.gate(g);
        *c = new.get();
        *h = o.gate(new).get();
    }
    Some(())
}

/// Computes some elements of a GRU cell (`ops::cells`). It does nothing if a length does not fit.
#[inline(never)]
pub fn gru_elements(elements: Range<usize>, a: &[f32], b: &[f32], h: &mut [f32]) {
    let _ = gru(elements, a, b, h);
}

fn gru(elements: Range<usize>, a: &[f32], b: &[f32], h: &mut [f32]) -> Option<()> {
    let of = |gate| <[f32]>::get(gate, elements.clone());
    let (ar, az_an) = a.split_at_checked(h.len())?;
    let (az, an) = az_an.split_at_checked(h.len())?;
    let (br, bz_bn) = b.split_at_checked(h.len())?;
    let (bz, bn) = bz_bn.split_at_checked(h.len())?;
    let input = of(ar)?.iter().zip(of(az)?).zip(of(an)?);
    let hidden = of(br)?.iter().zip(of(bz)?).zip(of(bn)?);
    let h = h.get_mut(elements.clone())?;
    for (h, (((ar, az), an), ((br, bz), bn))) in h.iter_mut().zip(input.zip(hidden)) {
        let [ar, az, an, br, bz, bn] = [ar, az, an, br, bz, bn].map(|gate| Native::of(*gate));
        let r = sigmoid(ar + br);
        // z = keep / (keep + renew), 1 - z = renew / (keep + renew).
        let (keep, renew) = exp_fraction(az + bz);
        let (n, d) = tanh_fraction(an + r * bn);
        *h = ((renew * n + keep * Native::of(*h) * d) / ((keep + renew) * d)).get();
    }
    Some(())
}
