//! An image's properties.

use std::collections::{BTreeMap, BTreeSet};

use actq::emit::{Core, repack};
use actq::graph::{Graph, WeightMatrix};
use actq::measure::size::{Beside, bits_per_weight, file_bits_per_weight, hex};
use actq::measure::time::StepTime;
use actq::pipeline::stats::Stats;
use actq::policy::Policy;
use actq::runtime::ImageBuffer;
use actq::text::printable;
use actq_kernels::image::{Op, OpKind, Region};
use actq_kernels::{Image, Port, PortKind};
use anyhow::Result;
use serde::Serialize;
use sha2::{Digest as _, Sha256};

use super::parts::RUNTIMES;
use crate::report::inspect::{CONTRACT, kind, playback, row};
use crate::report::time;
use crate::report::widths::Widths;

/// Properties of an image.
#[derive(Debug, Serialize)]
pub struct Facts {
    /// The policy's name.
    pub name: String,
    /// The version of this program.
    pub actq: &'static str,
    /// SHA-256 of the image.
    pub sha256: String,
    /// SHA-256 of the source policy.
    pub source: String,
    /// CRC-32 in the image's header.
    pub crc32: String,
    /// Meaning of the output, lengths and rate.
    pub kind: String,
    /// Values of an observation.
    pub observation: usize,
    /// Values of an action.
    pub action: usize,
    /// Control rate in Hz.
    pub rate_hz: f32,
    /// Bytes of the image.
    pub bytes: usize,
    /// Bytes of its parts beside the weights: biases, self-test, tables.
    pub beside: [usize; 3],
    /// Bits per weight, with scales and padding.
    pub bits_per_weight: f64,
    /// Bits per weight of the whole file.
    pub file_bits_per_weight: f64,
    /// Bytes of scratch memory.
    pub scratch: usize,
    /// The core whose layouts the image has, its predicted cycles, and the clock in Hz.
    pub time: (&'static str, u64, f64),
    /// The image in the layouts of each core.
    pub cores: BTreeMap<&'static str, OnCore>,
    /// Features that a build of the kernels needs.
    pub features: Vec<&'static str>,
    /// Settings of chunk playback.
    pub playback: Vec<String>,
    /// Steps from one run of the network to the next.
    pub execute: usize,
    /// Control periods that a run of the network may take, as the rest of a chunk plays meanwhile.
    pub periods: usize,
    /// Steps of the self-test.
    pub self_test: usize,
    /// Raw inputs and targets; empty without operations around the network.
    pub ports: Vec<PortFacts>,
    /// Operations in order.
    pub ops: Vec<OpFacts>,
    /// Distinct matrices.
    pub matrices: Vec<MatrixFacts>,
    /// `true` if rows are those of the trained matrices, removed ones too.
    pub is_trained: bool,
    /// Names of the action contract's arrays, and their values for each action.
    pub contract: Vec<(&'static str, Vec<f32>)>,
    /// Origin of the image, by name: method, options and seed need its statistics.
    pub made: Vec<(&'static str, String)>,
}

/// Figures of an image in the layouts of a core.
#[derive(Debug, Serialize)]
pub struct OnCore {
    /// Name of the core in a sentence.
    pub title: &'static str,
    /// Bytes of the image.
    pub bytes: usize,
    /// Bytes of scratch memory.
    pub scratch: usize,
    /// Predicted cycles of a step.
    pub cycles: u64,
    /// `true` if the cycles follow the core's manual.
    pub is_modelled: bool,
    /// `true` if the image is in these layouts.
    pub is_own: bool,
    /// Bytes of code that runs any image.
    pub runtime: usize,
}

impl OnCore {
    /// Collects the figures of all cores.
    ///
    /// # Errors
    ///
    /// If the image has no place in a core's layouts.
    fn of_all(image: &Image<'_>, bytes: &[u8]) -> Result<BTreeMap<&'static str, Self>> {
        let (mut all, mut packed) = (BTreeMap::new(), bytes.to_vec());
        for (core, runtime) in RUNTIMES {
            // An image that has the layouts already stays as it is.
            packed = repack(&packed, core)?;
            let buffer = ImageBuffer::new(&packed);
            let here = buffer.image("the image".as_ref())?;
            let figures = Self {
                title: core.title(),
                bytes: packed.len(),
                scratch: 4 * here.scratch_words(),
                cycles: StepTime::new(&here, core, 1.0).cycles,
                is_modelled: core.is_modelled(),
                is_own: core.has_layouts_of(image),
                runtime,
            };
            all.insert(core.name(), figures);
        }
        Ok(all)
    }
}

/// A raw input, or targets.
#[derive(Debug, Serialize)]
pub struct PortFacts {
    /// `input`, `positions`, `velocities`, `torques`.
    pub kind: &'static str,
    /// Its name.
    pub name: String,
    /// Names of its values, if they have some.
    pub names: Vec<String>,
    /// Number of values.
    pub len: usize,
    /// Lowest and highest value, if limited.
    pub range: [Option<f32>; 2],
    /// Of targets: the operations that give their values. See [`OpFacts::from`].
    pub from: Vec<usize>,
}

/// An operation.
#[derive(Debug, Serialize)]
pub struct OpFacts {
    /// Name.
    pub name: String,
    /// Function, shape, sizes.
    pub detail: String,
    /// Values that it writes.
    pub output: usize,
    /// Predicted cycles in a step.
    pub cycles: u64,
    /// Index of its matrix.
    pub matrix: Option<usize>,
    /// The raw inputs and operations that its values come from in the same step. Inputs have the first numbers,
    /// operations those after.
    pub from: Vec<usize>,
}

/// A matrix.
#[derive(Debug, Serialize)]
pub struct MatrixFacts {
    /// Name of the trained tensor, or its number.
    pub name: String,
    /// Rows and columns.
    pub shape: [usize; 2],
    /// Bits of each row, a digit each; `0` for a row without bits.
    pub widths: String,
    /// Bytes of codes, scales and block records.
    pub bytes: usize,
    /// Columns of a group scale; 0 for row scales only.
    pub group: usize,
    /// Largest quantized activation.
    pub x_max: u16,
    /// Smallest and largest row scale.
    pub scales: [f32; 2],
    /// Share of the predicted error of all rows, with statistics.
    pub error_share: Option<f64>,
}

impl Facts {
    /// Collects the properties of the image of `bytes`; the cycles are at `clock_hz`. Without statistics, the matrices
    /// have the names of the policy's, if that is known.
    ///
    /// # Errors
    ///
    /// If the statistics are of another image.
    pub fn new(
        image: &Image<'_>,
        bytes: &[u8],
        stats: Option<&Stats>,
        policy: Option<&Policy>,
        clock_hz: f64,
    ) -> Result<Self> {
        // Images of default layouts have those of several cores.
        let core = Core::of_image(image).min_by_key(|core| *core != Core::M4f).unwrap_or(Core::M4f);
        let step = StepTime::new(image, core, clock_hz);
        let widths = Widths::new(image, stats)?;
        let distinct = actq::measure::size::distinct(image);
        let places: Vec<_> =
            distinct.iter().map(|matrix| matrix.blocks().next().map(|rows| rows.scales.as_ptr())).collect();
        let place = |op: &actq_kernels::image::Op<'_>| {
            let own = op.matrix()?.blocks().next().map(|rows| rows.scales.as_ptr());
            places.iter().position(|place| *place == own)
        };
        let mut flow = Flow::new(image);
        let ops = image.ops().zip(&step.ops).map(|(op, time)| OpFacts {
            name: op.kind.name().to_owned(),
            detail: row(&op).swap_remove(3),
            output: op.dst().len,
            cycles: time.cycles,
            matrix: place(&op),
            from: flow.next(&op),
        });
        let ops: Vec<OpFacts> = ops.collect();
        let mut at = image.output().offset;
        let ports = image.ports().map(|port| {
            let is_target = port.kind != PortKind::Input;
            let region = Region { offset: at, len: if is_target { port.len } else { 0 } };
            at += region.len;
            PortFacts::new(&port, flow.writers(region))
        });
        let mut matrices: Vec<MatrixFacts> =
            distinct.iter().enumerate().map(|(i, matrix)| MatrixFacts::new(matrix, &widths, i)).collect();
        // In an image the matrices have the order of the operations that first use them, as in the policy.
        let names = policy.filter(|_| stats.is_none()).map(|policy| used(&policy.graph)).unwrap_or_default();
        if names.len() == matrices.len() {
            matrices.iter_mut().zip(names).for_each(|(facts, of)| facts.name = printable(&of.name).into_owned());
        }
        let Beside { biases, self_test, tables } = Beside::of(image);
        let contract = CONTRACT.into_iter().zip(image.contract_arrays());
        let values = |array: &[u32]| array.iter().map(|word| f32::from_bits(u32::from_le(*word))).collect();
        Ok(Self {
            name: printable(image.name()).into_owned(),
            actq: env!("CARGO_PKG_VERSION"),
            sha256: hex(&Sha256::digest(bytes)),
            source: hex(&image.digest()),
            crc32: format!("{:08x}", image.crc()),
            kind: kind(image),
            observation: image.obs_len(),
            action: image.act_len(),
            rate_hz: image.rate_hz(),
            bytes: image.bytes(),
            beside: [biases, self_test, tables],
            bits_per_weight: bits_per_weight(image),
            file_bits_per_weight: file_bits_per_weight(image),
            scratch: 4 * image.scratch_words(),
            time: (core.name(), step.cycles, clock_hz),
            cores: OnCore::of_all(image, bytes)?,
            features: image.features().collect(),
            playback: playback(image),
            execute: image.execute(),
            periods: time::periods(image),
            self_test: image.self_test_steps(),
            ports: ports.collect(),
            ops,
            matrices,
            is_trained: stats.is_some(),
            contract: contract
                .filter(|(_, array)| !array.is_empty())
                .map(|(name, array)| (name, values(array)))
                .collect(),
            made: made(image, core, stats),
        })
    }
}

impl PortFacts {
    fn new(port: &Port<'_>, from: Vec<usize>) -> Self {
        let kind = match port.kind {
            PortKind::Input => "input",
            PortKind::Position => "positions",
            PortKind::Velocity => "velocities",
            PortKind::Torque => "torques",
            _ => "output",
        };
        Self {
            kind,
            name: printable(port.name).into_owned(),
            names: port.names.lines().map(|name| printable(name).into_owned()).collect(),
            len: port.len,
            range: port.range.map(|limit| limit.is_finite().then_some(limit)),
            from,
        }
    }
}

/// Follows values through the arena: what wrote each word last.
struct Flow {
    last: Vec<Option<usize>>,
    next: usize,
}

impl Flow {
    /// Places the raw inputs.
    fn new(image: &Image<'_>) -> Self {
        let mut flow = Self { last: vec![None; image.scratch_words()], next: 0 };
        let mut offset = image.observation().offset;
        for port in image.ports().filter(|port| port.kind == PortKind::Input) {
            flow.write(Region { offset, len: port.len });
            offset += port.len;
            flow.next += 1;
        }
        flow
    }

    fn write(&mut self, region: Region) {
        self.last.get_mut(region.range()).into_iter().flatten().for_each(|word| *word = Some(self.next));
    }

    /// Returns what wrote the words of a region; words of an earlier step are left out.
    fn writers(&self, region: Region) -> Vec<usize> {
        let words = self.last.get(region.range()).unwrap_or_default();
        words.iter().flatten().copied().collect::<BTreeSet<_>>().into_iter().collect()
    }

    /// Follows the next operation, and returns what it reads.
    fn next(&mut self, op: &Op<'_>) -> Vec<usize> {
        let (dst, third) = (op.dst(), op.third());
        let mut from: BTreeSet<usize> = self.writers(op.src()).into_iter().collect();
        if op.reads_dst() {
            from.extend(self.writers(dst));
        }
        // A linear operation works there.
        if op.matrix().is_none() {
            from.extend(self.writers(third));
        }
        self.write(dst);
        if matches!(op.kind, OpKind::LstmCell | OpKind::Denoise | OpKind::Standstill) {
            self.write(third);
        }
        self.next += 1;
        from.into_iter().collect()
    }
}

impl MatrixFacts {
    fn new(matrix: &actq_kernels::image::Matrix<'_>, widths: &Widths, i: usize) -> Self {
        let scales = || matrix.blocks().flat_map(|rows| (0..rows.block.shape().rows).map(move |i| rows.scale(i)));
        let (low, high) = scales().fold((f32::INFINITY, 0.0f32), |(low, high), s| (low.min(s), high.max(s)));
        let (name, [rows, cols], widths, error_share) = widths.layer(i);
        Self {
            name,
            shape: [rows, cols],
            widths,
            bytes: matrix.weight_bytes(),
            group: matrix.group,
            x_max: matrix.x_max,
            scales: if low.is_finite() { [low, high] } else { [0.0, 0.0] },
            error_share,
        }
    }
}

/// Returns the matrices of a graph in the order of the operations that first use them.
pub(super) fn used(graph: &Graph) -> Vec<&WeightMatrix> {
    let mut seen = BTreeSet::new();
    let products = graph.nodes.iter().flat_map(|node| node.kind.products());
    products.filter(|product| seen.insert(product.matrix)).map(|product| &graph.matrices[product.matrix]).collect()
}

/// Lists how an image was made: what the image says, and with statistics the options.
fn made(image: &Image<'_>, core: Core, stats: Option<&Stats>) -> Vec<(&'static str, String)> {
    let distinct = |values: BTreeSet<String>| values.into_iter().collect::<Vec<_>>().join(", ");
    let matrices = || image.ops().filter_map(|op| op.matrix());
    let groups = matrices().map(|matrix| match matrix.group {
        0 => "a scale for each row".to_owned(),
        columns => format!("a scale for {columns} columns"),
    });
    let activations = matrices().map(|matrix| if matrix.x_max > 127 { "int16" } else { "int8" }.to_owned());
    let mut list = Vec::new();
    if let Some(stats) = stats {
        list.extend([
            ("method", printable(&stats.method).into_owned()),
            ("budget", stats.budget.to_string()),
            ("seed", stats.seed.to_string()),
            ("steps of distillation", stats.steps.to_string()),
            ("other options", printable(&stats.options.join(" ")).into_owned()),
            ("made by actq", printable(&stats.actq).into_owned()),
        ]);
    }
    list.extend([
        ("scales", distinct(groups.collect())),
        ("activations", distinct(activations.collect())),
        ("layouts", format!("of {}", core.title())),
    ]);
    list
}
