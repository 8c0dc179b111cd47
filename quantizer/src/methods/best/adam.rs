//! Adam (arXiv 1412.6980).

/// Adam's moments of a run of parameters.
#[derive(Debug, Default)]
pub(super) struct Adam {
    first: Vec<f32>,
    second: Vec<f32>,
}

impl Adam {
    /// Moves `parameters` along `grads` at `rate`; `t` counts from 1.
    pub(super) fn step<'p>(
        &mut self,
        parameters: impl Iterator<Item = &'p mut f32>,
        grads: impl Iterator<Item = f32>,
        rate: f32,
        t: i32,
    ) {
        const FIRST: f32 = 0.9;
        const SECOND: f32 = 0.999;
        let (c1, c2) = (1.0 / (1.0 - FIRST.powi(t)), 1.0 / (1.0 - SECOND.powi(t)));
        for (i, (p, g)) in parameters.zip(grads).enumerate() {
            if i == self.first.len() {
                self.first.push(0.0);
                self.second.push(0.0);
            }
            let (m, v) = (&mut self.first[i], &mut self.second[i]);
            *m = FIRST * *m + (1.0 - FIRST) * g;
            *v = SECOND * *v + (1.0 - SECOND) * g * g;
            *p -= rate * *m * c1 / ((*v * c2).sqrt() + 1e-12);
        }
    }
}
