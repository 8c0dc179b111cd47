//! Whole images in the layouts of other cores than those with the DSP extension, on these cores.

use actq::emit::{Core, repack};
use actq::graph::ops::{Concat, Gru, Linear, Lstm, Pointwise, Span};
use actq::methods::Activations;
use actq::random::Random;
use actq::runtime::ImageBuffer;
use actq_bench::Target;
use actq_bench::networks::Builder;
use actq_bench::qemu::same_bits;
use actq_kernels::Width;
use actq_kernels::layout::Lanes;
use actq_kernels::math::Function;
use anyhow::{Result, ensure};

/// Length of the observation.
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

#[test]
fn repacked_images_act_like_the_host_on_every_core() -> Result<()> {
    let mut random = Random::new(58);
    let mut observations: Vec<Vec<f32>> =
        (0..12).map(|_| (0..OBSERVATION).map(|_| random.normal()).collect()).collect();
    observations.push(vec![0.0; OBSERVATION]);
    // Each image of RV32IMAC is built in.
    let cores: [(_, _, &[usize]); 4] = [
        (Core::M55, Target::M55, &[0, 32, 64, 128]),
        (Core::M3, Target::NoDsp, &[0, 32, 64, 128]),
        (Core::M0, Target::V6m, &[0, 32, 64, 128]),
        (Core::Rv32imac, Target::Riscv, &[32]),
    ];
    for (core, target, groups) in cores {
        for group in groups {
            let bytes = repack(&image(*group)?, core)?;
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
