//! Measures the steps per second of a network with 190 thousand weights at 2, 3, 4 and 8 bits, in turn:
//!
//!     RAYON_NUM_THREADS=1 cargo run --release --package actq-batch --example speed -- [HEADS] [SECONDS]
//!
//! Beside other programs, the fastest step says most.

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
/// Each width is measured this many times.
const ROUNDS: usize = 5;

fn image(width: Width) -> Result<Vec<u8>> {
    let mut builder = Builder::new(LAYERS[0]);
    let mut last = 0;
    for (i, size) in LAYERS.windows(2).enumerate() {
        let (cols, rows) = (size[0], size[1]);
        let matrix = builder.matrix(rows, cols, Activations::Int8, &vec![Some(width); rows], 32)?;
        let bias = builder.values(rows);
        last = builder.node(Linear { matrix, bias }, &[last])?;
        if i + 2 < LAYERS.len() {
            last = builder.node(Pointwise(Function::Elu), &[last])?;
        }
    }
    builder.image("speed")
}

/// Steps a batch for this long; adds the seconds of each step.
fn measure(batch: &mut Batch, observations: &[f32], seconds: f64, times: &mut Vec<f64>) -> Result<()> {
    let mut actions = vec![0.0; batch.heads() * batch.act_len()];
    let begun = Instant::now();
    while begun.elapsed().as_secs_f64() < seconds {
        let begun = Instant::now();
        batch.step(observations, None, &mut actions)?;
        times.push(begun.elapsed().as_secs_f64());
    }
    Ok(())
}

fn main() -> Result<()> {
    let mut arguments = std::env::args().skip(1);
    let heads = arguments.next().map_or(Ok(4096), |text| text.parse())?;
    let seconds = arguments.next().map_or(Ok(1.0), |text| text.parse())?;
    let mut random = Random::new(1);
    let observations: Vec<f32> = (0..heads * LAYERS[0]).map(|_| random.normal()).collect();
    let new = |width| Ok((width, Batch::new(&image(width)?, heads)?, Vec::new()));
    let mut batches = Width::ALL.into_iter().map(new).collect::<Result<Vec<_>>>()?;
    for _ in 0..ROUNDS {
        for (_, batch, times) in &mut batches {
            measure(batch, &observations, seconds, times)?;
        }
    }
    println!("{heads} heads, steps per second: median, most");
    for (width, _, mut times) in batches {
        times.sort_by(f64::total_cmp);
        let [median, most] = [times.len() / 2, 0].map(|i| heads as f64 / times[i]);
        println!("{} bits: {median:.0}, {most:.0}", width.bits());
    }
    Ok(())
}
