//! Numbers of keys and rules.

use actq::error::{Context as _, Result, bail, ensure};

use super::schema::{Source, Sourced};
use crate::description::Numbers;
use crate::document::Document;
use crate::facts::Facts;
use crate::yaml::Node;

/// The file with the keys, and the rules.
pub(super) struct Values<'a> {
    pub(super) document: &'a Document,
    pub(super) facts: &'a mut Facts,
}

/// Texts that say which values a key may have.
pub(super) const ONE: &str = "a finite number";
pub(super) const SEVERAL: &str = "finite numbers";

/// Reads a number, or several in a list or a text with commas.
fn numbers(node: &Node) -> Option<Vec<f64>> {
    let parts = || node.text()?.split(',').map(|part| part.trim().parse().ok()).collect();
    let list: Vec<f64> = node.one_or_several().or_else(parts)?;
    (!list.is_empty() && list.iter().all(|number| number.is_finite())).then_some(list)
}

impl Values<'_> {
    /// Returns the path of a key: `{term}` is a term, and `*` the only key at its place.
    pub(super) fn path(&self, key: &str, term: &str) -> Result<String> {
        let path = key.replace("{term}", term);
        let Some((before, after)) = path.split_once("*") else { return Ok(path) };
        let all = before.trim_end_matches('.');
        match self.document.keys(all)[..] {
            [only] => Ok(format!("{before}{only}{after}")),
            ref keys => bail!("{} has {} entries; one is supported", self.document.location(all), keys.len()),
        }
    }

    /// Returns the file's text of a key.
    pub(super) fn text(&self, key: &str, term: &str) -> Result<String> {
        Ok(self.document.required(&self.path(key, term)?, "a text", Node::text)?.to_owned())
    }

    /// Returns numbers and where they are from; `None` if the file has none and no rule answers.
    pub(super) fn list(&mut self, source: &Source, term: &str) -> Result<Option<(Vec<f64>, String)>> {
        self.read(source, term, SEVERAL)
    }

    /// Does the same as [`Self::list`]; errors name `what` the key must be.
    fn read(&mut self, source: &Source, term: &str, what: &str) -> Result<Option<(Vec<f64>, String)>> {
        let all = |numbers: Numbers| match numbers {
            Numbers::All(one) => vec![one],
            Numbers::Each(list) => list,
        };
        let given = match source {
            Source::Stated(numbers) => return Ok(Some((all(numbers.clone()), "profile".to_owned()))),
            Source::Key(key) => &Sourced { key: Some(key.clone()), rule: None },
            Source::Of(given) => given,
        };
        let rule = given.rule.as_ref().map(|rule| rule.replace("{term}", term));
        if let Some(key) = &given.key {
            let path = self.path(key, term)?;
            if let Some(list) = self.document.optional(&path, what, numbers)? {
                let at = self.document.location(&path);
                if let (Some(rule), [one]) = (&rule, &list[..]) {
                    self.facts.agrees(rule, one, &at)?;
                }
                return Ok(Some((list, at)));
            }
        }
        let Some(rule) = rule else { return Ok(None) };
        let numbers: Option<Numbers> = self.facts.value(&rule)?;
        Ok(numbers.map(|numbers| (all(numbers), self.facts.source(&rule))))
    }

    /// Returns one number and where it is from; `open` while a rule is a question.
    pub(super) fn one(&mut self, source: &Source, term: &str, open: f64) -> Result<(f64, String)> {
        match self.read(source, term, ONE)? {
            Some((list, at)) => {
                ensure!(list.len() == 1, "{at} has {} numbers; give one", list.len());
                Ok((list[0], at))
            }
            None => {
                self.require(source, term, ONE)?;
                Ok((open, "a question".to_owned()))
            }
        }
    }

    /// Returns a number above 0 and where it is from; 1 while a rule is a question.
    pub(super) fn positive(&mut self, source: &Source) -> Result<(f64, String)> {
        let (number, at) = self.one(source, "", 1.0)?;
        ensure!(number > 0.0, "{} = {number} ({at}): give a number above 0", source.name());
        Ok((number, at))
    }

    /// Returns `true` if a source is one number, not a list.
    pub(super) fn is_single(&self, source: &Source) -> Result<bool> {
        Ok(match source {
            Source::Stated(Numbers::All(_)) => true,
            Source::Key(key) | Source::Of(Sourced { key: Some(key), .. }) => {
                self.document.peek(&self.path(key, "")?).is_some_and(|node| node.number().is_some())
            }
            _ => false,
        })
    }

    /// Refuses a missing key without a rule; the error says by `what` which value it must have.
    pub(super) fn require(&self, source: &Source, term: &str, what: &str) -> Result<()> {
        if let Source::Key(key) | Source::Of(Sourced { key: Some(key), rule: None }) = source {
            let path = self.path(key, term)?;
            self.document.required(&path, what, numbers).map(drop)?;
        }
        Ok(())
    }

    /// Returns the lists of pairs at a key, the lowest numbers and the highest.
    pub(super) fn pairs(&self, path: &str) -> Result<Option<[Vec<f64>; 2]>> {
        let Some(node) = self.document.node(path) else { return Ok(None) };
        let pairs: Option<Vec<[f64; 2]>> = match node.pair() {
            Some(pair) => Some(vec![pair]),
            None => node.items().iter().map(Node::pair).collect(),
        };
        let is_right = |pairs: &Vec<[f64; 2]>| !pairs.is_empty() && pairs.iter().all(|[low, high]| low <= high);
        let pairs = pairs.filter(is_right);
        let pairs = pairs.with_context(|| {
            format!(
                "{} (line {}) must be two numbers, the lowest first, or pairs",
                self.document.location(path),
                node.line
            )
        })?;
        let of = |i: usize| pairs.iter().map(|pair| pair[i]).collect();
        Ok(Some([of(0), of(1)]))
    }
}
