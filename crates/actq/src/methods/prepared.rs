//! A method with its statistics of the recorded observations.

use std::any::Any;
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::time::Duration;

use super::distill::balance::MixedUnits;
use super::distill::{self, RowStatistics};
use super::matrixwise;
use super::options::{CustomStatistics, Method, Options};
use super::progress::Progress;
use super::quantized::{Outcome, QuantizedNetwork};
use crate::budget::Rate;
use crate::calibrate::allowance::{Allowance, Sampled};
use crate::calibrate::equalize::equalized;
use crate::calibrate::imagined::Imagined;
use crate::calibrate::moments::{Moments, collect};
use crate::data::{Dataset, Recording};
use crate::error::{Context as _, Result, ensure};
use crate::graph::Graph;

/// Least frames of a method with a recording; distill needs more.
pub(super) const MIN_COUNTED_FRAMES: usize = 16;

/// Most input vectors of an iterative head's matrices in statistics; every frame gives one per denoising step.
const MAX_VECTORS: usize = 8192;

/// Least frames of an iterative head in statistics, however short the time; also the frames that measure the time of
/// one.
const MIN_SAMPLED: usize = 64;
const TIMED: usize = 8;

/// A prepared method, which quantizes a network at any number of rates.
#[derive(Debug)]
pub struct PreparedMethod<'a> {
    /// The network with equalized hidden elements.
    graph: Cow<'a, Graph>,
    method: Method,
    statistics: Statistics,
    sampled: Option<Sampled>,
}

/// Statistics of the recorded observations.
#[derive(Debug)]
enum Statistics {
    Rtn,
    Gptq(Vec<Moments>),
    Distill(Box<RowStatistics>),
    Custom(Box<dyn CustomStatistics>),
}

impl<'a> PreparedMethod<'a> {
    /// Collects the method's statistics from `calib`, a recording that fits the network. `progress` receives the share
    /// done.
    pub fn new(graph: &'a Graph, method: Method, calib: Option<&Dataset>, progress: impl FnMut(f64)) -> Result<Self> {
        Self::before(graph, method, calib, None, progress)
    }

    /// As [`Self::new`], for learning of at most this many `minutes`. The statistics of an iterative head are limited
    /// to as many frames as take a share of that time. They then depend on the machine, like learning with a time
    /// limit.
    ///
    /// # Errors
    ///
    /// If a method lacks a recording that it needs, or has too short a one; errors of [`CustomMethod::prepare`].
    ///
    /// [`CustomMethod::prepare`]: super::CustomMethod::prepare
    pub fn before(
        graph: &'a Graph,
        method: Method,
        calib: Option<&Dataset>,
        minutes: Option<f64>,
        mut progress: impl FnMut(f64),
    ) -> Result<Self> {
        // Rounding takes nothing from a recording: its image is the same with and without one.
        let equalized = equalized(graph, calib.filter(|_| !matches!(method, Method::Rtn)));
        let graph = &*equalized;
        let steps = graph.denoising_steps();
        let time = minutes.filter(|_| steps > 1).map(|minutes| Duration::from_secs_f64(60.0 * minutes));
        let allowance = time.map(Allowance::of);
        let calib = || -> Result<&Dataset> {
            let calib = calib.with_context(|| Recording::Calib.missing(&method.to_string()))?;
            calib.require_frames(MIN_COUNTED_FRAMES, "statistics of fewer frames are unreliable")?;
            Ok(calib)
        };
        let mut moments = |dataset: &Dataset| -> Result<_> {
            let most = if steps > 1 { (MAX_VECTORS / steps).min(dataset.frames()) } else { dataset.frames() };
            let most = allowance.map_or(most, |allowance| {
                let timed = dataset.thinned(TIMED, false);
                allowance.fits(timed.frames(), || drop(collect(graph, &timed, &mut |_| {})), MIN_SAMPLED, most)
            });
            let dataset = if steps > 1 { dataset.thinned(most, false) } else { Cow::Borrowed(dataset) };
            let all = dataset.frames().max(1) as f64;
            let moments = collect(graph, &dataset, &mut |frames| progress(frames as f64 / all));
            if moments.iter().any(|of| !of.fits_f32()) {
                dataset.require_finite(graph)?;
            }
            Ok((moments, dataset.frames()))
        };
        let mut sampled = None;
        let mut say = |frames, inputs, outputs| sampled = Some(Sampled { frames, inputs, outputs });
        let statistics = match &method {
            Method::Rtn => Statistics::Rtn,
            Method::Gptq => {
                let dataset = calib()?;
                let (moments, inputs) = moments(dataset)?;
                say(dataset.frames(), inputs, 0);
                Statistics::Gptq(moments)
            }
            Method::Distill => {
                let dataset = calib()?;
                let moments = moments(dataset)?;
                let inputs = moments.1;
                let rows = RowStatistics::collect(graph, dataset, moments, allowance)?;
                say(dataset.frames(), inputs, rows.outputs_of);
                Statistics::Distill(Box::new(rows))
            }
            Method::Custom(custom) => Statistics::Custom(custom.prepare(graph, calib()?, &mut progress)?),
        };
        Ok(Self { graph: equalized, method, statistics, sampled: sampled.filter(|_| steps > 1) })
    }

