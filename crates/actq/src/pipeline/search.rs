//! Finds the smallest budget whose measured error stays within a limit.
//!
//! Budgets are multiples of a tenth of a bit per weight. Each try is a whole quantization whose image is run by the
//! executor. A method that learns first looks with an eighth of the steps, at most `LOOKS` times. From the budget found
//! in this way, it continues with all its steps. The returned image has kept the limit with all its steps. The search
//! stops when the next smaller budget is known to fail, or after `TRIES` tries (`PLAIN_TRIES` without learning, or with
//! too few steps to share). Errors are measured on a held-out recording, or on parts of the calibration recording that are
//! held out in turn. After that many tries, a smaller budget may still pass, and the tries show which range is open.
//! The search assumes that errors fall with bits.

use std::borrow::Cow;
use std::path::Path;

use actq_kernels::Width;
use actq_kernels::cost::Core;

use super::quantizer::{QuantizedPolicy, Quantizer};
use super::tries::{Search, Try};
use super::watch::Watch;
use crate::budget::Rate;
use crate::data::{Dataset, Recording, Recordings};
use crate::error::{Context, Error, Result};
use crate::measure::eval;
use crate::measure::time::{CLOCK, StepTime};
use crate::methods::{self, Method, Options, Outcome, Progress};
use crate::policy::Policy;
use crate::text::count;

/// Budgets per bit.
const PER_BIT: usize = 10;
/// Most tries with a share of the steps, and the divisor of that share.
const LOOKS: usize = 6;
const SHARE: usize = 8;
/// Most tries with all steps.
const TRIES: usize = 5;
/// Most tries of a method that does not learn.
const PLAIN_TRIES: usize = 16;
/// First budget, in bits.
const START: usize = 3;
/// Expected fall of the error's logarithm per bit if nothing is known: rounding to half the step.
const SLOPE: f64 = 2.0 * std::f64::consts::LN_2;

/// Returns the recording that errors are measured on: the held-out recording, else the one that the method learns from.
/// The f32 network fills in missing actions.
fn measured<'a>(policy: &Policy, recordings: &'a Recordings) -> Result<Cow<'a, Dataset>> {
    let dataset = recordings.heldout.as_ref().or(recordings.calib.as_ref());
    let mut dataset = Cow::Borrowed(dataset.with_context(|| Recording::Heldout.missing("a limit to the error"))?);
    if dataset.action.is_none() {
        dataset.to_mut().fill_actions(&policy.graph);
    }
    Ok(dataset)
}

/// Makes the image of the smallest budget whose error (NMSE) is at most `limit`; `options.budget` is ignored.
/// `watch` receives the present work and the share of it that is done.
pub(super) fn smallest(
    quantizer: &Quantizer<'_>,
    options: &Options,
    limit: f64,
    watch: &mut impl Watch,
) -> Result<QuantizedPolicy> {
    let dataset = measured(quantizer.policy, quantizer.recordings)?;
    let top = top(quantizer.policy, options)?;
    let all_steps = quantizer.method.most_steps(options);
    let share = if quantizer.recordings.heldout.is_some() { 1.0 } else { 0.5 };
    let (tries, found) = (Vec::new(), None);
    let mut attempts = Attempts { quantizer, options, limit, dataset: &dataset, all_steps, share, tries, found };
    let few = all_steps / SHARE;
    let mut search = |first: usize, most_tries: usize, steps: usize| {
        narrow(first, top, most_tries, limit, |cell| attempts.run(cell, steps, watch))
    };
    let fails = if few > 0 {
        let looked = search(START * PER_BIT, LOOKS, few)?;
        search(looked.passes.map_or(top, |p| p.0), TRIES, all_steps)?.fails.0
    } else {
        search(START * PER_BIT, PLAIN_TRIES, all_steps)?.fails.0
    };
    let Attempts { tries, found, .. } = attempts;
    let Some((quantized, nmse, budget)) = found else { return Err(nothing_found(&tries, limit, top)) };
    let search = Search {
        limit,
        nmse,
        budget,
        step: 1.0 / PER_BIT as f64,
        fails: fails as f64 / PER_BIT as f64,
        tries,
        measured_on: match &quantized.held_out {
            Some(held_out) => {
                format!("{} of {} that it did not learn from", count(held_out.report.steps, "frame"), dataset.name())
            }
            None => dataset.name().into_owned(),
        },
        held_out: quantizer.recordings.heldout.is_some()
            || quantized.held_out.is_some()
            || options.method == Method::Rtn,
    };
    Ok(QuantizedPolicy { search: Some(search), ..quantized })
}

