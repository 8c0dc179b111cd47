//! A narrower network's learning, and its image.

use actq::budget::{Budget, Rate};
use actq::calibrate::widening::Widening;
use actq::calibrate::windows::Windows;
use actq::data::Dataset;
use actq::emit;
use actq::error::Result;
use actq::graph::operation::Operand;
use actq::graph::{Graph, NodeKind};
use actq::methods::distill::objective::Frames;
use actq::methods::distill::schedule::most_steps;
use actq::methods::{Effort, Method, Options, Outcome};
use actq::pipeline::QuantizedPolicy;
use actq::policy::Policy;

use super::codes::{Coded, Coder, Coding, column_squares};
use super::fit::{Fit, fit};
use super::form::{Form, Limits, Taken, milliseconds, taken};
use super::recipes::{Start, TRIAL_STEP_DIVISOR, choose};
use super::widths::Narrowing;
use actq::graph::ties::Ties;

/// The f32 policy that narrower networks learn from.
#[derive(Debug)]
pub struct Teacher<'a> {
    /// The policy.
    pub policy: &'a Policy,
    /// Its network; the method distill's with balanced columns is easier to learn from.
    pub graph: &'a Graph,
    /// Groups of its elements.
    pub ties: Ties,
    /// Its recorded observations.
    pub windows: Windows,
}

/// Settings of a rival.
#[derive(Clone, Copy, Debug)]
pub struct Settings {
    /// Budget of the image.
    pub budget: Budget,
    /// Steps of learning in f32; by default as many as the method distill takes at most for the teacher.
    pub steps: Option<usize>,
    /// Seed of weights and batches.
    pub seed: u64,
}

/// A narrower network that has learned.
#[derive(Debug)]
pub struct Rival {
    /// The network in f32, before codes were made of it.
    pub network: Graph,
    /// The image; `None` in f32.
    pub image: Option<QuantizedPolicy>,
    /// Widths and choices.
    pub description: String,
}

impl<'a> Teacher<'a> {
    /// Runs the network over the recording.
    pub fn new(policy: &'a Policy, graph: &'a Graph, calib: &'a Dataset) -> Self {
        Self { policy, graph, ties: Ties::of(graph), windows: Windows::new(graph.clone(), calib, 1) }
    }

    /// Describes what its narrower networks may take.
    ///
    /// # Errors
    ///
    /// As [`Limits::of`].
    pub fn narrowing(&self, form: Form, budget: Budget) -> Result<Narrowing<'_>> {
        let limits = Limits::of(budget, self.policy.weights)?;
        Ok(Narrowing { policy: self.policy, graph: self.graph, ties: &self.ties, form, limits })
    }

    /// Returns the usual size of each column's operand for matrices of `graph` that read observations and nothing else.
    pub fn units(&self, graph: &Graph, seed: u64) -> Vec<Option<Vec<f32>>> {
        let mut given = vec![true];
        for node in &graph.nodes {
            let is_given = node.kind.products().is_empty()
                && !node.inputs.is_empty()
                && !matches!(node.kind, NodeKind::Iterate(_) | NodeKind::Table(_))
                && node.inputs.iter().all(|&value| given[value]);
            given.push(is_given);
        }
        let squares = column_squares(graph, &self.windows, seed);
        let reads = |m: usize| {
            let mut products =
                graph.nodes.iter().flat_map(|node| node.kind.products().into_iter().map(move |p| (node, p)));
            products.any(|(node, p)| p.matrix == m && p.operand == Operand::Input && given[node.inputs[0]])
        };
        // A column that is always 0 keeps its unit.
        let unit = |square: f64| if square > 0.0 { square.sqrt() as f32 } else { 1.0 };
        let of_matrix = |(m, squares): (usize, Vec<f64>)| reads(m).then(|| squares.into_iter().map(unit).collect());
        squares.into_iter().enumerate().map(of_matrix).collect()
    }

    /// Learns in f32 from the best of `starts`, at the best of `rates`, and makes codes. `describe` formats a start.
    ///
    /// # Errors
    ///
    /// As [`emit::image`].
    pub fn learned(
        &self,
        (starts, rates): (&[Start], &[f32]),
        (form, settings): (Form, Settings),
        describe: &dyn Fn(usize) -> String,
        progress: &mut dyn FnMut(&str, f64),
    ) -> Result<Rival> {
        let steps = settings.steps.unwrap_or_else(|| most_steps(self.graph, Effort::Default));
        let frames = Frames::of(&Options::new(Method::Distill, settings.budget), self.graph);
        let by =
            Fit { steps, rate: 1e-3, widening: Widening::of(self.windows.recurrent()), frames, seed: settings.seed };
        let fold = self.windows.split();
        let chosen = choose(starts, rates, by, fold.as_ref(), &mut |share| progress("choosing", share));
        let by = Fit { steps, ..chosen.fit };
        let Start { graph, units } = &starts[chosen.start];
        let network = fit(graph, units, &self.windows, by, &mut |share| progress("learning in f32", share));
        let described = format!("{}, rate {}", describe(chosen.start), by.rate);
        let Some(width) = form.width() else { return Ok(Rival { network, image: None, description: described }) };
        let coder = Coder { width, widening: by.widening, frames, seed: settings.seed };
        let coding = match form {
            Form::Int8 => coder.coding(chosen.tried.as_ref(), fold.as_ref(), (steps / TRIAL_STEP_DIVISOR, steps / 2)),
            _ => Coding::Learned(steps),
        };
        let windows = &self.windows;
        let coded = coder.code(&network, coding, windows, &mut |share| progress("learning codes", share));
        let x_max = coder.activations(&coded, windows);
        let image = self.image(coded, &x_max, (form, settings.budget))?;
        let how = if coding == Coding::Rounded { "rounded" } else { "codes learned" };
        Ok(Rival { network, image: Some(image), description: format!("{described}, {how}") })
    }

    /// Makes the image; int16 activations stay as far as it keeps the budget, the first matrix first.
    fn image(&self, coded: Coded, wanted: &[u16], (form, budget): (Form, Budget)) -> Result<QuantizedPolicy> {
        let limits = Limits::of(budget, self.policy.weights)?;
        let policy = Policy { graph: coded.graph, ..self.policy.clone() };
        let outcome = |m: usize, limit: u16| -> Result<Outcome> {
            let quantized = coded.quantized[m].clone();
            Ok(Outcome { x_max: quantized.x_max(limit)?, quantized, error: None, allocation: None })
        };
        let mut outcomes: Vec<Outcome> = (0..coded.quantized.len()).map(|m| outcome(m, 127)).collect::<Result<_>>()?;
        let beside = taken(&policy, &policy.graph, form)?;
        let beside = beside.image - beside.weights;
        for (m, &limit) in wanted.iter().enumerate().filter(|(_, limit)| **limit > 127) {
            let before = std::mem::replace(&mut outcomes[m], outcome(m, limit)?);
            let weights = outcomes.iter().map(Outcome::bytes).sum();
            let milliseconds = milliseconds(&policy, &outcomes)?;
            if !limits.keep(Taken { weights, image: beside + weights, milliseconds }) {
                outcomes[m] = before;
            }
        }
        let image = emit::image(&policy, &outcomes)?;
        let rate = Rate::Bytes(image.len());
        Ok(QuantizedPolicy { policy, outcomes, image, rate, learning: None, search: None, held_out: None, time: None })
    }
}
