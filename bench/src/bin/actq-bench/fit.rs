//! `cargo xtask fit`: the rates of the cost model (`kernels/src/pace/`), from counted operations.
//!
//! Images with many shapes of every operation run under QEMU; every operation, and every whole step, is a sample: how many of
//! each feature it has, and what it took. The rates are the least squares of the relative errors. A feature that others
//! determine, or whose rate would be negative, gets the rate 0.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::Path;

use actq::contract::{Ensemble, Playback};
use actq::emit::{self, files};
use actq::graph::Denoising;
use actq::graph::ops::{Add, Gru, Iterate, LayerNorm, Lstm, Mul, Normalize, Pointwise, RmsNorm, Table};
use actq::methods::{Activations, Outcome};
use actq::policy::Policy;
use actq::random::Random;
use actq::runtime::ImageBuffer;
use actq_bench::networks::{Builder, accumulating};
use actq_bench::qemu::Counter;
use actq_bench::{Target, firmware, profile, root};
use actq_kernels::Width;
use actq_kernels::image::{Kind, Op, OpKind, op};
use actq_kernels::math::Function;
use actq_kernels::ops::denoise::Coefficients;
use actq_kernels::pace::cost::{self, Cost, Feature};
use anyhow::Result;

/// Rows and columns of the matrices: strips of all heights, runs of more than one, columns with and without a rest.
const SHAPES: [(usize, usize); 28] = [
    (4, 8),
    (8, 8),
    (8, 18),
    (12, 30),
    (16, 32),
    (3, 64),
    (20, 64),
    (64, 64),
    (128, 48),
    (33, 100),
    (96, 100),
    (16, 128),
    (48, 128),
    (72, 200),
    (30, 235),
    (8, 256),
    (64, 256),
    (128, 256),
    (20, 320),
    (40, 330),
    (6, 512),
    (24, 512),
    (12, 517),
    (16, 700),
    (40, 96),
    (100, 72),
    (320, 40),
    (288, 128),
];
/// Lengths of elementwise operations, and of the states of cells.
const LENGTHS: [usize; 5] = [8, 33, 64, 100, 256];
const HIDDEN: [usize; 4] = [8, 24, 64, 100];
/// Actions of chunks, and values of an action.
const CHUNKS: [(usize, usize); 5] = [(2, 3), (8, 7), (16, 2), (20, 14), (50, 6)];
/// Longest observation.
const OBSERVATION: usize = 700;
/// Steps with standard normal observations, whose cost is the expected one.
const NORMAL: usize = 6;
/// How many of the worst samples are shown.
const WORST: usize = 8;
/// A budget that limits nothing and is counted all the same.
const AMPLE: u32 = 100_000_000;

/// A counted operation or step.
struct Sample {
    /// What it is, for people.
    name: String,
    features: BTreeMap<Feature, f64>,
    cost: Cost,
    /// Whether the values were drawn as the expected cost has them.
    expected: bool,
}

pub(crate) fn run() -> Result<()> {
    let elf = firmware::harness(Target::Fpu)?;
    let counter = Counter::build()?;
    let mut samples = Vec::new();
    let mut polls = Vec::new();
    for (name, bytes) in images()? {
        println!("measuring {name}");
        measure((&name, &bytes), &elf, &counter, &mut samples, &mut polls)?;
    }
    let expected: Vec<&Sample> = samples.iter().filter(|s| s.expected).collect();
    let instructions = solve(&expected, |c| c.instructions);
    let cycles = solve(&expected, |c| c.cycles);
    for (what, rates, of) in
        [("instructions", &instructions, (|c| c.instructions) as fn(Cost) -> u64), ("cycles", &cycles, |c| c.cycles)]
    {
        let error = |s: &&&Sample| predicted(s, rates) / of(s.cost) as f64 - 1.0;
        let mut by_error: Vec<&&Sample> = expected.iter().collect();
        by_error.sort_by(|a, b| error(b).abs().total_cmp(&error(a).abs()));
        by_error.dedup_by_key(|s| &s.name);
        for s in by_error.iter().take(WORST) {
            println!("  {:+.2}% of {} in {}", 1e2 * error(s), of(s.cost), s.name);
        }
        let worst = by_error.first().map_or(0.0, |s| error(s).abs());
        let mean = (expected.iter().map(|s| error(&s).powi(2)).sum::<f64>() / expected.len() as f64).sqrt();
        println!(
            "{what}: {} samples, error {:.2}% root mean square, {:.2}% at most",
            expected.len(),
            1e2 * mean,
            1e2 * worst
        );
    }
    let mut most = most(&samples, &polls, &instructions);
    println!("measuring polls");
    let resumed = resumed(&elf, &counter, &most)?;
    most.insert(Feature::RESUMED, resumed);
    let path = root().join("kernels/src/pace/rates.rs");
    files::write(&path, table(&instructions, &cycles, &most).as_bytes())?;
    println!("{}: written", path.display());
    Ok(())
}

