//! The values that the graph's inputs read.

use actq::error::{Result, ensure};

use super::super::common::{Parts, given_gravity};
use super::graph::{BUFFERS, Graph, Outputs, base};
use crate::description::{Clock, Network, Numbers, Op, Operand, When};
use crate::document::Document;
use crate::facts::Facts;
use crate::yaml::Node;

/// Adds the values of the graph's inputs; returns the network that reads them.
pub(super) fn inputs(
    parts: &mut Parts,
    graph: &Graph,
    outputs: &Outputs,
    n: usize,
    period: f64,
    meta: &Document,
    facts: &mut Facts,
) -> Result<Network> {
    let mut network =
        Network { name: "policy".to_owned(), file: graph.file.clone(), inputs: [].into(), states: [].into() };
    let mut inputs = Inputs { parts, graph, outputs, period, meta, facts };
    for (input, len) in &graph.inputs {
        let len = *len;
        if let Some(expected) = expected_len(base(input), n) {
            let at = inputs.at(input);
            ensure!(len == expected, "{at} has {len} values; {expected} are needed for {n} joints");
        }
        if !inputs.add_state(&mut network, input, len)? {
            let value = inputs.value(input, len)?;
            network.inputs.insert(input.clone(), value);
        }
    }
    if !BUFFERS.iter().any(|name| graph.has_input(name)) {
        meta.node("num_observations");
    }
    Ok(network)
}

/// Returns the length that an input must have, for `n` joints; `None` if it may have any.
fn expected_len(name: &str, n: usize) -> Option<usize> {
    match name {
        "x_vel" | "y_vel" | "rot" | "t" | "timestamp" => Some(1),
        "vector_command" | "projected_gravity" | "imu_ang_vel" | "imu_euler_xyz" | "imu_lin_acc" => Some(3),
        "dof_pos" | "dof_vel" | "prev_actions" => Some(n),
        _ => None,
    }
}

/// The graph's inputs under construction.
struct Inputs<'a> {
    parts: &'a mut Parts,
    graph: &'a Graph,
    outputs: &'a Outputs,
    /// Seconds of a tick.
    period: f64,
    meta: &'a Document,
    facts: &'a mut Facts,
}

impl Inputs<'_> {
    /// Names an input, for reports and errors.
    fn at(&self, input: &str) -> String {
        format!("{}: input {input:?}", self.graph.file)
    }

    /// Makes an input a state if it reads an output of the tick before; returns `true` if it does.
    fn add_state(&mut self, network: &mut Network, input: &str, len: usize) -> Result<bool> {
        let name = base(input);
        if name == "prev_actions" {
            self.facts.note(name, self.facts.source("states.prev_actions"));
            state(self.parts, network, (input, len), &self.outputs.action, self.facts)?;
            return Ok(true);
        }
        if !BUFFERS.contains(&name) {
            return Ok(false);
        }
        let given = self.meta.optional("num_observations", "a number", Node::number)?;
        if let Some(given) = given.filter(|given| *given != len as f64) {
            return Err(Facts::contradiction(
                "length of the history",
                (&self.meta.location("num_observations"), &given.to_string()),
                (&self.at(input), &len.to_string()),
            ));
        }
        let next = self.outputs.buffer.clone().unwrap_or_default();
        self.facts.note(name, format!("output {next:?} by {}", self.facts.source("states.buffer")));
        state(self.parts, network, (input, len), &next, self.facts)?;
        Ok(true)
    }

    /// Adds the value that an input reads; returns its name.
    fn value(&mut self, input: &str, len: usize) -> Result<String> {
        let name = base(input);
        let mut source = self.at(input);
        let value = match name {
            "x_vel" | "y_vel" => raw(self.parts, name, len, "m/s"),
            "rot" | "imu_ang_vel" => raw(self.parts, name, len, "rad/s"),
            "vector_command" => raw(self.parts, name, len, "m/s, m/s, rad/s"),
            "imu_euler_xyz" => raw(self.parts, name, len, "rad"),
            "imu_lin_acc" => raw(self.parts, name, len, "m/s2"),
            "t" | "timestamp" => {
                let value = self.time(name)?;
                source = format!("{}; {}", self.meta.location("sim_dt"), self.facts.source("clock"));
                value
            }
            "dof_pos" => {
                let value = self.position(name)?;
                source = format!("{source}; {}", self.facts.source("dof_pos.relative"));
                value
            }
            "dof_vel" => {
                self.parts.raw_joints(name, "robot", "rad/s");
                name.to_owned()
            }
            "projected_gravity" => {
                let (value, from) = gravity(self.parts, self.facts)?;
                source = format!("{source}; {from}");
                value
            }
            // Only the application knows this term, so it becomes a raw input.
            _ => {
                self.facts.require_from_application(
                    &format!("raw.{name}"),
                    &format!("the input {input:?} is not known to this reader; does the application compute its {len} values (true)?"),
                )?;
                raw(self.parts, &name.replace('.', "_"), len, "")
            }
        };
        self.facts.note(name, source);
        Ok(value)
    }

    /// Adds the time, as a raw input or a clock; returns the name of its value.
    fn time(&mut self, name: &str) -> Result<String> {
        if self.facts.is_choice("clock", "raw")? {
            return Ok(raw(self.parts, name, 1, "s"));
        }
        self.parts.clock(Clock::from_zero(name, self.period, When::After));
        Ok(name.to_owned())
    }

    /// Adds the joints' positions; returns the name of their value, which may be relative to the default.
    fn position(&mut self, name: &str) -> Result<String> {
        self.parts.raw_joints(name, "robot", "rad");
        if !self.facts.value_or_default::<bool>("dof_pos.relative")? {
            return Ok(name.to_owned());
        }
        self.parts.value("relative_dof_pos", name, vec![Op::Subtract(Operand::Name("default".to_owned()))]);
        Ok("relative_dof_pos".to_owned())
    }
}

/// Adds a raw input; returns its name.
fn raw(parts: &mut Parts, name: &str, len: usize, unit: &str) -> String {
    parts.raw(name, len, unit);
    name.to_owned()
}

/// Makes an input a state that takes an output of the tick before.
fn state(
    parts: &mut Parts,
    network: &mut Network,
    (input, len): (&str, usize),
    output: &str,
    facts: &mut Facts,
) -> Result<()> {
    let start: f64 = facts.value_or_default("states.start")?;
    if start == 0.0 {
        network.states.insert(input.to_owned(), output.to_owned());
    } else {
        let name = base(input).replace('.', "_");
        parts.state_from(&name, len, Numbers::All(start), &format!("policy.{output}"));
        network.inputs.insert(input.to_owned(), name);
    }
    Ok(())
}

/// Adds the direction of gravity; returns the name of its value, and its source.
fn gravity(parts: &mut Parts, facts: &mut Facts) -> Result<(String, String)> {
    let (name, len, ops) = given_gravity(facts, "gravity", "vector", "orientation")?;
    let source = facts.source("gravity");
    if ops.is_empty() {
        return Ok((raw(parts, name, len, ""), source));
    }
    parts.raw(name, len, "");
    parts.value("projected_gravity", name, ops);
    Ok(("projected_gravity".to_owned(), source))
}
