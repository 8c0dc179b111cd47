//! Quantizes a policy in memory to 3 bits per weight, and prints the error of its actions.

use std::path::PathBuf;

use actq::budget::Budget;
use actq::data::{Dataset, Recordings};
use actq::graph::ops::{Linear, Pointwise};
use actq::graph::{Graph, WeightMatrix};
use actq::measure::eval;
use actq::methods::{Method, Options};
use actq::pipeline::quantize;
use actq::policy::Policy;
use actq::random::Random;
use actq_kernels::math::Function;
use ndarray::Array3;

fn main() -> actq::error::Result<()> {
    let mut random = Random::new(1);
    let mut matrix = |name: &str, rows: usize, cols: usize| {
        let data = (0..rows * cols).map(|_| random.unit() / (cols as f32).sqrt()).collect();
        WeightMatrix { name: name.to_owned(), rows, cols, data }
    };
    // A network from 12 observed values over 32 to 4 actions.
    let mut graph = Graph::new(12);
    let first = graph.add_matrix(matrix("first", 32, 12))?;
    let hidden = graph.add(Linear { matrix: first, bias: vec![0.0; 32] }, &[0])?;
    let hidden = graph.add(Pointwise(Function::Elu), &[hidden])?;
    let last = graph.add_matrix(matrix("last", 4, 32))?;
    graph.add(Linear { matrix: last, bias: vec![0.0; 4] }, &[hidden])?;
    let policy = Policy::of("in memory", graph);

    // One episode of 500 observations; a robot or a simulator would record them.
    let mut random = Random::new(2);
    let obs = Array3::from_shape_simple_fn((1, 500, 12), || random.unit());
    let mut recorded = Dataset { path: PathBuf::new(), obs, action: None, length: vec![500], state: None };
    recorded.fill_actions(&policy.graph);

    let recordings = Recordings { calib: Some(recorded.clone()), heldout: None };
    let options = Options { steps: Some(100), ..Options::new(Method::Distill, Budget::BitsPerWeight(3.0)) };
    let quantized = quantize(&policy, &recordings, &options, ())?;
    let image = quantized.buffer();
    let report = eval::evaluate(image.image(&policy.dir)?, &recorded)?;
    println!("{} bytes, NMSE {:.1e}", quantized.image.len(), report.nmse);
    assert!(report.nmse < 0.1);
    Ok(())
}

#[test]
fn quantized_error_is_small() -> actq::error::Result<()> {
    main()
}
