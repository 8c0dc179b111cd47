//! Facts that both the metadata and the YAML file give. If they differ, the user decides.

use std::collections::BTreeMap;

use actq::error::{Context as _, Result, bail, ensure};
use actq::text::printable;

use crate::facts::Facts;

/// Largest difference of two roundings of a number from the metadata's, which has 3 decimals.
const ROUNDING: f64 = 5.1e-4;

/// Numbers by joint, and where they are.
pub(super) type ByJoint = (BTreeMap<String, f64>, String);

/// Returns the policy's order of joints, and where it is. The metadata and the YAML file must agree, or the user
/// decides.
pub(super) fn order(
    raw: &[String],
    meta: &str,
    listed: &[String],
    yaml: &str,
    facts: &mut Facts,
) -> Result<(Vec<String>, String)> {
    for (i, joint) in listed.iter().enumerate() {
        ensure!(!listed[..i].contains(joint), "{yaml}: {:?} occurs twice", printable(joint));
    }
    if let Some(joint) = listed.iter().find(|joint| !raw.contains(joint)) {
        return Err(Facts::contradiction(
            "names of the joints",
            (yaml, &format!("{:?}", printable(joint))),
            (meta, &raw.join(", ")),
        ));
    }
    ensure!(!listed.is_empty(), "{yaml} has no names");
    let common: Vec<String> = raw.iter().filter(|joint| listed.contains(joint)).cloned().collect();
    let Some(i) = (0..common.len()).find(|&i| common.get(i) != listed.get(i)) else {
        return Ok((common, format!("{yaml}; {meta}")));
    };
    let shown = |names: &[String]| {
        let name = names.get(i).map(|name| printable(name));
        format!("joint {i} (from 0) is {:?}: {}", name.unwrap_or_default(), names.join(", "))
    };
    let dispute = Dispute {
        key: "joints.order",
        text: "which order of joints does the network have?",
        what: "order of the joints",
    };
    dispute.decide((common.clone(), meta, &shown(&common)), (listed.to_vec(), yaml, &shown(listed)), facts)
}

/// Two statements of one thing that differ.
struct Dispute<'a> {
    key: &'a str,
    text: &'a str,
    /// Name of the fact that both state.
    what: &'a str,
}

impl Dispute<'_> {
    /// Returns what the metadata or the file says, by the answer, and where it is. A statement has its value, its place
    /// and what a message shows of it. Without an answer both contradict each other.
    fn decide<T>(&self, meta: (T, &str, &str), file: (T, &str, &str), facts: &mut Facts) -> Result<(T, String)> {
        let Self { key, text, what } = self;
        let (value, at, _) = match facts.missing::<String>(key, text)?.as_deref() {
            Some("metadata") => meta,
            Some("file") => file,
            Some(other) => bail!("answer {key} = {other:?}: give \"metadata\" or \"file\""),
            None => {
                return Err(Facts::contradiction(
                    &format!("{what} (answer {key} = \"metadata\" or \"file\" to decide)"),
                    (meta.1, meta.2),
                    (file.1, file.2),
                ));
            }
        };
        Ok((value, format!("{at} (answer {key})")))
    }
}

/// Returns numbers of some joints, and where they are: the YAML file's, which must be the metadata's, too, or the user
/// decides.
pub(super) fn agreed(
    pair: (Option<ByJoint>, Option<ByJoint>),
    key: &str,
    joints: &[String],
    facts: &mut Facts,
) -> Result<Option<(Vec<f64>, String)>> {
    let (numbers, source) = match pair {
        (None, None) => return Ok(None),
        (Some(one), None) | (None, Some(one)) => one,
        (Some(own), Some(yaml)) => {
            let differs = |joint: &&String| match (own.0.get(*joint), yaml.0.get(*joint)) {
                (Some(own), Some(yaml)) => (own - yaml).abs() > ROUNDING,
                _ => false,
            };
            match joints.iter().find(differs) {
                None => (yaml.0, format!("{}; {}", yaml.1, own.1)),
                Some(joint) => {
                    let shown = |by: &ByJoint| {
                        let number = by.0.get(joint).copied().unwrap_or_default();
                        format!("{number} for joint {:?}", printable(joint))
                    };
                    let (of_own, of_yaml) = (shown(&own), shown(&yaml));
                    let dispute = Dispute { key, text: "which numbers hold?", what: key };
                    dispute.decide((own.0, &own.1, &of_own), (yaml.0, &yaml.1, &of_yaml), facts)?
                }
            }
        }
    };
    let number = |joint: &String| {
        let number = numbers.get(joint).copied();
        number.with_context(|| format!("{source}: it has no number for joint {:?}", printable(joint)))
    };
    Ok(Some((joints.iter().map(number).collect::<Result<_>>()?, source)))
}
