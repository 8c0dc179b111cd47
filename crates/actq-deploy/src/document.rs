//! A YAML file of a bundle, which knows what has been read of it.

use std::cell::RefCell;
use std::collections::BTreeSet;

use actq::error::{Context as _, Result};
use actq::text::printable;

use crate::bundle::Bundle;
use crate::yaml::Node;

/// A YAML file.
#[derive(Debug)]
pub(crate) struct Document {
    /// Path in the bundle.
    pub file: String,
    root: Node,
    /// Paths that have been read, with all below them.
    read: RefCell<BTreeSet<String>>,
}

impl Document {
    /// Reads a file of a bundle.
    ///
    /// # Errors
    ///
    /// If it is missing, or not YAML.
    pub(crate) fn read(bundle: &Bundle, file: &str) -> Result<Self> {
        let root = bundle.text(file).and_then(|text| Node::parse(&text).context(file.to_owned()))?;
        Ok(Self { file: file.to_owned(), root, read: RefCell::default() })
    }

    /// Takes a value that is part of another file; `file` names it, for reports and errors.
    pub(crate) fn of(file: &str, root: Node) -> Self {
        Self { file: file.to_owned(), root, read: RefCell::default() }
    }

    /// Returns the keys of a map at a path of keys with points between them; the empty path is the whole file. Nothing
    /// counts as read.
    pub(crate) fn keys(&self, path: &str) -> Vec<&str> {
        self.peek(path).map_or(&[][..], Node::entries).iter().map(|(key, _)| key.as_str()).collect()
    }

    /// Returns the value at a path without counting it as read.
    pub(crate) fn peek(&self, path: &str) -> Option<&Node> {
        if path.is_empty() { Some(&self.root) } else { find(&self.root, path) }
    }

    /// Returns the value at a path, or `None` if it is missing or null.
    pub(crate) fn node(&self, path: &str) -> Option<&Node> {
        let node = self.peek(path)?;
        self.read.borrow_mut().insert(path.to_owned());
        (!node.is_null()).then_some(node)
    }

    /// Names a path, for reports and errors.
    pub(crate) fn location(&self, path: &str) -> String {
        format!("{}: {}", self.file, printable(path))
    }

    /// Returns a value that must be there.
    ///
    /// # Errors
    ///
    /// If it is missing, or `as_type` does not accept it.
    pub(crate) fn required<'a, T>(
        &'a self,
        path: &str,
        what: &str,
        as_type: impl Fn(&'a Node) -> Option<T>,
    ) -> Result<T> {
        let value = self.optional(path, what, as_type)?;
        value.with_context(|| format!("{} is missing; it must be {what}", self.location(path)))
    }

    /// Returns a value, or `None` if it is missing or null.
    ///
    /// # Errors
    ///
    /// If it is there and `as_type` does not accept it.
    pub(crate) fn optional<'a, T>(
        &'a self,
        path: &str,
        what: &str,
        as_type: impl Fn(&'a Node) -> Option<T>,
    ) -> Result<Option<T>> {
        let Some(node) = self.node(path) else { return Ok(None) };
        let value =
            as_type(node).with_context(|| format!("{} (line {}) must be {what}", self.location(path), node.line))?;
        Ok(Some(value))
    }

    /// Returns a finite number.
    ///
    /// # Errors
    ///
    /// As [`Self::required`].
    pub(crate) fn number(&self, path: &str) -> Result<f64> {
        self.required(path, "a finite number", Node::number)
    }

    /// Returns a list of finite numbers.
    ///
    /// # Errors
    ///
    /// As [`Self::required`].
    pub(crate) fn numbers(&self, path: &str) -> Result<Vec<f64>> {
        self.required(path, "a list of finite numbers", Node::numbers)
    }

    /// Returns a list of texts.
    ///
    /// # Errors
    ///
    /// As [`Self::required`].
    pub(crate) fn texts(&self, path: &str) -> Result<Vec<String>> {
        self.required(path, "a list of texts", Node::texts)
    }

    /// Returns `true` if something has been read of it: it is of the policy that the user chose.
    pub(crate) fn is_read(&self) -> bool {
        !self.read.borrow().is_empty()
    }

    /// Returns the paths that nothing has read and that no pattern of `ignored` names.
    pub(crate) fn unread(&self, ignored: &[String]) -> Vec<String> {
        let mut unread = Vec::new();
        self.add_unread(&self.root, "", ignored, &mut unread);
        unread
    }

    fn add_unread(&self, node: &Node, path: &str, ignored: &[String], unread: &mut Vec<String>) {
        if self.read.borrow().contains(path) || ignored.iter().any(|pattern| fits(pattern, path)) {
            return;
        }
        if node.entries().is_empty() {
            unread.push(path.to_owned());
        }
        for (key, inner) in node.entries() {
            let inner_path = if path.is_empty() { key.clone() } else { format!("{path}.{key}") };
            self.add_unread(inner, &inner_path, ignored, unread);
        }
    }

    /// Returns `true` if it has a value at a path, of which `*` stands for any key.
    pub(crate) fn has(&self, path: &str) -> bool {
        match path.strip_prefix("*.") {
            Some(rest) => self.root.entries().iter().any(|(_, inner)| find(inner, rest).is_some()),
            None => self.peek(path).is_some(),
        }
    }
}

/// Finds a value; keys may hold points themselves.
fn find<'a>(node: &'a Node, path: &str) -> Option<&'a Node> {
    node.entries().iter().find_map(|(key, inner)| {
        let rest = path.strip_prefix(key.as_str())?;
        if rest.is_empty() { Some(inner) } else { find(inner, rest.strip_prefix('.')?) }
    })
}

/// Returns `true` if a path is, or is below, one that a pattern names; `*` stands for any text within a key.
pub(crate) fn fits(pattern: &str, path: &str) -> bool {
    let mut parts = path.split('.');
    pattern.split('.').all(|wanted| parts.next().is_some_and(|part| is_like(wanted, part)))
}

fn is_like(wanted: &str, part: &str) -> bool {
    match wanted.split_once('*') {
        None => wanted == part,
        Some((first, rest)) => part.strip_prefix(first).is_some_and(|mut left| {
            while !is_like(rest, left) {
                let mut letters = left.chars();
                if letters.next().is_none() {
                    return false;
                }
                left = letters.as_str();
            }
            true
        }),
    }
}
