//! A method with all that it needs to know about the recorded observations.

use std::borrow::Cow;
use std::time::Duration;

use super::actquant::score::Score;
use super::actquant::{self, ActionStatistics};
use super::distill::balance::MixedUnits;
use super::distill::{self, RowStatistics};
use super::matrixwise;
use super::options::{Method, Options};
use super::progress::Progress;
use super::quantized::{Outcome, QuantizedNetwork};
use crate::budget::Rate;
use crate::calibrate::allowance::{Allowance, Sampled};
use crate::calibrate::moments::{Moments, collect};
use crate::data::{Dataset, Recording};
use crate::error::{Context as _, Result, ensure};
use crate::graph::Graph;

/// Frames that every method with a recording needs at least; distill needs more.
const LEAST_FRAMES: usize = 16;

/// Vectors of an iterative head's matrices that statistics are taken of; every frame gives one for each denoising step.
const MOST_VECTORS: usize = 8192;

/// Frames of it that are taken however little time there is, and those that tell how much a frame takes.
const LEAST_SAMPLED: usize = 64;
const TIMED: usize = 8;

/// A method made ready once, to quantize a network at any number of rates.
#[derive(Debug)]
pub struct PreparedMethod<'a> {
    graph: &'a Graph,
    statistics: Statistics,
    sampled: Option<Sampled>,
}

/// What a method takes from the recorded observations.
#[derive(Debug)]
enum Statistics {
    Rtn,
    Gptq(Vec<Moments>),
    ActQuant(ActionStatistics),
    Distill(Box<RowStatistics>),
}

impl<'a> PreparedMethod<'a> {
    /// Collects what the method needs from `calib`, a recording that fits the network. `progress` gets the share done.
    pub fn new(graph: &'a Graph, method: Method, calib: Option<&Dataset>, progress: impl FnMut(f64)) -> Result<Self> {
        Self::before(graph, method, calib, None, progress)
    }

    /// As [`Self::new`], before learning of at most so many `minutes`: the statistics of an iterative head are taken of
    /// so many frames that they take a share of it. They then depend on the machine, as learning by the clock does.
    ///
    /// # Errors
    ///
    /// Where a method that needs a recording has none, or too short a one, and where one of actquant holds no actions.
    pub fn before(
        graph: &'a Graph,
        method: Method,
        calib: Option<&Dataset>,
        minutes: Option<f64>,
        mut progress: impl FnMut(f64),
    ) -> Result<Self> {
        let steps = graph.denoising_steps();
        let time = minutes.filter(|_| steps > 1).map(|minutes| Duration::from_secs_f64(60.0 * minutes));
        let allowance = time.map(Allowance::of);
        let calib = || -> Result<&Dataset> {
            let calib = calib.with_context(|| Recording::Calib.missing(&method.to_string()))?;
            calib.require_frames(LEAST_FRAMES, "statistics of fewer are those of a few chance observations")?;
            Ok(calib)
        };
        let mut moments = |dataset: &Dataset| {
            let most = if steps > 1 { (MOST_VECTORS / steps).min(dataset.frames()) } else { dataset.frames() };
            let most = allowance.map_or(most, |allowance| {
                let timed = dataset.thinned(TIMED, false);
                allowance.fits(timed.frames(), || drop(collect(graph, &timed, &mut |_| {})), LEAST_SAMPLED, most)
            });
            let dataset = if steps > 1 { dataset.thinned(most, false) } else { Cow::Borrowed(dataset) };
            let all = dataset.frames().max(1) as f64;
            (collect(graph, &dataset, &mut |frames| progress(frames as f64 / all)), dataset.frames())
        };
        let mut sampled = None;
        let mut say = |frames, inputs, outputs| sampled = Some(Sampled { frames, inputs, outputs });
        let statistics = match method {
            Method::Rtn => Statistics::Rtn,
            Method::Gptq => {
                let dataset = calib()?;
                let (moments, inputs) = moments(dataset);
                say(dataset.frames(), inputs, 0);
                Statistics::Gptq(moments)
            }
            Method::ActQuant(choices) => {
                Statistics::ActQuant(ActionStatistics::collect(graph, calib()?, choices, &mut progress)?)
            }
            Method::Distill => {
                let dataset = calib()?;
                let moments = moments(dataset);
                let inputs = moments.1;
                let rows = RowStatistics::collect(graph, dataset, moments, allowance)?;
                say(dataset.frames(), inputs, rows.outputs_of);
                Statistics::Distill(Box::new(rows))
            }
        };
        Ok(Self { graph, statistics, sampled: sampled.filter(|_| steps > 1) })
    }

