//! A method with all that it needs to know about the recorded observations.

use std::borrow::Cow;

use anyhow::{Context as _, Result, ensure};

use super::actquant::score::Score;
use super::actquant::{self, ActionStatistics};
use super::best::{self, RowStatistics};
use super::matrixwise;
use super::options::{Method, Options};
use super::progress::Progress;
use super::quantized::{Outcome, QuantizedNetwork};
use crate::budget::Rate;
use crate::calibrate::moments::{Moments, collect};
use crate::data::{Dataset, Recording};
use crate::graph::Graph;

/// Frames that every method with a recording needs at least; best needs more.
const LEAST_FRAMES: usize = 16;

/// Vectors of an iterative head's matrices that statistics are taken of; every frame gives one for each denoising step.
const MOST_VECTORS: usize = 8192;

/// A method made ready once, to quantize a network at any number of rates.
#[derive(Debug)]
pub struct PreparedMethod<'a> {
    graph: &'a Graph,
    statistics: Statistics<'a>,
}

/// What a method takes from the recorded observations.
#[derive(Debug)]
enum Statistics<'a> {
    Rtn,
    Gptq(Vec<Moments>),
    ActQuant(ActionStatistics),
    Best(Box<RowStatistics<'a>>),
}

impl<'a> PreparedMethod<'a> {
    /// Collects what the method needs from `calib`, a recording that fits the network. `progress` gets the share done.
    pub fn new(
        graph: &'a Graph,
        method: Method,
        calib: Option<&Dataset>,
        mut progress: impl FnMut(f64),
    ) -> Result<Self> {
        let calib = || -> Result<&Dataset> {
            let calib = calib.with_context(|| Recording::Calib.missing(&method.to_string()))?;
            calib.require_frames(LEAST_FRAMES, "statistics of fewer are those of a few chance observations")?;
            Ok(calib)
        };
        let mut moments = |dataset: &Dataset| {
            let steps = graph.denoising_steps();
            let dataset = if steps > 1 { dataset.thinned(MOST_VECTORS / steps, false) } else { Cow::Borrowed(dataset) };
            let all = dataset.frames().max(1) as f64;
            collect(graph, &dataset, |frames| progress(frames as f64 / all))
        };
        let statistics = match method {
            Method::Rtn => Statistics::Rtn,
            Method::Gptq => Statistics::Gptq(moments(calib()?)),
            Method::ActQuant(choices) => {
                Statistics::ActQuant(ActionStatistics::collect(graph, calib()?, choices, progress)?)
            }
            Method::Best => {
                let dataset = calib()?;
                let moments = moments(dataset);
                Statistics::Best(Box::new(RowStatistics::collect(graph, dataset, moments)?))
            }
        };
        Ok(Self { graph, statistics })
    }

    /// The method.
    pub fn method(&self) -> Method {
        match &self.statistics {
            Statistics::Rtn => Method::Rtn,
            Statistics::Gptq(_) => Method::Gptq,
            Statistics::ActQuant(statistics) => Method::ActQuant(statistics.choices),
            Statistics::Best(_) => Method::Best,
        }
    }

    /// Quantizes the network. `options.method` is the one that was prepared; not `options.budget` counts, but `rate`. `progress` is
    /// called by what learns.
    pub fn quantize(&self, rate: Rate, options: &Options, progress: impl FnMut(Progress)) -> Result<QuantizedNetwork> {
        let (graph, method) = (self.graph, self.method());
        ensure!(options.method == method, "prepared for {method}, not for {}", options.method);
        ensure!(
            options.forced.is_empty() || method == Method::Best,
            "widths of single matrices go with method best, not with {method}"
        );
        options.check()?;
        let outcomes = match &self.statistics {
            Statistics::Rtn => matrixwise::quantize(graph, None, rate, options)?,
            Statistics::Gptq(moments) => matrixwise::quantize(graph, Some(moments), rate, options)?,
            Statistics::ActQuant(statistics) => actquant::quantize(graph, statistics, rate, options)?,
            Statistics::Best(statistics) => return best::quantize(graph, statistics, rate, options, progress),
        };
        Ok(QuantizedNetwork { graph: graph.clone(), outcomes, learning: None })
    }

    /// The most steps of distillation with these options; 0 for methods that do not learn.
    pub fn most_steps(&self, options: &Options) -> usize {
        match &self.statistics {
            Statistics::Best(statistics) => statistics.most_steps(options),
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
