//! Actions of an image and of the f32 policy on recordings, and the image for the page to run.

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

use super::facts::used;
use super::{encoded, packed};

/// Most MACs of the image over a recording, about a second of each network on a host.
const MAX_MACS: usize = 1_000_000_000;
/// Observations that are always compared, if recorded.
const MIN_STEPS: usize = 200;
/// Observations over which the rounding of activations is measured.
const LAYER_STEPS: usize = 100;
/// Most values of the drawn episodes, and most words of the listed observations.
const MAX_DRAWN: usize = 16_000;
const MAX_LISTED: usize = 12_000;
/// Most episodes that are drawn.
const DRAWN_EPISODES: usize = 4;
/// Most bytes of a golden run.
const MAX_GOLDEN: usize = 64_000;
/// Most f32 weights that a page has whole; of more it has 16 bits each.
const MAX_F32_WEIGHTS: usize = 180_000;
/// Most weights of an f32 policy in a page, so that it takes at most 1.5 MB beside the image.
const MAX_WEIGHTS: usize = 340_000;

/// Actions of the image and of the f32 policy on a recording.
#[derive(Debug, Serialize)]
pub struct Runs {
    /// The recording's name.
    pub recording: String,
    /// Observations in it.
    pub recorded: usize,
    /// Error of the network's raw output on it, as `actq eval` prints it; `None` for images with raw inputs.
    pub nmse: Option<(f64, usize)>,
    /// Error of the image: of the raw output, or else the mean over the actions that vary.
    pub error: Option<f64>,
    /// Compared observations, from its start.
    pub compared: usize,
    /// Errors of each action: over its variance, if it varies, and the largest.
    pub actions: Vec<(Option<f64>, f32)>,
    /// Error that rounding its input adds to an operation's output, over the output's variance.
    pub rounding: Vec<Option<f64>>,
    /// The first episode, and those of the largest errors: a part of each.
    pub traces: Vec<Trace>,
    /// Number of observations in the percent with the largest errors, of those on which the network ran.
    pub percent: usize,
    /// The first of that percent.
    pub worst: Vec<Worst>,
}

/// A part of an episode.
#[derive(Clone, Debug, Serialize)]
pub struct Trace {
    /// Episode and first step, from 0.
    pub at: [usize; 2],
    /// Actions of the f32 policy and of the image, step by step: f32 in base64.
    pub actions: [String; 2],
}

/// An observation with its actions.
#[derive(Clone, Debug, Serialize)]
pub struct Worst {
    /// Episode and step, from 0.
    pub at: [usize; 2],
    /// Squared error over the variance, mean over the actions that vary.
    pub error: f64,
    /// The observation: f32 in base64, as the actions.
    pub observation: String,
    /// Actions of the f32 policy and of the image.
    pub actions: [String; 2],
    /// States of the heads before the step, of the f32 policy and of the image: base64.
    pub states: [String; 2],
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
        let used = used(graph);
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

/// A step of a recording.
struct Step<'a> {
    /// Episode and step, from 0.
    at: [usize; 2],
    /// `true` if the network runs; `false` if the rest of a chunk plays.
    runs: bool,
    action: &'a [f32],
}

