//! The widths of an image's rows and the reasons for them: as a table and as text.

use std::fmt::Write as _;

use actq::measure::size::distinct;
use actq::methods::Outcome;
use actq::pipeline::stats::{MatrixRecord, Stats};
use actq::policy::Policy;
use actq::text::printable;
use actq_kernels::image::block_bytes;
use actq_kernels::{Image, Width};
use anyhow::{Context, Result, ensure};
use comfy_table::Table;

use super::table::table;

/// A row of a matrix.
#[derive(Clone, Debug, PartialEq)]
struct Row {
    /// `None` for rows without bits.
    width: Option<Width>,
    /// The values that its width was chosen from, if known.
    reasons: Option<Reasons>,
}

/// See [`actq::pipeline::stats::AllocationRecord`].
#[derive(Clone, Copy, Debug, PartialEq)]
struct Reasons {
    energy: f64,
    expected: f64,
}

/// A matrix and its rows: with statistics, the rows of the trained matrix; without, those of the image, in the order of
/// the output.
#[derive(Clone, Debug)]
struct Layer {
    name: String,
    shape: (usize, usize),
    rows: Vec<Row>,
    /// Bytes of each block, narrow to wide.
    bytes: Vec<(Width, usize)>,
}

/// The widths of all rows of an image.
#[derive(Clone, Debug)]
pub struct Widths {
    layers: Vec<Layer>,
    /// `true` if the rows are those of the trained matrices.
    trained: bool,
}

/// All widths, in the order of tables and legends.
const ALL: [Option<Width>; 5] = [None, Some(Width::W2), Some(Width::W3), Some(Width::W4), Some(Width::W8)];

fn bits(width: Option<Width>) -> u32 {
    width.map_or(0, Width::bits)
}

/// Returns the letter of a width: `.`, `2`, `3`, `4` or `8`.
fn letter(width: Option<Width>) -> char {
    width.and_then(|w| char::from_digit(w.bits(), 10)).unwrap_or('.')
}

impl Widths {
    /// Reads the widths of `image`. Its statistics add the reasons and the removed rows.
    pub fn new(image: &Image<'_>, stats: Option<&Stats>) -> Result<Self> {
        let matrices = distinct(image);
        if let Some(stats) = stats {
            let (here, there) = (matrices.len(), stats.matrices.len());
            ensure!(here == there, "the statistics describe {there} matrices, the image has {here}");
        }
        let layer = |(m, matrix): (usize, &actq_kernels::image::Matrix<'_>)| -> Result<Layer> {
            let mut widths = vec![None; matrix.rows];
            let mut bytes = Vec::new();
            for rows in matrix.blocks() {
                let shape = rows.block.shape();
                for output in rows.outputs() {
                    *widths.get_mut(output).context("a row has no place in the output of its matrix")? =
                        Some(shape.width);
                }
                bytes.push((shape.width, block_bytes(shape, !rows.steps.is_empty())));
            }
            let Some(stats) = stats.and_then(|s| s.matrices.get(m)) else {
                let rows = widths.into_iter().map(|width| Row { width, reasons: None }).collect();
                return Ok(Layer { name: format!("matrix {m}"), shape: (matrix.rows, matrix.cols), rows, bytes });
            };
            let same = stats.image_rows.len() == matrix.rows
                && stats.image_cols.len() == matrix.cols
                && stats
                    .image_rows
                    .iter()
                    .zip(&widths)
                    .all(|(&row, width)| stats.widths.get(row) == Some(&bits(*width)));
            ensure!(
                same,
                "the widths of {:?} differ from those in the image; pass the statistics that were saved with it",
                stats.name
            );
            let rows = (0..stats.rows).map(|r| row(stats, r)).collect::<Result<_>>()?;
            Ok(Layer { name: printable(&stats.name).into_owned(), shape: (stats.rows, stats.cols), rows, bytes })
        };
        let layers = matrices.iter().enumerate().map(layer).collect::<Result<_>>()?;
        Ok(Self { layers, trained: stats.is_some() })
    }

    /// Returns name and shape of a matrix, the bits of its rows, a digit each, and with statistics its share of the
    /// predicted error of all.
    pub(super) fn layer(&self, i: usize) -> (String, [usize; 2], String, Option<f64>) {
        let expected = |layer: &Layer| -> f64 { layer.rows.iter().filter_map(|r| r.reasons).map(|r| r.expected).sum() };
        let all: f64 = self.layers.iter().map(expected).sum();
        let Layer { name, shape, rows, .. } = &self.layers[i];
        let digits = rows.iter().filter_map(|row| char::from_digit(bits(row.width), 10)).collect();
        (name.clone(), [shape.0, shape.1], digits, (all > 0.0).then(|| expected(&self.layers[i]) / all))
    }

