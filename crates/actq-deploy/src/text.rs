//! `deploy.toml` as text.

use std::collections::BTreeMap;

use actq::error::{Error, Result};
use toml::{Table, Value};

use crate::description::Description;

impl Description {
    /// Parses a `deploy.toml`.
    ///
    /// # Errors
    ///
    /// If it is not TOML, lacks a key, or has one that is not known. The error has the line.
    pub fn parse(text: &str) -> Result<Self> {
        toml::from_str(text).map_err(|error| Error::input(error.to_string()))
    }

    /// Formats the description as human-readable text: one line a key, with each part's source as a comment.
    ///
    /// # Errors
    ///
    /// If a number is too large for TOML.
    pub fn to_toml(&self, sources: &BTreeMap<String, String>) -> Result<String> {
        let table = Table::try_from(self).map_err(Error::other)?;
        let source = |name: &str| sources.get(name).map_or(String::new(), |source| format!("# {source}\n"));
        let mut text = String::new();
        for (key, value) in &table {
            if !value.is_table() && tables_of(value).is_none() {
                text += &source(key);
                text += &line(key, value);
            }
        }
        for (key, value) in &table {
            if let Value::Table(inner) = value {
                text += &format!("\n{}[{key}]\n", source(key));
                for (key, value) in inner {
                    text += &(source(key) + &line(key, value));
                }
            }
            for part in tables_of(value).into_iter().flatten() {
                let name = part.get("name").or_else(|| part.get("value")).and_then(Value::as_str).unwrap_or_default();
                text += &format!("\n{}[[{key}]]\n", source(name));
                part.iter().for_each(|(key, value)| text += &line(key, value));
            }
        }
        Ok(text)
    }
}

/// Returns the tables of an array of tables.
fn tables_of(value: &Value) -> Option<impl Iterator<Item = &Table>> {
    let items = value.as_array().filter(|items| !items.is_empty() && items.iter().all(Value::is_table))?;
    Some(items.iter().filter_map(Value::as_table))
}

fn line(key: &str, value: &Value) -> String {
    let bare = !key.is_empty() && key.chars().all(|c| c.is_ascii_alphanumeric() || c == '_' || c == '-');
    let key = if bare { key.to_owned() } else { Value::from(key).to_string() };
    format!("{key} = {value}\n")
}
