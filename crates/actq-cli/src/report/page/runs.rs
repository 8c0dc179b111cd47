//! Actions of an image and of the f32 policy on recordings, and the image for the page to run.

use std::collections::BTreeSet;

use actq::budget::Budget;
use actq::data::{Dataset, Recordings};
use actq::error::Error;
use actq::measure::size::distinct;
use actq::measure::unrounded::dequantized;
use actq::methods::{Method, Options};
use actq::pipeline::Quantizer;
use actq::policy::Policy;
use actq::runtime::{ImageBuffer, with_head};
use actq_kernels::image::{Op, OpKind};
use actq_kernels::{Head, Image, StepError, Width};
use actq_wasm::Products;
use anyhow::{Context as _, Result, ensure};
use ndarray::ArrayView1;
use serde::Serialize;

use super::{encoded, packed};

/// Most MACs of the image over a recording, about a second of each network on a host.
const MAX_MACS: usize = 1_000_000_000;
/// Observations that are always compared, if recorded.
const MIN_STEPS: usize = 200;
/// Observations over which the rounding of activations is measured.
const LAYER_STEPS: usize = 100;
/// Most values of a drawn episode, and of the listed observations.
const MAX_DRAWN: usize = 16_000;
const MAX_LISTED: usize = 6_000;
/// Most bytes of a golden run.
const MAX_GOLDEN: usize = 64_000;
/// Most f32 weights that a page has whole; of more it has 16 bits each.
const MAX_F32_WEIGHTS: usize = 210_000;
/// Most weights of an f32 policy in a page, so that it takes at most 1.5 MB beside the image.
const MAX_WEIGHTS: usize = 370_000;

/// Actions of the image and of the f32 policy on a recording.
#[derive(Debug, Serialize)]
pub struct Runs {
    /// The recording's name.
    pub recording: String,
    /// Observations in it.
    pub recorded: usize,
    /// Error of the network's raw output on it, as `actq eval` prints it; `None` for images with raw inputs.
    pub nmse: Option<(f64, usize)>,
    /// Compared observations, from its start.
    pub compared: usize,
    /// Errors of each action: over its variance, if it varies, and the largest.
    pub actions: Vec<(Option<f64>, f32)>,
    /// Error that rounding its input adds to an operation's output, over the output's variance.
    pub rounding: Vec<Option<f64>>,
    /// Actions of an episode, one list a dimension: of the f32 policy, and of the image.
    pub trace: [Vec<Vec<f32>>; 2],
    /// The percent of observations with the largest errors.
    pub worst: Vec<Worst>,
}

/// An observation with its actions.
#[derive(Clone, Debug, Serialize)]
pub struct Worst {
    /// Episode and step, from 0.
    pub at: [usize; 2],
    /// Squared error over the variance, mean over the actions that vary.
    pub error: f64,
    /// The observation.
    pub observation: Vec<f32>,
    /// Actions of the f32 policy and of the image.
    pub actions: [Vec<f32>; 2],
}

/// The image as the page runs it.
#[derive(Debug, Serialize)]
pub struct HeadData {
    /// Its bytes, in base64, as all arrays here.
    pub image: String,
    /// Ranges of the observation's values: those recorded, or else those accepted.
    pub ranges: Vec<[f32; 2]>,
    /// An observation to start from.
    pub start: Vec<f32>,
    /// Observations after a reset, f32.
    pub observations: String,
    /// Bits of this host's actions for them, u32.
    pub actions: String,
    /// The policy before it was quantized, if it is small enough for a page.
    pub reference: Option<ReferenceData>,
}

/// The policy before it was quantized, as the page runs it.
#[derive(Debug, Serialize)]
pub struct ReferenceData {
    /// An image of its operations, by gzip.
    pub image: String,
    /// Rows and columns of its matrices.
    pub shapes: Vec<[usize; 2]>,
    /// Bits of a weight: 32 are an f32; 16 an integer times the row's scale.
    pub bits: u32,
    /// The weights, then the rows' scales.
    pub weights: String,
}

/// The policy in f32: an image of its operations, and its weights.
#[derive(Debug)]
pub struct Reference {
    buffer: ImageBuffer,
    weights: Vec<f32>,
    shapes: Vec<[usize; 2]>,
}

