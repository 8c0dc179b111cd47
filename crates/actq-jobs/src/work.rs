//! The work of a job: what is to be made, measured or put together.

use std::collections::BTreeMap;
use std::path::PathBuf;

use actq::budget::Budget;
use actq::error::{Context as _, Result};
use actq::methods::{Activations, Effort, Method, Options};
use actq_kernels::Width;
use serde::{Deserialize, Serialize};
use serde_json::Value;

/// The work of a job.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", content = "options", rename_all = "kebab-case", deny_unknown_fields)]
pub enum Work {
    /// Makes an image.
    Quantize(Make),
    /// Measures an image on episodes of the held-out recording.
    Evaluate(Evaluate),
    /// Runs closed-loop episodes of an image.
    Drive(Drive),
    /// Makes an image that also learns from earlier images' rollouts.
    Learn(Learn),
    /// Puts the results of a plan into one.
    Merge(Merge),
    /// Does what the program that runs the jobs has for it ([`crate::host::Host::custom`]).
    Custom(Custom),
}

/// An image to make.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Make {
    /// The policy's path, as importers read it; only its last part is part of the address.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub policy: Option<PathBuf>,
    /// The method's name.
    pub method: String,
    /// Budget of the image.
    pub budget: Budget,
    /// Columns per u8 scale, 0 for one scale a row; `None`: the method's default.
    pub group: Option<usize>,
    /// Bits of the activations, 8 or 16; `None`: chosen by the method.
    pub activations: Option<u32>,
    /// Widths in bits of all rows of a matrix, by its tensor's name.
    pub widths: BTreeMap<String, u32>,
    /// Most steps of distillation; `None`: chosen for the network, times the effort.
    pub steps: Option<usize>,
    /// Effort, if the steps are not given.
    pub effort: Effort,
    /// `true` if errors are weighed relative to the action's size.
    pub relative: bool,
    /// Seed of all random numbers.
    pub seed: u64,
}

/// Work of the program's own.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Custom {
    /// Name of the work.
    pub name: String,
    /// All that the result depends on, but inputs and other results.
    pub options: Value,
    /// Addresses of the jobs of this kind whose results it reads, in order.
    pub needs: Vec<String>,
}

/// A range of episodes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Episodes {
    /// Seed of the first episode; of a recording, its number.
    pub first: u64,
    /// Number of episodes.
    pub count: u64,
}

/// A measurement on the held-out recording.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Evaluate {
    /// Address of the image's job.
    pub image: String,
    /// The policy's path; see [`Make::policy`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub policy: Option<PathBuf>,
    /// Episodes of the recording.
    pub episodes: Episodes,
}

/// Closed-loop episodes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Drive {
    /// Address of the image's job.
    pub image: String,
    /// The policy's path; see [`Make::policy`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub policy: Option<PathBuf>,
    /// Folder that the command runs in; not part of the address.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub folder: Option<PathBuf>,
    /// Command line for `sh -c`.
    pub command: String,
    /// Seeds of the episodes.
    pub seeds: Episodes,
    /// `true` if the observations are kept to learn from.
    pub record: bool,
}

/// An image of an on-policy round.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Learn {
    /// The image.
    pub make: Make,
    /// The round, from 1.
    pub round: usize,
    /// Addresses of the drive jobs whose recordings are learned from, in order.
    pub recordings: Vec<String>,
}

/// Results to merge.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Merge {
    /// Clock of predicted times in Hz.
    pub clock_hz: f64,
    /// Names of the policies.
    pub policies: Vec<String>,
    /// Images, in the order of the tables.
    pub rows: Vec<Row>,
}

/// One image's jobs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Row {
    /// Index of its policy in [`Merge::policies`].
    pub policy: usize,
    /// The method's name.
    pub method: String,
    /// Budget of the image.
    pub budget: Budget,
    /// Seed.
    pub seed: u64,
    /// The on-policy round; 0 without.
    pub round: usize,
    /// Address of the job that makes the image.
    pub image: String,
    /// Addresses of its evaluations.
    pub evaluations: Vec<String>,
    /// Addresses of its closed-loop episodes.
    pub drives: Vec<String>,
}

impl Make {
    /// Returns the options of a quantization by `method`, which has this job's name.
    ///
    /// # Errors
    ///
    /// If bits are not those of a width or of activations; if the method does not have an option.
    pub fn options(&self, method: Method) -> Result<Options> {
        let width = |(name, bits): (&String, &u32)| {
            let width =
                Width::from_bits(*bits).with_context(|| format!("widths: {name} = {bits}: use 2, 3, 4 or 8"))?;
            Ok((name.clone(), width))
        };
        let options = Options {
            group: self.group.unwrap_or(method.default_group()),
            activations: match self.activations {
                None => Activations::Auto,
                Some(bits) => {
                    Activations::of_bits(bits).with_context(|| format!("activations: {bits}; use 8 or 16 bits"))?
                }
            },
            steps: self.steps,
            effort: self.effort,
            relative: self.relative,
            seed: self.seed,
            forced: self.widths.iter().map(width).collect::<Result<_>>()?,
            ..Options::new(method, self.budget)
        };
        options.check()?;
        Ok(options)
    }
}

impl Work {
    /// Returns the name of the kind.
    pub fn kind(&self) -> &'static str {
        match self {
            Self::Quantize(_) => "quantize",
            Self::Evaluate(_) => "evaluate",
            Self::Drive(_) => "drive",
            Self::Learn(_) => "learn",
            Self::Merge(_) => "merge",
            Self::Custom(_) => "custom",
        }
    }

    /// Returns the addresses of the jobs whose results are read, each once.
    pub fn deps(&self) -> Vec<String> {
        let mut deps: Vec<String> = match self {
            Self::Quantize(_) => Vec::new(),
            Self::Evaluate(Evaluate { image, .. }) | Self::Drive(Drive { image, .. }) => vec![image.clone()],
            Self::Learn(learn) => learn.recordings.clone(),
            Self::Custom(custom) => custom.needs.clone(),
            Self::Merge(merge) => {
                let of_row = |row: &Row| [&[row.image.clone()][..], &row.evaluations, &row.drives].concat();
                merge.rows.iter().flat_map(of_row).collect()
            }
        };
        deps.sort_unstable();
        deps.dedup();
        deps
    }

    /// Returns the work without paths, which may differ between machines.
    pub(crate) fn without_paths(&self) -> Self {
        let mut work = self.clone();
        match &mut work {
            Self::Quantize(make) | Self::Learn(Learn { make, .. }) => make.policy = None,
            Self::Evaluate(evaluate) => evaluate.policy = None,
            Self::Drive(drive) => (drive.policy, drive.folder) = (None, None),
            Self::Merge(_) | Self::Custom(_) => (),
        }
        work
    }
}
