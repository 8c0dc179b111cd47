//! Weight matrices into codes and scales.

pub mod actquant;
pub mod allocate;
pub mod best;
pub mod compact;
pub mod distill;
pub mod feedback;
pub mod gptq;
pub mod hsic;
pub mod moments;
pub mod prepared;
pub mod scale;
pub mod sensitivity;
pub mod windows;

use std::fmt;

use actq_kernels::format::{BlockShape, Lanes, Width};
use actq_kernels::image::block_bytes;
use anyhow::{Result, bail, ensure};
use half::bf16;

use crate::graph::{Graph, WeightMatrix};
use allocate::Allocation;
use moments::Moments;

/// How codes are chosen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// Round to nearest, scales by least squared weight error.
    Rtn,
    /// Column-wise error feedback with the second moment of the matrix's input (GPTQ, arXiv 2210.17323).
    Gptq,
    /// Round to nearest, widths by HSIC scores, scales by the Fisher information of the action loss (ActQuant, arXiv
    /// 2605.24011).
    ActQuant,
    /// Widths by rows, pruning and distillation ([`best`]).
    Best,
}

impl Method {
    /// Columns per u8 scale where the user asks for none in particular. Error feedback and learning make good what one scale
    /// a row loses; rounding has only its scales.
    pub fn default_group(self) -> usize {
        match self {
            Self::Rtn | Self::ActQuant => 32,
            Self::Gptq | Self::Best => 0,
        }
    }
}

impl fmt::Display for Method {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::Rtn => "rtn",
            Self::Gptq => "gptq",
            Self::ActQuant => "actquant",
            Self::Best => "best",
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
}

impl Activations {
    /// The largest magnitude.
    pub fn limit(self) -> u16 {
        match self {
            Self::Int8 | Self::Auto => 127,
            Self::Int16 => i16::MAX as u16,
        }
    }
}

/// How many bits the weights may take.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Budget {
    /// One width for every matrix.
    Width(Width),
    /// The widths that keep the whole below this many bits per weight, everything counted.
    BitsPerWeight(f64),
    /// The widths that keep the whole image within this many bytes.
    ImageBytes(usize),
}

impl Budget {
    /// Bytes that the weights may take; infinite where the width is given. [`prepared::Prepared::quantize`] has turned image bytes
    /// into bits per weight.
    fn weight_bytes(self, graph: &Graph) -> f64 {
        match self {
            Self::Width(_) => f64::INFINITY,
            Self::BitsPerWeight(bits) => bits * graph.weights() as f64 / 8.0,
            Self::ImageBytes(bytes) => bytes as f64,
        }
    }
}

/// The error of a budget that not even the narrowest widths keep.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BudgetTooSmall {
    /// What the narrowest widths take.
    pub bytes: usize,
    /// What is allowed.
    pub limit: f64,
    /// Weights of the policy.
    pub weights: usize,
}

impl fmt::Display for BudgetTooSmall {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { bytes, limit, weights } = *self;
        let bits = 8.0 * bytes as f64 / weights.max(1) as f64;
        write!(
            f,
            "the budget is too small: with scales and padding the least is {bytes} bytes ({bits:.3} bits a weight), \
             {limit:.0} bytes are allowed"
        )
    }
}

impl std::error::Error for BudgetTooSmall {}

/// What to quantize to.
#[derive(Clone, Debug)]
pub struct Options {
    /// How codes are chosen.
    pub method: Method,
    /// How many bits.
    pub budget: Budget,
    /// Columns per u8 scale; 0 = one scale a row.
    pub group: usize,
    /// Bits of the activations.
    pub activations: Activations,
    /// Steps of distillation; None: as many as suit the network.
    pub steps: Option<usize>,
    /// Seed of everything that is drawn.
    pub seed: u64,
    /// Matrices, by their tensors' names, whose rows all get a certain width (method best).
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
    /// The shape of a block of rows.
    pub fn shape(self, width: Width, rows: usize, cols: usize) -> BlockShape {
        BlockShape { width, lanes: self.lanes, rows, cols, group: self.group }
    }
}

impl Options {
    /// How matrices are packed before any of them is found to need int16 activations.
    pub fn packing(&self) -> Packing {
        Packing { lanes: Lanes::of(self.activations.limit(), self.group), group: self.group }
    }

    /// A method and a budget, one scale a row, everything else as it suits the method.
    pub fn new(method: Method, budget: Budget) -> Self {
        Self { method, budget, group: 0, activations: Activations::Auto, steps: None, seed: 1, forced: Vec::new() }
    }
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
    /// The width of each row; a row without one has no bits and gives its bias alone.
    pub widths: Vec<Option<Width>>,
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
        let level = self.widths[row].map_or(0, |width| width.level(self.codes[row * self.cols + col]));
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

