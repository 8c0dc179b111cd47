//! Method, budget and other options of a quantization.

use std::fmt;

use actq_kernels::Width;
use actq_kernels::layout::{BlockShape, GROUPS, Lanes, is_group};

use super::actquant::choices::Choices;
use crate::budget::Budget;
use crate::error::{Result, ensure};

/// Method by which codes are chosen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// Round to nearest, scales by least squared weight error.
    Rtn,
    /// Column-wise error feedback with the second moment of the matrix's input (GPTQ, arXiv 2210.17323).
    Gptq,
    /// Round to nearest, widths by HSIC scores, scales by the Fisher information of the action loss (ActQuant, arXiv
    /// 2605.24011); the choices decide ambiguities.
    ActQuant(Choices),
    /// Widths by rows, pruning and distillation ([`super::distill`]).
    Distill,
}

impl Method {
    /// Returns the default columns per u8 scale. Error feedback and learning compensate the losses of one scale per
    /// row; rounding has only its scales.
    pub fn default_group(self) -> usize {
        match self {
            Self::Rtn | Self::ActQuant(_) => 32,
            Self::Gptq | Self::Distill => 0,
        }
    }
}

/// Shows the name, and in parentheses choices of ActQuant other than the defaults.
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
    /// int16 if it lowers the error noticeably, else int8; methods that do not measure it use int8.
    Auto,
    /// The setting of [`Self::Auto`] before it measures, with the same widths: for drafts, whose time counts.
    Unmeasured,
}

impl Activations {
    /// Returns `true` if all matrices get the requested bits.
    pub fn are_asked_for(self) -> bool {
        matches!(self, Self::Int8 | Self::Int16)
    }

    /// Returns the largest magnitude.
    pub const fn limit(self) -> u16 {
        match self {
            Self::Int8 | Self::Auto | Self::Unmeasured => 127,
            Self::Int16 => i16::MAX as u16,
        }
    }
}

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
    /// Most steps of distillation; `None`: chosen for the network.
    pub steps: Option<usize>,
    /// Most minutes of distillation; `None`: no limit but the steps.
    pub minutes: Option<f64>,
    /// `true` if learning weighs errors relative to the action's size, more than by default (method distill).
    pub relative: bool,
    /// Seed of all random numbers.
    pub seed: u64,
    /// Matrices, by their tensors' names, whose rows all get the given width (method distill).
    pub forced: Vec<(String, Width)>,
}

/// Packing of rows, beside their widths.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Packing {
    /// Lanes of the activations.
    pub lanes: Lanes,
    /// Columns per u8 scale; 0 = none.
    pub group: usize,
}

impl Packing {
    /// Returns the packing for activations up to this magnitude.
    pub fn of(x_max: u16, group: usize) -> Self {
        Self { lanes: Lanes::of(x_max, group), group }
    }

    /// Returns the shape of a block of rows.
    pub fn shape(self, width: Width, rows: usize, cols: usize) -> BlockShape {
        BlockShape { width, lanes: self.lanes, rows, cols, group: self.group }
    }
}

impl Options {
    /// Refuses groups that no kernel supports, and options of learning without learning.
    pub fn check(&self) -> Result<()> {
        ensure!(
            !self.relative || self.learns(),
            "--relative changes how method distill learns; remove it for other methods and for --steps 0"
        );
        ensure!(is_group(self.group), "group is {}; it must be 0 or one of {GROUPS:?}", self.group);
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
            minutes: None,
            relative: false,
            seed: 1,
            forced: Vec::new(),
        }
    }
}