/// The tries of a search, and the last image that has kept the limit with all steps.
struct Attempts<'a, 'q> {
    quantizer: &'a Quantizer<'q>,
    options: &'a Options,
    limit: f64,
    dataset: &'a Dataset,
    all_steps: usize,
    /// Share of a try that makes its image; the rest measures it on held-out parts.
    share: f64,
    tries: Vec<Try>,
    /// The image with its error and its budget.
    found: Option<(QuantizedPolicy, f64, f64)>,
}

impl Attempts<'_, '_> {
    /// Quantizes with the budget of a cell. Returns the error; infinite if the budget is too small.
    fn run(&mut self, cell: usize, steps: usize, watch: &mut impl Watch) -> Result<f64> {
        let budget = cell as f64 / PER_BIT as f64;
        let options = Options { steps: Some(steps), ..self.options.clone() };
        let work = format!("try {}: {budget} bits per weight", self.tries.len() + 1);
        let mut progress = |state: Progress| watch.progress(&work, self.share * state.share());
        let measured = match self.quantizer.at(Rate::BitsPerWeight(budget), &options, &mut progress) {
            Err(error) if error.budget().is_some() => None,
            Err(error) => return Err(error),
            Ok(quantized) => {
                let buffer = quantized.buffer();
                let image = buffer.image(Path::new("image in memory"))?;
                let milliseconds = StepTime::new(&image, Core::M4f, CLOCK).milliseconds;
                let watch = |share: f64| watch.progress(&work, 0.5 + 0.5 * share);
                let held_out = self.quantizer.held_out_error(&quantized, &options, watch)?;
                let report = match &held_out {
                    Some(held_out) => held_out.report.clone(),
                    None => eval::evaluate(image, self.dataset)?,
                };
                if report.nmse <= self.limit && steps == self.all_steps {
                    self.found = Some((QuantizedPolicy { held_out, ..quantized }, report.nmse, budget));
                }
                Some((report, milliseconds))
            }
        };
        let (report, milliseconds) = measured.unzip();
        let error = report.as_ref().map_or(f64::INFINITY, |r| r.nmse);
        self.tries.push(Try { budget, steps, report, milliseconds });
        Ok(error)
    }
}

/// Returns the error of a search in which no image has kept the limit.
fn nothing_found(tries: &[Try], limit: f64, top: usize) -> Error {
    let reports = tries.iter().filter_map(|t| t.report.as_ref());
    let Some(best) = reports.min_by(|a, b| a.nmse.total_cmp(&b.nmse)) else {
        return Error::input("no budget of the search gave an image");
    };
    Error::input(format!(
        "no budget up to {} bits per weight (8 bits and all scales) keeps the error within {limit}; the lowest NMSE was \
         {:.2e} at {:.3} bits per weight",
        top as f64 / PER_BIT as f64,
        best.nmse,
        best.bpw
    ))
}

/// Returns the first budget with room for 8 bits everywhere, in steps of the search.
fn top(policy: &Policy, options: &Options) -> Result<usize> {
    let plain = Options { method: Method::Rtn, relative: false, forced: Vec::new(), ..options.clone() };
    let (_, outcomes) = methods::quantize(&policy.graph, None, Rate::Width(Width::W8), &plain)?;
    let bytes: usize = outcomes.iter().map(Outcome::bytes).sum();
    Ok((PER_BIT * 8 * bytes).div_ceil(policy.graph.weights().max(1)))
}

/// Range of the smallest budget: the largest cell known to fail and the smallest known to pass, with errors.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Range {
    fails: (usize, f64),
    passes: Option<(usize, f64)>,
}

impl Range {
    /// Returns `true` if no cell up to `top` is left to try in between.
    fn is_closed(&self, top: usize) -> bool {
        self.fails.0 + 1 > self.passes.map_or(top, |p| p.0 - 1)
    }

