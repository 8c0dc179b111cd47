//! The quantizer of every layout.

use crate::layout::{Lanes, Width, XLayout, layout};

macro_rules! quantize_kernels {
    ($($name:ident)*) => {
        /// A quantizer: it writes `groups` groups of `chunks` column chunks, the first of `first` times eight values
        /// and the others of `eights` times eight. `group` is 0 for a single group, whose sum, if any, has a word of
        /// its own.
        pub(super) type Quantize = unsafe extern "C" fn(
            inverse: f32, round: f32, x: *const f32, out: *mut u32,
            groups: usize, chunks: usize, first: usize, eights: usize, bias: i32, factor: i32, second_factor: i32, group: usize,
        );

        unsafe extern "C" {
            $(fn $name(
                inverse: f32, round: f32, x: *const f32, out: *mut u32,
                groups: usize, chunks: usize, first: usize, eights: usize, bias: i32, factor: i32, second_factor: i32, group: usize,
            );)*
        }
    };
}
quantize_kernels!(actq_quantize0 actq_quantize1 actq_quantize2 actq_quantize3);

/// Quantizers by the shift of the layout's activations.
static QUANTIZERS: [Quantize; 4] = {
    let all: [Quantize; 4] = [actq_quantize0, actq_quantize1, actq_quantize2, actq_quantize3];
    // No layout of the build has the other shifts: their entries are a quantizer that it needs anyway.
    let mut quantizers = [all[shift_from(0)]; 4];
    let mut shift = 0;
    while shift < quantizers.len() {
        if shift_from(shift) == shift {
            quantizers[shift] = all[shift];
        }
        shift += 1;
    }
    quantizers
};

/// Returns the least shift, from `least` on, of a layout of this build; 0 if there is none.
const fn shift_from(least: usize) -> usize {
    let (mut found, mut i) = (usize::MAX, 0);
    while i < Width::ALL.len() * Lanes::DSP.len() {
        let (width, lanes) = (Width::ALL[i / Lanes::DSP.len()], Lanes::DSP[i % Lanes::DSP.len()]);
        let shift = layout(width, lanes).x.shift as usize;
        if width.is_built() && lanes.is_built() && shift >= least && shift < found {
            found = shift;
        }
        i += 1;
    }
    if found == usize::MAX { 0 } else { found }
}

/// Returns the quantizer for a layout with this shift.
#[inline(always)]
pub(super) fn quantizer(shift: u8) -> Quantize {
    QUANTIZERS[shift as usize % QUANTIZERS.len()]
}

/// Returns `true` if that quantizer suits the layout: it writes two start words, the second without a bias, at shift 1;
/// sums from shift 2 on, those of pairs at 2; chunks of eight columns at 3.
const fn suits(x: &XLayout) -> bool {
    let &XLayout { shift, chunk, start_words, starts: [_, second], sum, pairs, .. } = x;
    let starts = start_words == if shift == 1 { 2 } else { 1 } && second.bias == 0;
    let chunks = (chunk == 8) == (shift == 3) && chunk % 8 == 0;
    (shift as usize) < QUANTIZERS.len() && starts && chunks && sum == (shift >= 2) && pairs == (shift == 2)
}

const _: () = {
    let mut i = 0;
    while i < Width::ALL.len() * Lanes::DSP.len() {
        assert!(suits(&layout(Width::ALL[i / Lanes::DSP.len()], Lanes::DSP[i % Lanes::DSP.len()]).x));
        i += 1;
    }
};
