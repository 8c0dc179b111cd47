//! Files that say the same of a policy must agree.

use actq::error::Result;

use super::model::{Action, Policy, Sourced, Term, TermSource};
use crate::document::Document;
use crate::facts::Facts;
use crate::families::common::{names, numbers};
use crate::yaml::Node;

/// Largest difference of two numbers, relative to 1 and their size: one file has them in f32.
const F32: f64 = 1e-5;
/// Largest difference from a number of the ONNX metadata, which has 3 decimals.
const DECIMALS: f64 = 5.1e-4;

/// Gives what is compared of a term with this number of values.
type OfTerm = fn(&Term, usize) -> Vec<f64>;

/// Checks an environment by the exported descriptors of it, and takes from them the lengths of terms that only they
/// have.
pub(super) fn with_descriptors(environment: &mut Policy, descriptors: &Policy) -> Result<()> {
    same("ticks a second", &environment.rate, &descriptors.rate, F32)?;
    same("default positions", &environment.default, &descriptors.default, F32)?;
    same("default velocities", &environment.default_velocity, &descriptors.default_velocity, F32)?;
    match (&mut environment.gains, &descriptors.gains) {
        (Some(own), Some(other)) => {
            let mut other = other.clone();
            for place in 0..own[0].numbers.len().min(other[0].numbers.len()) {
                // Joints whose actuators are computed outside of PhysX.
                if other.iter().all(|gain| gain.numbers[place] == 0.0) {
                    other.iter_mut().zip(&*own).for_each(|(gain, own)| gain.numbers[place] = own.numbers[place]);
                }
            }
            same("stiffness", &own[0], &other[0], F32)?;
            same("damping", &own[1], &other[1], F32)?;
        }
        (Some(_), None) => {}
        (own @ None, other) => own.clone_from(other),
    }
    environment.limits.clone_from(&descriptors.limits);
    of_actions(&environment.actions, &descriptors.actions)?;
    let total = environment.actions.iter().map(|action| action.joints.len()).sum();
    let mut described = descriptors.terms.iter().peekable();
    let mut last = String::new();
    for term in &mut environment.terms {
        let other = described.next_if(|other| other.function == term.function);
        let Some(other) = other else {
            // The exporter leaves out functions without a descriptor; all that this reader knows have one.
            if !matches!(term.what, TermSource::Unknown(..)) {
                let next = described.peek().map_or("no further term", |other| other.function.as_str());
                return Err(Facts::contradiction(
                    "terms of the observation",
                    (&term.from, &format!("{} follows {last:?}", term.function)),
                    (&descriptors.terms[0].from, &format!("{next} follows it, in the list that begins here")),
                ));
            }
            continue;
        };
        of_term(term, other, total)?;
        if let TermSource::Unknown(_, len) = &mut term.what {
            *len = other.len(total);
        }
        last.clone_from(&term.name);
    }
    if let Some(other) = described.next() {
        return Err(Facts::contradiction(
            "terms of the observation",
            (&other.from, &format!("{} follows {last:?}", other.function)),
            (&environment.terms.last().map_or(String::new(), |term| term.from.clone()), "it is the last term"),
        ));
    }
    Ok(())
}

fn of_term(own: &Term, other: &Term, actions: usize) -> Result<()> {
    let lens = (own.len(actions), other.len(actions));
    let len = lens.0.or(lens.1).unwrap_or(1);
    let of = |term: &Term, numbers: Vec<f64>| Sourced { numbers, from: term.from.clone() };
    let pairs: [(&str, OfTerm); 5] = [
        ("number of joints", |term, _| vec![term.joints.len() as f64]),
        ("joints", |term, _| term.joints.iter().map(|place| *place as f64).collect()),
        ("offset", |term, _| if term.offset.iter().all(|n| *n == 0.0) { Vec::new() } else { term.offset.clone() }),
        ("scale", |term, len| spread(term.scale.as_deref().unwrap_or(&[1.0]), len)),
        ("number of frames", |term, _| vec![term.frames as f64]),
    ];
    if let (Some(a), Some(b)) = lens {
        same("number of values", &of(own, vec![a as f64]), &of(other, vec![b as f64]), 0.0)?;
    }
    for (what, numbers) in pairs {
        same(&format!("{what} of {:?}", own.name), &of(own, numbers(own, len)), &of(other, numbers(other, len)), F32)?;
    }
    limits(&own.name, (&own.from, own.clip.as_slice()), (&other.from, other.clip.as_slice()))
}

