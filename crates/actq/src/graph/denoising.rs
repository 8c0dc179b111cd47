//! The denoising steps of an iterative head, from noise to its output.

use actq_kernels::ops::denoise::{Coefficients, denoise};
use ndarray::{Array2, ArrayView2, s};

/// Denoising steps of a flow or a diffusion policy. The network reads the iterate by a node
/// [`Iterate`](super::ops::Iterate); a step makes the next iterate of its last value.
#[derive(Clone, Debug)]
pub struct Denoising {
    /// First node that every step runs; the nodes before it depend on the observation alone.
    pub first: usize,
    /// Values of the iterate.
    pub len: usize,
    /// Largest magnitude of the predicted sample, or of the value in its place; may be infinite.
    pub limit: f32,
    /// Coefficients of each step.
    pub steps: Vec<Coefficients>,
}

/// The iterate, and the value that the network reads of it.
#[derive(Clone, Debug)]
pub(super) struct Iterates {
    pub(super) x: Array2<f32>,
    pub(super) y: Array2<f32>,
}

impl Denoising {
    /// Returns the noise values of an evaluation: the first iterate and, if steps add noise, that of each step.
    pub fn noise_len(&self) -> usize {
        let draws = if self.draws() { 1 + self.steps.len() } else { 1 };
        self.len * draws
    }

    /// Returns `true` if steps add noise.
    pub fn draws(&self) -> bool {
        self.steps.iter().any(|by| by.sigma != 0.0)
    }

    /// Returns the iterates before the first step.
    pub(super) fn start(&self, noise: ArrayView2<'_, f32>) -> Iterates {
        let x = noise.slice(s![.., ..self.len]).to_owned();
        Iterates { y: x.clone(), x }
    }

    /// Returns the iterates after `step`, in which the network gave `v`: as [`actq_kernels::ops::denoise`].
    pub(super) fn next(&self, step: usize, at: &Iterates, v: &Array2<f32>, noise: ArrayView2<'_, f32>) -> Iterates {
        let by = &self.steps[step];
        let mut x: Vec<f32> = at.x.iter().copied().collect();
        let (mut y, v) = (vec![0.0; x.len()], v.iter().copied().collect::<Vec<f32>>());
        let drawn = if by.sigma == 0.0 { 0..0 } else { (1 + step) * self.len..(2 + step) * self.len };
        let z: Vec<f32> = noise.slice(s![.., drawn]).iter().copied().collect();
        denoise(by, self.limit, &v, &z, &mut x, &mut y);
        let array = |values| Array2::from_shape_vec(at.x.raw_dim(), values).unwrap_or_default();
        Iterates { x: array(x), y: array(y) }
    }

    /// Backpropagates through a step. From the derivatives by the iterate and the network's input after it, it computes
    /// those by the iterate before it and by the network's output.
    pub(super) fn back(&self, step: usize, at: &Iterates, v: &Array2<f32>, d: Iterates) -> (Array2<f32>, Array2<f32>) {
        let by = &self.steps[step];
        let mut dx = d.x + &d.y;
        let mut dv = d.y * by.ahead;
        for ((dx, dv), (x, v)) in dx.iter_mut().zip(&mut dv).zip(at.x.iter().zip(v)) {
            let within = (by.sample_x * x + by.sample_v * v).abs() <= self.limit;
            let by_sample = if within { by.sample * *dx } else { 0.0 };
            *dv += by.direct * *dx + by.sample_v * by_sample;
            *dx = by.keep * *dx + by.sample_x * by_sample;
        }
        (dx, dv)
    }
}
