//! The step of an iterative head: from the network's output to the next iterate.

use crate::image::header::COEFFICIENTS;
use crate::math::clamp;

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
/// Where `v` is not finite, neither are they. As far as all go.
#[inline(never)]
pub fn denoise(by: &Coefficients, limit: f32, v: &[f32], z: &[f32], x: &mut [f32], y: &mut [f32]) {
    let &Coefficients { sample_x, sample_v, keep, direct, sample, sigma, ahead } = by;
    let straight = |v, x| keep * x + direct * v;
    // A limit hides that a value has left f32's range; the other terms show it.
    let limited = |v, x| straight(v, x) + sample * clamp(sample_x * x + sample_v * v, -limit, limit);
    let look = |x, v| [x, x + ahead * v];
    let stir = |x, z| {
        let x = x + sigma * z;
        [x, x]
    };
    // A loop for each, in which nothing is left to choose.
    match (sample_x == 0.0 && sample_v == 0.0, z.is_empty()) {
        (true, true) => each(v, v, x, y, |v, _, x| look(straight(v, x), v)),
        (true, false) => in_eights(v, z, x, y, |v, z, x| stir(straight(v, x), z)),
        (false, true) => each(v, v, x, y, |v, _, x| look(limited(v, x), v)),
        (false, false) => each(v, z, x, y, |v, z, x| stir(limited(v, x), z)),
    }
}

/// Sets x and y to what they become of the output, the noise and x.
#[inline(always)]
fn each(v: &[f32], z: &[f32], x: &mut [f32], y: &mut [f32], of: impl Fn(f32, f32, f32) -> [f32; 2]) {
    for ((x, y), (v, z)) in x.iter_mut().zip(y).zip(v.iter().zip(z)) {
        [*x, *y] = of(*v, *z, *x);
    }
}

/// As [`each`], eight elements in a pass: with three operands to count up, a pass costs more.
#[inline(always)]
fn in_eights(v: &[f32], z: &[f32], x: &mut [f32], y: &mut [f32], of: impl Fn(f32, f32, f32) -> [f32; 2]) {
    let len = x.len().min(y.len()).min(v.len()).min(z.len());
    let ((v, vs), (z, zs)) = (v[..len].as_rchunks::<8>(), z[..len].as_rchunks::<8>());
    let ((x, xs), (y, ys)) = (x[..len].as_rchunks_mut::<8>(), y[..len].as_rchunks_mut::<8>());
    each(v, z, x, y, &of);
    for ((x, y), (v, z)) in xs.iter_mut().zip(ys).zip(vs.iter().zip(zs)) {
        [x[0], y[0]] = of(v[0], z[0], x[0]);
        [x[1], y[1]] = of(v[1], z[1], x[1]);
        [x[2], y[2]] = of(v[2], z[2], x[2]);
        [x[3], y[3]] = of(v[3], z[3], x[3]);
        [x[4], y[4]] = of(v[4], z[4], x[4]);
        [x[5], y[5]] = of(v[5], z[5], x[5]);
        [x[6], y[6]] = of(v[6], z[6], x[6]);
        [x[7], y[7]] = of(v[7], z[7], x[7]);
    }
}