    /// How many rows have which width, as text: `3`, or `0x12 2x200 4x44`.
    pub fn width_counts(&self) -> String {
        let count = |width: Option<Width>| self.widths.iter().filter(|w| **w == width).count();
        let all = std::iter::once(None).chain(Width::ALL.map(Some));
        let used: Vec<(u32, usize)> =
            all.map(|w| (w.map_or(0, Width::bits), count(w))).filter(|(_, n)| *n > 0).collect();
        match used[..] {
            [(bits, _)] => bits.to_string(),
            _ => used.iter().map(|(bits, n)| format!("{bits}x{n}")).collect::<Vec<_>>().join(" "),
        }
    }

    /// Whether the blocks' rows follow each other in the order of the output, so that no index is stored. (Missing rows may
    /// only be the last.)
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
    /// `E |(W' - W) x|^2 / E |W x|^2` under the second moment of the calibration inputs; without them, of white inputs. None
    /// where the matrix was learned anew, so that its own error says nothing.
    pub error: Option<f64>,
    /// Activation magnitude.
    pub x_max: u16,
    /// What became of the rows and columns, where they have widths of their own (method best).
    pub allocation: Option<Allocation>,
}

impl Outcome {
    /// Measures what became of `matrix`.
    pub fn new(
        matrix: &WeightMatrix,
        quantized: Quantized,
        moments: Option<&Moments>,
        activations: Activations,
    ) -> Result<Self> {
        let x_max = quantized.x_max(activations.limit())?;
        let error = Some(moments::relative_error(matrix, &quantized.dequantized(), moments));
        Ok(Self { error, quantized, x_max, allocation: None })
    }

    /// The width of every row of the matrix as it was trained: also of those that are gone.
    pub fn trained_widths(&self) -> &[Option<Width>] {
        self.allocation.as_ref().map_or(&self.quantized.widths, |allocation| &allocation.widths)
    }

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
                let rows: Vec<usize> = (0..matrix.rows).filter(|&r| matrix.widths[r] == Some(width)).collect();
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

/// Quantizes every matrix of `graph` by rtn or gptq. `moments` has one entry per matrix, or is empty where the method needs none.
pub fn quantize(graph: &Graph, moments: &[Moments], options: &Options) -> Result<Vec<Outcome>> {
    ensure!(matches!(options.group, 0 | 32 | 64 | 128), "group is {}, it must be 0, 32, 64 or 128", options.group);
    let one = |i: usize, width| -> Result<Outcome> {
        let matrix: &WeightMatrix = &graph.matrices[i];
        let moment = moments.get(i);
        let quantized = match (options.method, moment) {
            (Method::Rtn, _) => scale::round_to_nearest(matrix, width, options.group),
            (Method::Gptq, Some(moment)) => gptq::quantize(matrix, width, options.group, moment)?,
            (Method::Gptq, None) => bail!("gptq needs the moments of recorded observations"),
            (method, _) => bail!("{method} takes more than moments: see quantize::prepared"),
        };
        Outcome::new(matrix, quantized, moment, options.activations)
    };
    let indexes = 0..graph.matrices.len();
    match options.budget {
        Budget::Width(width) => indexes.map(|i| one(i, width)).collect(),
        Budget::BitsPerWeight(_) | Budget::ImageBytes(_) => {
            let tries: Vec<Vec<Outcome>> =
                indexes.map(|i| Width::ALL.into_iter().map(|width| one(i, width)).collect()).collect::<Result<_>>()?;
            let chosen = allocate(&tries, options.budget.weight_bytes(graph), graph.weights())?;
            Ok(tries.into_iter().zip(chosen).map(|(mut tries, choice)| tries.swap_remove(choice)).collect())
        }
    }
}

/// One of each matrix's tries so that the bytes stay within `limit`: starting from the narrowest, always the change that lowers
/// the sum of relative errors most per byte and still fits. (A wider try can take fewer bytes, where it pads less.)
fn allocate(tries: &[Vec<Outcome>], limit: f64, weights: usize) -> Result<Vec<usize>> {
    let size = |m: usize, choice: usize| tries[m][choice].bytes();
    let error = |m: usize, choice: usize| tries[m][choice].error.unwrap_or(0.0);
    let mut chosen = vec![0; tries.len()];
    let mut bytes: usize = (0..tries.len()).map(|m| size(m, 0)).sum();
    ensure!(bytes as f64 <= limit, BudgetTooSmall { bytes, limit, weights });
    loop {
        let mut best: Option<(f64, usize, usize, usize)> = None;
        for m in 0..tries.len() {
            for choice in 0..tries[m].len() {
                let after = bytes - size(m, chosen[m]) + size(m, choice);
                let gain = error(m, chosen[m]) - error(m, choice);
                let rate = gain / after.saturating_sub(bytes).max(1) as f64;
                if after as f64 <= limit && gain > 0.0 && best.is_none_or(|(known, ..)| rate > known) {
                    best = Some((rate, m, choice, after));
                }
            }
        }
        let Some((_, m, choice, after)) = best else { return Ok(chosen) };
        (chosen[m], bytes) = (choice, after);
    }
}