    /// Of how many frames the statistics of an iterative head were taken; `None` where they are those of all.
    pub fn sampled(&self) -> Option<Sampled> {
        self.sampled
    }

    /// Matrices that read observations in units far apart, which distill could not balance; empty for other methods.
    pub fn mixed_units(&self) -> &[MixedUnits] {
        match &self.statistics {
            Statistics::Distill(statistics) => &statistics.mixed,
            _ => &[],
        }
    }

    /// The network that is quantized: of distill with balanced columns.
    pub fn graph(&self) -> &Graph {
        match &self.statistics {
            Statistics::Distill(statistics) => statistics.graph(),
            _ => self.graph,
        }
    }

    /// The method.
    pub fn method(&self) -> Method {
        match &self.statistics {
            Statistics::Rtn => Method::Rtn,
            Statistics::Gptq(_) => Method::Gptq,
            Statistics::ActQuant(statistics) => Method::ActQuant(statistics.choices),
            Statistics::Distill(_) => Method::Distill,
        }
    }

    /// Quantizes the network. `options.method` is the one that was prepared; not `options.budget` counts, but `rate`.
    /// `progress` is called by what learns.
    pub fn quantize(
        &self,
        rate: Rate,
        options: &Options,
        mut progress: impl FnMut(Progress),
    ) -> Result<QuantizedNetwork> {
        let (graph, method) = (self.graph, self.method());
        ensure!(options.method == method, "prepared for {method}, not for {}", options.method);
        ensure!(
            options.forced.is_empty() || method == Method::Distill,
            "widths of single matrices go with method distill, not with {method}"
        );
        options.check()?;
        let outcomes = match &self.statistics {
            Statistics::Rtn => matrixwise::quantize(graph, None, rate, options)?,
            Statistics::Gptq(moments) => matrixwise::quantize(graph, Some(moments), rate, options)?,
            Statistics::ActQuant(statistics) => actquant::quantize(graph, statistics, rate, options)?,
            Statistics::Distill(statistics) => return distill::quantize(statistics, rate, options, &mut progress),
        };
        Ok(QuantizedNetwork { graph: graph.clone(), outcomes, learning: None })
    }

    /// The most steps of distillation with these options; 0 for methods that do not learn.
    pub fn most_steps(&self, options: &Options) -> usize {
        match &self.statistics {
            Statistics::Distill(statistics) => statistics.most_steps(options),
            _ => 0,
        }
    }

    /// ActQuant's statistics; other methods have none.
    pub fn action_statistics(&self) -> Option<&ActionStatistics> {
        match &self.statistics {
            Statistics::ActQuant(statistics) => Some(statistics),
            _ => None,
        }
    }

    /// ActQuant's scores, per matrix; empty for other methods.
    pub fn scores(&self) -> &[Score] {
        self.action_statistics().map_or(&[], |statistics| &statistics.scores)
    }
}

/// The fewest bytes with which a method can meet a rate, from the shapes alone.
pub fn least_bytes(graph: &Graph, rate: Rate, options: &Options) -> usize {
    match options.method {
        Method::Rtn | Method::Gptq => matrixwise::least_bytes(graph, options),
        Method::ActQuant(choices) => actquant::allocation::least_bytes(graph, &choices, options.packing()),
        Method::Distill => distill::least_bytes(graph, rate, options),
    }
}

/// Quantizes a network once, by any method: see [`PreparedMethod::quantize`].
pub fn quantize(
    graph: &Graph,
    calib: Option<&Dataset>,
    rate: Rate,
    options: &Options,
) -> Result<(Graph, Vec<Outcome>)> {
    let quantized = PreparedMethod::new(graph, options.method, calib, |_| {})?.quantize(rate, options, |_| {})?;
    Ok((quantized.graph, quantized.outcomes))
}