type Rates = BTreeMap<Feature, f64>;

fn predicted(sample: &Sample, rates: &Rates) -> f64 {
    sample.features.iter().map(|(feature, n)| n * rates.get(feature).copied().unwrap_or(0.0)).sum()
}

/// The rates as the source of the kernels' table: a feature's debug text is its key.
fn table(instructions: &Rates, cycles: &Rates, most: &Rates) -> String {
    let mut text =
        "//! Written by `cargo xtask fit`: expected instructions, expected cycles, instructions at most.\n\n\
                    use super::feature::{Feature, Gemv, Prepare, Scales::*, Strips::*};\n\
                    use crate::image::op;\n\
                    use crate::layout::{Lanes::*, Width::*};\n\
                    use crate::math::Function;\n\n\
                    #[rustfmt::skip]\npub(super) const RATES: &[(Feature, [f64; 3])] = &[\n"
            .to_owned();
    for feature in Feature::all() {
        let rate = |rates: &Rates| rates.get(&feature).copied().unwrap_or(0.0);
        let [a, b, c] = [instructions, cycles, most].map(rate);
        let _ = writeln!(text, "    ({feature:?}, [{a:.3}, {b:.3}, {c:.3}]),");
    }
    text + "];\n"
}

/// Runs an image, in steps and by operations; `polls` gets what a limit adds to an operation, and the pieces of it.
fn measure(
    (name, bytes): (&str, &[u8]),
    elf: &Path,
    counter: &Counter,
    samples: &mut Vec<Sample>,
    polls: &mut Vec<(f64, usize)>,
) -> Result<()> {
    let buffer = ImageBuffer::new(bytes);
    let image = buffer.image(Path::new(name))?;
    let observations = observations(image.obs_len());
    let frame = features(|add| cost::frame(&image, add));
    let ops: Vec<Op<'_>> = image.ops().collect();
    let of_ops: Vec<_> = ops.iter().map(|op| features(|add| cost::features(op, add))).collect();
    // There is nothing to lead over from before the second chunk.
    let expected = |step| (usize::from(image.overlap() > 0)..NORMAL).contains(&step);
    let steps = profile::steps(elf, counter, bytes, &observations)?;
    for (step, cost) in steps.into_iter().enumerate() {
        let mut all = frame.clone();
        of_ops.iter().flatten().for_each(|(feature, n)| *all.entry(*feature).or_default() += n);
        samples.push(Sample { name: format!("{name}, a step"), features: all, cost, expected: expected(step) });
    }
    let single = profile::parts(elf, counter, &image, bytes, &observations, u32::MAX)?;
    let limited = profile::parts(elf, counter, &image, bytes, &observations[..1], AMPLE)?;
    for ((op, cost), plain) in ops.iter().zip(&limited[0].ops).zip(&single[0].ops) {
        polls.push((cost.instructions as f64 - plain.instructions as f64, pieces(op)));
    }
    for (step, parts) in single.into_iter().enumerate() {
        let mut sample = |what: String, cost, poll: f64, mut features: BTreeMap<Feature, f64>| {
            if poll > 0.0 {
                features.insert(Feature::POLL_OP, poll);
            }
            samples.push(Sample { name: format!("{name}, {what}"), features, cost, expected: expected(step) });
        };
        sample("begin".to_owned(), parts.begin, 0.0, features(|add| cost::begin(&image, add)));
        sample("action".to_owned(), parts.action, 1.0, features(|add| cost::action(&image, add)));
        for ((cost, of_op), op) in parts.ops.into_iter().zip(&of_ops).zip(&ops) {
            let what = match op.matrix() {
                Some(matrix) => format!("{}x{}", matrix.rows, matrix.cols),
                None => format!("{} of {}", cost::values(op).1, cost::values(op).2),
            };
            sample(what, cost, 1.0, of_op.clone());
        }
    }
    Ok(())
}

