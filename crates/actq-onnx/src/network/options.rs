//! Options of the import.

use actq::error::{Result, ensure};
use actq::import::Sampler;
use actq::import::contract::StatedLimits;
use actq::text::printable;

use crate::file::model::{Graph, Port};

/// The most names in a message.
const MAX_LISTED: usize = 20;

/// Options of the import; none by default.
#[derive(Clone, Debug, Default)]
pub struct ImportOptions {
    /// The value that is the action: an output of the graph, or any value inside.
    pub output: Option<String>,
    /// Inputs that hold recurrent state, with the outputs of their next values.
    pub states: Vec<(String, String)>,
    /// Inputs that are observed, although their names are those of states or constants.
    pub observed: Vec<String>,
    /// Inputs that are keys or values of a prefix, which a host sends (docs/POLICY.md).
    pub prefix: Vec<String>,
    /// `true` if the caller gives each input its value in each step, and takes the values of the output one after the
    /// other. An input may then hold a state without a cell, and the output's axes mean nothing.
    pub is_fed: bool,
    /// `true` if factors and limits at the end stay operations of the network: another network reads its output.
    pub is_inner: bool,
    /// Limits of the actions, beside those of the graph.
    pub limits: StatedLimits,
    /// Actions in a second; `None` if the caller does not know.
    pub rate_hz: Option<f64>,
    /// The steps of a flow or a diffusion policy, whose network the file has; `None` for any other policy.
    pub sampler: Option<Sampler>,
}

impl ImportOptions {
    /// Fails for names that the file does not have.
    pub(super) fn check(&self, graph: &Graph) -> Result<()> {
        let outputs = || format!("its outputs are {}", listed(graph.outputs.iter()));
        if let Some(name) = &self.output {
            let gives =
                graph.nodes.iter().flat_map(|node| &node.outputs).chain(graph.outputs.iter().map(|port| &port.name));
            ensure!(
                gives.into_iter().any(|given| given == name),
                "--output {}: the file has no value of this name; {}",
                printable(name),
                outputs()
            );
        }
        for (option, names) in [("observe", &self.observed), ("prefix", &self.prefix)] {
            for name in names {
                ensure!(
                    graph.inputs.iter().any(|port| port.name == *name),
                    "--{option} {}: the file has no input of this name; its inputs are {}",
                    printable(name),
                    listed(graph.inputs.iter())
                );
            }
        }
        for (from, to) in &self.states {
            let [state, from_name, to_name] =
                [&format!("{from}={to}"), from, to].map(|name| printable(name).into_owned());
            ensure!(
                graph.inputs.iter().any(|port| port.name == *from),
                "--state {state}: the file has no input {from_name:?}; its inputs are {}",
                listed(graph.inputs.iter())
            );
            ensure!(
                graph.outputs.iter().any(|port| port.name == *to),
                "--state {state}: the file has no output {to_name:?}; {}",
                outputs()
            );
        }
        Ok(())
    }
}

/// Lists names for a message.
pub(super) fn listed<'p>(ports: impl ExactSizeIterator<Item = &'p Port>) -> String {
    let count = ports.len();
    let names: Vec<_> = ports.take(MAX_LISTED).map(|port| printable(&port.name)).collect();
    let more = count - names.len();
    names.join(", ") + &if more > 0 { format!(" and {more} more") } else { String::new() }
}
