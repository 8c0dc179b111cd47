//! Families of bundles.

use actq::error::Result;

use crate::bundle::Bundle;
use crate::description::Description;
use crate::document::Document;
use crate::facts::Facts;

/// A family: bundles that one exporter writes and one deploy code reads.
pub(crate) trait Family: Sync {
    /// Returns its profile's text (TOML), whose `family` is its name.
    fn profile(&self) -> &str;

    /// Finds the files that it reads in a bundle; `None` if the bundle is of another family.
    ///
    /// # Errors
    ///
    /// If a file that decides it cannot be read.
    fn recognize(&self, bundle: &Bundle) -> Result<Option<Recognized>>;

    /// Makes the description.
    ///
    /// # Errors
    ///
    /// If the files contradict each other or lack something that no answer can give.
    fn read(&self, bundle: &Bundle, found: &Recognized, facts: &mut Facts) -> Result<Description>;
}

/// The files of a bundle that a family reads.
#[derive(Debug, Default)]
pub(crate) struct Recognized {
    /// YAML files, the main one first.
    pub documents: Vec<Document>,
    /// ONNX files, the policy's first.
    pub networks: Vec<String>,
    /// All other files.
    pub others: Vec<String>,
}
