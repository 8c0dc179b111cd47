//! The receiver of a pipeline's progress.

/// A receiver of progress. Every closure `FnMut(&str, f64)` is one, and `()` ignores all progress.
pub trait Watch {
    /// Receives the present work and the share of it that is done, from 0 to 1.
    fn progress(&mut self, work: &str, share: f64);
}

impl<F: FnMut(&str, f64)> Watch for F {
    fn progress(&mut self, work: &str, share: f64) {
        self(work, share);
    }
}

impl Watch for () {
    fn progress(&mut self, _: &str, _: f64) {}
}
