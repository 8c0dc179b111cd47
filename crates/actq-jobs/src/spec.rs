//! The spec of a sweep, a TOML file.

mod drive;
mod quantities;

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

use actq::budget::{Budget, TimeLimit};
use actq::error::{Context as _, Error, Result, ensure};
use actq::measure::time::CLOCK;
use actq::methods::Effort;
use actq_kernels::Width;
use actq_kernels::cost::Core;
use serde::Deserialize;

pub use drive::{Drive, Learn};
use quantities::{clock, sizes, widths};

/// The most jobs of a plan.
pub const MAX_JOBS: usize = 1_000_000;

/// Policies, methods, budgets, seeds and episodes of a sweep. Every combination becomes an image.
#[derive(Clone, Debug, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Spec {
    /// Policy folders or ONNX files; paths in the spec are relative to its folder.
    pub policies: Vec<PathBuf>,
    /// Recordings that a user made, to learn from instead of those beside the policy.
    pub calib: Vec<PathBuf>,
    /// The recording that errors are measured on, instead of the one beside the policy.
    pub heldout: Option<PathBuf>,
    /// Methods by name.
    pub methods: Vec<String>,
    /// Budgets: one width for every matrix.
    #[serde(deserialize_with = "widths")]
    pub bits: Vec<Width>,
    /// Budgets, in bits per weight.
    pub bpw: Vec<f64>,
    /// Budgets: the largest errors on the held-out recording.
    pub max_nmse: Vec<f64>,
    /// Budgets, in bytes of the image. With [`Self::ms`], every image keeps one of each.
    #[serde(deserialize_with = "sizes")]
    pub flash: Vec<usize>,
    /// Budgets, in predicted milliseconds of a step.
    pub ms: Vec<f64>,
    /// The processor's clock in Hz, for predicted times.
    #[serde(deserialize_with = "clock")]
    pub clock: f64,
    /// Seeds of the quantizer.
    pub seeds: Vec<u64>,
    /// Columns per u8 scale; without it, the method's default.
    pub group: Option<usize>,
    /// Bits of the activations; without it, chosen by the method.
    pub activations: Option<u32>,
    /// Widths in bits of all rows of a matrix, by its tensor's name (method distill).
    pub widths: BTreeMap<String, u32>,
    /// Most steps of distillation; without it, chosen for the network.
    pub steps: Option<usize>,
    /// Effort of distillation, if the steps are not given.
    pub effort: Effort,
    /// Refused: learning that time limits depends on the machine.
    minutes: Option<toml::Value>,
    /// `true` if method distill weighs errors relative to the action's size.
    pub relative: bool,
    /// Cores of a job that makes an image.
    pub cpus: usize,
    /// Measurement on the held-out recording.
    pub evaluate: Evaluate,
    /// Closed-loop episodes of every image.
    pub drive: Option<Drive>,
    /// On-policy rounds of method distill.
    pub learn: Option<Learn>,
}

/// Measurement on the held-out recording.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Evaluate {
    /// Episodes of the recording in one job; without it, all.
    pub per_job: Option<usize>,
}

impl Default for Spec {
    fn default() -> Self {
        Self {
            policies: Vec::new(),
            calib: Vec::new(),
            heldout: None,
            methods: ["rtn", "gptq", "distill"].map(str::to_owned).into(),
            bits: Vec::new(),
            bpw: Vec::new(),
            max_nmse: Vec::new(),
            flash: Vec::new(),
            ms: Vec::new(),
            clock: CLOCK,
            seeds: vec![1],
            group: None,
            activations: None,
            widths: BTreeMap::new(),
            steps: None,
            effort: Effort::Default,
            minutes: None,
            relative: false,
            cpus: 1,
            evaluate: Evaluate::default(),
            drive: None,
            learn: None,
        }
    }
}

impl Spec {
    /// Makes a spec of these policies, with defaults and without budgets.
    pub fn new(policies: Vec<PathBuf>) -> Self {
        Self { policies, ..Self::default() }
    }

    /// Reads a spec, and makes its paths absolute.
    ///
    /// # Errors
    ///
    /// If the file cannot be read, has an unknown key or a value out of range. Every error names the file and the key.
    pub fn read(path: &Path) -> Result<Self> {
        let read = || {
            let text = fs::read_to_string(path).context("cannot read the file")?;
            let mut spec: Self = toml::from_str(&text).map_err(Error::other)?;
            let file = std::path::absolute(path)?;
            let folder = file.parent().context("the path has no folder")?;
            let recordings = spec.calib.iter_mut().chain(&mut spec.heldout);
            let files = spec.drive.iter_mut().flat_map(|drive| &mut drive.files);
            spec.policies.iter_mut().chain(recordings).chain(files).for_each(|path| *path = folder.join(&*path));
            spec.drive.iter_mut().for_each(|drive| drive.folder = Some(folder.to_owned()));
            spec.check()?;
            Ok(spec)
        };
        read().map_err(|error: Error| error.context(path.display().to_string()))
    }

