//! Operands and the hash of results, for `src/bin/functions.rs` on the target and
//! `host-tests/tests/all/on_target/functions.rs` on the host.

/// Number of elements.
pub const LEN: usize = 256;

/// Values near or outside f32's range, subnormal numbers, and zeros.
pub const EXTREMES: [f32; 13] =
    [f32::MAX, f32::MIN, 1e38, -1e38, 1.0, -1.0, f32::INFINITY, f32::NEG_INFINITY, f32::NAN, 1e-40, -1e-40, 0.0, -0.0];

/// A denoising step.
#[derive(Debug)]
pub struct Denoised {
    /// Name of the case.
    pub name: &'static str,
    /// Factor of the limited sample; 0 for a step without a limit.
    pub sample: f32,
    /// Limit of the sample.
    pub limit: f32,
    /// `true` if noise is added.
    pub noise: bool,
}

/// Steps with limits that affect none, half and all of [`values`].
pub const DENOISED: [Denoised; 8] = [
    Denoised { name: "denoise", sample: 0.0, limit: f32::INFINITY, noise: false },
    Denoised { name: "denoise with noise", sample: 0.0, limit: f32::INFINITY, noise: true },
    Denoised { name: "denoise, none limited", sample: 0.4, limit: 4.0, noise: false },
    Denoised { name: "denoise, half limited", sample: 0.4, limit: 1.8, noise: false },
    Denoised { name: "denoise, all limited", sample: 0.4, limit: 0.001, noise: false },
    Denoised { name: "denoise with noise, none", sample: 0.4, limit: 4.0, noise: true },
    Denoised { name: "denoise with noise, half", sample: 0.4, limit: 1.8, noise: true },
    Denoised { name: "denoise with noise, all", sample: 0.4, limit: 0.001, noise: true },
];

impl Denoised {
    /// Returns the step's coefficients in the image's order, with the shares of iterate and output in the sample.
    pub fn coefficients(&self, x: f32, v: f32) -> [f32; 7] {
        [x * self.sample, v * self.sample, 0.6, 0.2, self.sample, 0.1, 0.3]
    }
}

/// Returns values from -6 to 0, for which no function takes a shortcut.
pub fn values<const N: usize>() -> [f32; N] {
    core::array::from_fn(|i| i as f32 * (6.0 / N as f32) - 6.0)
}

/// Returns values of all magnitudes with both signs.
pub fn magnitudes<const N: usize>() -> [f32; N] {
    core::array::from_fn(|i| f32::from_bits(((i as u32) << 31) | (i as u32 * (0x7f80_0000 / N as u32))))
}

/// Returns a hash of all results' bits; all NaNs count as one value.
pub fn hash(results: &[&[f32]]) -> u32 {
    let bits = |v: &f32| if v.is_nan() { f32::NAN.to_bits() } else { v.to_bits() };
    results.iter().copied().flatten().map(bits).fold(0, |hash: u32, bits| hash.rotate_left(5) ^ bits)
}
