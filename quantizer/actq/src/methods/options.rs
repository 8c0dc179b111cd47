//! What to quantize to.

use std::fmt;

use actq_kernels::Width;
use actq_kernels::layout::{BlockShape, GROUPS, Lanes, is_group};

use super::actquant::choices::Choices;
use crate::budget::Budget;
use crate::error::{Result, ensure};

/// How codes are chosen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// Round to nearest, scales by least squared weight error.
    Rtn,
    /// Column-wise error feedback with the second moment of the matrix's input (GPTQ, arXiv 2210.17323).
    Gptq,
    /// Round to nearest, widths by HSIC scores, scales by the Fisher information of the action loss (ActQuant, arXiv
    /// 2605.24011); where it may be read in several ways, by these choices.
    ActQuant(Choices),
    /// Widths by rows, pruning and distillation ([`super::distill`]).
    Distill,
}

impl Method {
    /// Columns per u8 scale where the user asks for none in particular. Error feedback and learning make good what one
    /// scale a row loses; rounding has only its scales.
    pub fn default_group(self) -> usize {
        match self {
            Self::Rtn | Self::ActQuant(_) => 32,
            Self::Gptq | Self::Distill => 0,
        }
    }
}

/// The name, and in parentheses other choices of ActQuant's than the defaults.
impl fmt::Display for Method {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::Rtn => "rtn",
            Self::Gptq => "gptq",
            Self::ActQuant(choices) if *choices != Choices::default() => {
                return f.pad(&format!("actquant ({choices})"));
            }
            Self::ActQuant(_) => "actquant",
            Self::Distill => "distill",
        })
    }
}

/// Bits of the activations.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Activations {
    /// -127 to 127
    Int8,
    /// Up to -32767 to 32767, as far as the int32 accumulator allows.
    Int16,
    /// int16 where it lowers the error noticeably, int8 elsewhere; methods that do not measure take int8.
    Auto,
    /// What [`Self::Auto`] has before it measures, with the same widths: for drafts, whose time counts.
    Unmeasured,
}

impl Activations {
    /// Whether all matrices get what was asked for.
    pub fn are_asked_for(self) -> bool {
        matches!(self, Self::Int8 | Self::Int16)
    }

    /// The largest magnitude.
    pub const fn limit(self) -> u16 {
        match self {
            Self::Int8 | Self::Auto | Self::Unmeasured => 127,
            Self::Int16 => i16::MAX as u16,
        }
    }
}

/// What to quantize to.
#[derive(Clone, Debug)]
pub struct Options {
    /// How codes are chosen.
    pub method: Method,
    /// What the image may cost.
    pub budget: Budget,
    /// Columns per u8 scale; 0 = one scale a row.
    pub group: usize,
    /// Bits of the activations.
    pub activations: Activations,
    /// The most steps of distillation; None: as many as suit the network.
    pub steps: Option<usize>,
    /// The most minutes of distillation; None: only the steps bound it.
    pub minutes: Option<f64>,
    /// Whether what is learned counts errors relative to the action's size, more than it does by itself (method distill).
    pub relative: bool,
    /// Seed of everything that is drawn.
    pub seed: u64,
    /// Matrices, by their tensors' names, whose rows all get a certain width (method distill).
    pub forced: Vec<(String, Width)>,
}

/// How rows are packed, beside their widths.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Packing {
    /// Lanes of the activations.
    pub lanes: Lanes,
    /// Columns per u8 scale; 0 = none.
    pub group: usize,
}

impl Packing {
    /// That of activations up to this magnitude.
    pub fn of(x_max: u16, group: usize) -> Self {
        Self { lanes: Lanes::of(x_max, group), group }
    }

    /// The shape of a block of rows.
    pub fn shape(self, width: Width, rows: usize, cols: usize) -> BlockShape {
        BlockShape { width, lanes: self.lanes, rows, cols, group: self.group }
    }
}

impl Options {
    /// Refuses groups that no kernel has, and a way to learn where nothing is learned.
    pub fn check(&self) -> Result<()> {
        ensure!(
            !self.relative || self.learns(),
            "--relative says how method distill learns: leave it out with other methods and with --steps 0"
        );
        ensure!(is_group(self.group), "group is {}, it must be 0 or one of {GROUPS:?}", self.group);
        Ok(())
    }

    /// `true` if the method learns.
    pub fn learns(&self) -> bool {
        self.method == Method::Distill && self.steps != Some(0)
    }

    /// How matrices are packed before any of them is found to need int16 activations.
    pub fn packing(&self) -> Packing {
        Packing::of(self.activations.limit(), self.group)
    }

    /// A method and a budget, one scale a row, everything else as it suits the method.
    pub fn new(method: Method, budget: Budget) -> Self {
        Self {
            method,
            budget,
            group: 0,
            activations: Activations::Auto,
            steps: None,
            minutes: None,
            relative: false,
            seed: 1,
            forced: Vec::new(),
        }
    }
}
