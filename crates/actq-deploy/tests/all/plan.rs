//! Descriptions without files: what they compute, and what is refused.

use std::collections::BTreeMap;

use actq::error::{Result, bail};
use actq_deploy::description::{Description, Network};
use actq_deploy::{Array, Compute, Plan, Runner, Sources};

/// A network whose output is the sum of its inputs of two values, and counts the ticks.
struct Sum {
    inputs: Vec<(String, usize)>,
    ticks: f32,
}

impl Compute for Sum {
    fn inputs(&self) -> &[(String, usize)] {
        &self.inputs
    }

    fn outputs(&self) -> &[usize] {
        &[2]
    }

    fn reset(&mut self) {
        self.ticks = 0.0;
    }

    fn step(&mut self, inputs: &[Vec<f32>]) -> Vec<Vec<f32>> {
        self.ticks += 1.0;
        vec![(0..2).map(|i| inputs.iter().map(|input| input[i]).sum::<f32>() + 100.0 * self.ticks).collect()]
    }
}

/// Gives a network of inputs `x` and `y`, and a table of three rows.
struct Given;

impl Sources for Given {
    fn network(&self, _: &Network, outputs: &[String]) -> Result<Box<dyn Compute>> {
        match outputs {
            [out] if out == "out" => {
                Ok(Box::new(Sum { inputs: vec![("x".to_owned(), 2), ("y".to_owned(), 2)], ticks: 0.0 }))
            }
            _ => bail!("there is no output {outputs:?}; there is out"),
        }
    }

    fn array(&self, file: &str, name: &str) -> Result<Array> {
        if (file, name) != ("motion.npz", "rows") {
            bail!("{file}: there is no array {name:?}");
        }
        Ok(Array { shape: vec![3, 2], values: vec![0.0, 1.0, 10.0, 11.0, 20.0, 21.0] })
    }
}

/// A description that every section is part of.
const WHOLE: &str = r#"
schema = 1
name = "test"
rate_hz = 50.0
action = "net.out"

[joints]
robot = ["left", "right"]
policy = ["right", "left"]

[constants]
default = [1.0, 2.0]

[[input]]
name = "q"
joints = "robot"

[[state]]
name = "last"
len = 2
next = "net.out"

[[clock]]
name = "phase"
start = [0.0, 0.5]
advance = 0.25

[[motion]]
name = "motion"
file = "motion.npz"
array = "rows"
lag = 1
end = "repeat"

[[value]]
name = "relative"
from = "q"
do = [{ subtract = "default" }, { select = "policy" }, { scale = [10.0, 1.0] }]

[[value]]
name = "sum"
from = "relative"
do = [{ add = "last" }, { add = "phase" }, { add = "motion" }]

[[value]]
name = "target"
from = "relative"
do = [{ place = "robot" }]

[[network]]
name = "net"
file = "net.onnx"
inputs = { x = "sum" }
states = { y = "out" }

[[target]]
kind = "position"
value = "target"
joints = "robot"

[gains]
joints = "robot"
stiffness = [1.0, 2.0]
damping = [0.1, 0.2]
"#;

fn plan(text: &str) -> Result<Plan> {
    Plan::new(&Description::parse(text)?, &Given)
}

#[test]
fn every_section_takes_part_in_a_tick() -> Result<()> {
    let mut runner = Runner::new(plan(WHOLE)?);
    for _ in 0..2 {
        // relative: (q - default) as right, left, times 10 and 1.
        let first = runner.step(&[vec![2.0, 4.0]])?;
        assert_eq!(first.targets[0].1, [1.0, 20.0]);
        // x: relative + last (0) + phase (0, 0.5) + row 0 (0, 1); y: 0.
        assert_eq!(first.observation, [20.0, 2.5, 0.0, 0.0]);
        assert_eq!(first.action, [120.0, 102.5]);
        let second = runner.step(&[vec![1.0, 2.0]])?;
        // Row 0 again, by the lag; last and y are the output before.
        assert_eq!(second.observation, [120.25, 104.25, 120.0, 102.5]);
        let third = runner.step(&[vec![1.0, 2.0]])?;
        assert_eq!(third.observation[0], second.action[0] + 0.5 + 10.0);
        runner.reset();
    }
    Ok(())
}

#[test]
fn a_description_survives_its_text() -> Result<()> {
    let description = Description::parse(WHOLE)?;
    assert_eq!(Description::parse(&description.to_toml(&[].into())?)?, description);
    Ok(())
}

#[test]
fn the_table_counts_one_in_the_singular() -> Result<()> {
    let rows = Description::parse(&WHOLE.replace("len = 2", "len = 1"))?.rows();
    let content = |name: &str| rows.iter().find(|row| row.name == name).map(|row| row.content.as_str());
    assert_eq!(content("q"), Some("2 values in the order of joints.robot"));
    assert_eq!(content("last"), Some("1 value; next tick: net.out"));
    assert_eq!(content("motion"), Some("motion.npz: rows, 1 tick late, repeats"));
    Ok(())
}

#[test]
fn mistakes_are_refused_by_their_keys() {
    let table: BTreeMap<String, Vec<[String; 3]>> =
        toml::from_str(include_str!("../cases/mistakes.toml")).expect("a table");
    for [from, to, expected] in &table["cases"] {
        assert_eq!(WHOLE.matches(from).count(), 1, "{from:?} must occur once");
        let error = plan(&WHOLE.replace(from, to)).map_or_else(|error| format!("{error:#}"), |_| "accepted".to_owned());
        assert!(error.contains(expected), "{to}: {error}");
    }
}
