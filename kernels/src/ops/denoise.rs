//! The step of an iterative head: from the network's output to the next iterate.

use crate::arch;
use crate::image::header::COEFFICIENTS;

/// Coefficients of one denoising step, as they stand in the image. With the iterate `x`, the network's output `v`,
/// noise `z` and a limit, the next iterate and what the network reads next are
///
/// ```text
/// s  = clamp(sample_x * x + sample_v * v, ±limit)
/// x' = keep * x + direct * v + sample * s + sigma * z
/// y  = x' + ahead * v
/// ```
///
/// each from left to right. So all of these are one operation: Euler's and the midpoint method of a flow (Lipman et
/// al., Flow matching, arXiv 2210.02747), DDPM (Ho et al., arXiv 2006.11239, equation 11) and DDIM (Song et al., arXiv
/// 2010.02502, equation 12) with their predictions of noise, sample or velocity, where `s` is the predicted sample.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Coefficients {
    /// The iterate's share in the predicted sample.
    pub sample_x: f32,
    /// The output's share in it.
    pub sample_v: f32,
    /// The iterate's share in the next.
    pub keep: f32,
    /// The output's.
    pub direct: f32,
    /// The predicted sample's.
    pub sample: f32,
    /// The noise's; where it is not 0, `ahead` is 0.
    pub sigma: f32,
    /// How far the network reads ahead of the iterate.
    pub ahead: f32,
}

impl Coefficients {
    /// From numbers in the order of the fields.
    pub fn from_array([sample_x, sample_v, keep, direct, sample, sigma, ahead]: [f32; COEFFICIENTS]) -> Self {
        Self { sample_x, sample_v, keep, direct, sample, sigma, ahead }
    }

    /// The numbers in the order of the fields.
    pub fn to_array(self) -> [f32; COEFFICIENTS] {
        let Self { sample_x, sample_v, keep, direct, sample, sigma, ahead } = self;
        [sample_x, sample_v, keep, direct, sample, sigma, ahead]
    }
}

/// The iterate `x` and the network's input `y` after its output `v`, with noise `z` or, where that is empty, without.
/// Where `v` is not finite, neither are they: a limit hides that a value has left f32's range, and the other terms show
/// it. As far as all go.
#[inline(never)]
pub fn denoise(by: &Coefficients, limit: f32, v: &[f32], z: &[f32], x: &mut [f32], y: &mut [f32]) {
    arch::denoise(&by.to_array(), limit, v, z, x, y);
}