    /// Returns what each image may take: widths, bits per weight, errors, and every size with every time.
    pub fn budgets(&self) -> Vec<Budget> {
        let widths = self.bits.iter().map(|width| Budget::Width(*width));
        let bits = self.bpw.iter().map(|bits| Budget::BitsPerWeight(*bits));
        let errors = self.max_nmse.iter().map(|nmse| Budget::MaxNmse(*nmse));
        let sizes = self.flash.iter().filter(|_| self.ms.is_empty()).map(|bytes| Budget::ImageBytes(*bytes));
        let time = |milliseconds: f64, image_bytes: Option<usize>| {
            Budget::Time(TimeLimit { milliseconds, core: Core::M4f, clock_hz: self.clock, image_bytes })
        };
        let of_time = |ms: &f64| match &self.flash[..] {
            [] => vec![time(*ms, None)],
            sizes => sizes.iter().map(|bytes| time(*ms, Some(*bytes))).collect(),
        };
        widths.chain(bits).chain(errors).chain(sizes).chain(self.ms.iter().flat_map(of_time)).collect()
    }

    /// Checks all values.
    ///
    /// # Errors
    ///
    /// Names the key and the remedy.
    pub fn check(&self) -> Result<()> {
        ensure!(
            self.minutes.is_none(),
            "minutes: learning that time limits gives other images on another machine; use steps or effort instead"
        );
        let empty = [
            ("policies", self.policies.is_empty()),
            ("methods", self.methods.is_empty()),
            ("seeds", self.seeds.is_empty()),
        ];
        for (key, is_empty) in empty {
            ensure!(!is_empty, "{key}: the list is empty; name at least one");
        }
        ensure!(!self.budgets().is_empty(), "no budget: name at least one with bpw, bits, flash, ms or max_nmse");
        for (key, values) in [("bpw", &self.bpw), ("max_nmse", &self.max_nmse), ("ms", &self.ms)] {
            let is_above = |value: &f64| value.is_finite() && *value > 0.0;
            ensure!(values.iter().all(is_above), "{key}: {values:?}: budgets are numbers above 0");
            distinct(key, values.iter().map(f64::to_string))?;
        }
        distinct("bits", self.bits.iter().map(|width| width.bits().to_string()))?;
        distinct("flash", self.flash.iter().map(usize::to_string))?;
        distinct("policies", self.policies.iter().map(|path| path.display().to_string()))?;
        distinct("methods", self.methods.iter().cloned())?;
        distinct("seeds", self.seeds.iter().map(u64::to_string))?;
        ensure!(
            self.policies.len() == 1 || (self.calib.is_empty() && self.heldout.is_none()),
            "calib and heldout apply to one policy, and {} are given; sweep each policy of its own",
            self.policies.len()
        );
        ensure!(
            self.steps.is_none() || self.effort == Effort::Default,
            "steps and effort: both say how long to learn; remove one"
        );
        let distills = self.methods.iter().any(|method| method == "distill");
        ensure!(
            self.widths.is_empty() || distills,
            "widths: only method distill has them; add \"distill\" to methods, or remove widths"
        );
        let of_learning =
            [("steps", self.steps.is_some()), ("effort", self.effort != Effort::Default), ("relative", self.relative)];
        for (key, _) in of_learning.into_iter().filter(|(_, is_given)| *is_given) {
            ensure!(distills, "{key}: only method distill learns; add \"distill\" to methods, or remove {key}");
        }
        ensure!(self.cpus > 0, "cpus: 0; a job takes at least 1");
        ensure!(self.evaluate.per_job != Some(0), "evaluate.per_job: 0; use 1 or more episodes");
        if let Some(drive) = &self.drive {
            drive.check()?;
        }
        if let Some(learn) = &self.learn {
            learn.check(self.drive.as_ref(), &self.methods)?;
        }
        Ok(())
    }
}

/// Refuses a value that a list names twice: its jobs would have one address.
fn distinct(key: &str, values: impl Iterator<Item = String>) -> Result<()> {
    let mut seen = BTreeSet::new();
    for value in values {
        ensure!(
            !seen.contains(&value),
            "{key}: {value} is named twice, which would give two jobs one address; remove one"
        );
        seen.insert(value);
    }
    Ok(())
}
