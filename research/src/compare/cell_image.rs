//! Makes the image of a cell.

use std::collections::BTreeMap;
use std::path::Path;

use actq::budget::BudgetTooSmall;
use actq::data::{Dataset, Recording, Recordings};
use actq::graph::Graph;
use actq::measure::eval;
use actq::measure::time::{CLOCK, StepTime};
use actq::methods::{Options, Quantized};
use actq::pipeline::{QuantizedPolicy, Quantizer};
use actq::policy::Policy;
use actq_kernels::Width;
use actq_kernels::cost::Core;
use actq_kernels::layout::GROUPS;
use anyhow::{Context as _, Result};

use super::actquant_k;
use super::cell::Made;
use super::limits::Limit;
use super::plan::{Contender, Rival};
use crate::actquant::ActionStatistics;
use crate::kquants::Format;
use crate::pruned::pruned;
use crate::student::rival::{Settings, Teacher};
use crate::student::{form, student};

/// A policy and its recordings.
pub(super) struct Subject {
    policy: Policy,
    recordings: Recordings,
}

/// The outcome of a cell.
pub(super) enum Attempt {
    /// An image and its figures.
    Made(Vec<u8>, Made),
    /// A network without an image, and its figures.
    Simulated(Graph, Made),
    /// The figures of a network that nothing runs.
    Undriven(Made),
    /// Impossible, with the reason.
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

/// The methods prepared for a policy, each on first use.
pub(super) struct Maker<'a> {
    subject: &'a Subject,
    steps: Option<usize>,
    seed: u64,
    ready: BTreeMap<String, Quantizer<'a>>,
}

impl<'a> Maker<'a> {
    pub(super) fn new(subject: &'a Subject, steps: Option<usize>, seed: u64) -> Self {
        Self { subject, steps, seed, ready: BTreeMap::new() }
    }

    pub(super) fn policy(&self) -> &Policy {
        &self.subject.policy
    }

    /// Makes the image of a cell. `progress` gets the name of the current work and its finished share.
    ///
    /// Uses the method's default group. Only if it does not fit the budget, tries the other groups, and takes the one
    /// with the lowest held-out error: a choice in the method's favour.
    pub(super) fn make(
        &mut self,
        contender: Contender,
        budget: Limit,
        mut progress: impl FnMut(&str, f64),
    ) -> Result<Attempt> {
        self.prepare(contender, &mut progress)?;
        if let Some(rival) = contender.rival() {
            return self.rival((contender, rival), budget, &mut progress);
        }
        if contender.is_simulated() {
            return match budget {
                Limit::Bits(bits) => self.simulate(contender, bits),
                Limit::Flash { .. } | Limit::Time { .. } => {
                    Ok(Attempt::Impossible("a simulated format has no image; use bits per weight".to_owned()))
                }
            };
        }
        let default = contender.method().default_group();
        let first = self.with_group(contender, budget, default, &mut progress)?;
        let too_small = match first {
            Ok(made) => return Ok(made),
            Err(too_small) => too_small,
        };
        let mut least_of_all = (too_small, default);
        let mut best: Option<(Vec<u8>, Made)> = None;
        for group in GROUPS.into_iter().chain([0]).filter(|group| *group != default) {
            match self.with_group(contender, budget, group, &mut progress)? {
                Ok(Attempt::Made(image, made)) if best.as_ref().is_none_or(|(_, best)| made.nmse < best.nmse) => {
                    best = Some((image, made));
                }
                Ok(_) => {}
                Err(too_small) if too_small.bytes < least_of_all.0.bytes => least_of_all = (too_small, group),
                Err(_) => {}
            }
        }
        Ok(match best {
            Some((image, made)) => Attempt::Made(image, made),
            None => {
                let (too_small, group) = least_of_all;
                Attempt::Impossible(least(&too_small, &scales(group)))
            }
        })
    }

    /// Makes ActQuant in K-quants.
    fn simulate(&self, contender: Contender, budget: f64) -> Result<Attempt> {
        let quantizer = self.prepared(contender)?;
        let statistics = quantizer.method().custom::<ActionStatistics>().context("the method has no statistics")?;
        let policy = &self.subject.policy;
        let simulated = match actquant_k::quantize(&policy.graph, statistics, budget, self.subject.heldout()?) {
            Ok(simulated) => simulated,
            Err(error) => {
                let error = error.downcast::<actq::error::Error>()?;
                let Some(&too_small) = error.budget() else { return Err(error.into()) };
                return Ok(Attempt::Impossible(least(&too_small, &format!("all matrices in {}", Format::ALL[0]))));
            }
        };
        let (weights, parameters) = (policy.weights, policy.parameters);
        // Everything but the matrices stays in f32.
        let bytes = simulated.bytes + 4 * (parameters - weights);
        let made = Made {
            nmse: simulated.nmse,
            milliseconds: None,
            cmsis_nn_milliseconds: None,
            bpw: 8.0 * simulated.bytes as f64 / weights.max(1) as f64,
            bytes,
            bytes_per_parameter: bytes as f64 / parameters.max(1) as f64,
            format: simulated.formats.iter().map(Format::to_string).collect::<Vec<_>>().join(" "),
            default_group: true,
        };
        Ok(Attempt::Simulated(simulated.graph, made))
    }

