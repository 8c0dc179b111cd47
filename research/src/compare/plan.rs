//! The plan of a comparison.

use std::path::PathBuf;

use actq::methods::Method;
use clap::{Args, ValueEnum};
use serde::{Deserialize, Serialize};

use super::limits::Limit;
use crate::actquant::ActQuant;
use crate::actquant::choices::Choices;
use crate::student::form::Form;

/// The name of the project's own policy.
pub(super) const UR3: &str = "ur3";

/// Every row but the f32 policy's.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Contender {
    /// Round to nearest
    Rtn,
    /// GPTQ: column-wise error feedback
    Gptq,
    /// ActQuant in the formats of this project
    #[value(name = "actquant")]
    #[serde(rename = "actquant")]
    ActQuant,
    /// ActQuant in the formats of this project, by its authors' choices
    #[value(name = "actquant-authors")]
    #[serde(rename = "actquant-authors")]
    ActQuantAuthors,
    /// ActQuant in llama.cpp's K-quants, as in its paper, simulated
    #[value(name = "actquant-k")]
    #[serde(rename = "actquant-k")]
    ActQuantK,
    /// The same, with half of the action loss a likelihood (alpha 0.5)
    #[value(name = "actquant-k-half")]
    #[serde(rename = "actquant-k-half")]
    ActQuantKHalf,
    /// distill with --steps 0: not learned
    #[value(name = "distill-0", alias = "best-0")]
    #[serde(rename = "distill-0", alias = "best-0")]
    DistillNotLearned,
    /// distill
    #[value(alias = "best")]
    #[serde(alias = "best")]
    Distill,
    /// A narrower network of the same structure, learned from random weights on, in int8
    Student,
    /// The same in 4 bits
    #[value(name = "student-4")]
    #[serde(rename = "student-4")]
    Student4,
    /// student that learns from distill's imagined rollouts, too
    #[value(name = "student-imagined")]
    #[serde(rename = "student-imagined")]
    StudentImagined,
    /// The same in 4 bits
    #[value(name = "student-4-imagined")]
    #[serde(rename = "student-4-imagined")]
    Student4Imagined,
    /// student, in f32: its error and its size, no image
    #[value(name = "student-f32")]
    #[serde(rename = "student-f32")]
    StudentF32,
    /// Structured pruning with fine-tuning, in int8
    Pruned,
}

/// A rival that is a network of its own, not codes of the trained one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rival {
    /// A narrower network that learns from random weights on.
    Student {
        /// Form of its weights.
        form: Form,
        /// `true` if it learns from imagined rollouts, too.
        has_imagined: bool,
    },
    /// A pruned network that learns on.
    Pruned,
}

impl Contender {
    /// Returns the quantizer's method, or the one whose statistics it uses.
    pub fn method(self) -> Method {
        match self {
            Self::Rtn => Method::Rtn,
            Self::Gptq => Method::Gptq,
            Self::ActQuant | Self::ActQuantK => Method::custom(ActQuant(Choices::default())),
            Self::ActQuantKHalf => Method::custom(ActQuant(Choices::half())),
            Self::ActQuantAuthors => Method::custom(ActQuant(Choices::AUTHORS)),
            Self::DistillNotLearned
            | Self::Distill
            | Self::Student
            | Self::Student4
            | Self::StudentImagined
            | Self::Student4Imagined
            | Self::StudentF32
            | Self::Pruned => Method::Distill,
        }
    }

    /// Returns `true` if the method's formats are simulated in f32, without an image.
    pub fn is_simulated(self) -> bool {
        matches!(self, Self::ActQuantK | Self::ActQuantKHalf)
    }

    /// Returns the rival that is made instead of codes of the trained network.
    pub fn rival(self) -> Option<Rival> {
        let student = |form, has_imagined| Some(Rival::Student { form, has_imagined });
        match self {
            Self::Student => student(Form::Int8, false),
            Self::Student4 => student(Form::Bits4, false),
            Self::StudentImagined => student(Form::Int8, true),
            Self::Student4Imagined => student(Form::Bits4, true),
            Self::StudentF32 => student(Form::F32, false),
            Self::Pruned => Some(Rival::Pruned),
            _ => None,
        }
    }

    /// Returns `true` if the closed loop can run the method's results.
    pub fn is_driven(self) -> bool {
        self != Self::StudentF32
    }

    /// Returns the name on the command line.
    pub fn name(self) -> String {
        self.to_possible_value().map(|value| value.get_name().to_owned()).unwrap_or_default()
    }

    /// Returns the name in the report.
    pub fn title(self) -> &'static str {
        match self {
            Self::Rtn => "rtn",
            Self::Gptq => "gptq",
            Self::ActQuant => "actquant",
            Self::ActQuantAuthors => "actquant, authors' choices",
            Self::ActQuantK => "actquant, K-quants",
            Self::ActQuantKHalf => "actquant, K-quants, alpha 0.5",
            Self::DistillNotLearned => "distill, not learned",
            Self::Distill => "distill",
            Self::Student => "student, int8",
            Self::Student4 => "student, 4 bits",
            Self::StudentImagined => "student, int8, imagined rollouts",
            Self::Student4Imagined => "student, 4 bits, imagined rollouts",
            Self::StudentF32 => "student, f32",
            Self::Pruned => "pruned, int8",
        }
    }
}

/// Policies, methods, budgets, and episodes.
#[derive(Clone, Debug, Args, Serialize)]
pub struct Plan {
    /// Folders of policies under $ACTQ_SHARED/policies; ur3 is the project's own
    #[arg(
        long,
        value_name = "LIST",
        value_delimiter = ',',
        default_value = "go1_mlp,g1_lstm256,g1_lstm64,fetch_pickplace,ur3"
    )]
    pub policies: Vec<String>,
    /// Methods; distill-0 is distill with --steps 0, not learned; actquant-authors, actquant-k-half, students and
    /// pruned are not in the default
    #[arg(
        long,
        value_name = "LIST",
        value_delimiter = ',',
        default_value = "rtn,gptq,actquant,actquant-k,distill-0,distill"
    )]
    pub methods: Vec<Contender>,
    /// Limit bits per weight, everything counted; or flash of the whole image, in KiB as 12K or in bytes as 12000B;
    /// or time of a step, in milliseconds at 168 MHz as 0.25ms
    #[arg(long, value_name = "LIST", value_delimiter = ',', value_parser = Limit::parse, default_value = "1.5,2,2.3,2.5,3,4")]
    pub budgets: Vec<Limit>,
    /// Closed-loop episodes of each cell
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=100_000), default_value_t = 100)]
    pub episodes: u64,
    /// Seed of the first episode; no choice was ever made by the hundred episodes from the default on
    #[arg(long, value_name = "S", value_parser = clap::value_parser!(u64).range(..=u64::from(u32::MAX)), default_value_t = 50_000)]
    pub seed0: u64,
    /// Seed of the quantizer
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub seed: u64,
    /// Limit of learning steps; by default chosen for the network
    #[arg(long, value_name = "N")]
    pub steps: Option<usize>,
    /// Folder of compare.md and the results; created if missing
    #[arg(long, value_name = "DIR")]
    #[serde(skip)]
    pub out: PathBuf,
    /// Run nothing: rewrite compare.md from the results
    #[arg(long)]
    #[serde(skip)]
    pub report: bool,
}
