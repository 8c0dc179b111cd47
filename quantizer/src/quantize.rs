//! Weight matrices into codes and scales.

pub mod gptq;
pub mod moments;
pub mod scale;

use actq_kernels::format::{BlockShape, Lanes, Width};
use actq_kernels::image::block_bytes;
use anyhow::{Result, bail, ensure};
use half::bf16;

use crate::graph::{Graph, Matrix};
use moments::Moments;

/// How codes are chosen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// Round to nearest, scales by least squared weight error.
    Rtn,
    /// Column-wise error feedback with the second moment of the matrix's input (GPTQ, arXiv 2210.17323).
    Gptq,
}

/// Bits of the activations.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Activations {
    /// -127 to 127
    Int8,
    /// Up to -32767 to 32767, as far as the int32 accumulator allows.
    Int16,
}

/// How many bits the weights may take.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Budget {
    /// One width for every matrix.
    Width(Width),
    /// The widths that keep the whole below this many bits per weight, everything counted.
    BitsPerWeight(f64),
}

/// What to quantize to.
#[derive(Clone, Copy, Debug)]
pub struct Options {
    /// How codes are chosen.
    pub method: Method,
    /// How many bits.
    pub budget: Budget,
    /// Columns per u8 scale; 0 = one scale a row.
    pub group: usize,
    /// Bits of the activations.
    pub activations: Activations,
}

/// A quantized matrix.
#[derive(Clone, Debug)]
pub struct Quantized {
    /// Outputs.
    pub rows: usize,
    /// Inputs.
    pub cols: usize,
    /// Columns per u8 scale; 0 = none.
    pub group: usize,
    /// The width of each row.
    pub widths: Vec<Width>,
    /// The scale of each row.
    pub scales: Vec<bf16>,
    /// `rows * groups` scales; empty without groups.
    pub group_scales: Vec<u8>,
    /// `rows * cols` codes.
    pub codes: Vec<u8>,
}

impl Quantized {
    /// Group scales of a row.
    pub fn groups(&self) -> usize {
        if self.group == 0 { 0 } else { self.cols.div_ceil(self.group) }
    }

    /// Level times group scale at (`row`, `col`): the weight divided by the row's scale.
    pub fn integer(&self, row: usize, col: usize) -> i32 {
        let level = self.widths[row].level(self.codes[row * self.cols + col]);
        match self.group {
            0 => level,
            group => level * i32::from(self.group_scales[row * self.groups() + col / group]),
        }
    }

    /// The weights that the codes stand for.
    pub fn dequantized(&self) -> Vec<f32> {
        (0..self.rows * self.cols)
            .map(|i| self.integer(i / self.cols, i % self.cols) as f32 * self.scales[i / self.cols].to_f32())
            .collect()
    }

    /// Whether the blocks' rows follow each other in the order of the output, so that no index is stored.
    pub fn in_order(blocks: &[(BlockShape, Vec<usize>)]) -> bool {
        blocks.iter().flat_map(|(_, rows)| rows).enumerate().all(|(i, &row)| i == row)
    }

    /// The largest activation magnitude whose worst-case row sum stays within int32, at most `limit`.
    pub fn x_max(&self, limit: u16) -> Result<u16> {
        let row_sum = |row| (0..self.cols).map(|col| i64::from(self.integer(row, col).abs())).sum::<i64>();
        let largest = (0..self.rows).map(row_sum).max().unwrap_or(0).max(1);
        let x_max = (i64::from(i32::MAX) / largest).min(i64::from(limit)) as u16;
        ensure!(
            x_max >= 127,
            "rows of {} columns overflow int32 even with int8 activations; use another group",
            self.cols
        );
        Ok(x_max)
    }
}

/// The result for one matrix.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// Codes and scales.
    pub quantized: Quantized,
    /// `E |(W' - W) x|^2 / E |W x|^2` under the second moment of the calibration inputs; without them, of white inputs.
    pub error: f64,
    /// Activation magnitude.
    pub x_max: u16,
}