impl Reference {
    /// Makes an image of the policy's operations; the codes of its weights have no meaning.
    ///
    /// # Errors
    ///
    /// If the policy cannot be made into an image.
    pub fn of(policy: &Policy) -> Result<Self> {
        let none = Recordings::default();
        let options = Options { group: 0, ..Options::new(Method::Rtn, Budget::Width(Width::W2)) };
        let quantizer = Quantizer::new(policy, &none, Method::Rtn, None, |_| {})?;
        let quantized = quantizer.quantize(&options, |_: &str, _: f64| {})?;
        let buffer = ImageBuffer::new(&quantized.whole_image()?);
        let graph = &quantized.policy.graph;
        let mut seen = BTreeSet::new();
        let products = graph.nodes.iter().flat_map(|node| node.kind.products());
        let used =
            products.filter(|product| seen.insert(product.matrix)).map(|product| &graph.matrices[product.matrix]);
        let used: Vec<_> = used.collect();
        let shapes: Vec<[usize; 2]> = used.iter().map(|matrix| [matrix.rows, matrix.cols]).collect();
        let weights = used.iter().flat_map(|matrix| matrix.data.iter().copied()).collect();
        let reference = Self { buffer, weights, shapes };
        let of_image: Vec<[usize; 2]> = distinct(&reference.image()?).iter().map(|m| [m.rows, m.cols]).collect();
        ensure!(reference.shapes == of_image, "internal error: the image of the policy has other matrices");
        Ok(reference)
    }

    fn image(&self) -> Result<Image<'_>> {
        Ok(Image::new_checked(self.buffer.bytes())?)
    }

    /// Returns it for a page: whole, or with weights of 16 bits.
    fn data(&self) -> Result<ReferenceData> {
        let image = packed(self.buffer.bytes())?;
        let shapes = self.shapes.clone();
        if self.weights.len() <= MAX_F32_WEIGHTS {
            let weights = encoded(&bytes_of(self.weights.iter().map(|weight| weight.to_bits())));
            return Ok(ReferenceData { image, shapes, bits: 32, weights });
        }
        let (mut levels, mut scales) = (Vec::new(), Vec::new());
        let mut rest = &self.weights[..];
        for &[rows, cols] in &self.shapes {
            let (matrix, after) = rest.split_at(rows * cols);
            rest = after;
            for row in matrix.chunks(cols) {
                let most = row.iter().fold(0.0f32, |most, weight| most.max(weight.abs()));
                let scale = if most > 0.0 { most / f32::from(i16::MAX) } else { 1.0 };
                levels.extend(row.iter().flat_map(|weight| ((weight / scale).round() as i16).to_le_bytes()));
                scales.push(scale.to_bits());
            }
        }
        levels.resize(levels.len().next_multiple_of(4), 0);
        levels.extend(bytes_of(scales.into_iter()));
        Ok(ReferenceData { image, shapes, bits: 16, weights: encoded(&levels) })
    }
}

fn bytes_of(words: impl Iterator<Item = u32>) -> Vec<u8> {
    words.flat_map(u32::to_le_bytes).collect()
}

/// Runs a network over the recording's first `steps` observations, each episode from its start. `run` receives episode,
/// step, observation and action.
fn play(
    image: Image<'_>,
    products: Option<&Products<'_>>,
    dataset: &Dataset,
    steps: usize,
    mut run: impl FnMut([usize; 2], &[f32], &[f32]),
) -> Result<()> {
    let mut left = steps;
    with_head::<_, Error>(image, |head| {
        for episode in 0..dataset.length.len() {
            head.reset();
            if let Some(start) = dataset.start(episode) {
                head.state_mut().iter_mut().zip(start).for_each(|(to, from)| *to = from);
            }
            for (step, row) in dataset.episode(episode).enumerate().take(left) {
                // The noise of an iterative head follows the observation; the head makes its own.
                let observation = &row[..image.obs_len()];
                let action = match products {
                    Some(products) => products.step(head, observation),
                    None => head.step(observation),
                };
                let at = |error: StepError| {
                    Error::input(format!("{}: episode {episode}, step {step}: {error}", dataset.path.display()))
                };
                run([episode, step], observation, action.map_err(at)?);
            }
            left -= dataset.length[episode].min(left);
        }
        Ok(())
    })?;
    Ok(())
}

/// Sums of errors of an action.
#[derive(Clone, Copy, Default)]
struct Moments {
    square: f64,
    max: f32,
    sum: f64,
    signal: f64,
}

impl Moments {
    fn add(&mut self, exact: f32, given: f32) {
        self.square += (f64::from(exact) - f64::from(given)).powi(2);
        self.max = self.max.max((exact - given).abs());
        self.sum += f64::from(exact);
        self.signal += f64::from(exact).powi(2);
    }