fn of_actions(own: &[Action], others: &[Action]) -> Result<()> {
    let listed =
        |actions: &[Action]| actions.iter().map(|action| format!("{:?}", action.kind)).collect::<Vec<_>>().join(", ");
    if listed(own) != listed(others) {
        return Err(Facts::contradiction(
            "kinds of the actions",
            (&own[0].from, &listed(own)),
            (&others[0].from, &listed(others)),
        ));
    }
    for (own, other) in own.iter().zip(others) {
        let of = |action: &Action, numbers: &[f64]| Sourced { numbers: numbers.to_vec(), from: action.from.clone() };
        let places = |action: &Action| action.joints.iter().map(|place| *place as f64).collect::<Vec<_>>();
        let name = &own.name;
        same(&format!("joints of {name:?}"), &of(own, &places(own)), &of(other, &places(other)), 0.0)?;
        same(&format!("scale of {name:?}"), &of(own, &own.scale), &of(other, &other.scale), F32)?;
        same(&format!("offset of {name:?}"), &of(own, &own.offset), &of(other, &other.offset), F32)?;
        limits(
            name,
            (&own.from, own.clip.as_deref().unwrap_or_default()),
            (&other.from, other.clip.as_deref().unwrap_or_default()),
        )?;
    }
    Ok(())
}

/// Checks a policy by the metadata that some exporters store in the ONNX file. `named` is set if the terms have the
/// names of an environment.
pub(super) fn with_metadata(policy: &Policy, meta: &Document, named: bool) -> Result<()> {
    let list = |key: &str| -> Result<Option<Sourced>> {
        Ok(numbers(meta, key)?.map(|numbers| Sourced { numbers, from: meta.location(key) }))
    };
    let mut pairs = vec![("default positions", Some(policy.default.clone()), list("default_joint_pos")?)];
    if let Some([stiffness, damping]) = &policy.gains {
        pairs.push(("stiffness", Some(stiffness.clone()), list("joint_stiffness")?));
        pairs.push(("damping", Some(damping.clone()), list("joint_damping")?));
    }
    if let ([action], Some(scale)) = (&policy.actions[..], list("action_scale")?) {
        let scale = Sourced { numbers: spread(&scale.numbers, action.scale.len()), ..scale };
        let own = Sourced { numbers: action.scale.clone(), from: action.from.clone() };
        pairs.push(("scale of the action", Some(own), Some(scale)));
    }
    for (what, own, other) in pairs {
        if let (Some(own), Some(other)) = (own, other) {
            same(what, &own, &other, DECIMALS)?;
        }
    }
    let key = "observation_names";
    if named && meta.optional(key, "a text", Node::text)?.is_some() {
        let (listed, own) = (names(meta, key)?, policy.terms.iter().map(|term| term.name.clone()).collect::<Vec<_>>());
        if listed != own {
            return Err(Facts::contradiction(
                "terms of the observation",
                (&policy.terms.first().map_or(String::new(), |term| term.from.clone()), &own.join(", ")),
                (&meta.location(key), &listed.join(", ")),
            ));
        }
    }
    Ok(())
}

fn spread(numbers: &[f64], len: usize) -> Vec<f64> {
    if let [one] = numbers { vec![*one; len] } else { numbers.to_vec() }
}

/// Refuses different limits.
fn limits(of: &str, own: (&str, &[[f64; 2]]), other: (&str, &[[f64; 2]])) -> Result<()> {
    let is_close = |a: f64, b: f64| a == b || (a - b).abs() <= F32 * (1.0 + a.abs());
    let agree = own.1.len() == other.1.len()
        && own.1.iter().flatten().zip(other.1.iter().flatten()).all(|(a, b)| is_close(*a, *b));
    if agree {
        return Ok(());
    }
    let shown =
        |limits: &[[f64; 2]]| if limits.is_empty() { "there are none".to_owned() } else { format!("{limits:?}") };
    Err(Facts::contradiction(&format!("limits of {of:?}"), (own.0, &shown(own.1)), (other.0, &shown(other.1))))
}

/// Refuses lists whose lengths differ, or whose numbers differ by more than `most`, relative to 1 and their size.
fn same(what: &str, own: &Sourced, other: &Sourced, most: f64) -> Result<()> {
    let lens = (own.numbers.len(), other.numbers.len());
    if lens.0 != lens.1 {
        let shown = |len: usize| format!("{len} values");
        return Err(Facts::contradiction(what, (&own.from, &shown(lens.0)), (&other.from, &shown(lens.1))));
    }
    let differs = |(_, (a, b)): &(usize, (&f64, &f64))| (*a - *b).abs() > most * (1.0 + a.abs());
    if let Some((i, (a, b))) = own.numbers.iter().zip(&other.numbers).enumerate().find(differs) {
        let shown = |number: f64| format!("{number} for value {i} (from 0)");
        return Err(Facts::contradiction(what, (&own.from, &shown(*a)), (&other.from, &shown(*b))));
    }
    Ok(())
}

/// Refuses two orders of the joints.
pub(super) fn orders(own: &super::patterns::Joints, other: &super::patterns::Joints) -> Result<()> {
    let place = (0..own.len().max(other.len())).find(|place| own.names.get(*place) != other.names.get(*place));
    let Some(place) = place else { return Ok(()) };
    let shown = |joints: &super::patterns::Joints| match joints.names.get(place) {
        Some(name) => format!("joint {place} (from 0) is {name:?}: {}", joints.names.join(", ")),
        None => format!("{} joints: {}", joints.len(), joints.names.join(", ")),
    };
    Err(Facts::contradiction("order of the joints", (&own.from, &shown(own)), (&other.from, &shown(other))))
}
