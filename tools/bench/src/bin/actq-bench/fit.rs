//! `cargo xtask fit`: the rates of the cost model (`kernels/src/cost/`), from counted operations.
//!
//! Images with many shapes of every operation run under QEMU on a core. Every operation and every whole step is a sample:
//! the count of each item, and the measured cost. The rates minimize the squared relative errors. An item that others
//! determine, or whose rate would be negative, gets the rate 0.

mod images;
mod least_squares;
mod sample;

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::Path;

use actq::emit::repack;
use actq::methods::Activations;
use actq::random::Random;
use actq::runtime::ImageBuffer;
use actq_bench::networks::Builder;
use actq_bench::profile::Harness;
use actq_bench::{Target, root};
use actq_cli::outputs::files;
use actq_kernels::Width;
use actq_kernels::cost::{self, CORES, Core, Cost, CostItem};
use actq_kernels::image::{Op, OpKind, op};
use actq_kernels::math::Function;
use anyhow::{Context as _, Result, bail};

use images::images;
use least_squares::solve;
use sample::{Rates, Sample, predicted};

/// Steps with standard normal observations, whose cost is the expected one.
const NORMAL_STEPS: usize = 6;
/// Number of the worst samples to show.
const WORST_SAMPLES: usize = 8;
/// A budget too large to limit anything, which is counted all the same.
const AMPLE_BUDGET: u32 = 100_000_000;

/// Measures the rates of these cores; those of the others stay. With `only`, a word of the items' names, all other items
/// keep their rates, and only images with this word in their names are measured.
pub(crate) fn run(cores: &[Core], only: Option<&str>) -> Result<()> {
    let mut rates: BTreeMap<CostItem, Row> = CostItem::all().map(|item| (item, cost::rates_of(item))).collect();
    for core in cores {
        of_core(*core, only, &mut rates)?;
        let path = root().join("kernels/src/cost/rates.rs");
        files::write(&path, table(&rates).as_bytes())?;
        println!("{}: written with the rates of {}", path.display(), core.name());
    }
    Ok(())
}

/// The rates of an item: of a Cortex-M4 with FPU, and of the other cores.
type Row = ([f64; 3], [[f64; 2]; CORES.len()]);

