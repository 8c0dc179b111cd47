//! The observation of FALCON: a list of terms, and their histories.

use actq::error::{Context as _, Result, ensure};

use super::super::common::Histories;
use super::lengths::count;
use super::reader::Reader;

impl Reader<'_> {
    /// Adds the observation of FALCON; returns its length.
    pub(super) fn falcon(&mut self) -> Result<usize> {
        let yaml = self.yaml;
        let listed = if yaml.peek("obs_dict").is_some() { "obs_dict.actor_obs" } else { "obs_list" };
        let mut terms = yaml.texts(listed)?;
        if !self.facts.is_choice("terms.order", "listed")? {
            terms.sort();
        }
        let lengths =
            if yaml.peek("history_length_dict").is_some() { "history_length_dict.actor_obs" } else { "history_length" };
        let length = yaml.required(lengths, "a number of frames", count)?;
        let histories = Histories::of(self.facts)?;
        let rules = ["terms.order", "history.layout"].map(|rule| self.facts.source(rule)).join("; ");
        self.facts.note("observation", format!("{}; {}; {rules}", yaml.location(listed), yaml.location(lengths)));
        if self.action_len.is_none() && terms.iter().any(|term| term == "actions") {
            self.action_len_from = yaml.location("obs_dims.actions");
            self.action_len = Some(self.dim("actions")?);
        }
        let mut all = 0;
        for (i, name) in terms.iter().enumerate() {
            ensure!(
                !terms.iter().take(i).any(|other| other == name),
                "{}: {name:?} occurs twice",
                yaml.location(listed)
            );
            let term = self.term(name)?;
            self.parts.begin(name, &term.from);
            let value = self.parts.term(term.ops, length);
            self.facts.note(&value, yaml.location(&format!("obs_scales.{name}")));
            all += term.len;
        }
        self.parts.observe(&histories)?;
        all.checked_mul(length).context("the observation is too long")
    }
}
