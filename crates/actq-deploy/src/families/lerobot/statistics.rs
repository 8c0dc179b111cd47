//! Statistics of features in .safetensors files.

use std::collections::BTreeMap;

use actq::error::{Context as _, Result};
use actq::import::values::Tensor;
use actq::text::printable;

use super::feature::Feature;
use crate::bundle::Bundle;
use crate::facts::Facts;
use crate::families::tensors::{finite, tensors};

/// Most names in a message.
const MAX_LISTED: usize = 12;

/// The statistics of a file.
#[derive(Debug)]
pub(super) struct Statistics {
    file: String,
    /// Prefixes of the names of a feature's statistics, each up to the name of the statistic.
    prefixes: fn(&str) -> Vec<String>,
    tensors: BTreeMap<String, Tensor>,
}

impl Statistics {
    /// Reads a processor's state: tensors `FEATURE.STATISTIC`.
    pub(super) fn of_processor(bundle: &Bundle, file: &str) -> Result<Self> {
        let tensors = tensors(bundle, file, |_| true)?;
        Ok(Self { file: file.to_owned(), prefixes: |feature| vec![format!("{feature}.")], tensors })
    }

    /// Stands for a state that `file` does not name.
    pub(super) fn none(file: &str) -> Self {
        Self { file: file.to_owned(), prefixes: |_| Vec::new(), tensors: BTreeMap::new() }
    }

    /// Reads the buffers that older policies kept beside their weights; without any, it is empty.
    pub(super) fn of_weights(bundle: &Bundle, file: &str) -> Result<Self> {
        let tensors = tensors(bundle, file, |name| {
            ["normalize_inputs.", "unnormalize_outputs."].iter().any(|p| name.starts_with(p))
        })?;
        let prefixes = |feature: &str| {
            let module = if feature == "action" { "unnormalize_outputs" } else { "normalize_inputs" };
            let feature = feature.replace('.', "_");
            vec![format!("{module}.buffer_{feature}."), format!("{module}.{feature}_")]
        };
        Ok(Self { file: file.to_owned(), prefixes, tensors })
    }

    /// Returns the name of one of the tensors, if there is one.
    pub(super) fn first(&self) -> Option<&str> {
        self.tensors.keys().next().map(String::as_str)
    }

    /// Returns a statistic of a feature, and its place for reports.
    pub(super) fn vector(&self, feature: &Feature, statistic: &str) -> Result<(Vec<f64>, String)> {
        let mut names = (self.prefixes)(&feature.name).into_iter().map(|prefix| prefix + statistic);
        let found = names.find_map(|name| self.tensors.get_key_value(&name));
        let (name, tensor) = found.with_context(|| {
            let names: Vec<_> = self.tensors.keys().take(MAX_LISTED).map(|name| printable(name)).collect();
            format!(
                "{}: it has no {statistic} of {:?}; save the policy with its dataset's statistics, or set the mode of {} to \
                 IDENTITY if its values are not normalized. It has {}",
                self.file,
                printable(&feature.name),
                feature.kind,
                if names.is_empty() { "none".to_owned() } else { names.join(", ") }
            )
        })?;
        let at = format!("{}: {}", self.file, printable(name));
        if tensor.shape != [feature.len] {
            return Err(Facts::contradiction(
                &format!("length of {:?}", printable(&feature.name)),
                (&feature.at, &format!("{} values", feature.len)),
                (&at, &format!("the shape {:?}", tensor.shape)),
            ));
        }
        let values = finite(tensor, &at)?;
        Ok((values, at))
    }
}
