//! The record of a search for the fewest bits.

use crate::measure::eval::ErrorReport;

/// One quantization of a search.
#[derive(Clone, Debug)]
pub struct Try {
    /// Allowed bits per weight.
    pub budget: f64,
    /// Steps of distillation.
    pub steps: usize,
    /// Errors and true bits per weight; `None` if the budget is too small for any image.
    pub report: Option<ErrorReport>,
    /// Predicted milliseconds of a step at the default [`CLOCK`](crate::measure::time::CLOCK).
    pub milliseconds: Option<f64>,
}

/// Result of a search.
#[derive(Clone, Debug)]
pub struct Search {
    /// Largest allowed error (NMSE).
    pub limit: f64,
    /// Error of the returned image (NMSE).
    pub nmse: f64,
    /// Its budget, in bits per weight.
    pub budget: f64,
    /// Distance of two budgets, in bits per weight.
    pub step: f64,
    /// Largest budget that is known to fail with all steps; 0 if none is.
    pub fails: f64,
    /// All tries in order.
    pub tries: Vec<Try>,
    /// File that errors were measured on.
    pub measured_on: String,
    /// `true` if the method has not learned from it.
    pub held_out: bool,
}
