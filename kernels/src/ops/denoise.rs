//! The denoising step of a flow or diffusion policy: from the network's output to the next iterate.

use crate::arch;
use crate::image::header::COEFFICIENTS;

/// Coefficients of one denoising step, as in the image. With the iterate `x`, the network's output `v`, noise `z` and a
/// limit, the next iterate `x'` and the network's next input `y` are
///
/// ```text
/// s  = clamp(sample_x * x + sample_v * v, ±limit)
/// x' = keep * x + direct * v + sample * s + sigma * z
/// y  = x' + ahead * v
/// ```
///
/// each from left to right, where `s` is the predicted sample. So one operation covers Euler's and the midpoint method
/// of a flow (Lipman et al., Flow matching, arXiv 2210.02747), DDPM (Ho et al., arXiv 2006.11239, equation 11) and DDIM
/// (Song et al., arXiv 2010.02502, equation 12), with predictions of noise, sample or velocity.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Coefficients {
    /// Coefficient of the iterate in the predicted sample.
    pub sample_x: f32,
    /// Coefficient of the output in the predicted sample.
    pub sample_v: f32,
    /// Coefficient of the iterate in the next iterate.
    pub keep: f32,
    /// Coefficient of the output in the next iterate.
    pub direct: f32,
    /// Coefficient of the predicted sample in the next iterate.
    pub sample: f32,
    /// Coefficient of the noise; if it is not 0, `ahead` is 0.
    pub sigma: f32,
    /// Coefficient of the output in the network's next input.
    pub ahead: f32,
}

impl Coefficients {
    /// Converts numbers in the order of the fields.
    pub fn from_array([sample_x, sample_v, keep, direct, sample, sigma, ahead]: [f32; COEFFICIENTS]) -> Self {
        Self { sample_x, sample_v, keep, direct, sample, sigma, ahead }
    }

    /// Returns the numbers in the order of the fields.
    pub fn to_array(self) -> [f32; COEFFICIENTS] {
        let Self { sample_x, sample_v, keep, direct, sample, sigma, ahead } = self;
        [sample_x, sample_v, keep, direct, sample, sigma, ahead]
    }
}

/// Updates the iterate `x` and the network's input `y` by its output `v`, with noise `z` unless that is empty, up to
/// the shortest length. If `v` is not finite, the results are not finite: a limit hides a value outside f32's range,
/// but the other terms do not.
#[inline(never)]
pub fn denoise(by: &Coefficients, limit: f32, v: &[f32], z: &[f32], x: &mut [f32], y: &mut [f32]) {
    arch::denoise(&by.to_array(), limit, v, z, x, y);
}