fn features(list: impl FnOnce(&mut dyn FnMut(Feature, usize))) -> BTreeMap<Feature, f64> {
    let mut features = BTreeMap::new();
    list(&mut |feature, n| {
        if n > 0 {
            *features.entry(feature).or_default() += n as f64;
        }
    });
    features
}

/// Pieces of an operation where the budget is ample.
fn pieces(op: &Op<'_>) -> usize {
    let (OpKind::Linear { accumulate }, Some(matrix)) = (op.kind, op.matrix()) else { return 1 };
    let bias = matrix.start_values(accumulate).is_none();
    let mut widths: Vec<Width> = matrix.blocks().map(|rows| rows.block.shape().width).collect();
    let blocks = widths.len();
    widths.dedup();
    1 + usize::from(bias) + widths.len() + blocks
}

/// The rates, none of them negative, with the least sum of squared relative errors (Lawson and Hanson, Solving Least Squares
/// Problems, 1974, chapter 23, on the normal equations).
fn solve(samples: &[&Sample], of: impl Fn(Cost) -> u64) -> Rates {
    let mut features: Vec<Feature> = samples.iter().flat_map(|s| s.features.keys().copied()).collect();
    features.sort();
    features.dedup();
    let place: BTreeMap<Feature, usize> = features.iter().enumerate().map(|(i, f)| (*f, i)).collect();
    let n = features.len();
    let (mut normal, mut right) = (vec![vec![0.0f64; n]; n], vec![0.0f64; n]);
    for sample in samples {
        let target = of(sample.cost) as f64;
        // Relative errors, and some instructions either way in what is short.
        let weight = 1.0 / (target + 100.0);
        let row: Vec<(usize, f64)> = sample.features.iter().map(|(f, count)| (place[f], count * weight)).collect();
        for &(i, a) in &row {
            row.iter().for_each(|&(j, b)| normal[i][j] += a * b);
            right[i] += a * target * weight;
        }
    }
    // Features of the same size, so that one measure of what is small holds for all.
    let scale: Vec<f64> = (0..n).map(|i| normal[i][i].sqrt()).collect();
    for i in 0..n {
        right[i] /= scale[i];
        (0..n).for_each(|j| normal[i][j] /= scale[i] * scale[j]);
    }
    let mut rates = vec![0.0f64; n];
    let mut used: Vec<usize> = Vec::new();
    loop {
        let gain = |i: usize| right[i] - (0..n).map(|j| normal[i][j] * rates[j]).sum::<f64>();
        let unused = (0..n).filter(|i| !used.contains(i));
        let Some((gain, next)) = unused.map(|i| (gain(i), i)).max_by(|a, b| a.0.total_cmp(&b.0)) else { break };
        if gain < 1e-7 {
            break;
        }
        used.push(next);
        loop {
            let wanted = least_squares(&normal, &right, &used);
            // As far towards the solution as no rate becomes negative; those that would are used no more.
            let share = |(&i, &x): (&usize, &f64)| if x > 0.0 { 1.0 } else { rates[i] / (rates[i] - x) };
            let step = used.iter().zip(&wanted).map(share).fold(1.0, f64::min);
            used.iter().zip(&wanted).for_each(|(&i, x)| rates[i] += step * (x - rates[i]));
            if step >= 1.0 {
                break;
            }
            used.retain(|&i| rates[i] > 1e-12);
            rates.iter_mut().enumerate().filter(|(i, _)| !used.contains(i)).for_each(|(_, rate)| *rate = 0.0);
        }
    }
    (0..n).map(|i| (features[i], rates[i] / scale[i])).collect()
}

