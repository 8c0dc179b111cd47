//! LeRobot's normalization of a vector as operations.

use actq::error::{Result, bail, ensure};

use super::super::common::Parts;
use super::feature::Feature;
use super::statistics::Statistics;
use crate::description::{Op, Operand};

/// Largest relative difference of two normalizations that are the same.
const SAME: f64 = 1e-3;

/// Method that normalizes a vector: LeRobot's `NormalizationMode`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Mode {
    Identity,
    /// To a mean of 0 and a standard deviation of 1.
    MeanStd,
    /// From the interval between these two statistics to -1 .. 1.
    Range([&'static str; 2]),
}

impl Mode {
    /// Reads a mode's name, which `at` has.
    pub(super) fn parse(name: &str, at: &str) -> Result<Self> {
        Ok(match name {
            "IDENTITY" => Self::Identity,
            "MEAN_STD" => Self::MeanStd,
            "MIN_MAX" => Self::Range(["min", "max"]),
            "QUANTILES" => Self::Range(["q01", "q99"]),
            "QUANTILE10" => Self::Range(["q10", "q90"]),
            other => bail!("{at} = {other:?}: give IDENTITY, MEAN_STD, MIN_MAX, QUANTILES or QUANTILE10"),
        })
    }

    fn statistics(self) -> [&'static str; 2] {
        match self {
            Self::Identity => [""; 2],
            Self::MeanStd => ["mean", "std"],
            Self::Range(names) => names,
        }
    }
}

/// Guard against division by 0.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Eps {
    pub(super) value: f64,
    /// It is added to each range; otherwise it takes the place of a range of 0. It is added to standard deviations in
    /// both cases.
    pub(super) added: bool,
}

/// The normalization of a feature.
#[derive(Debug)]
pub(super) struct Normalizer {
    mode: Mode,
    /// Numbers to subtract: means, or lower ends.
    center: Vec<f64>,
    /// Divisors of the normalization.
    divisor: Vec<f64>,
    /// Factors of its reverse.
    factor: Vec<f64>,
    /// The files and keys that state it.
    pub(super) source: String,
}

impl Normalizer {
    /// Reads the statistics of a feature by the mode that `source` states.
    pub(super) fn of(feature: &Feature, mode: Mode, eps: Eps, statistics: &Statistics, source: &str) -> Result<Self> {
        if mode == Mode::Identity {
            let (center, divisor, factor) = Default::default();
            return Ok(Self { mode, center, divisor, factor, source: source.to_owned() });
        }
        let names = mode.statistics();
        let (center, at) = statistics.vector(feature, names[0])?;
        let (second, second_at) = statistics.vector(feature, names[1])?;
        let is_range = mode != Mode::MeanStd;
        let width: Vec<f64> = match is_range {
            true => second.iter().zip(&center).map(|(high, low)| high - low).collect(),
            false => second,
        };
        let what = if is_range { "below the other end" } else { "negative" };
        let wrong = width.iter().position(|width| *width < 0.0);
        ensure!(wrong.is_none(), "{second_at}: value {} (from 0) is {what}", wrong.unwrap_or_default());
        let replaced = |width: &f64| if *width == 0.0 { eps.value } else { *width };
        let added = |width: &f64| width + eps.value;
        let (divisor, factor): (Vec<f64>, Vec<f64>) = match (is_range, eps.added) {
            (true, false) => (width.iter().map(replaced).collect(), width.iter().map(replaced).collect()),
            _ => (width.iter().map(added).collect(), width),
        };
        // An image multiplies by the reciprocal, in f32.
        let zero = divisor.iter().position(|divisor| *divisor < f64::from(f32::MIN_POSITIVE));
        ensure!(
            zero.is_none(),
            "{second_at}: value {} (from 0) gives a division by 0 with eps = {}; give eps = 1e-8",
            zero.unwrap_or_default(),
            eps.value
        );
        Ok(Self { mode, center, divisor, factor, source: format!("{source}; {at}, {}", names[1]) })
    }

