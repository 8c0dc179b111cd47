//! Making the image of a cell.

use std::collections::BTreeMap;
use std::path::Path;
use std::time::Instant;

use actq::budget::{Budget, BudgetTooSmall};
use actq::data::{Dataset, Recording, Recordings};
use actq::measure::eval;
use actq::methods::{Method, Options};
use actq::pipeline::Quantizer;
use actq::policy::Policy;
use actq_kernels::layout::GROUPS;
use anyhow::{Context as _, Result};

use super::cell::Made;
use super::plan::{Contender, Plan};

/// A policy as the methods take it.
pub(super) struct Subject {
    pub(super) policy: Policy,
    recordings: Recordings,
}

/// What became of a cell.
pub(super) enum Attempt {
    /// An image, and its figures.
    Made(Vec<u8>, Made),
    /// None, and why.
    Impossible(String),
}

impl Subject {
    pub(super) fn load(folder: &Path) -> Result<Self> {
        let policy = Policy::load(folder)?;
        let mut recordings = Recordings::load(&policy)?;
        let heldout = recordings.heldout.as_mut().with_context(|| Recording::Heldout.missing("a comparison"))?;
        if heldout.action.is_none() {
            heldout.fill_actions(&policy.graph);
        }
        Ok(Self { policy, recordings })
    }

    fn heldout(&self) -> Result<&Dataset> {
        self.recordings.heldout.as_ref().with_context(|| Recording::Heldout.missing("a comparison"))
    }
}

/// The methods made ready for a policy, each when it is first asked for.
pub(super) struct Maker<'a> {
    subject: &'a Subject,
    plan: &'a Plan,
    ready: BTreeMap<String, (Quantizer<'a>, f64)>,
}

impl<'a> Maker<'a> {
    pub(super) fn new(subject: &'a Subject, plan: &'a Plan) -> Self {
        Self { subject, plan, ready: BTreeMap::new() }
    }

    /// Makes the image of a cell. `progress` gets what is being done and the share of it that is done.
    ///
    /// The method's default group counts. Only where it does not fit the budget, the others are tried, and of those that fit the one
    /// with the lowest held-out error is taken: the choice on what errors are measured on is in the method's favour.
    pub(super) fn make(
        &mut self,
        contender: Contender,
        budget: f64,
        mut progress: impl FnMut(&str, f64),
    ) -> Result<Attempt> {
        let method = contender.method();
        let preparing = self.prepare(method, &mut progress)?;
        let default = method.default_group();
        let first = self.with_group(contender, budget, default, preparing, &mut progress)?;
        let too_small = match first {
            Ok(made) => return Ok(made),
            Err(too_small) => too_small,
        };
        let mut least = (too_small, default);
        let mut best: Option<(Vec<u8>, Made)> = None;
        for group in GROUPS.into_iter().chain([0]).filter(|group| *group != default) {
            match self.with_group(contender, budget, group, preparing, &mut progress)? {
                Ok(Attempt::Made(image, made)) if best.as_ref().is_none_or(|(_, best)| made.nmse < best.nmse) => {
                    best = Some((image, made));
                }
                Ok(_) => {}
                Err(too_small) if too_small.bytes < least.0.bytes => least = (too_small, group),
                Err(_) => {}
            }
        }
        Ok(match best {
            Some((image, made)) => Attempt::Made(image, made),
            None => {
                let (BudgetTooSmall { bytes, weights, .. }, group) = least;
                Attempt::Impossible(format!(
                    "the least is {:.3} bits per weight, {}",
                    8.0 * bytes as f64 / weights.max(1) as f64,
                    scales(group)
                ))
            }
        })
    }

    /// Seconds that the statistics of a method take, which are collected once.
    fn prepare(&mut self, method: Method, progress: &mut impl FnMut(&str, f64)) -> Result<f64> {
        if let Some((_, seconds)) = self.ready.get(&method.to_string()) {
            return Ok(*seconds);
        }
        let begun = Instant::now();
        let Subject { policy, recordings } = self.subject;
        let quantizer = Quantizer::new(policy, recordings, method, |share| progress("calibrating", share))?;
        let seconds = begun.elapsed().as_secs_f64();
        self.ready.insert(method.to_string(), (quantizer, seconds));
        Ok(seconds)
    }

    fn with_group(
        &self,
        contender: Contender,
        budget: f64,
        group: usize,
        preparing: f64,
        progress: &mut impl FnMut(&str, f64),
    ) -> Result<Result<Attempt, BudgetTooSmall>> {
        let method = contender.method();
        let steps = if contender == Contender::BestNotLearned { Some(0) } else { self.plan.steps };
        let plain = Options::new(method, Budget::BitsPerWeight(budget));
        let options = Options { group, steps, seed: self.plan.seed, ..plain };
        let begun = Instant::now();
        let (quantizer, _) = self.ready.get(&method.to_string()).context("the method was not made ready")?;
        let quantized = match quantizer.quantize(&options, progress) {
            Ok(quantized) => quantized,
            Err(error) => return error.downcast::<BudgetTooSmall>().map(Err),
        };
        let seconds = preparing + begun.elapsed().as_secs_f64();
        let report = eval::evaluate(quantized.buffer().image(Path::new("image in memory"))?, self.subject.heldout()?)?;
        let made = Made {
            nmse: report.nmse,
            bpw: report.bpw,
            bytes: report.bytes,
            bytes_per_parameter: report.bytes as f64 / self.subject.policy.graph.parameters().max(1) as f64,
            group: Some(group),
            default_group: group == method.default_group(),
            seconds,
        };
        Ok(Ok(Attempt::Made(quantized.image, made)))
    }
}

/// A group for people.
fn scales(group: usize) -> String {
    match group {
        0 => "with one scale a row".to_owned(),
        _ => format!("with groups of {group}"),
    }
}