/// The solution of the normal equations for some of the features, by elimination.
fn least_squares(normal: &[Vec<f64>], right: &[f64], used: &[usize]) -> Vec<f64> {
    let mut rows: Vec<Vec<f64>> =
        used.iter().map(|&i| used.iter().map(|&j| normal[i][j]).chain([right[i]]).collect()).collect();
    for pivot in 0..rows.len() {
        let row = rows[pivot].clone();
        // What others determine gets 0.
        let small = row[pivot] < 1e-9;
        for (i, other) in rows.iter_mut().enumerate() {
            match (i == pivot, small) {
                (true, true) => other.fill(0.0),
                (false, true) => other[pivot] = 0.0,
                (true, false) => {}
                (false, false) => {
                    let factor = other[pivot] / row[pivot];
                    other.iter_mut().zip(&row).skip(pivot).for_each(|(o, r)| *o -= factor * r);
                }
            }
        }
    }
    (0..rows.len()).map(|i| if rows[i][i] == 0.0 { 0.0 } else { rows[i][rows.len()] / rows[i][i] }).collect()
}

/// What features take at most: values whose code branches on them, and pieces.
fn most(samples: &[Sample], polls: &[(f64, usize)], rates: &Rates) -> Rates {
    let mut most = rates.clone();
    let rate = |feature: Feature| rates.get(&feature).copied().unwrap_or(0.0);
    let varying: Vec<Feature> = Function::ALL
        .into_iter()
        .map(Feature::function)
        .chain([
            Feature::value(op::NORMALIZE),
            Feature::value(op::LSTM_CELL),
            Feature::value(op::GRU_CELL),
            Feature::value(op::DENOISE),
            Feature::LIMITED,
            Feature::CONTRACT,
            Feature::FORESEEN_VALUE,
            Feature::LED,
        ])
        .collect();
    // Whole steps differ in much; only parts of them by themselves say what a value takes.
    for sample in samples.iter().filter(|s| s.features.contains_key(&Feature::POLL_OP)) {
        for &feature in &varying {
            let Some(&n) = sample.features.get(&feature).filter(|n| **n >= 30.0) else { continue };
            let excess = sample.cost.instructions as f64 - predicted(sample, rates);
            let at_most = most.entry(feature).or_default();
            *at_most = at_most.max(rate(feature) + excess / n);
        }
    }
    // What a limit adds to an operation, and to each of its pieces.
    let n = polls.len() as f64;
    let [x, y] = [polls.iter().map(|p| p.1 as f64).sum::<f64>() / n, polls.iter().map(|p| p.0).sum::<f64>() / n];
    let covariance: f64 = polls.iter().map(|p| (p.1 as f64 - x) * (p.0 - y)).sum();
    let variance: f64 = polls.iter().map(|p| (p.1 as f64 - x).powi(2)).sum();
    let piece = (covariance / variance).max(0.0);
    let entered = polls.iter().map(|p| p.0 - piece * p.1 as f64).fold(0.0, f64::max);
    most.extend([(Feature::PIECE, piece), (Feature::ENTERED, entered), (Feature::POLL, rate(Feature::POLL_OP))]);
    most
}

