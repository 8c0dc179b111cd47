//! Reading of bundles by their families.

use std::collections::BTreeMap;

use actq::error::{Context as _, Result, bail, ensure};
use actq::import::contract::StatedLimits;

use crate::bundle::Bundle;
use crate::description::{Description, Numbers, Op, Operand};
use crate::facts::{Answers, Facts, Profile, Question};
use crate::families::{FAMILIES, Stack};
use crate::family::{Family, Recognized};
use crate::nearest::nearest;
use crate::plan::Plan;

/// File of a description, in a bundle's folder. Where it is, no reader is needed.
pub const DESCRIPTION: &str = "deploy.toml";

/// A bundle as its family's reader understands it.
#[derive(Debug)]
pub struct Reading {
    /// Name of the family.
    pub family: String,
    /// Repository and commit that the family's profile was read from.
    pub profile: Option<[String; 2]>,
    /// The description; values that questions ask for are placeholders.
    pub description: Description,
    /// Source of each part, by its name or key.
    pub sources: BTreeMap<String, String>,
    /// Questions that nothing answers. The description is complete if there are none.
    pub questions: Vec<Question>,
    /// Keys of the files that nothing read.
    pub unread: Vec<String>,
}

impl Reading {
    /// Limits the targets to what a user states, with a value for all targets or one for each value of them in their
    /// order; of two limits, the stricter one holds.
    ///
    /// # Errors
    ///
    /// As [`StatedLimits::within`], for a largest step, and if the description is not complete.
    pub fn limit(&mut self, stated: &StatedLimits, bundle: &Bundle) -> Result<()> {
        ensure!(
            stated.max_step.is_empty(),
            "a bundle's targets have no largest step; its firmware takes LOW:HIGH:RATE"
        );
        let known: Vec<Vec<[f64; 2]>> = Plan::new(&self.description, bundle).context(DESCRIPTION)?.target_limits();
        let has_one_kind = self.description.targets.windows(2).all(|pair| pair[0].kind == pair[1].kind);
        ensure!(
            stated.low.len().max(stated.high.len()) > 1 || has_one_kind,
            "the bundle has targets of several kinds; state limits for each of their values"
        );
        let mut limits = stated.within(&known.concat(), "the bundle")?.into_iter();
        for (target, known) in self.description.targets.iter_mut().zip(known) {
            let own: Vec<[f64; 2]> = limits.by_ref().take(known.len()).collect();
            let side = |side: usize| own.iter().map(|limits| limits[side]).collect::<Vec<f64>>();
            let [low, high] = [side(0), side(1)];
            if own != known {
                ensure!(
                    low.iter().chain(&high).all(|limit| limit.is_finite()),
                    "target {:?}: a limit is missing or infinite; state the lowest and the highest value",
                    target.value
                );
                target.limits = Some([low, high].map(Numbers::Each));
                self.sources.insert("limits".to_owned(), "the option for limits".to_owned());
            }
        }
        Ok(())
    }
}

/// Limits the targets that end in a clip to its numbers: a controller needs them to arm.
fn limit_clipped(description: &mut Description, facts: &mut Facts) {
    for i in 0..description.targets.len() {
        let target = &description.targets[i];
        let value = description.values.iter().find(|value| value.name == target.value);
        let Some(Op::Clip(limits)) = value.and_then(|value| value.ops.last()) else { continue };
        let of = |list: &Vec<f64>| if let [one] = list[..] { Numbers::All(one) } else { Numbers::Each(list.clone()) };
        let numbers = |limit: &Operand| match limit {
            Operand::Number(number) => Some(Numbers::All(*number)),
            Operand::List(list) => Some(of(list)),
            Operand::Name(name) => description.constants.get(name).map(of),
        };
        if let ([Some(low), Some(high)], None) = (limits.each_ref().map(numbers), &target.limits) {
            facts.note("limits", facts.source(&target.value));
            description.targets[i].limits = Some([low, high]);
        }
    }
}

/// Reads a bundle as one of a family.
fn read_as(
    family: &dyn Family,
    bundle: &Bundle,
    found: &Recognized,
    accepted: bool,
    answers: Answers,
) -> Result<Reading> {
    let profile = Profile::parse(family.profile())?;
    let (name, upstream) = (profile.family.clone(), [profile.upstream.clone(), profile.commit.clone()]);
    let upstream = (!profile.upstream.is_empty()).then_some(upstream);
    let mut facts = Facts::new(profile, accepted, answers);
    let mut description = family.read(bundle, found, &mut facts).with_context(|| format!("{name} bundle"))?;
    limit_clipped(&mut description, &mut facts);
    let unread = facts.unread(&found.documents)?;
    let (sources, questions) = facts.finish()?;
    Ok(Reading { family: name, profile: upstream, description, sources, questions, unread })
}

/// Reads a bundle by its profile, or by the first family that recognizes it.
///
/// `accepted`: the values of the family's profile hold. They are questions otherwise.
///
/// # Errors
///
/// If no family recognizes it, or its reader fails.
pub fn read(bundle: &Bundle, accepted: bool, answers: Answers) -> Result<Reading> {
    if let Some(profile) = bundle.profile() {
        let stack = Stack(profile);
        let found = stack.recognize(bundle).context("the profile")?;
        let found = found.with_context(|| {
            let near = nearest(bundle, &Profile::parse(profile).into_iter().collect::<Vec<_>>());
            let near = if near.is_empty() { "no file has its keys".to_owned() } else { near.join("; ") };
            format!("{}: not a bundle of this profile: {near}", bundle.root().display())
        })?;
        return read_as(&stack, bundle, &found, true, answers);
    }
    if bundle.has(DESCRIPTION) {
        if let Some(key) = answers.keys().next() {
            bail!("answers: nothing asks for {key}: {DESCRIPTION} describes this bundle; change it there");
        }
        let description = bundle.text(DESCRIPTION).and_then(|text| Description::parse(&text).context(DESCRIPTION))?;
        let (sources, questions, unread) = Default::default();
        return Ok(Reading { family: DESCRIPTION.to_owned(), profile: None, description, sources, questions, unread });
    }
    for family in FAMILIES {
        if let Some(found) = family.recognize(bundle)? {
            return read_as(*family, bundle, &found, accepted, answers);
        }
    }
    let profiles: Vec<Profile> =
        FAMILIES.iter().map(|family| Profile::parse(family.profile())).collect::<Result<_>>()?;
    let known: Vec<&str> = profiles.iter().map(|profile| profile.family.as_str()).collect();
    let near = nearest(bundle, &profiles);
    let near = if near.is_empty() { "no file has keys of one".to_owned() } else { near.join("; ") };
    bail!(
        "{}: no known family of deploy bundles ({}); {near}; write deploy.toml beside the files by docs/DEPLOY.md",
        bundle.root().display(),
        known.join(", ")
    )
}