    /// Collects the statistics of a contender's method, unless they are there.
    fn prepare(&mut self, contender: Contender, progress: &mut impl FnMut(&str, f64)) -> Result<()> {
        let method = contender.method();
        let name = method.to_string();
        if !self.ready.contains_key(&name) {
            let Subject { policy, recordings } = self.subject;
            let quantizer = Quantizer::new(policy, recordings, method, None, |share| progress("calibrating", share))?;
            self.ready.insert(name, quantizer);
        }
        Ok(())
    }

    /// Returns a contender's prepared method.
    fn prepared(&self, contender: Contender) -> Result<&Quantizer<'a>> {
        self.ready.get(&contender.method().to_string()).context("the method is not prepared")
    }

    /// Makes a student or a pruned network.
    fn rival(
        &self,
        (contender, rival): (Contender, Rival),
        budget: Limit,
        progress: &mut impl FnMut(&str, f64),
    ) -> Result<Attempt> {
        let quantizer = self.prepared(contender)?;
        let Subject { policy, recordings } = self.subject;
        let calib = recordings.calib.as_ref().with_context(|| Recording::Calib.missing("a rival"))?;
        let mut teacher = Teacher::new(policy, quantizer.method().graph(), calib);
        if matches!(rival, Rival::Student { has_imagined: true, .. }) {
            teacher.windows.imagine(self.seed);
        }
        let settings = Settings { budget: budget.budget(), steps: self.steps, seed: self.seed };
        let made = match rival {
            Rival::Student { form, .. } => student(&teacher, form, settings, progress),
            Rival::Pruned => pruned(&teacher, settings, progress),
        };
        let made = match made {
            Ok(made) => made,
            Err(error) => {
                let Some(&BudgetTooSmall { bytes, .. }) = error.budget() else { return Err(error.into()) };
                return Ok(Attempt::Impossible(format!("the narrowest takes {bytes} bytes")));
            }
        };
        let format = format!("row; {}", made.description);
        if let Some(image) = made.image {
            let figures = self.measured(&image, format)?;
            return Ok(Attempt::Made(image.image, figures));
        }
        let taken = form::taken(policy, &made.network, form::Form::F32)?;
        Ok(Attempt::Undriven(Made {
            nmse: eval::network_nmse(&made.network, self.subject.heldout()?)?,
            milliseconds: Some(taken.milliseconds),
            cmsis_nn_milliseconds: None,
            bpw: 8.0 * taken.weights as f64 / policy.weights.max(1) as f64,
            bytes: taken.image,
            bytes_per_parameter: taken.image as f64 / policy.parameters.max(1) as f64,
            format,
            default_group: true,
        }))
    }

    /// Measures an image.
    fn measured(&self, quantized: &QuantizedPolicy, format: String) -> Result<Made> {
        let buffer = quantized.buffer();
        let image = buffer.image(Path::new("image in memory"))?;
        let report = eval::evaluate(image, self.subject.heldout()?)?;
        let step = StepTime::new(&image, Core::M4f, CLOCK);
        let is_int8 = |q: &Quantized| q.group == 0 && q.widths.iter().all(|width| *width == Some(Width::W8));
        let is_int8 = quantized.outcomes.iter().all(|outcome| is_int8(&outcome.quantized) && outcome.x_max <= 127);
        Ok(Made {
            nmse: report.nmse,
            milliseconds: Some(step.milliseconds),
            cmsis_nn_milliseconds: is_int8.then(|| form::cmsis_nn_milliseconds(&step)),
            bpw: report.bpw,
            bytes: report.bytes,
            bytes_per_parameter: report.bytes as f64 / self.subject.policy.parameters.max(1) as f64,
            format,
            default_group: true,
        })
    }

    fn with_group(
        &self,
        contender: Contender,
        budget: Limit,
        group: usize,
        progress: &mut impl FnMut(&str, f64),
    ) -> Result<Result<Attempt, BudgetTooSmall>> {
        let steps = if contender == Contender::DistillNotLearned { Some(0) } else { self.steps };
        let plain = Options::new(contender.method(), budget.budget());
        let options = Options { group, steps, seed: self.seed, ..plain };
        let quantized = match self.prepared(contender)?.quantize(&options, progress) {
            Ok(quantized) => quantized,
            Err(error) => return error.budget().map(|small| Err(*small)).ok_or(error.into()),
        };
        let format = if group == 0 { "row".to_owned() } else { group.to_string() };
        let made = self.measured(&quantized, format)?;
        let made = Made { default_group: group == options.method.default_group(), ..made };
        Ok(Ok(Attempt::Made(quantized.image, made)))
    }
}

/// Explains why a budget is too small.
fn least(BudgetTooSmall { bytes, weights, .. }: &BudgetTooSmall, with: &str) -> String {
    let bits = 8.0 * *bytes as f64 / (*weights).max(1) as f64;
    format!("the least is {bytes} bytes of weights, {bits:.3} bits per weight, {with}")
}

/// Describes a group.
fn scales(group: usize) -> String {
    if group == 0 { "with one scale a row".to_owned() } else { format!("with groups of {group}") }
}