    /// Predicts where the limit is reached: on the line through the logarithms of both errors, or from the only known
    /// one along [`SLOPE`].
    fn guess(&self, limit: f64) -> f64 {
        let (low, low_error) = (self.fails.0 as f64, libm::log(self.fails.1.max(1e-300)));
        let limit = libm::log(limit);
        let slope = SLOPE / PER_BIT as f64;
        match self.passes {
            None => low + (low_error - limit) / slope,
            Some((high, error)) => {
                let (high, high_error) = (high as f64, libm::log(error.max(1e-300)));
                if low_error.is_finite() {
                    low + (high - low) * (low_error - limit) / (low_error - high_error)
                } else {
                    high - (limit - high_error) / slope
                }
            }
        }
    }
}

/// Narrows the range of cells 1 to `top` with at most `runs` calls of `error`, the first at `first`. It tries
/// predictions, and halves the range where they converge slowly. If nothing has passed, the last run is at `top`.
fn narrow(
    first: usize,
    top: usize,
    runs: usize,
    limit: f64,
    mut error: impl FnMut(usize) -> Result<f64>,
) -> Result<Range> {
    let mut range = Range { fails: (0, f64::INFINITY), passes: None };
    let mut cell = first.clamp(1, top);
    for run in 1..=runs {
        let found = error(cell)?;
        if found <= limit {
            range.passes = Some((cell, found));
        } else {
            range.fails = (cell, found);
        }
        if range.is_closed(top) {
            break;
        }
        let (from, to) = (range.fails.0 + 1, range.passes.map_or(top, |p| p.0 - 1));
        let halve = run % 2 == 0 && range.passes.is_some() && range.fails.0 > 0;
        cell = match range.passes {
            None if run + 1 == runs => top,
            _ if halve => from.midpoint(to),
            // The least image and the limit itself give no slope.
            _ => range.guess(limit).clamp(from as f64, to as f64).round() as usize,
        };
    }
    Ok(range)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Narrows for an error that is quartered per bit from `at_zero` on, and returns the range and the tried cells.
    fn search(at_zero: f64, least: usize, runs: usize, limit: f64) -> (Range, Vec<usize>) {
        let mut cells = Vec::new();
        let range = narrow(30, 83, runs, limit, |cell| {
            cells.push(cell);
            Ok(if cell < least { f64::INFINITY } else { at_zero * (-0.12 * cell as f64).exp() })
        });
        (range.expect("no run fails"), cells)
    }

    #[test]
    fn the_smallest_cell_is_found_without_repeated_tries() {
        for limit in [1e-4, 1e-3, 0.013, 0.1, 0.5, 2.0] {
            for least in [1, 12, 20] {
                let (range, cells) = search(1.0, least, 16, limit);
                let passing = |cell: &usize| *cell >= least && (-0.12 * *cell as f64).exp() <= limit;
                assert_eq!(
                    range.passes.map(|p| p.0),
                    (1..=83).find(passing),
                    "limit {limit}, least {least}: {cells:?}"
                );
                assert!(cells.iter().all(|c| (1..=83).contains(c)));
                let mut once = cells.clone();
                once.sort_unstable();
                once.dedup();
                assert_eq!(once.len(), cells.len(), "{cells:?}");
            }
        }
    }

    #[test]
    fn few_runs_leave_a_range_with_the_answer() {
        let (range, cells) = search(1.0, 1, 3, 0.01);
        assert_eq!(cells.len(), 3);
        let answer = (1..=83).find(|c| (-0.12 * f64::from(*c)).exp() <= 0.01).map(|c| c as usize);
        assert!(answer > Some(range.fails.0) && range.passes.is_none_or(|p| answer <= Some(p.0)));
    }

    #[test]
    fn hopeless_limits_are_tried_at_the_top() {
        for runs in [1, 2, 4, 6] {
            let (range, cells) = search(1e9, 1, runs, 1e-3);
            assert_eq!(range.passes, None);
            assert!(runs == 1 || cells.last() == Some(&83), "{cells:?}");
        }
    }
}
