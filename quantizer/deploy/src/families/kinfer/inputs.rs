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
    for (input, len) in &graph.inputs {
        let (name, len) = (base(input), *len);
        let at = format!("{}: input {input:?}", graph.file);
        let needed = match name {
            "x_vel" | "y_vel" | "rot" | "t" | "timestamp" => Some(1),
            "vector_command" | "projected_gravity" | "imu_ang_vel" | "imu_euler_xyz" | "imu_lin_acc" => Some(3),
            "dof_pos" | "dof_vel" | "prev_actions" => Some(n),
            _ => None,
        };
        if let Some(needed) = needed {
            ensure!(len == needed, "{at} has {len} values, and {needed} are known with {n} joints");
        }
        let mut source = at.clone();
        let value = match name {
            "x_vel" | "y_vel" => raw(parts, name, len, "m/s"),
            "rot" | "imu_ang_vel" => raw(parts, name, len, "rad/s"),
            "vector_command" => raw(parts, name, len, "m/s, m/s, rad/s"),
            "imu_euler_xyz" => raw(parts, name, len, "rad"),
            "imu_lin_acc" => raw(parts, name, len, "m/s2"),
            "t" | "timestamp" => {
                let is_raw = facts.chooses("clock", "raw")?;
                source = format!("{}; {}", meta.at("sim_dt"), facts.source("clock"));
                if is_raw {
                    raw(parts, name, 1, "s")
                } else {
                    parts.clock(Clock::from_zero(name, period, When::After));
                    name.to_owned()
                }
            }
            "dof_pos" => {
                parts.raw_joints(name, "robot", "rad");
                let relative: bool = facts.get("dof_pos.relative")?;
                source = format!("{at}; {}", facts.source("dof_pos.relative"));
                if relative {
                    parts.value("relative_dof_pos", name, vec![Op::Subtract(Operand::Name("default".to_owned()))]);
                    "relative_dof_pos".to_owned()
                } else {
                    name.to_owned()
                }
            }
            "dof_vel" => {
                parts.raw_joints(name, "robot", "rad/s");
                name.to_owned()
            }
            "projected_gravity" => {
                let (value, from) = gravity(parts, facts)?;
                source = format!("{at}; {from}");
                value
            }
            "prev_actions" => {
                facts.note(name, facts.source("states.prev_actions"));
                state(parts, &mut network, (input, len), &outputs.action, facts)?;
                continue;
            }
            _ if BUFFERS.contains(&name) => {
                let given = meta.maybe("num_observations", "a number", Node::number)?;
                if let Some(given) = given.filter(|given| *given != len as f64) {
                    return Err(Facts::contradiction(
                        "length of the history",
                        (&meta.at("num_observations"), &given.to_string()),
                        (&at, &len.to_string()),
                    ));
                }
                let next = outputs.buffer.clone().unwrap_or_default();
                facts.note(name, format!("output {next:?} by {}", facts.source("states.buffer")));
                state(parts, &mut network, (input, len), &next, facts)?;
                continue;
            }
            _ => {
                // What it is only the application's code says, so it is an input under its own name.
                facts.of_application(
                    &format!("raw.{name}"),
                    &format!("the input {input:?} is not known to this reader; does the application compute its {len} values (true)?"),
                )?;
                raw(parts, &name.replace('.', "_"), len, "")
            }
        };
        facts.note(name, source);
        network.inputs.insert(input.clone(), value);
    }
    if !BUFFERS.iter().any(|name| graph.has_input(name)) {
        meta.get("num_observations");
    }
    Ok(network)
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
    let start: f64 = facts.get("states.start")?;
    if start == 0.0 {
        network.states.insert(input.to_owned(), output.to_owned());
    } else {
        let name = base(input).replace('.', "_");
        parts.kept_from(&name, len, Numbers::All(start), &format!("policy.{output}"));
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
