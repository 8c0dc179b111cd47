//! Measures the steps a second of a network with 190 thousand weights at 2 bits, in batches of 4096:
//!
//!     cargo run --release --package actq-batch --example speed -- [HEADS] [SECONDS]

use std::time::Instant;

use actq::graph::ops::{Linear, Pointwise};
use actq::methods::Activations;
use actq::random::Random;
use actq_batch::Batch;
use actq_bench::networks::Builder;
use actq_kernels::Width;
use actq_kernels::math::Function;
use anyhow::Result;

/// Lengths of the network's layers, from observation to action.
const LAYERS: [usize; 5] = [48, 512, 256, 128, 12];

fn main() -> Result<()> {
    let mut arguments = std::env::args().skip(1);
    let heads = arguments.next().map_or(Ok(4096), |text| text.parse())?;
    let seconds = arguments.next().map_or(Ok(3.0), |text| text.parse())?;
    let mut builder = Builder::new(LAYERS[0]);
    let mut last = 0;
    for (i, size) in LAYERS.windows(2).enumerate() {
        let (cols, rows) = (size[0], size[1]);
        let matrix = builder.matrix(rows, cols, Activations::Int8, &vec![Some(Width::W2); rows], 32)?;
        let bias = builder.values(rows);
        last = builder.node(Linear { matrix, bias }, &[last])?;
        if i + 2 < LAYERS.len() {
            last = builder.node(Pointwise(Function::Elu), &[last])?;
        }
    }
    let weights: usize = LAYERS.windows(2).map(|size| size[0] * size[1]).sum();
    let mut batch = Batch::new(&builder.image("speed")?, heads)?;
    let mut random = Random::new(1);
    let observations: Vec<f32> = (0..heads * batch.obs_len()).map(|_| random.normal()).collect();
    let mut actions = vec![0.0; heads * batch.act_len()];
    batch.step(&observations, None, &mut actions)?;
    let (start, mut steps) = (Instant::now(), 0);
    while start.elapsed().as_secs_f64() < seconds {
        batch.step(&observations, None, &mut actions)?;
        steps += heads;
    }
    let rate = steps as f64 / start.elapsed().as_secs_f64();
    println!("{weights} weights, {heads} heads: {rate:.0} steps/s, {:.1} GMAC/s", rate * weights as f64 / 1e9);
    Ok(())
}