    /// Formats the table and the strips.
    pub fn report(&self) -> String {
        let mut text = format!("{}\n\n", self.table());
        for layer in &self.layers {
            let _ = writeln!(text, "{}", layer.strip());
        }
        let order =
            if self.trained { "in the order of the trained matrix" } else { "in the order of the image's outputs" };
        let _ = writeln!(text, "\nOne character per row, {order}: its width, or . for no bits.");
        text
    }

    /// Formats a row for each matrix and width: the number of rows and their bytes; with statistics, also their
    /// energies and expected errors.
    fn table(&self) -> Table {
        let mut header = vec!["matrix", "shape", "bits", "rows", "bytes", "share"];
        let reasons = self.layers.iter().flat_map(|l| &l.rows).any(|r| r.reasons.is_some());
        if reasons {
            header.extend(["energy: mean", "least", "most", "error share"]);
        }
        let mut table = table(&header);
        let all_bytes: usize = self.layers.iter().flat_map(|l| &l.bytes).map(|b| b.1).sum();
        let all_error: f64 =
            self.layers.iter().flat_map(|l| &l.rows).filter_map(|r| r.reasons).map(|r| r.expected).sum();
        for layer in &self.layers {
            let used = ALL.into_iter().filter(|width| layer.rows.iter().any(|r| r.width == *width));
            for (i, width) in used.enumerate() {
                let rows: Vec<&Row> = layer.rows.iter().filter(|r| r.width == width).collect();
                let bytes: usize = layer.bytes.iter().filter(|b| Some(b.0) == width).map(|b| b.1).sum();
                let first = |text: String| if i == 0 { text } else { String::new() };
                let mut cells = vec![
                    first(layer.name.clone()),
                    first(format!("{}x{}", layer.shape.0, layer.shape.1)),
                    bits(width).to_string(),
                    rows.len().to_string(),
                    bytes.to_string(),
                    percent(bytes as f64, all_bytes as f64),
                ];
                let known: Vec<Reasons> = rows.iter().filter_map(|r| r.reasons).collect();
                if !known.is_empty() {
                    let energies = || known.iter().map(|r| r.energy);
                    let (least, most) = (energies().fold(f64::INFINITY, f64::min), energies().fold(0.0, f64::max));
                    let mean = energies().sum::<f64>() / known.len() as f64;
                    cells.extend([mean, least, most].map(|e| format!("{e:.1e}")));
                    cells.push(percent(known.iter().map(|r| r.expected).sum(), all_error));
                }
                table.add_row(cells);
            }
        }
        table
    }
}

/// Formats which rows of the trained policy's matrices, each of them a neuron, are removed, and how many have which width.
/// Rows without bits that stay give a constant.
pub fn line(policy: &Policy, outcomes: &[Outcome]) -> String {
    let of = |outcome: &Outcome, width| outcome.trained_widths().iter().filter(|w| **w == width).count();
    let (mut removed, mut constant) = (Vec::new(), Vec::new());
    for (i, (matrix, outcome)) in policy.graph.matrices.iter().zip(outcomes).enumerate() {
        let (without, all) = (of(outcome, None), outcome.trained_widths().len());
        if without > 0 {
            let to = if outcome.quantized.rows < all { &mut removed } else { &mut constant };
            to.push(format!("{without} of the {all} neurons of layer {} ({})", i + 1, matrix.name));
        }
    }
    let count = |width| outcomes.iter().map(|outcome| of(outcome, Some(width))).sum::<usize>();
    let widths = ALL.iter().flatten().map(|width| (count(*width), width.bits())).filter(|(count, _)| *count > 0);
    let mut lines = Vec::new();
    lines.extend(removed.into_iter().map(|neurons| neurons + " removed"));
    lines.extend(constant.into_iter().map(|neurons| neurons + " made constant"));
    lines.push(format!(
        "rows: {}",
        widths.map(|(count, bits)| format!("{count} at {bits} bits")).collect::<Vec<_>>().join(", ")
    ));
    lines.join("\n")
}

fn row(stats: &MatrixRecord, r: usize) -> Result<Row> {
    let &bits = stats.widths.get(r).context("the statistics lack the width of a row")?;
    let width =
        if bits == 0 { None } else { Some(Width::from_bits(bits).context("the statistics hold an unknown width")?) };
    let reasons = stats
        .allocation
        .as_ref()
        .and_then(|a| Some(Reasons { energy: *a.energy.get(r)?, expected: *a.expected.get(r)? }));
    Ok(Row { width, reasons })
}

fn percent(part: f64, whole: f64) -> String {
    if whole > 0.0 { format!("{:.1}%", 100.0 * part / whole) } else { "-".to_owned() }
}

/// Characters in a line of a strip.
const STRIP_CHARS: usize = 100;

impl Layer {
    /// Formats the widths as characters, in lines.
    fn strip(&self) -> String {
        let letters: Vec<char> = self.rows.iter().map(|r| letter(r.width)).collect();
        let lines: Vec<String> = letters.chunks(STRIP_CHARS).map(|line| line.iter().collect()).collect();
        format!("{}\n  {}", self.name, lines.join("\n  "))
    }
}
