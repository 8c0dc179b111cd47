//! The names of a description.

use std::collections::{BTreeMap, BTreeSet};

use actq::error::{Result, bail, ensure};
use actq::text::printable;

use crate::description::{Description, Op, Operand};

/// Most names of a description, which also bounds how deep one value may depend on others.
const MAX_NAMES: usize = 1000;
/// Most names in a message.
const MAX_LISTED: usize = 20;

/// Names of a description, and the outputs that they read.
pub(crate) struct Names<'a> {
    /// Inputs, states, clocks, motions and values, in this order.
    own: Vec<&'a str>,
    /// Outputs that something reads, by `network.output`.
    outputs: BTreeMap<String, (usize, usize)>,
    /// The same for each network.
    of_networks: Vec<Vec<String>>,
}

impl<'a> Names<'a> {
    /// Refuses names that occur twice, are empty, or have characters that a report cannot show.
    pub(super) fn of(description: &'a Description) -> Result<Self> {
        let own: Vec<&str> = (description.inputs.iter().map(|input| input.name.as_str()))
            .chain(description.states.iter().map(|state| state.name.as_str()))
            .chain(description.clocks.iter().map(|clock| clock.name.as_str()))
            .chain(description.motions.iter().map(|motion| motion.name.as_str()))
            .chain(description.values.iter().map(|value| value.name.as_str()))
            .collect();
        ensure!(own.len() <= MAX_NAMES, "there are {} names; at most {MAX_NAMES} are allowed", own.len());
        let networks = description.networks.iter().map(|network| network.name.as_str());
        let mut seen = BTreeSet::new();
        for name in own.iter().copied().chain(networks) {
            plain(name)?;
            ensure!(!name.contains('.'), "name {name:?}: a point separates a network from its output; omit it");
            ensure!(seen.insert(name), "name {name:?} occurs twice");
            ensure!(!description.constants.contains_key(name), "name {name:?} is that of a value and of a constant");
        }
        for (order, joints) in &description.joints {
            plain(order)?;
            let mut seen = BTreeSet::new();
            for joint in joints {
                plain(joint)?;
                ensure!(seen.insert(joint), "joints.{order}: {joint:?} occurs twice");
            }
        }
        let mut names =
            Self { own, outputs: BTreeMap::new(), of_networks: vec![Vec::new(); description.networks.len()] };
        for name in read(description) {
            names.find_output(name, description);
        }
        for (index, network) in description.networks.iter().enumerate() {
            for output in network.states.values() {
                names.add_output(index, output, &network.name);
            }
        }
        Ok(names)
    }

    fn find_output(&mut self, name: &str, description: &Description) {
        let Some((network, output)) = name.split_once('.') else { return };
        if let Some(index) = description.networks.iter().position(|n| n.name == network) {
            self.add_output(index, output, network);
        }
    }

    fn add_output(&mut self, index: usize, output: &str, network: &str) {
        let outputs = &mut self.of_networks[index];
        if !outputs.iter().any(|other| other == output) {
            outputs.push(output.to_owned());
            self.outputs.insert(format!("{network}.{output}"), (index, outputs.len() - 1));
        }
    }

    /// Returns the network and the number of an output.
    pub(super) fn output(&self, name: &str) -> Option<(usize, usize)> {
        self.outputs.get(name).copied()
    }

    /// Returns the outputs of a network that something reads.
    pub(super) fn outputs_of(&self, network: usize) -> &[String] {
        &self.of_networks[network]
    }

    pub(super) fn all(&self) -> impl Iterator<Item = &str> {
        self.own.iter().copied().chain(self.outputs.keys().map(String::as_str))
    }

    /// Lists the names for a message.
    pub(super) fn listed(&self) -> String {
        let count = self.all().count();
        let more = if count > MAX_LISTED { format!(" and {} more", count - MAX_LISTED) } else { String::new() };
        self.all().take(MAX_LISTED).collect::<Vec<_>>().join(", ") + &more
    }
}

/// Lists the names that a description reads.
fn read(description: &Description) -> Vec<&str> {
    let mut names: Vec<&str> = vec![&description.action];
    names.extend(description.states.iter().map(|state| state.next.as_str()));
    names.extend(description.targets.iter().map(|target| target.value.as_str()));
    names.extend(description.networks.iter().flat_map(|network| network.inputs.values().map(String::as_str)));
    for clock in &description.clocks {
        names.extend(clock.standing.iter().flat_map(|standing| standing.of.iter().map(String::as_str)));
    }
    for value in &description.values {
        names.extend(value.from.names().iter().map(String::as_str));
        for op in &value.ops {
            let operands: &[Operand] = match op {
                Op::Add(o) | Op::Subtract(o) | Op::Scale(o) | Op::Divide(o) => std::slice::from_ref(o),
                Op::Clip(both) => both,
                _ => &[],
            };
            names.extend(
                operands.iter().filter_map(|o| if let Operand::Name(name) = o { Some(name.as_str()) } else { None }),
            );
        }
    }
    names
}

/// Refuses a name that cannot be shown.
fn plain(name: &str) -> Result<()> {
    if name.is_empty() || name.chars().count() > 100 || printable(name) != name {
        bail!("name {:?}: give 1 to 100 characters without control characters", printable(name));
    }
    Ok(())
}
