//! What a search for the fewest bits has tried.

use crate::measure::eval::ErrorReport;

/// One quantization.
#[derive(Clone, Debug)]
pub struct Try {
    /// Bits per weight that were allowed.
    pub budget: f64,
    /// Steps of distillation.
    pub steps: usize,
    /// Errors and true bits per weight; `None` where the budget is too small for any image.
    pub report: Option<ErrorReport>,
}

/// What a search found.
#[derive(Clone, Debug)]
pub struct Search {
    /// The largest error that was allowed (NMSE).
    pub limit: f64,
    /// The error that was found.
    pub nmse: f64,
    /// The budget, in bits per weight.
    pub budget: f64,
    /// The distance of two budgets.
    pub step: f64,
    /// The largest budget that is known to fail with all steps; 0 where none is.
    pub fails: f64,
    /// Everything that was tried, in order.
    pub tries: Vec<Try>,
    /// The file that errors were measured on.
    pub measured_on: String,
    /// Whether the method has not seen it.
    pub held_out: bool,
}
