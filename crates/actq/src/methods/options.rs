//! Methods, built in and of other crates, and the options of a quantization.

use std::any::Any;
use std::collections::BTreeMap;
use std::fmt;
use std::sync::Arc;

use actq_kernels::Width;
use actq_kernels::image::block_bytes;
use actq_kernels::layout::{GROUPS, is_group};
use serde::{Deserialize, Serialize};

use super::distill::MIN_FRAMES;
use super::learning::Choice;
use super::packing::{Activations, Packing};
use super::prepared::MIN_COUNTED_FRAMES;
use super::quantized::Outcome;
use crate::budget::{Budget, Rate};
use crate::data::Dataset;
use crate::error::{Result, ensure};
use crate::graph::{Graph, WeightMatrix};

/// Method by which codes are chosen.
#[derive(Clone, Debug, PartialEq)]
pub enum Method {
    /// Round to nearest, scales by least squared weight error.
    Rtn,
    /// Column-wise error feedback with the second moment of the matrix's input (GPTQ, arXiv 2210.17323).
    Gptq,
    /// Widths by rows, pruning and distillation ([`super::distill`]).
    Distill,
    /// A method of another crate.
    Custom(Arc<dyn CustomMethod>),
}

impl Method {
    /// Wraps a method of another crate.
    pub fn custom(method: impl CustomMethod + 'static) -> Self {
        Self::Custom(Arc::new(method))
    }

    /// Returns the default columns per u8 scale. Error feedback and learning compensate the losses of one scale per
    /// row; rounding has only its scales.
    pub fn default_group(&self) -> usize {
        match self {
            Self::Rtn => 32,
            Self::Gptq | Self::Distill => 0,
            Self::Custom(method) => method.default_group(),
        }
    }

    /// Returns the budget if none is given: 3 bits for every weight. Method distill divides as many bytes among the rows,
    /// unless the caller forces widths.
    pub fn default_budget(&self, graph: &Graph, group: usize, is_forced: bool) -> Budget {
        const WIDTH: Width = Width::W3;
        if *self != Self::Distill || is_forced {
            return Budget::Width(WIDTH);
        }
        let packing = Packing::of(Activations::Int8.limit(), group);
        let bytes = |matrix: &WeightMatrix| block_bytes(packing.shape(WIDTH, matrix.rows, matrix.cols), false);
        let all: usize = graph.matrices.iter().map(bytes).sum();
        Budget::BitsPerWeight(8.0 * all as f64 / graph.weights().max(1) as f64)
    }

    /// Returns the fewest frames that the method takes.
    pub fn least_frames(&self) -> usize {
        match self {
            Self::Rtn => 0,
            Self::Gptq | Self::Custom(_) => MIN_COUNTED_FRAMES,
            Self::Distill => MIN_FRAMES,
        }
    }
}

/// Shows the name.
impl fmt::Display for Method {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::Rtn => "rtn",
            Self::Gptq => "gptq",
            Self::Distill => "distill",
            Self::Custom(method) => return f.pad(&method.name()),
        })
    }
}

/// A method of another crate, for [`Method::custom`]. It keeps the network's structure and chooses codes and scales for
/// each matrix. The pipeline does the rest: the search for a budget of bytes, error or time, the image, and its
/// measurements. `actq-research` has an example, ActQuant.
pub trait CustomMethod: fmt::Debug + Send + Sync {
    /// Returns the name, with all settings that differ from the defaults: methods of one name count as equal.
    fn name(&self) -> String;

    /// Returns the default columns per u8 scale; 0 = one scale a row.
    fn default_group(&self) -> usize;

    /// Returns the widest codes that it gives.
    fn widest(&self) -> Width {
        Width::W8
    }

    /// Returns the fewest bytes that the matrices of `graph` can take, from their shapes alone.
    fn least_bytes(&self, graph: &Graph, packing: Packing) -> usize;

    /// Collects the statistics of `graph` over `calib`, a recording of at least 16 frames that fits the network; its
    /// actions may be missing. `progress` receives the share done, 0 to 1.
    ///
    /// # Errors
    ///
    /// If the method cannot use the recording.
    fn prepare(
        &self,
        graph: &Graph,
        calib: &Dataset,
        progress: &mut dyn FnMut(f64),
    ) -> Result<Box<dyn CustomStatistics>>;
}

/// The statistics of a [`CustomMethod`], for any number of budgets.
pub trait CustomStatistics: Any + fmt::Debug + Send + Sync {
    /// Quantizes `graph`, the one of the statistics, to the rate. Returns an outcome for each matrix, in the graph's
    /// order and of the matrix's shape. `options.budget` is to be ignored.
    ///
    /// # Errors
    ///
    /// [`BudgetTooSmall`](crate::budget::BudgetTooSmall) if the method's fewest bytes exceed the rate; the pipeline
    /// relies on it.
    fn quantize(&self, graph: &Graph, rate: Rate, options: &Options) -> Result<Vec<Outcome>>;

    /// Returns figures by name for each matrix, which explain its width in files of statistics; empty without.
    fn scores(&self) -> Vec<BTreeMap<String, f64>> {
        Vec::new()
    }
}

impl PartialEq for dyn CustomMethod {
    fn eq(&self, other: &Self) -> bool {
        self.name() == other.name()
    }
}

