//! Whole images in the layouts of other cores than those with the DSP extension, on these cores.

use actq::data::{Dataset, Sizes};
use actq::emit::{Core, repack};
use actq::graph::ops::{Concat, Gru, Linear, Lstm, Pointwise, Span};
use actq::measure::time::{CLOCK, StepTime};
use actq::methods::Activations;
use actq::policy::Policy;
use actq::random::Random;
use actq::runtime::ImageBuffer;
use actq_bench::networks::Builder;
use actq_bench::profile::Harness;
use actq_bench::qemu::same_bits;
use actq_bench::{Target, rtn, ur3};
use actq_kernels::Width;
use actq_kernels::cost::Cost;
use actq_kernels::layout::Lanes;
use actq_kernels::math::Function;
use anyhow::{Result, ensure};

const OBSERVATION: usize = 41;

/// Returns an image with every width, rows of mixed widths and of none, rows and columns that fill no strip and no unit, both
/// cells, and a matrix of int16 activations, which keeps its layout.
fn image(group: usize) -> Result<Vec<u8>> {
    let mut builder = Builder::new(OBSERVATION);
    let (int8, int16) = (Activations::Int8, Activations::Int16);
    let mixed = |row: usize| Width::ALL.get(row * 7 % 5).copied();
    let in_blocks = |rows: usize| move |row: usize| Some(Width::ALL[4 * row / rows]);
    let first = builder.linear((67, OBSERVATION), int8, mixed, group, true)?;
    let elu = builder.node(Pointwise(Function::Elu), &[first])?;
    let mut matrix = |rows, cols, activations, widths: &dyn Fn(usize) -> Option<Width>| {
        builder.matrix(rows, cols, activations, &(0..rows).map(widths).collect::<Vec<_>>(), group)
    };
    let [input, state] = [matrix(36, 67, int8, &in_blocks(36))?, matrix(36, 9, int8, &|_| Some(Width::W3))?];
    let [gru_input, gru_state] = [matrix(33, 9, int8, &in_blocks(33))?, matrix(33, 11, int8, &mixed)?];
    let [next, last] = [matrix(90, 20, int16, &mixed)?, matrix(7, 90, int8, &|_| Some(Width::W8))?];
    let bias = builder.values(36);
    let lstm = builder.node(Lstm { hidden: 9, input, state, bias }, &[elu])?;
    let (input_bias, state_bias) = (builder.values(33), builder.values(33));
    let gru = Gru { hidden: 11, input: gru_input, state: gru_state, input_bias, state_bias };
    let gru = builder.node(gru, &[lstm])?;
    let both = builder.node(Concat(vec![Span { from: 0, len: 9 }, Span { from: 0, len: 11 }]), &[lstm, gru])?;
    let bias = builder.values(90);
    let next = builder.node(Linear { matrix: next, bias }, &[both])?;
    let next = builder.node(Pointwise(Function::Tanh), &[next])?;
    // Without biases.
    builder.node(Linear { matrix: last, bias: vec![0.0; 7] }, &[next])?;
    builder.image("repacked")
}

/// The cores, with the targets that have them in QEMU.
const CORES: [(Core, Target); 5] = [
    (Core::M55, Target::M55),
    (Core::M3, Target::NoDsp),
    (Core::M0, Target::V6m),
    (Core::Rv32imac, Target::Riscv),
    (Core::Rv32zb, Target::RiscvZb),
];

/// Largest relative error of a policy's predicted step, and of one with groups or small blocks. Floats in software take other
/// times for other values.
fn limits(core: Core) -> [f64; 2] {
    match core {
        Core::M55 => [0.01, 0.03],
        Core::M4 => [0.06, 0.06],
        Core::Rv32zb => [0.04, 0.10],
        _ => [0.03, 0.10],
    }
}

/// Whole steps of a policy at every width, with groups and without, and of the image above, whose blocks are small.
#[test]
fn predictions_hold_on_every_core() -> Result<()> {
    const STEPS: usize = 12;
    let policy = Policy::load(&ur3())?;
    let dataset = Dataset::load(&ur3().join("heldout.npz"), Sizes::of(&policy))?;
    let recorded: Vec<Vec<f32>> = dataset.episode(0).take(STEPS).collect();
    // The last tells whether the blocks are small or have groups.
    let mut images = vec![("mixed".to_owned(), image(0)?, true), ("mixed in groups".to_owned(), image(32)?, true)];
    for (width, group) in [(Width::W2, 0), (Width::W3, 0), (Width::W3, 32), (Width::W4, 0), (Width::W8, 0)] {
        let name = format!("{} bits, group {group}", width.bits());
        images.push((name, rtn(&policy, width, group, Activations::Int8)?, group != 0));
    }
    let mut random = Random::new(58);
    let normal: Vec<Vec<f32>> = (0..STEPS).map(|_| (0..OBSERVATION).map(|_| random.normal()).collect()).collect();
    let mut wrong = Vec::new();
    for (core, target) in CORES.into_iter().chain([(Core::M4, Target::NoFpu)]) {
        let harness = Harness::build(target)?;
        for (name, bytes, is_small) in &images {
            let bytes = repack(bytes, core)?;
            let buffer = ImageBuffer::new(&bytes);
            let image = buffer.image("repacked".as_ref())?;
            let of_policy = image.obs_len() != OBSERVATION;
            // The first state is zeros; then only steps that evaluate the network.
            let all = harness.steps(&bytes, if of_policy { &recorded } else { &normal })?;
            let counted: Vec<Cost> = all.into_iter().skip(image.execute()).step_by(image.execute()).collect();
            let predicted = StepTime::new(&image, core, CLOCK);
            let mean = |of: fn(&Cost) -> u64| counted.iter().map(of).sum::<u64>() as f64 / counted.len() as f64;
            let error = predicted.instructions as f64 / mean(|cost| cost.instructions) - 1.0;
            let of_cycles = predicted.cycles as f64 / mean(|cost| cost.cycles) - 1.0;
            let text = format!(
                "{core:?}, {name}: {} instructions, {:+.2}%, {} cycles, {:+.2}%",
                predicted.instructions,
                1e2 * error,
                predicted.cycles,
                1e2 * of_cycles
            );
            println!("{text}");
            let [whole, small] = limits(core);
            let limit = if *is_small { small } else { whole };
            if error.abs() > limit || of_cycles.abs() > limit {
                wrong.push(text);
            }
        }
    }
    ensure!(wrong.is_empty(), "{}", wrong.join("\n"));
    Ok(())
}

#[test]
fn repacked_images_act_like_the_host_on_every_core() -> Result<()> {
    let mut random = Random::new(58);
    let mut observations: Vec<Vec<f32>> =
        (0..12).map(|_| (0..OBSERVATION).map(|_| random.normal()).collect()).collect();
    observations.push(vec![0.0; OBSERVATION]);
    for (core, target) in CORES {
        for group in [0, 32, 64, 128] {
            let bytes = repack(&image(group)?, core)?;
            let buffer = ImageBuffer::new(&bytes);
            let matrices = buffer.image("repacked".as_ref())?.matrices();
            let blocks =
                matrices.flat_map(|matrix| matrix.blocks().map(|rows| rows.block.shape().lanes).collect::<Vec<_>>());
            let lanes = if core == Core::M55 { Lanes::Helium } else { Lanes::Scalar };
            let count = blocks.filter(|of_block| *of_block == lanes).count();
            ensure!(count > 15, "{core:?}: {count} blocks of its layouts");
            same_bits(target, &bytes, &observations)?;
        }
    }
    Ok(())
}