    /// Reports errors on some of a held-out recording while something is learned; nothing else depends on it.
    pub fn watch(&mut self, held_out: &Dataset) {
        if let Statistics::Distill(statistics) = &mut self.statistics {
            statistics.watch(held_out);
        }
    }

    /// Returns the frames over which the statistics of an iterative head were taken; `None` for all.
    pub fn sampled(&self) -> Option<Sampled> {
        self.sampled
    }

    /// Returns matrices that read observations in very different units and that distill could not balance; empty for
    /// other methods.
    pub fn mixed_units(&self) -> &[MixedUnits] {
        match &self.statistics {
            Statistics::Distill(statistics) => &statistics.mixed,
            _ => &[],
        }
    }

    /// Returns the imagined rollouts that distill learns from; `None` for other methods, and without a model.
    pub fn imagined(&self) -> Option<&Imagined> {
        match &self.statistics {
            Statistics::Distill(statistics) => statistics.imagined(),
            _ => None,
        }
    }

    /// Returns the network that is quantized: with equalized hidden elements and, for distill, balanced columns.
    pub fn graph(&self) -> &Graph {
        match &self.statistics {
            Statistics::Distill(statistics) => statistics.graph(),
            _ => &self.graph,
        }
    }

    /// Returns the method.
    pub fn method(&self) -> &Method {
        &self.method
    }

    /// Quantizes the network at `rate`; `options.budget` is ignored. `options.method` must be the prepared method.
    /// Methods that learn call `progress`.
    pub fn quantize(
        &self,
        rate: Rate,
        options: &Options,
        mut progress: impl FnMut(Progress),
    ) -> Result<QuantizedNetwork> {
        let Self { graph, method, .. } = self;
        ensure!(options.method == *method, "the quantizer is prepared for method {method}, not for {}", options.method);
        ensure!(
            options.forced.is_empty() || *method == Method::Distill,
            "only method distill takes widths of single matrices, not {method}"
        );
        options.check()?;
        let outcomes = match &self.statistics {
            Statistics::Rtn => matrixwise::quantize(graph, None, rate, options)?,
            Statistics::Gptq(moments) => matrixwise::quantize(graph, Some(moments), rate, options)?,
            Statistics::Distill(statistics) => return distill::quantize(statistics, rate, options, &mut progress),
            Statistics::Custom(statistics) => {
                let outcomes = statistics.quantize(graph, rate, options)?;
                let given = outcomes.iter().map(|outcome| (outcome.quantized.rows, outcome.quantized.cols));
                let is_whole = given.eq(graph.matrices.iter().map(|matrix| (matrix.rows, matrix.cols)));
                ensure!(is_whole, "method {method} must return an outcome for each matrix, of the matrix's shape");
                outcomes
            }
        };
        Ok(QuantizedNetwork { graph: graph.clone().into_owned(), outcomes, learning: None, cycles: None })
    }

    /// Returns the most steps of distillation with these options; 0 for methods that do not learn.
    pub fn most_steps(&self, options: &Options) -> usize {
        match &self.statistics {
            Statistics::Distill(statistics) => statistics.most_steps(options),
            _ => 0,
        }
    }

    /// Returns the statistics of a custom method, if they are of this type.
    pub fn custom<S: CustomStatistics>(&self) -> Option<&S> {
        match &self.statistics {
            Statistics::Custom(statistics) => (&**statistics as &dyn Any).downcast_ref(),
            _ => None,
        }
    }

    /// Returns the figures of a custom method per matrix ([`CustomStatistics::scores`]); empty for other methods.
    pub fn scores(&self) -> Vec<BTreeMap<String, f64>> {
        match &self.statistics {
            Statistics::Custom(statistics) => statistics.scores(),
            _ => Vec::new(),
        }
    }
}

