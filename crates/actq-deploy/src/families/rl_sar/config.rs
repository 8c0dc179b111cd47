//! The keys of a policy: those of its config.yaml, and those of its robot's base.yaml that it does not replace.

use actq::error::{Context as _, Result, ensure};
use actq::text::printable;

use super::super::common::{check_names, count, counts};
use crate::bundle::beside;
use crate::document::Document;
use crate::facts::Facts;
use crate::yaml::Node;

/// A map of a file, below its first key.
#[derive(Clone, Copy, Debug)]
pub(super) struct Section<'a> {
    pub(super) document: &'a Document,
    pub(super) name: &'a str,
}

impl Section<'_> {
    fn path(self, key: &str) -> String {
        format!("{}.{key}", self.name)
    }

    pub(super) fn has(self, key: &str) -> bool {
        self.document.peek(&self.path(key)).is_some()
    }

    /// Returns a list of names, if it has one.
    pub(super) fn names(self, key: &str) -> Result<Option<Vec<String>>> {
        let path = self.path(key);
        let names = self.document.optional(&path, "a list of names", Node::texts)?;
        if let Some(names) = &names {
            check_names(names, &self.location(key))?;
        }
        Ok(names)
    }

    pub(super) fn location(self, key: &str) -> String {
        self.document.location(&self.path(key))
    }
}

/// The keys of a policy.
#[derive(Clone, Copy, Debug)]
pub(super) struct Config<'a> {
    pub(super) own: Section<'a>,
    pub(super) base: Option<Section<'a>>,
}

impl<'a> Config<'a> {
    /// Returns the section that has a key: the policy's own, if both have it.
    fn section(&self, key: &str) -> Section<'a> {
        let given = |section: &Section<'_>| section.document.node(&section.path(key)).is_some();
        // Both are looked up, since a key of base.yaml counts as read if the policy replaces it.
        match (given(&self.own), self.base.filter(given)) {
            (false, Some(base)) => base,
            _ => self.own,
        }
    }

    /// Names a key, for reports and errors.
    pub(super) fn location(&self, key: &str) -> String {
        self.section(key).location(key)
    }

    pub(super) fn required<T>(&self, key: &str, what: &str, as_type: impl Fn(&'a Node) -> Option<T>) -> Result<T> {
        let section = self.section(key);
        section.document.required(&section.path(key), what, as_type)
    }

    pub(super) fn optional<T>(
        &self,
        key: &str,
        what: &str,
        as_type: impl Fn(&'a Node) -> Option<T>,
    ) -> Result<Option<T>> {
        let section = self.section(key);
        section.document.optional(&section.path(key), what, as_type)
    }

    pub(super) fn number(&self, key: &str) -> Result<f64> {
        self.required(key, "a finite number", Node::number)
    }

    pub(super) fn positive(&self, key: &str) -> Result<f64> {
        self.required(key, "a number above 0", |node| node.number().filter(|number| *number > 0.0))
    }

    /// Returns the number of the policy's joints.
    pub(super) fn joints(&self) -> Result<usize> {
        let joints = self.required("num_of_dofs", "a number of joints", count)?;
        ensure!(joints > 0, "{} is 0", self.location("num_of_dofs"));
        Ok(joints)
    }

    /// Returns a number for each joint of the policy; `None` if the list is empty or missing.
    pub(super) fn optional_of_joints(&self, key: &str) -> Result<Option<Vec<f64>>> {
        let Some(list) = self.optional(key, "a list of finite numbers", Node::numbers)? else { return Ok(None) };
        if list.is_empty() {
            return Ok(None);
        }
        self.check(key, list.len())?;
        Ok(Some(list))
    }

    /// Returns a number for each joint of the policy.
    pub(super) fn of_joints(&self, key: &str) -> Result<Vec<f64>> {
        let list = self.required(key, "a list of finite numbers", Node::numbers)?;
        self.check(key, list.len())?;
        Ok(list)
    }

    /// Refuses a list that has not one value for each joint of the policy.
    pub(super) fn check(&self, key: &str, len: usize) -> Result<()> {
        let joints = self.joints()?;
        if len != joints {
            return Err(Facts::contradiction(
                "number of joints",
                (&self.location("num_of_dofs"), &joints.to_string()),
                (&self.location(key), &format!("{len} values")),
            ));
        }
        Ok(())
    }

    /// Returns joints by their numbers, each at most once; none if the list is missing.
    pub(super) fn places(&self, key: &str) -> Result<Vec<usize>> {
        let joints = self.joints()?;
        let places = self.optional(key, "a list of joints' numbers, from 0", counts)?.unwrap_or_default();
        for (i, place) in places.iter().enumerate() {
            ensure!(*place < joints, "{}: there is no joint {place}; num_of_dofs is {joints}", self.location(key));
            ensure!(!places[..i].contains(place), "{}: joint {place} occurs twice", self.location(key));
        }
        Ok(places)
    }

    /// Returns the network's file: `model_name` beside the policy's config.yaml, with the ending .onnx.
    pub(super) fn model(&self) -> Result<(String, String)> {
        let name = self.required("model_name", "the name of a file", Node::text)?;
        let file = beside(&self.own.document.file, name);
        let stem = file.rsplit_once('.').map(|(stem, _)| stem);
        let stem =
            stem.with_context(|| format!("{}: {:?} has no ending", self.location("model_name"), printable(name)))?;
        Ok((format!("{stem}.onnx"), file))
    }
}