/// Length of learning, in units of the default steps of a network of its size.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Effort {
    /// An eighth.
    Quick,
    /// All.
    #[default]
    Default,
    /// Two and a half times as many.
    Thorough,
}

impl Effort {
    /// All efforts with their names.
    pub const ALL: [(&str, Self); 3] =
        [("quick", Self::Quick), ("default", Self::Default), ("thorough", Self::Thorough)];

    /// Returns the effort of this name.
    pub fn of_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find_map(|(known, effort)| (known == name).then_some(effort))
    }

    /// Returns the factor of the steps.
    pub fn factor(self) -> f64 {
        match self {
            Self::Quick => 0.125,
            Self::Default => 1.0,
            Self::Thorough => 2.5,
        }
    }
}

/// The most minutes that learning may be limited to: a week.
pub const MAX_MINUTES: f64 = 10_080.0;

/// Options of a quantization.
#[derive(Clone, Debug)]
pub struct Options {
    /// Method.
    pub method: Method,
    /// Budget of the image.
    pub budget: Budget,
    /// Columns per u8 scale; 0 = one scale a row.
    pub group: usize,
    /// Bits of the activations.
    pub activations: Activations,
    /// Most steps of distillation; `None`: chosen for the network, times the effort.
    pub steps: Option<usize>,
    /// Effort, if the steps are not given.
    pub effort: Effort,
    /// Most minutes of distillation; `None`: no limit but the steps.
    pub minutes: Option<f64>,
    /// `true` if learning weighs errors relative to the action's size, more than by default (method distill).
    pub relative: bool,
    /// Seed of all random numbers.
    pub seed: u64,
    /// Matrices, by their tensors' names, whose rows all get the given width (method distill).
    pub forced: Vec<(String, Width)>,
    /// The way to choose codes and its settings; `None`: tried out (method distill).
    pub choice: Option<Choice>,
}

impl Options {
    /// Refuses groups that no kernel supports, and options of learning without learning.
    pub fn check(&self) -> Result<()> {
        ensure!(
            !self.relative || self.learns(),
            "--relative changes how method distill learns; remove it for other methods and for --steps 0"
        );
        for (i, (name, width)) in self.forced.iter().enumerate() {
            let other = self.forced[..i].iter().any(|(before, other)| before == name && other != width);
            ensure!(!other, "{name:?} is given two widths by --width or --protect; remove one");
        }
        ensure!(is_group(self.group), "group is {}; it must be 0 or one of {GROUPS:?}", self.group);
        Ok(())
    }

    /// Refuses options that say how long to learn if nothing learns. [`Self::check`] accepts them, as searches set the
    /// steps of every method.
    pub fn check_length(&self) -> Result<()> {
        let lengths = [
            ("--steps", self.steps.is_some() && self.method != Method::Distill),
            ("--effort", self.effort != Effort::Default),
            ("--minutes", self.minutes.is_some()),
        ];
        let given: Vec<&str> = lengths.into_iter().filter(|(_, is_given)| *is_given).map(|(name, _)| name).collect();
        let given = given.join(" and ");
        ensure!(
            given.is_empty() || self.method == Method::Distill,
            "{given}: method {} does not learn; remove {given}, or pass --method distill and a recording (without one, the method is rtn)",
            self.method
        );
        ensure!(given.is_empty() || self.learns(), "{given}: --steps 0 does not learn; remove one of them");
        Ok(())
    }

    /// Returns `true` if the method learns.
    pub fn learns(&self) -> bool {
        self.method == Method::Distill && self.steps != Some(0)
    }

    /// Returns the packing of matrices before any of them is found to need int16 activations.
    pub fn packing(&self) -> Packing {
        Packing::of(self.activations.limit(), self.group)
    }

    /// Makes options of a method and a budget, with one scale per row and defaults for the rest.
    pub fn new(method: Method, budget: Budget) -> Self {
        Self {
            method,
            budget,
            group: 0,
            activations: Activations::Auto,
            steps: None,
            effort: Effort::Default,
            minutes: None,
            relative: false,
            seed: 1,
            forced: Vec::new(),
            choice: None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_distill_divides_bits_by_default() {
        let graph = crate::testing::layers(&[48, 64, 12]);
        let Budget::BitsPerWeight(bits) = Method::Distill.default_budget(&graph, 0, false) else { panic!("one width") };
        // Scales and the padding of short rows count.
        assert!(bits > 3.0 && bits < 4.5, "{bits}");
        for (method, is_forced) in [(Method::Distill, true), (Method::Gptq, false), (Method::Rtn, false)] {
            assert_eq!(method.default_budget(&graph, 0, is_forced), Budget::Width(Width::W3));
        }
    }

    #[test]
    fn a_matrix_has_one_forced_width() {
        let with = |forced: &[(&str, Width)]| {
            let forced = forced.iter().map(|(name, width)| ((*name).to_owned(), *width)).collect();
            Options { forced, ..Options::new(Method::Distill, Budget::BitsPerWeight(3.0)) }.check()
        };
        with(&[("a", Width::W2), ("b", Width::W8), ("a", Width::W2)]).expect("nothing contradicts");
        let error = with(&[("a", Width::W2), ("b", Width::W8), ("a", Width::W8)]).expect_err("two widths").to_string();
        assert_eq!(error, "\"a\" is given two widths by --width or --protect; remove one");
    }
}