    /// Returns the variance of the exact values; `None` if they do not vary.
    fn variance(&self, count: usize) -> Option<f64> {
        let count = count as f64;
        let variance = self.signal / count - (self.sum / count).powi(2);
        (variance > 1e-12 * self.signal / count).then_some(variance)
    }

    fn nmse(&self, count: usize) -> Option<f64> {
        Some(self.square / count as f64 / self.variance(count)?)
    }
}

/// Returns the MACs of a step of the network.
pub(crate) fn macs(image: &Image<'_>) -> usize {
    let of_ops = image.ops().filter_map(|op| op.matrix()).map(|matrix| matrix.rows * matrix.cols);
    of_ops.sum::<usize>() * image.denoising_steps()
}

/// Compares the image with the f32 policy on a recording.
///
/// # Errors
///
/// If the recording is empty, or one of both cannot run on it.
pub fn compare(image: Image<'_>, reference: &Reference, dataset: &Dataset, nmse: Option<(f64, usize)>) -> Result<Runs> {
    let macs = macs(&image).max(reference.weights.len() * image.denoising_steps());
    let steps = dataset.frames().min((MAX_MACS / macs.max(1)).max(MIN_STEPS));
    ensure!(steps > 0, "{}: the recording has no observation", dataset.path.display());
    let whole = reference.image()?;
    let products = Products::new(&whole, &reference.weights).map_err(anyhow::Error::msg)?;
    let mut all: Vec<Worst> = Vec::with_capacity(steps);
    play(whole, Some(&products), dataset, steps, |at, observation, action| {
        let actions = [action.to_vec(), Vec::new()];
        all.push(Worst { at, error: 0.0, observation: observation.to_vec(), actions });
    })?;
    let mut i = 0;
    play(image, None, dataset, steps, |_, _, action| {
        all[i].actions[1] = action.to_vec();
        i += 1;
    })?;
    let mut moments = vec![Moments::default(); image.act_len()];
    for Worst { actions: [exact, given], .. } in &all {
        moments.iter_mut().zip(exact.iter().zip(given)).for_each(|(moments, (x, y))| moments.add(*x, *y));
    }
    let varying = moments.iter().filter(|m| m.variance(steps).is_some()).count().max(1) as f64;
    for Worst { error, actions: [exact, given], .. } in &mut all {
        let relative = |(moments, (x, y)): (&Moments, (&f32, &f32))| {
            Some((f64::from(*x) - f64::from(*y)).powi(2) / moments.variance(steps)?)
        };
        *error = moments.iter().zip(exact.iter().zip(&*given)).filter_map(relative).sum::<f64>() / varying;
    }
    let drawn = (MAX_DRAWN / (2 * image.act_len())).max(50);
    let episode: Vec<&Worst> = all.iter().take_while(|one| one.at[0] == 0).take(drawn).collect();
    let trace = [0, 1].map(|which| {
        (0..image.act_len()).map(|dim| episode.iter().map(|one| one.actions[which][dim]).collect()).collect()
    });
    let listed = (MAX_LISTED / (image.obs_len() + 2 * image.act_len())).max(5);
    let rounding = rounding(image, dataset)?;
    all.sort_by(|a, b| b.error.total_cmp(&a.error));
    all.truncate(steps.div_ceil(100).min(listed));
    Ok(Runs {
        recording: actq::text::printable(&dataset.name()).into_owned(),
        recorded: dataset.frames(),
        nmse,
        compared: steps,
        actions: moments.iter().map(|m| (m.nmse(steps), m.max)).collect(),
        rounding,
        trace,
        worst: all,
    })
}