/// Runs a network over the recording: `lengths` are the steps of each episode from its start. `before` receives episode,
/// step and the head before a step, `after` the step.
fn play(
    image: Image<'_>,
    products: Option<&Products<'_>>,
    dataset: &Dataset,
    lengths: &[usize],
    mut before: impl FnMut([usize; 2], &Head<'_, '_>) -> Result<(), Error>,
    mut after: impl FnMut(&Step<'_>),
) -> Result<()> {
    with_head::<_, Error>(image, |head| {
        for (episode, length) in lengths.iter().enumerate() {
            head.reset();
            if let Some(start) = dataset.start(episode) {
                head.state_mut().iter_mut().zip(start).for_each(|(to, from)| *to = from);
            }
            for (step, row) in dataset.episode(episode).enumerate().take(*length) {
                // The noise of an iterative head follows the observation; the head makes its own.
                let (at, observation) = ([episode, step], &row[..image.obs_len()]);
                let failed = |error: StepError| {
                    Error::input(format!("{}: episode {episode}, step {step}: {error}", dataset.path.display()))
                };
                before(at, head)?;
                let (runs, action) = match products {
                    Some(products) => (true, products.step(head, observation).map_err(failed)?),
                    None => {
                        head.begin_ops(observation).map_err(failed)?;
                        (head.next_op().is_some(), head.finish_ops().map_err(failed)?)
                    }
                };
                after(&Step { at, runs, action });
            }
        }
        Ok(())
    })?;
    Ok(())
}

/// Encodes values for the page.
fn floats(values: impl IntoIterator<Item = f32>) -> String {
    encoded(&bytes_of(values.into_iter().map(f32::to_bits)))
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

/// A compared observation.
struct Compared {
    at: [usize; 2],
    /// `true` if the network ran on it.
    ran: bool,
    error: f64,
    /// Actions of the f32 policy and of the image.
    actions: [Vec<f32>; 2],
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
    let mut all: Vec<Compared> = Vec::with_capacity(steps);
    let mut left = steps;
    let take = |length: &usize| {
        let taken = left.min(*length);
        left -= taken;
        taken
    };
    let lengths: Vec<usize> = dataset.length.iter().map(take).collect();
    let nothing = |_: [usize; 2], _: &Head<'_, '_>| Ok(());
    play(whole, Some(&products), dataset, &lengths, nothing, |step| {
        all.push(Compared { at: step.at, ran: true, error: 0.0, actions: [step.action.to_vec(), Vec::new()] });
    })?;
    let mut next = all.iter_mut();
    play(image, None, dataset, &lengths, nothing, |step| {
        if let Some(one) = next.next() {
            (one.ran, one.actions[1]) = (step.runs, step.action.to_vec());
        }
    })?;
    let mut moments = vec![Moments::default(); image.act_len()];
    for Compared { actions: [exact, given], .. } in &all {
        moments.iter_mut().zip(exact.iter().zip(given)).for_each(|(moments, (x, y))| moments.add(*x, *y));
    }
    let varying = moments.iter().filter(|m| m.variance(steps).is_some()).count().max(1) as f64;
    for Compared { error, actions: [exact, given], .. } in &mut all {
        let relative = |(moments, (x, y)): (&Moments, (&f32, &f32))| {
            Some((f64::from(*x) - f64::from(*y)).powi(2) / moments.variance(steps)?)
        };
        *error = moments.iter().zip(exact.iter().zip(&*given)).filter_map(relative).sum::<f64>() / varying;
    }
    let actions: Vec<_> = moments.iter().map(|m| (m.nmse(steps), m.max)).collect();
    let known: Vec<f64> = actions.iter().filter_map(|(nmse, _)| *nmse).collect();
    let mean = (!known.is_empty()).then(|| known.iter().sum::<f64>() / known.len() as f64);
    let mut worst: Vec<&Compared> = all.iter().filter(|one| one.ran).collect();
    worst.sort_by(|a, b| b.error.total_cmp(&a.error));
    let percent = worst.len().div_ceil(100);
    worst.truncate(percent);
    let traces = traces(&all, &worst, image.act_len());
    let words = |head: Image<'_>| with_head::<_, Error>(head, |head| Ok(head.saved_len() / 4));
    let each = image.obs_len() + 2 * image.act_len() + words(image)? + words(whole)?;
    worst.truncate((MAX_LISTED / each).max(5));
    Ok(Runs {
        recording: actq::text::printable(&dataset.name()).into_owned(),
        recorded: dataset.frames(),
        nmse,
        error: nmse.map(|(nmse, _)| nmse).or(mean),
        compared: steps,
        actions,
        rounding: rounding(image, dataset)?,
        traces,
        percent,
        worst: listed([(whole, Some(&products)), (image, None)], dataset, &worst)?,
    })
}

/// Takes the parts of episodes that are drawn.
fn traces(all: &[Compared], worst: &[&Compared], act_len: usize) -> Vec<Trace> {
    let mut places = vec![[0, 0]];
    for at in worst.iter().map(|one| one.at) {
        if places.len() < DRAWN_EPISODES && places.iter().all(|place| place[0] != at[0]) {
            places.push(at);
        }
    }
    let drawn = (MAX_DRAWN / (2 * act_len * places.len())).max(50);
    let trace = |[episode, step]: [usize; 2]| {
        // The step is in the part, with what led to it.
        let first = (step + 1).saturating_sub(drawn * 3 / 4);
        let part: Vec<&Compared> =
            all.iter().filter(|one| one.at[0] == episode && one.at[1] >= first).take(drawn).collect();
        let actions = [0, 1].map(|which| floats(part.iter().flat_map(|one| one.actions[which].iter().copied())));
        Trace { at: [episode, first], actions }
    };
    places.into_iter().map(trace).collect()
}

/// Runs the episodes of the observations with the largest errors again, and takes the states before these. The heads are
/// those of the f32 policy and of the image.
fn listed(
    heads: [(Image<'_>, Option<&Products<'_>>); 2],
    dataset: &Dataset,
    worst: &[&Compared],
) -> Result<Vec<Worst>> {
    let mut found: Vec<Worst> = Vec::new();
    for Compared { at, error, actions, .. } in worst {
        let actions = actions.each_ref().map(|values| floats(values.iter().copied()));
        let row = dataset.episode(at[0]).nth(at[1]).unwrap_or_default();
        let observation = floats(row.into_iter().take(heads[0].0.obs_len()));
        found.push(Worst { at: *at, error: *error, observation, actions, states: Default::default() });
    }
    let needed = |episode| worst.iter().filter(|one| one.at[0] == episode).map(|one| one.at[1] + 1).max().unwrap_or(0);
    let lengths: Vec<usize> = (0..dataset.length.len()).map(needed).collect();
    for (which, (image, products)) in heads.into_iter().enumerate() {
        let keep = |at: [usize; 2], head: &Head<'_, '_>| {
            if let Some(one) = found.iter_mut().find(|one| one.at == at) {
                let mut state = vec![0; head.saved_len()];
                head.save(&mut state).map_err(|error| Error::input(format!("internal error: {error}")))?;
                one.states[which] = encoded(&state);
            }
            Ok(())
        };
        play(image, products, dataset, &lengths, keep, |_| ())?;
    }
    Ok(found)
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
                let (OpKind::Linear { accumulate, .. }, Some(weights), Some(matrix)) =
                    (op.kind, &weights[i], op.matrix())
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

#[cfg(test)]
mod tests {
    use super::*;

    /// Largest page without its image, in bytes.
    const MAX_PAGE: usize = 1_500_000;
    /// Bytes of the facts of an image: names, ranges, widths of rows.
    const FACTS: usize = 60_000;

    #[test]
    fn a_page_has_at_most_a_megabyte_and_a_half_beside_its_image() {
        let base64 = |bytes: usize| (4 * bytes).div_ceil(3);
        let runs = base64(MAX_GOLDEN) + base64(4 * MAX_DRAWN) + base64(4 * MAX_LISTED);
        let rest = super::super::code_bytes() + runs + FACTS;
        for (weights, bytes) in [(MAX_F32_WEIGHTS, 4), (MAX_WEIGHTS, 2)] {
            // The image of the policy's operations has codes of 2 bits.
            let page = rest + base64(bytes * weights) + base64(weights / 4);
            assert!(page <= MAX_PAGE, "{weights} weights of {bytes} bytes: {page} bytes");
        }
    }

    #[test]
    fn the_document_has_the_limits_of_a_page() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/REPORT.md");
        // A published crate has no documents.
        let Ok(text) = std::fs::read_to_string(path) else { return };
        for limit in [MAX_F32_WEIGHTS, MAX_WEIGHTS] {
            let limit = format!("{},{:03} ", limit / 1000, limit % 1000);
            assert!(text.contains(&limit), "docs/REPORT.md does not name {limit}");
        }
    }
}
