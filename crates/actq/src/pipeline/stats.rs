//! Statistics and bit allocation of an image as a JSON file. `docs/QUANTIZER.md` describes its fields.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use actq_kernels::{Image, Width};
use serde::{Deserialize, Deserializer, Serialize};

use super::quantizer::{QuantizedPolicy, Quantizer};
use crate::budget::Budget;
use crate::error::{Context, Result, ensure};
use crate::graph::WeightMatrix;
use crate::measure::size::{bits_per_weight, hex};
use crate::methods::distill::balance::balance_bytes;
use crate::methods::{Activations, Effort, Method, Options, Outcome, Quantized};
use crate::strict_json;

/// Version of the file's format. It changes when a field changes its meaning or disappears, not when one is added.
pub const SCHEMA: &str = "actq-stats-1";

/// Statistics of one image.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Stats {
    /// Always [`SCHEMA`].
    pub schema: String,
    /// Version of actq.
    pub actq: String,
    /// The policy's name.
    pub policy: String,
    /// SHA-256 of the policy, in hexadecimal digits.
    pub source: String,
    /// CRC-32 of the image, in hexadecimal digits.
    pub crc32: String,
    /// Bytes of the image.
    pub bytes: usize,
    /// Bits per weight of the matrices, with scales and padding; biases and header do not count.
    pub bpw: f64,
    /// The method's name; `best`, the former name of `distill`, is read as `distill`.
    #[serde(deserialize_with = "method_name")]
    pub method: String,
    /// Requested budget.
    pub budget: Budget,
    /// Seed of all random numbers.
    pub seed: u64,
    /// Steps of distillation; 0 for methods that do not learn.
    pub steps: usize,
    /// The other options, as `actq quantize` takes them.
    #[serde(default)]
    pub options: Vec<String>,
    /// Bytes of the means and factors that balance the matrices' columns (distill).
    #[serde(default)]
    pub balance: usize,
    /// The matrices in the policy's order.
    pub matrices: Vec<MatrixRecord>,
}

/// Statistics of one matrix. Rows and columns are those of the matrix as it was trained, without those that the network
/// ignores.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MatrixRecord {
    /// Name of its tensor.
    pub name: String,
    /// Rows (outputs).
    pub rows: usize,
    /// Columns (inputs).
    pub cols: usize,
    /// Columns that share a u8 scale; 0 = one scale a row.
    pub group: usize,
    /// Largest magnitude of its quantized activations.
    pub x_max: u16,
    /// Bytes in the image: codes, padding, scales, output steps, block records.
    pub bytes: usize,
    /// Bits of each row's codes; 0 for a row without bits.
    pub widths: Vec<u32>,
    /// Bits of each row: codes, scales and, for mixed widths, its output step; without padding and block records.
    pub bits: Vec<usize>,
    /// Trained row of each row of the image's matrix, in the order of its output.
    pub image_rows: Vec<usize>,
    /// Trained column of each column of the image's matrix.
    pub image_cols: Vec<usize>,
    /// Squared error of the matrix's output over its energy (all methods but distill).
    pub error: Option<f64>,
    /// Reasons for the rows' widths (distill).
    pub allocation: Option<AllocationRecord>,
    /// Reasons for the matrix's width, as figures by name (custom methods).
    pub score: Option<BTreeMap<String, f64>>,
}

/// Values that the widths of a matrix's rows were chosen by. Errors are squared differences of the actions over their
/// variances, summed over the network's outputs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct AllocationRecord {
    /// Error scale of each row; a width's rounding costs a share of it.
    pub energy: Vec<f64>,
    /// Predicted error of each row without bits.
    pub removal: Vec<f64>,
    /// Predicted error of each row at its width.
    pub expected: Vec<f64>,
    /// Importance of each column.
    pub importance: Vec<f64>,
}

/// Returns the options beside method, budget, seed and steps.
fn given(options: &Options) -> Vec<String> {
    let effort = Effort::ALL.into_iter().find(|(_, effort)| *effort == options.effort && *effort != Effort::Default);
    let of_effort = effort.map(|(name, _)| format!("--effort {name}"));
    let minutes = options.minutes.map(|minutes| format!("--minutes {minutes}"));
    let relative = options.relative.then(|| "--relative".to_owned());
    let forced = options.forced.iter().map(|(name, width)| format!("--width {name}={}", width.bits()));
    let group = format!("--group {}", options.group);
    let activations = match options.activations {
        Activations::Int8 => Some("--activations 8".to_owned()),
        Activations::Int16 => Some("--activations 16".to_owned()),
        Activations::Auto | Activations::Unmeasured => None,
    };
    [group].into_iter().chain(activations).chain(of_effort).chain(minutes).chain(relative).chain(forced).collect()
}