fn of_core(core: Core, only: Option<&str>, all: &mut BTreeMap<CostItem, Row>) -> Result<()> {
    let target = match core {
        Core::M0 => Target::V6m,
        Core::M3 => Target::NoDsp,
        Core::Rv32imac => Target::Riscv,
        Core::Rv32zb => Target::RiscvZb,
        Core::M4 => Target::NoFpu,
        Core::M4f => Target::Fpu,
        Core::M55 => Target::M55,
        Core::M7 | Core::M33 => {
            bail!("the rates of {} are those of {}", core.name(), core.measured().name())
        }
    };
    let attention = Harness::build_with(target, "attention")?;
    // Only images of attention are measured without the other.
    let others = if only == Some("attention") { None } else { Some(Harness::build(target)?) };
    let harness = others.as_ref().unwrap_or(&attention);
    let mut samples = Vec::new();
    let mut polls = Vec::new();
    for (name, bytes) in images()?.into_iter().filter(|(name, _)| only.is_none_or(|word| name.contains(word))) {
        println!("measuring {name}");
        let bytes = repack(&bytes, core).with_context(|| name.clone())?;
        let harness = if name.contains("attention") { &attention } else { harness };
        measure((&name, &bytes), harness, &mut samples, (core == Core::M4f).then_some(&mut polls))?;
    }
    if let Some(word) = only {
        samples = samples.into_iter().filter_map(|sample| rest_of(sample, word, core)).collect();
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
        for s in by_error.iter().take(WORST_SAMPLES) {
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
    // Budgets of slices are those of a Cortex-M4 on every core.
    let most = if core == Core::M4f && only.is_some() {
        Some(instructions.clone())
    } else if core == Core::M4f {
        let mut most = most(&samples, &polls, &instructions);
        println!("measuring polls");
        let resumed = resumed(harness, &most)?;
        most.insert(CostItem::RESUMED, resumed);
        Some(most)
    } else {
        None
    };
    let rate = |rates: &Rates, item: CostItem| rates.get(&item).copied().unwrap_or(0.0);
    for (item, (dsp, others)) in all.iter_mut().filter(|(item, _)| only.is_none_or(|word| has_word(**item, word))) {
        let now = [rate(&instructions, *item), rate(&cycles, *item)];
        if let Some(most) = &most {
            *dsp = [now[0], now[1], rate(most, *item)];
        } else if let Some(at) = CORES.iter().position(|known| *known == core) {
            others[at] = now;
        }
    }
    Ok(())
}

fn has_word(item: CostItem, word: &str) -> bool {
    format!("{item:?}").contains(word)
}

/// Returns the part of an operation's cost that the items with this word in their names have; `None` for a sample without
/// such an item.
fn rest_of(sample: Sample, word: &str, core: Core) -> Option<Sample> {
    let (items, known): (BTreeMap<_, _>, BTreeMap<_, _>) =
        sample.items.into_iter().partition(|(item, _)| has_word(*item, word));
    let rates = |item: &CostItem| match (cost::rates_of(*item), CORES.iter().position(|known| *known == core)) {
        ((_, others), Some(at)) => others[at],
        (([instructions, cycles, _], _), None) => [instructions, cycles],
    };
    let of = |which: usize| known.iter().map(|(item, n)| n * rates(item)[which]).sum::<f64>() as u64;
    let Cost { instructions, cycles } = sample.cost;
    let [instructions, cycles] = [instructions.saturating_sub(of(0)), cycles.saturating_sub(of(1))];
    // Of the parts, only the operations themselves: whole steps have all items of an image.
    let is_operation = !items.is_empty() && known.contains_key(&CostItem::POLL_OP);
    is_operation.then_some(Sample { items, cost: Cost { instructions, cycles }, ..sample })
}

/// Writes the rates as the source of the kernels' table: an item's debug text is its key.
fn table(rates: &BTreeMap<CostItem, Row>) -> String {
    let mut text = format!(
        "//! Written by `cargo xtask fit`: for a Cortex-M4 with FPU expected instructions, expected cycles, instructions at\n\
         //! most; for the cores of a writer expected instructions and cycles.\n\n\
         #[cfg(all(feature = \"writer\", feature = \"scalar\", feature = \"helium\"))]\n\
         use super::Core;\n\
         use super::item::{{Attention, CostItem, Gemv, Prepare, Scales::*, Strips::*}};\n\
         use crate::image::op;\n\
         use crate::layout::{{Lanes::*, Width::*}};\n\
         use crate::math::Function;\n\n\
         /// Cores that were measured beside the Cortex-M4 with FPU.\n\
         #[cfg(all(feature = \"writer\", feature = \"scalar\", feature = \"helium\"))]\n\
         pub const CORES: [Core; {}] = [{}];\n\n\
         /// The rates of an item.\n\
         type Row = (CostItem, [f64; 3], [[f64; 2]; {}]);\n\n\
         #[rustfmt::skip]\npub(super) const RATES: &[Row] = &[\n",
        CORES.len(),
        CORES.map(|core| format!("Core::{core:?}")).join(", "),
        CORES.len()
    );
    for (item, (dsp, others)) in rates {
        let [a, b, c] = dsp;
        let others: Vec<String> = others.iter().map(|[i, c]| format!("[{i:.3}, {c:.3}]")).collect();
        let _ = writeln!(text, "    ({item:?}, [{a:.3}, {b:.3}, {c:.3}], [{}]),", others.join(", "));
    }
    text + "];\n"
}

/// Runs an image, in steps and by operations. `polls`, if given, gets the cost that a limit adds to an operation, and its
/// pieces.
fn measure(
    (name, bytes): (&str, &[u8]),
    harness: &Harness,
    samples: &mut Vec<Sample>,
    polls: Option<&mut Vec<(f64, usize)>>,
) -> Result<()> {
    let buffer = ImageBuffer::new(bytes);
    let image = buffer.image(Path::new(name))?;
    let all = observations(image.obs_len());
    // Only slices need the ends of every branch.
    let observations = if polls.is_some() { &all[..] } else { &all[..NORMAL_STEPS] };
    let frame = items(|add| cost::frame(&image, add));
    let ops: Vec<Op<'_>> = image.ops().collect();
    let of_ops: Vec<_> = ops.iter().map(|op| items(|add| cost::items(op, add))).collect();
    // Before the second chunk there is none to blend with, and the first state is zeros, which floats in software are
    // faster or slower with.
    let first = usize::from(image.overlap() > 0 || image.state().len > 0);
    let expected = |step| (first..NORMAL_STEPS).contains(&step);
    let steps = harness.steps(bytes, observations)?;
    for (step, cost) in steps.into_iter().enumerate() {
        let mut all = frame.clone();
        of_ops.iter().flatten().for_each(|(item, n)| *all.entry(*item).or_default() += n);
        samples.push(Sample { name: format!("{name}, a step"), items: all, cost, expected: expected(step) });
    }
    let single = harness.parts(&image, bytes, observations, u32::MAX)?;
    if let Some(polls) = polls {
        let limited = harness.parts(&image, bytes, &observations[..1], AMPLE_BUDGET)?;
        for ((op, cost), plain) in ops.iter().zip(&limited[0].ops).zip(&single[0].ops) {
            polls.push((cost.instructions as f64 - plain.instructions as f64, pieces(op)));
        }
    }
    for (step, parts) in single.into_iter().enumerate() {
        let mut sample = |what: String, cost, poll: f64, mut items: BTreeMap<CostItem, f64>| {
            if poll > 0.0 {
                items.insert(CostItem::POLL_OP, poll);
            }
            samples.push(Sample { name: format!("{name}, {what}"), items, cost, expected: expected(step) });
        };
        sample("begin".to_owned(), parts.begin, 0.0, items(|add| cost::begin(&image, add)));
        sample("action".to_owned(), parts.action, 1.0, items(|add| cost::action(&image, add)));
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

fn items(list: impl FnOnce(&mut dyn FnMut(CostItem, usize))) -> BTreeMap<CostItem, f64> {
    let mut items = BTreeMap::new();
    list(&mut |item, n| {
        if n > 0 {
            *items.entry(item).or_default() += n as f64;
        }
    });
    items
}

/// Pieces of an operation under an ample budget.
fn pieces(op: &Op<'_>) -> usize {
    let (OpKind::Linear { accumulate, .. }, Some(matrix)) = (op.kind, op.matrix()) else { return 1 };
    let bias = matrix.start_values(accumulate).is_none();
    let mut widths: Vec<Width> = matrix.blocks().map(|rows| rows.block.shape().width).collect();
    let blocks = widths.len();
    widths.dedup();
    1 + usize::from(bias) + widths.len() + blocks
}

/// Features whose cost is a maximum: values whose code branches on them, and pieces.
fn most(samples: &[Sample], polls: &[(f64, usize)], rates: &Rates) -> Rates {
    let mut most = rates.clone();
    let rate = |item: CostItem| rates.get(&item).copied().unwrap_or(0.0);
    let varying: Vec<CostItem> = Function::ALL
        .into_iter()
        .map(CostItem::function)
        .chain([
            CostItem::value(op::NORMALIZE),
            CostItem::value(op::LSTM_CELL),
            CostItem::value(op::GRU_CELL),
            CostItem::value(op::DENOISE),
            // Only the first step after a reset writes the values.
            CostItem::value(op::INITIAL),
            CostItem::LIMITED,
            CostItem::CONTRACT,
            CostItem::PREDICTED_VALUE,
            CostItem::BLENDED,
        ])
        .collect();
    // Whole steps differ in many items; only their parts tell the cost of a value.
    for sample in samples.iter().filter(|s| s.items.contains_key(&CostItem::POLL_OP)) {
        for &item in &varying {
            let Some(&n) = sample.items.get(&item).filter(|n| **n >= 30.0) else { continue };
            let excess = sample.cost.instructions as f64 - predicted(sample, rates);
            let at_most = most.entry(item).or_default();
            *at_most = at_most.max(rate(item) + excess / n);
        }
    }
    // The cost that a limit adds to an operation and to each of its pieces.
    let n = polls.len() as f64;
    let [x, y] = [polls.iter().map(|p| p.1 as f64).sum::<f64>() / n, polls.iter().map(|p| p.0).sum::<f64>() / n];
    let covariance: f64 = polls.iter().map(|p| (p.1 as f64 - x) * (p.0 - y)).sum();
    let variance: f64 = polls.iter().map(|p| (p.1 as f64 - x).powi(2)).sum();
    let piece = (covariance / variance).max(0.0);
    let entered = polls.iter().map(|p| p.0 - piece * p.1 as f64).fold(0.0, f64::max);
    most.extend([(CostItem::PIECE, piece), (CostItem::ENTERED, entered), (CostItem::POLL, rate(CostItem::POLL_OP))]);
    most
}

/// Measures the cost of returning to a linear operation for each of its blocks, from steps in short polls, whose number
/// tells how often that was. The image's least budget comes from the previous rates, which need not be exact here.
fn resumed(harness: &Harness, most: &Rates) -> Result<f64> {
    let known: f64 = [CostItem::POLL, CostItem::ENTERED, CostItem::operation(op::LINEAR), CostItem::PIECE]
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
                let bytes = builder.image("polls")?;
                let buffer = ImageBuffer::new(&bytes);
                let image = buffer.image(Path::new("polls"))?;
                let observations = &observations(cols)[..1];
                let sum = |arguments: &str| -> Result<(f64, usize)> {
                    let (costs, _) = harness.regions(&bytes, arguments, observations)?;
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

/// Draws standard normal observations, and others that reach the ends of every branch.
fn observations(len: usize) -> Vec<Vec<f32>> {
    let mut random = Random::new(1);
    let normal = (0..NORMAL_STEPS).map(|_| (0..len).map(|_| random.normal()).collect::<Vec<_>>()).collect::<Vec<_>>();
    let ends = [0.0, 1e-3, 1.0, -1.0, 30.0, -30.0, 1e4, -1e4];
    normal.into_iter().chain(ends.map(|x| vec![x; len])).collect()
}
