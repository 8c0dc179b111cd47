//! The families that a bundle nearly is of.

use std::collections::BTreeMap;

use crate::bundle::Bundle;
use crate::document::Document;
use crate::facts::Profile;
use crate::families::metadata_document;
use crate::yaml::Node;

/// Most bundle files that are looked at.
const MAX_FILES: usize = 100;

/// Names the families most of whose keys a file has: the family, the file, and the keys found and missing.
pub(crate) fn nearest(bundle: &Bundle, profiles: &[Profile]) -> Vec<String> {
    let mut documents: BTreeMap<&str, Vec<Document>> = BTreeMap::new();
    let mut found = Vec::new();
    for mark in profiles.iter().flat_map(|profile| &profile.marks) {
        let ending = mark.ending.as_str();
        documents.entry(ending).or_insert_with(|| read(bundle, ending));
    }
    for profile in profiles {
        for mark in &profile.marks {
            for document in documents.get(mark.ending.as_str()).into_iter().flatten() {
                let (has, lacks): (Vec<&str>, Vec<&str>) =
                    mark.keys.iter().map(String::as_str).partition(|key| document.has(key));
                if !has.is_empty() {
                    found.push((has.len() as f64 / mark.keys.len() as f64, profile, document, has, lacks));
                }
            }
        }
    }
    let most = found.iter().map(|(share, ..)| *share).fold(0.0, f64::max);
    let of_most = found.iter().filter(|(share, ..)| *share == most);
    let text = |(_, profile, document, has, lacks): &(f64, &Profile, &Document, Vec<&str>, Vec<&str>)| {
        let has = has.join(", ");
        if lacks.is_empty() {
            return format!(
                "{} has the keys of {} ({has}), but not in the form of its files",
                document.file, profile.family
            );
        }
        format!("nearest is {}: {} has {has}, and lacks {}", profile.family, document.file, lacks.join(", "))
    };
    of_most.map(text).collect()
}

/// Reads the files with an ending; those that cannot be read have no keys.
fn read(bundle: &Bundle, ending: &str) -> Vec<Document> {
    let endings: &[&str] = if ending == "yaml" { &["yaml", "yml"] } else { &[ending] };
    let files = endings.iter().flat_map(|ending| bundle.with_ending(ending)).take(MAX_FILES);
    let document = |file: &str| {
        if ending == "onnx" {
            let signature = bundle.signature(file).ok()?;
            return Some(metadata_document(file, &signature.metadata));
        }
        Some(Document::of(file, Node::parse(&bundle.text(file).ok()?).ok()?.numbered()))
    };
    files.filter_map(document).collect()
}
