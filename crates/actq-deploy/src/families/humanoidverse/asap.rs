//! The observation of ASAP: terms, and their histories as a term of its own.

use std::path::Path;

use actq::error::{Context as _, Result, ensure};

use super::lengths::count;
use super::reader::Reader;
use crate::description::{History, Op, Operand};
use crate::document::Document;
use crate::yaml::Node;

/// Policies of ASAP's files: name, key of the histories, key of the lengths, and scale of the histories.
const ASAP: [[&str; 4]; 3] = [
    ["locomotion", "history_loco_config", "obs_loco_dims", "history_loco"],
    ["locomotion_height", "history_loco_height_config", "obs_loco_dims", "history_loco"],
    ["mimic", "history_mimic_config", "obs_mimic_dims", "history_mimic"],
];

/// Returns `true` if a file has the histories of one of ASAP's policies.
pub(super) fn is_one(yaml: &Document) -> bool {
    ASAP.iter().any(|[_, histories, ..]| yaml.peek(histories).is_some())
}

impl Reader<'_> {
    /// Adds the observation of ASAP; returns its length.
    pub(super) fn asap(&mut self, file: &str, observation_len: Option<usize>) -> Result<usize> {
        let [policy, histories, dims, scale] = self.asap_policy(file, observation_len)?;
        self.dims = dims.to_owned();
        let yaml = self.yaml;
        if policy == "mimic" {
            let skill = self.skill(file)?;
            let kind = yaml.required(&format!("mimic_robot_types.{skill}"), "a text", Node::text)?;
            let mask = yaml.numbers(&format!("robot_dofs.{kind}"))?;
            self.active = Some(self.places(&mask, &format!("robot_dofs.{kind}"))?);
            self.motion = yaml.optional(&format!("motion_length_s.{skill}"), "a number of s", Node::number)?;
            self.facts.note("joints of the policy", yaml.location(&format!("robot_dofs.{kind}")));
        }
        if self.action_len.is_none() {
            self.action_len_from = yaml.location(&format!("{dims}.actions"));
            let len = self.dim("actions")?;
            self.action_len = Some(self.active.as_ref().map_or(len, Vec::len));
        }
        let flag = if policy == "mimic" { "USE_HISTORY_MIMIC" } else { "USE_HISTORY_LOCO" };
        let with_history = yaml.optional(flag, "True or False", Node::truth)?.unwrap_or(false);
        let mut terms = yaml.keys(histories);
        terms.sort_unstable();
        ensure!(!terms.is_empty(), "{} has no terms", yaml.location(histories));
        self.facts.note("observation", format!("{}; {}", yaml.location(histories), self.facts.source("asap.terms")));
        let spec = History {
            length: 1,
            stride: 1,
            first: self.facts.value_or_default("asap.history.first")?,
            fill: self.facts.value_or_default("asap.history.fill")?,
            current: self.facts.value("asap.history.current")?.unwrap_or(false),
        };
        let (mut before, mut past, mut after, mut all) = (Vec::new(), Vec::new(), Vec::new(), 0);
        for name in terms {
            let term = self.term(name)?;
            let value = if term.from == name { format!("{name}_term") } else { name.to_owned() };
            let len = term.len;
            self.parts.value(&value, &term.from, term.ops);
            self.facts.note(&value, yaml.location(&format!("obs_scales.{name}")));
            let key = format!("{histories}.{name}");
            let length = yaml.required(&key, "a number of frames", count)?;
            all += len;
            if with_history {
                let by = yaml.number(&format!("obs_scales.{scale}"))?;
                let ops = vec![Op::History(History { length, ..spec }), Op::Scale(Operand::Number(by))];
                let history = format!("{name}_history");
                self.parts.value(&history, &value, ops);
                self.facts
                    .note(&history, format!("{}; {}", yaml.location(&key), self.facts.source("asap.history.first")));
                past.push(history);
                all = len.checked_mul(length).and_then(|len| len.checked_add(all)).context("a history is too long")?;
            }
            // The histories are one term, whose name begins with "history".
            if name < "history" { before.push(value) } else { after.push(value) }
        }
        let names: Vec<&str> = before.iter().chain(&past).chain(&after).map(String::as_str).collect();
        self.parts.values("observation", &names);
        Ok(all)
    }

    /// Returns which of ASAP's policies a network is: by its folder, by its length, or by the answer.
    fn asap_policy(&mut self, file: &str, observation_len: Option<usize>) -> Result<[&'static str; 4]> {
        // The order of the terms is the same for all; it is asked for here, since nothing else states it.
        let listed: bool = self.facts.value("asap.terms")?.unwrap_or(true);
        ensure!(listed, "asap.terms = false: write the terms of the observation in deploy.toml");
        let there: Vec<[&str; 4]> =
            ASAP.into_iter().filter(|[_, histories, ..]| self.yaml.peek(histories).is_some()).collect();
        let skills = self.yaml.keys("mimic_models");
        let is_mimic = Path::new(file)
            .iter()
            .filter_map(|part| part.to_str())
            .any(|part| part == "mimic" || skills.contains(&part));
        let fits = |policy: &[&str; 4]| {
            let mimic = policy[0] == "mimic";
            mimic == is_mimic && (mimic || observation_len.is_none_or(|len| self.asap_len(policy) == Some(len)))
        };
        let fitting: Vec<[&str; 4]> = there.iter().filter(|policy| fits(policy)).copied().collect();
        if let [one] = fitting[..] {
            self.facts.note("policy", format!("{file}: its folder and the length of its input"));
            return Ok(one);
        }
        let answer: Option<String> = self.facts.value("asap.policy")?;
        let first = there.first().copied().context("it has no policies")?;
        let Some(answer) = answer else { return Ok(first) };
        let names = || there.iter().map(|policy| policy[0]).collect::<Vec<_>>().join(", ");
        let found = there.iter().copied().find(|policy| policy[0] == answer);
        found.with_context(|| format!("asap.policy = {answer:?}: expected one of {}", names()))
    }

    /// Returns the length of an observation of ASAP that selects no joints.
    fn asap_len(&self, [_, histories, dims, _]: &[&str; 4]) -> Option<usize> {
        let with_history = self.yaml.peek("USE_HISTORY_LOCO").and_then(Node::truth).unwrap_or(false);
        let terms = self.yaml.keys(histories);
        let len = |term: &&str| {
            let dim = count(self.yaml.peek(&format!("{dims}.{term}"))?)?;
            let frames = count(self.yaml.peek(&format!("{histories}.{term}"))?)?;
            dim.checked_mul(if with_history { frames.checked_add(1)? } else { 1 })
        };
        terms.iter().try_fold(0_usize, |all, term| all.checked_add(len(term)?))
    }

    /// Returns the name of a skill of ASAP: the network's folder, the only one of the file, or the answer.
    fn skill(&mut self, file: &str) -> Result<String> {
        let skills = self.yaml.keys("mimic_models");
        let folder = Path::new(file).parent().and_then(Path::file_name).and_then(|name| name.to_str());
        let found = skills.iter().find(|skill| Some(**skill) == folder);
        self.yaml.node("mimic_models");
        if let Some(skill) = found {
            return Ok((*skill).to_owned());
        }
        if let [only] = skills[..] {
            return Ok(only.to_owned());
        }
        ensure!(!skills.is_empty(), "{} has no skills", self.yaml.location("mimic_models"));
        self.facts.choose_one_of("asap.skill", &skills)
    }

    fn places(&self, mask: &[f64], key: &str) -> Result<Vec<usize>> {
        let n = self.robot.len();
        let at = self.yaml.location(key);
        ensure!(mask.len() == n, "{at} has {} values; {n} are needed, one for each joint", mask.len());
        ensure!(mask.iter().all(|flag| *flag == 0.0 || *flag == 1.0), "{at} must hold 0 and 1 only");
        let places: Vec<usize> = (0..n).filter(|i| mask[*i] == 1.0).collect();
        ensure!(!places.is_empty(), "{at} selects no joint");
        Ok(places)
    }
}