/// Measures for each operation the error that rounding its input adds to its output.
fn rounding(image: Image<'_>, dataset: &Dataset) -> Result<Vec<Option<f64>>> {
    let ops: Vec<Op<'_>> = image.ops().collect();
    let weights: Vec<_> = ops.iter().map(|op| op.matrix().map(|matrix| dequantized(&matrix))).collect();
    let mut moments = vec![Moments::default(); ops.len()];
    let mut counts = vec![0; ops.len()];
    with_head::<_, Error>(image, |head| {
        for row in dataset.episode(0).take(LAYER_STEPS) {
            head.begin_ops(&row[..image.obs_len()])?;
            while let Some(i) = head.next_op() {
                let (op, floats) = (&ops[i], |head: &Head<'_, '_>, range: std::ops::Range<usize>| -> Vec<f32> {
                    head.arena()[range].iter().map(|word| f32::from_bits(*word)).collect()
                });
                let (x, before) = (floats(head, op.src().range()), floats(head, op.dst().range()));
                head.run_op()?;
                let (OpKind::Linear { accumulate }, Some(weights), Some(matrix)) = (op.kind, &weights[i], op.matrix())
                else {
                    continue;
                };
                let sums = weights.dot(&ArrayView1::from(&x));
                for (row, (sum, given)) in sums.iter().zip(floats(head, op.dst().range())).enumerate() {
                    let start = if accumulate { before[row] } else { 0.0 };
                    moments[i].add(start + matrix.bias(row) + sum, given);
                    counts[i] += 1;
                }
            }
            head.finish_ops()?;
        }
        Ok(())
    })?;
    Ok(moments.iter().zip(counts).map(|(m, count)| if count > 0 { m.nmse(count) } else { None }).collect())
}

impl HeadData {
    /// Takes the image of `bytes`, and what it did on a recording, or else on its self-test.
    ///
    /// # Errors
    ///
    /// If the image cannot run on it.
    pub fn new(
        image: Image<'_>,
        bytes: &[u8],
        dataset: Option<&Dataset>,
        reference: Option<&Reference>,
    ) -> Result<Self> {
        let values = |words: &[u32]| words.iter().map(|word| f32::from_bits(u32::from_le(*word))).collect::<Vec<f32>>();
        let most = MAX_GOLDEN / (4 * (image.obs_len() + image.act_len()));
        let observations: Vec<Vec<f32>> = match dataset.filter(|dataset| dataset.frames() > 0) {
            Some(dataset) => dataset.episode(0).take(most.max(1)).map(|row| row[..image.obs_len()].to_vec()).collect(),
            None => {
                (0..image.self_test_steps()).filter_map(|i| image.self_test(i)).map(|(obs, _)| values(obs)).collect()
            }
        };
        let mut actions = Vec::new();
        with_head::<_, Error>(image, |head| {
            for observation in &observations {
                actions.extend(head.step(observation)?.iter().map(|value| value.to_bits()));
            }
            Ok(())
        })
        .context("the golden run")?;
        let mut seen = vec![[f32::INFINITY, f32::NEG_INFINITY]; image.obs_len()];
        let mut see = |value: f32, i: usize| seen[i] = [seen[i][0].min(value), seen[i][1].max(value)];
        observations.iter().for_each(|row| row.iter().enumerate().for_each(|(i, value)| see(*value, i)));
        for row in dataset.into_iter().flat_map(Dataset::observations) {
            row.iter().take(image.obs_len()).enumerate().for_each(|(i, value)| see(*value, i));
        }
        let ranges = seen.into_iter().zip(accepted(&image)).map(|(seen, own)| {
            widened(match seen {
                [low, high] if low < high => seen,
                // A constant stays within reach.
                [low, high] if low == high => [own[0].max(low - 1.0), own[1].min(high + 1.0)],
                _ => own,
            })
        });
        Ok(Self {
            image: encoded(bytes),
            ranges: ranges.collect(),
            start: observations.first().cloned().unwrap_or_else(|| vec![0.0; image.obs_len()]),
            observations: encoded(&bytes_of(observations.iter().flatten().map(|value| value.to_bits()))),
            actions: encoded(&bytes_of(actions.into_iter())),
            reference: reference.filter(|one| one.weights.len() <= MAX_WEIGHTS).map(Reference::data).transpose()?,
        })
    }
}

/// Returns the range that each value of an observation may have.
fn accepted(image: &Image<'_>) -> Vec<[f32; 2]> {
    let inputs = image.ports().filter(|port| port.kind == actq_kernels::PortKind::Input);
    let ranges: Vec<[f32; 2]> = inputs.flat_map(|port| vec![port.range; port.len]).collect();
    if ranges.is_empty() { vec![[f32::NEG_INFINITY, f32::INFINITY]; image.obs_len()] } else { ranges }
}

/// Makes a range that a slider can have.
fn widened([low, high]: [f32; 2]) -> [f32; 2] {
    match (low.is_finite(), high.is_finite()) {
        (true, true) => [low, high],
        (true, false) => [low, low + 2.0],
        (false, true) => [high - 2.0, high],
        (false, false) => [-1.0, 1.0],
    }
}