/// Returns the fewest bytes with which a method can meet a rate, from the shapes alone.
pub fn least_bytes(graph: &Graph, rate: Rate, options: &Options) -> usize {
    match &options.method {
        Method::Rtn | Method::Gptq => matrixwise::least_bytes(graph, options),
        Method::Distill => distill::least_bytes(graph, rate, options),
        Method::Custom(method) => method.least_bytes(graph, options.packing()),
    }
}

/// Quantizes a network once, by any method: see [`PreparedMethod::quantize`].
pub fn quantize(
    graph: &Graph,
    calib: Option<&Dataset>,
    rate: Rate,
    options: &Options,
) -> Result<(Graph, Vec<Outcome>)> {
    let quantized =
        PreparedMethod::new(graph, options.method.clone(), calib, |_| {})?.quantize(rate, options, |_| {})?;
    Ok((quantized.graph, quantized.outcomes))
}

#[cfg(test)]
mod tests {
    use actq_kernels::Width;

    use super::*;
    use crate::budget::Budget;
    use crate::methods::scale::round_to_nearest;
    use crate::methods::{CustomMethod, Packing};
    use crate::testing::{dataset, lstm, mlp};

    /// Rounds the first so many matrices.
    #[derive(Clone, Copy, Debug)]
    struct First(usize);

    impl CustomMethod for First {
        fn name(&self) -> String {
            format!("first {}", self.0)
        }

        fn default_group(&self) -> usize {
            0
        }

        fn least_bytes(&self, _: &Graph, _: Packing) -> usize {
            0
        }

        fn prepare(&self, _: &Graph, _: &Dataset, _: &mut dyn FnMut(f64)) -> Result<Box<dyn CustomStatistics>> {
            Ok(Box::new(*self))
        }
    }

    impl CustomStatistics for First {
        fn quantize(&self, graph: &Graph, _: Rate, options: &Options) -> Result<Vec<Outcome>> {
            let rounded = |matrix| {
                Outcome::new(matrix, round_to_nearest(matrix, Width::W3, options.group), None, options.activations)
            };
            graph.matrices.iter().take(self.0).map(rounded).collect()
        }
    }

    #[test]
    fn a_custom_method_must_return_every_matrix() {
        let graph = mlp();
        let recording = dataset(&graph, 2, 10);
        let quantize = |prepared: First, asked: First| {
            let method = PreparedMethod::new(&graph, Method::custom(prepared), Some(&recording), |_| {})?;
            let options = Options::new(Method::custom(asked), Budget::Width(Width::W3));
            Ok::<_, crate::error::Error>(method.quantize(Rate::Width(Width::W3), &options, |_| {})?.outcomes.len())
        };
        let error = |prepared, asked| quantize(prepared, asked).expect_err("a refusal").to_string();
        assert_eq!(quantize(First(2), First(2)).expect("outcomes"), 2);
        assert_eq!(
            error(First(1), First(1)),
            "method first 1 must return an outcome for each matrix, of the matrix's shape"
        );
        assert_eq!(error(First(2), First(1)), "the quantizer is prepared for method first 2, not for first 1");
    }
    #[test]
    fn reporting_the_held_out_error_changes_nothing() {
        for graph in [mlp(), lstm()] {
            let (recording, held_out) = (dataset(&graph, 4, 100), dataset(&graph, 2, 90));
            let options = Options { steps: Some(200), ..Options::new(Method::Distill, Budget::Width(Width::W4)) };
            let quantized = |watched: Option<&Dataset>| {
                let mut method = PreparedMethod::new(&graph, Method::Distill, Some(&recording), |_| {})?;
                watched.into_iter().for_each(|held_out| method.watch(held_out));
                let mut last = None;
                let found = method.quantize(Rate::Width(Width::W4), &options, |progress| last = Some(progress))?;
                let codes: Vec<Vec<u8>> = found.outcomes.into_iter().map(|outcome| outcome.quantized.codes).collect();
                Ok::<_, crate::error::Error>((codes, last))
            };
            let (codes, unwatched) = quantized(None).expect("quantized");
            let (of_watched, watched) = quantized(Some(&held_out)).expect("quantized");
            assert_eq!(codes, of_watched);
            assert!(matches!(unwatched, Some(Progress::Learning { held_out: None, .. })));
            let Some(Progress::Learning { held_out: Some(error), .. }) = watched else { panic!("{watched:?}") };
            assert!((1e-9..0.5).contains(&error), "{error}");
        }
    }
}