impl Outcome {
    /// The lanes that the matrix is packed for.
    pub fn lanes(&self) -> Lanes {
        Lanes::of(self.x_max, self.quantized.group)
    }

    /// Rows sorted by width, as blocks: shape and rows of each. A matrix of one width is one block in the rows' own order.
    pub fn blocks(&self) -> Vec<(BlockShape, Vec<usize>)> {
        let matrix = &self.quantized;
        let lanes = self.lanes();
        Width::ALL
            .into_iter()
            .filter_map(|width| {
                let rows: Vec<usize> = (0..matrix.rows).filter(|&r| matrix.widths[r] == width).collect();
                let shape = BlockShape { width, lanes, rows: rows.len(), cols: matrix.cols, group: matrix.group };
                (!rows.is_empty()).then_some((shape, rows))
            })
            .collect()
    }

    /// Bytes of codes, padding, scales, indexes and block records.
    pub fn bytes(&self) -> usize {
        let blocks = self.blocks();
        let indexed = !Quantized::in_order(&blocks);
        blocks.iter().map(|(shape, _)| block_bytes(*shape, indexed)).sum()
    }
}

/// Quantizes every matrix of `graph`. `moments` has one entry per matrix, or is empty where the method needs none.
pub fn quantize(graph: &Graph, moments: &[Moments], options: &Options) -> Result<Vec<Outcome>> {
    ensure!(matches!(options.group, 0 | 32 | 64 | 128), "group is {}, it must be 0, 32, 64 or 128", options.group);
    let one = |i: usize, width| -> Result<Outcome> {
        let matrix: &Matrix = &graph.matrices[i];
        let moment = moments.get(i);
        let quantized = match (options.method, moment) {
            (Method::Rtn, _) => scale::round_to_nearest(matrix, width, options.group),
            (Method::Gptq, Some(moment)) => gptq::quantize(matrix, width, options.group, moment)?,
            (Method::Gptq, None) => bail!("gptq needs recorded observations: put calib.npz beside policy.json"),
        };
        let limit = match options.activations {
            Activations::Int8 => 127,
            Activations::Int16 => i16::MAX as u16,
        };
        let x_max = quantized.x_max(limit)?;
        Ok(Outcome { error: moments::relative_error(matrix, &quantized.dequantized(), moment), quantized, x_max })
    };
    let indexes = 0..graph.matrices.len();
    match options.budget {
        Budget::Width(width) => indexes.map(|i| one(i, width)).collect(),
        Budget::BitsPerWeight(limit) => {
            let tries: Vec<Vec<Outcome>> =
                indexes.map(|i| Width::ALL.into_iter().map(|width| one(i, width)).collect()).collect::<Result<_>>()?;
            let chosen = allocate(&tries, limit * graph.weights() as f64 / 8.0)?;
            Ok(tries.into_iter().zip(chosen).map(|(mut tries, choice)| tries.swap_remove(choice)).collect())
        }
    }
}

/// One of each matrix's tries, narrow to wide, so that the bytes stay within `limit`: starting from the narrowest, always the
/// upgrade that lowers the sum of relative errors most per byte and still fits.
fn allocate(tries: &[Vec<Outcome>], limit: f64) -> Result<Vec<usize>> {
    let mut chosen = vec![0; tries.len()];
    let mut bytes: usize = tries.iter().map(|t| t[0].bytes()).sum();
    ensure!(
        bytes as f64 <= limit,
        "the budget is too small: 2 bits a weight with scales and padding take {bytes} bytes, {limit:.0} are allowed"
    );
    loop {
        let upgrade = |m: usize| {
            let now = &tries[m][chosen[m]];
            let next = tries[m].get(chosen[m] + 1)?;
            let more = next.bytes() - now.bytes();
            ((bytes + more) as f64 <= limit).then(|| (m, more, (now.error - next.error) / more as f64))
        };
        let best = (0..tries.len()).filter_map(upgrade).max_by(|a, b| a.2.total_cmp(&b.2));
        let Some((m, more, _)) = best else { return Ok(chosen) };
        chosen[m] += 1;
        bytes += more;
    }
}