/// What coming back to a linear operation takes for each of its blocks: from steps in short polls, whose number tells how often
/// that was. The image's least budget is that of the rates before, which need not be exact here.
fn resumed(elf: &Path, counter: &Counter, most: &Rates) -> Result<f64> {
    let known: f64 = [Feature::POLL, Feature::ENTERED, Feature::operation(op::LINEAR), Feature::PIECE]
        .map(|f| most[&f])
        .iter()
        .sum();
    let mut resumed = 0.0f64;
    for (rows, cols) in [(128, 256), (96, 100), (64, 30)] {
        for blocks in [1, 4] {
            for mixed in [false, true] {
                let width = |row: usize| Some(Width::ALL[if mixed { row % blocks } else { blocks * row / rows }]);
                let mut builder = Builder::new(cols);
                builder.linear((rows, cols), Activations::Int8, width, 0, true)?;
                let (policy, outcomes) = builder.finish("polls".to_owned(), false);
                let bytes = emit::image(&policy, &outcomes)?;
                let buffer = ImageBuffer::new(&bytes);
                let image = buffer.image(Path::new("polls"))?;
                let observations = &observations(cols)[..1];
                let sum = |arguments: &str| -> Result<(f64, usize)> {
                    let (costs, _) = profile::regions(elf, counter, &bytes, arguments, observations)?;
                    Ok((costs.iter().skip(1).map(|c| c.instructions as f64).sum(), costs.len() - 1))
                };
                let (whole, _) = sum(&format!("poll {}", u32::MAX))?;
                let (cut, polls) = sum(&format!("poll {}", image.least_budget() * 11 / 10))?;
                let excess = (cut - whole) / (polls.max(2) - 1) as f64;
                resumed = resumed.max((excess - known) / blocks as f64);
            }
        }
    }
    Ok(resumed)
}

/// Standard normal observations, and such as reach the ends of every branch.
fn observations(len: usize) -> Vec<Vec<f32>> {
    let mut random = Random::new(1);
    let normal = (0..NORMAL).map(|_| (0..len).map(|_| random.normal()).collect::<Vec<_>>()).collect::<Vec<_>>();
    let ends = [0.0, 1e-3, 1.0, -1.0, 30.0, -30.0, 1e4, -1e4];
    normal.into_iter().chain(ends.map(|x| vec![x; len])).collect()
}

/// Images with their names.
fn images() -> Result<Vec<(String, Vec<u8>)>> {
    let mut images = Vec::new();
    for (policy, outcomes) in policies()? {
        images.push((policy.name.clone(), emit::image(&policy, &outcomes)?));
    }
    let mut builder = Builder::new(OBSERVATION);
    for rows in LENGTHS {
        for _ in 0..2 {
            builder.linear((rows, 40), Activations::Int8, |_| Some(Width::W2), 0, true)?;
        }
    }
    let (policy, outcomes) = builder.finish("biases that are added".to_owned(), false);
    images.push((policy.name.clone(), accumulating(&emit::image(&policy, &outcomes)?)?));
    Ok(images)
}