    /// Returns the operations that normalize a feature.
    pub(super) fn normalize(&self, parts: &mut Parts, feature: &Feature) -> Vec<Op> {
        let named = self.constants(parts, feature, &self.divisor);
        let [center, divisor] = named.map(Operand::Name);
        match self.mode {
            Mode::Identity => Vec::new(),
            Mode::MeanStd => vec![Op::Subtract(center), Op::Divide(divisor)],
            Mode::Range(_) => vec![
                Op::Subtract(center),
                Op::Scale(Operand::Number(2.0)),
                Op::Divide(divisor),
                Op::Subtract(Operand::Number(1.0)),
            ],
        }
    }

    /// Returns the operations that make a feature of its normalized values.
    pub(super) fn reverse(&self, parts: &mut Parts, feature: &Feature) -> Vec<Op> {
        let named = self.constants(parts, feature, &self.factor);
        let [center, factor] = named.map(Operand::Name);
        match self.mode {
            Mode::Identity => Vec::new(),
            Mode::MeanStd => vec![Op::Scale(factor), Op::Add(center)],
            Mode::Range(_) => {
                vec![Op::Add(Operand::Number(1.0)), Op::Scale(Operand::Number(0.5)), Op::Scale(factor), Op::Add(center)]
            }
        }
    }

    /// Adds its numbers as constants, and returns their names.
    fn constants(&self, parts: &mut Parts, feature: &Feature, width: &[f64]) -> [String; 2] {
        let (first, second) = match self.mode {
            Mode::MeanStd => ("mean", "std"),
            Mode::Identity | Mode::Range(_) => ("low", "range"),
        };
        let names = [first, second].map(|name| format!("{}_{name}", feature.plain()));
        if self.mode != Mode::Identity {
            parts.constant(&names[0], self.center.clone());
            parts.constant(&names[1], width.to_vec());
        }
        names
    }

    /// Returns `true` if `(x - mean) * scale` has this normalization in it.
    pub(super) fn is_in(&self, mean: &[f64], scale: &[f64]) -> bool {
        let Some((center, factor)) = self.affine(&self.divisor) else { return false };
        let len = center.len();
        let same = |(mean, scale): (&[f64], &[f64])| {
            (0..len)
                .all(|i| (scale[i] / factor[i] - 1.0).abs() < SAME && ((mean[i] - center[i]) * factor[i]).abs() < SAME)
        };
        mean.windows(len).zip(scale.windows(len)).any(same)
    }

    /// Returns `true` if `x * scale + offset` is the reverse of this normalization.
    pub(super) fn is_reversed_by(&self, scale: &[f64], offset: &[f64]) -> bool {
        let Some((center, factor)) = self.affine(&self.factor) else { return false };
        let same =
            |i: usize| (scale[i] * factor[i] - 1.0).abs() < SAME && ((offset[i] - center[i]) * factor[i]).abs() < SAME;
        scale.len() == center.len() && offset.len() == center.len() && (0..center.len()).all(same)
    }

    /// Returns center and factor of `(x - center) * factor`; nothing if that changes no value, and for a width of 0.
    fn affine(&self, width: &[f64]) -> Option<(Vec<f64>, Vec<f64>)> {
        let (center, factor): (Vec<f64>, Vec<f64>) = match self.mode {
            Mode::Identity => return None,
            Mode::MeanStd => (self.center.clone(), width.iter().map(|width| 1.0 / width).collect()),
            Mode::Range(_) => {
                let middle = self.center.iter().zip(width).map(|(low, width)| low + width / 2.0);
                (middle.collect(), width.iter().map(|width| 2.0 / width).collect())
            }
        };
        let changes = center.iter().any(|center| *center != 0.0) || factor.iter().any(|factor| *factor != 1.0);
        (changes && factor.iter().all(|factor| factor.is_finite())).then_some((center, factor))
    }
}
