//! What the metadata and the YAML file both state: they must agree, or the user decides.

use std::collections::BTreeMap;

use actq::error::{Context as _, Result, bail, ensure};
use actq::text::printable;

use crate::facts::Facts;

/// Largest difference of a number from the metadata's, which has 3 decimals.
const ROUNDING: f64 = 5.1e-4;

/// Numbers by joint, and where they are.
pub(super) type ByJoint = (BTreeMap<String, f64>, String);

/// Returns the policy's order of joints, and where it is. The metadata and the YAML file must agree, or the user decides.
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
    let key = "joints.order";
    match facts.missing::<String>(key, "which order of joints does the network have?")?.as_deref() {
        Some("metadata") => Ok((common, format!("{meta} (answer {key})"))),
        Some("file") => Ok((listed.to_vec(), format!("{yaml} (answer {key})"))),
        Some(other) => bail!("answer {key} = {other:?}: give \"metadata\" or \"file\""),
        None => {
            let shown = |names: &[String]| {
                let name = names.get(i).map(|name| printable(name));
                format!("joint {i} (the first is 0) is {:?}: {}", name.unwrap_or_default(), names.join(", "))
            };
            Err(Facts::contradiction(
                &format!("order of the joints (answer {key} = \"metadata\" or \"file\" to decide)"),
                (meta, &shown(&common)),
                (yaml, &shown(listed)),
            ))
        }
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
                    let which = facts.missing::<String>(key, "which numbers hold?")?;
                    match which.as_deref() {
                        Some("metadata") => (own.0, format!("{} (answer {key})", own.1)),
                        Some("file") => (yaml.0, format!("{} (answer {key})", yaml.1)),
                        Some(other) => bail!("answer {key} = {other:?}: give \"metadata\" or \"file\""),
                        None => {
                            let shown = |by: &ByJoint| {
                                format!(
                                    "{} for joint {:?}",
                                    by.0.get(joint).copied().unwrap_or_default(),
                                    printable(joint)
                                )
                            };
                            return Err(Facts::contradiction(
                                &format!("{key} (answer {key} = \"metadata\" or \"file\" to decide)"),
                                (&own.1, &shown(&own)),
                                (&yaml.1, &shown(&yaml)),
                            ));
                        }
                    }
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