fn policies() -> Result<Vec<(Policy, Vec<Outcome>)>> {
    let mut policies = Vec::new();
    for activations in [Activations::Int8, Activations::Int16] {
        for group in [0, 32, 64, 128] {
            for width in Width::ALL {
                let mut builder = Builder::new(OBSERVATION);
                for shape in SHAPES {
                    builder.linear(shape, activations, |_| Some(width), group, true)?;
                }
                policies.push(builder.finish(format!("{width:?} {activations:?} group {group}"), false));
            }
        }
        // Blocks of several widths in order, by index, and outputs without biases.
        type Widths = fn(usize, usize) -> usize;
        let in_order: Widths = |row, rows| 4 * row / rows;
        let mixed: Widths = |row, _| row * 7 % 4;
        // Two of three rows have no bits.
        let pruned: Widths = |row, _| [3, 4, 4][row % 3];
        for (name, which, bias) in [
            ("in order", in_order, true),
            ("in order, no bias", in_order, false),
            ("mixed", mixed, true),
            ("pruned", pruned, true),
            ("pruned, no bias", pruned, false),
        ] {
            let mut builder = Builder::new(OBSERVATION);
            for (rows, cols) in SHAPES {
                let width = |row| Width::ALL.get(which(row, rows)).copied();
                builder.linear((rows, cols), activations, width, 0, bias)?;
            }
            policies.push(builder.finish(format!("blocks {name}, {activations:?}"), false));
        }
    }
    // Steps with hardly any work.
    for (observation, action, contract) in
        [(8, 8, false), (40, 2, true), (256, 30, false), (256, 30, true), (40, 12, true)]
    {
        let mut builder = Builder::new(observation);
        builder.part(action)?;
        policies.push(builder.finish(format!("{observation} to {action}, contract {contract}"), contract));
    }
    for (name, contract) in [("functions", false), ("functions with contract", true)] {
        let mut builder = Builder::new(if contract { OBSERVATION } else { 256 });
        for len in LENGTHS {
            for function in Function::ALL {
                let input = builder.part(len)?;
                builder.node(Pointwise(function), &[input])?;
            }
            let [mean, scale] = [builder.values(len), vec![1.5; len]];
            builder
                .node_of_part(len, Normalize { mean: mean.clone(), scale: scale.clone(), pre_clip: 10.0, clip: 5.0 })?;
            let limitless = f32::INFINITY;
            builder.node_of_part(
                len,
                Normalize { mean: mean.clone(), scale: scale.clone(), pre_clip: limitless, clip: limitless },
            )?;
            builder.node_of_part(len, LayerNorm { weight: scale.clone(), bias: mean, eps: 1e-5 })?;
            builder.node_of_part(len, RmsNorm { weight: scale, eps: 1e-5 })?;
            let (a, b) = (builder.part(len)?, builder.part(len)?);
            builder.node(Add, &[a, b])?;
            let (a, b) = (builder.part(len)?, builder.part(len)?);
            builder.node(Mul, &[a, b])?;
        }
        for hidden in HIDDEN {
            for width in [Width::W2, Width::W4] {
                let cols = 40;
                let all = vec![Some(width); 4 * hidden];
                let input = builder.matrix(4 * hidden, cols, Activations::Int8, &all, 0)?;
                let state = builder.matrix(4 * hidden, hidden, Activations::Int8, &all, 0)?;
                let bias = builder.values(4 * hidden);
                builder.node_of_part(cols, Lstm { hidden, input, state, bias })?;
                let all = vec![Some(width); 3 * hidden];
                let input = builder.matrix(3 * hidden, cols, Activations::Int8, &all, 0)?;
                let state = builder.matrix(3 * hidden, hidden, Activations::Int8, &all, 0)?;
                let (input_bias, state_bias) = (builder.values(3 * hidden), builder.values(3 * hidden));
                builder.node_of_part(cols, Gru { hidden, input, state, input_bias, state_bias })?;
            }
        }
        builder.part(12)?;
        policies.push(builder.finish(name.to_owned(), contract));
    }
    // Chunks that are averaged, and such that lead over from one to the next.
    for (chunk, act_len) in CHUNKS {
        for (horizon, overlap) in [(chunk, 0), (chunk / 2, 0), (0, chunk - 1), (0, chunk / 2)] {
            let mut builder = Builder::new(chunk * act_len);
            builder.part(chunk * act_len)?;
            let name = format!("chunks of {chunk} by {act_len}, horizon {horizon}, overlap {overlap}");
            let (mut policy, outcomes) = builder.finish(name, false);
            (policy.kind, policy.chunk, policy.act_len) = (Kind::Chunk, chunk, act_len);
            let ensemble = (horizon > 0).then_some(Ensemble { horizon, m: 0.01 });
            policy.contract.playback = Playback { ensemble, overlap, deadline: None };
            policies.push((policy, outcomes));
        }
    }
    // A denoising step, with a limit and noise and without.
    for (limit, sigma) in [(f32::INFINITY, 0.0), (f32::INFINITY, 0.1), (1.0, 0.0), (1.0, 0.1)] {
        for len in LENGTHS {
            let mut builder = Builder::new(8);
            let rows = builder.values(len);
            let (iterate, table) = (builder.node(Iterate { len }, &[])?, builder.node(Table { rows, len }, &[])?);
            builder.node(Add, &[iterate, table])?;
            let sample = if limit.is_finite() { 0.3 } else { 0.0 };
            let steps = vec![Coefficients::from_array([sample, -sample, 0.5, 0.1, sample, sigma, 0.0])];
            builder.graph.denoising = Some(Denoising { first: 0, len, limit, steps });
            let (mut policy, outcomes) =
                builder.finish(format!("a denoising step, limit {limit}, sigma {sigma}"), false);
            policy.kind = Kind::Flow;
            policies.push((policy, outcomes));
        }
    }
    Ok(policies)
}
