//! A deploy.toml is refused, or it can be planned, run and written again.
#![no_main]

use actq::error::Result;
use actq_deploy::description::{Description, Network};
use actq_deploy::{Array, Compute, Plan, Runner, Sources};
use libfuzzer_sys::fuzz_target;

/// Lengths of the network's input and output.
const LEN: usize = 4;

struct Copy {
    inputs: [(String, usize); 1],
    outputs: Vec<usize>,
}

impl Compute for Copy {
    fn inputs(&self) -> &[(String, usize)] {
        &self.inputs
    }

    fn outputs(&self) -> &[usize] {
        &self.outputs
    }

    fn reset(&mut self) {}

    fn step(&mut self, inputs: &[Vec<f32>]) -> Vec<Vec<f32>> {
        vec![inputs[0].clone(); self.outputs.len()]
    }
}

struct Given;

impl Sources for Given {
    fn network(&self, _: &Network, outputs: &[String]) -> Result<Box<dyn Compute>> {
        Ok(Box::new(Copy { inputs: [("x".to_owned(), LEN)], outputs: vec![LEN; outputs.len()] }))
    }

    fn array(&self, _: &str, _: &str) -> Result<Array> {
        Ok(Array { shape: vec![2, LEN], values: vec![0.5; 2 * LEN] })
    }
}

fuzz_target!(|text: &str| {
    let Ok(description) = Description::parse(text) else { return };
    if let Ok(written) = description.to_toml(&[].into()) {
        drop(Description::parse(&written).expect("what is written can be read"));
    }
    let Ok(plan) = Plan::new(&description, &Given) else { return };
    let raw: Vec<Vec<f64>> = plan.inputs().iter().map(|(_, len)| vec![0.5; *len]).collect();
    let mut runner = Runner::new(plan);
    for _ in 0..3 {
        runner.step(&raw);
    }
});