impl Stats {
    /// Collects the statistics of the image that `quantizer` made with `options`.
    pub fn new(quantizer: &Quantizer<'_>, options: &Options, quantized: &QuantizedPolicy) -> Result<Self> {
        let (source, mut scores) = (quantizer.policy, quantizer.method.scores().into_iter());
        let buffer = quantized.buffer();
        let image = buffer.image(Path::new("the new image"))?;
        let matrices = source.graph.matrices.iter().zip(&quantized.outcomes);
        Ok(Self {
            schema: SCHEMA.to_owned(),
            actq: env!("CARGO_PKG_VERSION").to_owned(),
            policy: source.name.clone(),
            source: hex(&source.digest),
            crc32: crc32(&image),
            bytes: image.bytes(),
            bpw: bits_per_weight(&image),
            method: options.method.to_string(),
            budget: options.budget,
            seed: options.seed,
            steps: quantized.steps(),
            options: given(options),
            balance: balance_bytes(&quantized.policy.graph),
            matrices: matrices.map(|(source, outcome)| matrix(source, outcome, scores.next())).collect(),
        })
    }

    /// Returns the file's content.
    pub fn json(&self) -> Result<String> {
        Ok(serde_json::to_string(self)? + "\n")
    }

    /// Reads the statistics of `image` from a file; refuses those of another image.
    pub fn read(path: &Path, image: &Image<'_>) -> Result<Self> {
        let read = || -> Result<Self> {
            let text = fs::read(path).context("cannot read the file")?;
            let value: serde_json::Value = strict_json::parse(&text).context("not valid JSON")?;
            let schema = value.get("schema").and_then(|s| s.as_str()).unwrap_or("none");
            ensure!(schema == SCHEMA, "not statistics of an image: its schema is {schema}, but {SCHEMA} is needed");
            let stats: Self = serde_json::from_value(value).with_context(|| format!("does not follow {SCHEMA}"))?;
            let crc = crc32(image);
            ensure!(
                stats.crc32 == crc,
                "belongs to another image (crc32 {}, this one has {crc}); write both with quantize --save-stats",
                stats.crc32
            );
            stats.check()?;
            Ok(stats)
        };
        read().with_context(|| path.display().to_string())
    }

    /// Checks that every array has an entry for every row or column, so that readers need not.
    fn check(&self) -> Result<()> {
        for m in &self.matrices {
            let per_row = [m.widths.len(), m.bits.len()];
            let allocation = m.allocation.as_ref().map(|a| [a.energy.len(), a.removal.len(), a.expected.len()]);
            let whole = per_row.iter().chain(allocation.iter().flatten()).all(|n| *n == m.rows)
                && m.allocation.as_ref().is_none_or(|a| a.importance.len() == m.cols)
                && m.image_rows.iter().all(|r| *r < m.rows)
                && m.image_cols.iter().all(|c| *c < m.cols);
            ensure!(whole, "the arrays of matrix {:?} do not fit its {} rows and {} columns", m.name, m.rows, m.cols);
        }
        Ok(())
    }
}

/// Reads a method's name, former ones included.
fn method_name<'de, D: Deserializer<'de>>(deserializer: D) -> Result<String, D::Error> {
    let name = String::deserialize(deserializer)?;
    Ok(if name == "best" { Method::Distill.to_string() } else { name })
}

fn crc32(image: &Image<'_>) -> String {
    format!("{:08x}", image.crc())
}

fn matrix(source: &WeightMatrix, outcome: &Outcome, score: Option<BTreeMap<String, f64>>) -> MatrixRecord {
    let quantized = &outcome.quantized;
    let allocation = outcome.allocation.as_ref();
    let image_rows = allocation.map_or_else(|| (0..source.rows).collect(), |a| a.rows.clone());
    let image_cols = allocation.map_or_else(|| (0..source.cols).collect(), |a| a.columns.clone());
    let stepped = !Quantized::in_order(&outcome.blocks());
    let overhead = 16 + 8 * quantized.groups() + if stepped { 8 } else { 0 };
    let bits_of = |width: Width| width.bits() as usize * quantized.cols + overhead;
    let widths = outcome.trained_widths();
    MatrixRecord {
        name: source.name.clone(),
        rows: source.rows,
        cols: source.cols,
        group: quantized.group,
        x_max: outcome.x_max,
        bytes: outcome.bytes(),
        widths: widths.iter().map(|width| width.map_or(0, Width::bits)).collect(),
        bits: widths.iter().map(|width| width.map_or(0, bits_of)).collect(),
        image_rows,
        image_cols,
        error: outcome.error,
        allocation: allocation.map(|a| AllocationRecord {
            energy: a.energy.clone(),
            removal: a.removal.clone(),
            expected: a.expected.clone(),
            importance: a.inputs.clone(),
        }),
        score,
    }
}
