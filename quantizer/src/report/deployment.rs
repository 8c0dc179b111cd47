//! Reports on an imported deploy bundle.

use actq_deploy::{Comparison, Question, Reading};

use super::table::table;

/// Formats the parts of a description, each with its source.
pub fn summary(reading: &Reading) -> String {
    let mut parts = table(&["part", "name", "content", "source"]);
    for column in parts.column_iter_mut() {
        column.set_cell_alignment(comfy_table::CellAlignment::Left);
    }
    for row in reading.description.rows() {
        let source = reading.sources.get(&row.name).cloned().unwrap_or_default();
        parts.add_row([row.section.to_owned(), row.name, row.content, source]);
    }
    let rate = reading.description.rate_hz;
    let profile = reading.profile.as_ref().map_or(String::new(), |[upstream, commit]| {
        format!("; its profile was read from {upstream} at {}", commit.get(..12).unwrap_or(commit))
    });
    format!(
        "family    {}{profile}\nrate      {rate:.6} Hz\naction    {}\n\n{parts}\n\n",
        reading.family, reading.description.action
    )
}

/// Formats open questions.
pub fn questions(questions: &[Question]) -> String {
    let mut text = String::new();
    for question in questions {
        text += &format!("  {}: {}\n", question.key, question.meaning);
        if let Some((value, source)) = &question.profile {
            text += &format!("      {} = {value}, says {source}\n", question.key);
        }
    }
    text
}

/// Formats the keys that nothing reads, as a note.
pub fn unread(keys: &[String]) -> Option<String> {
    (!keys.is_empty()).then(|| format!("nothing reads these keys of the bundle: {}", keys.join("; ")))
}

/// Formats an agreement with a reference.
pub fn agreement(comparison: &Comparison) -> String {
    let largest: Vec<String> = comparison.largest.iter().map(|(kind, share)| format!("{kind} {share:.1e}")).collect();
    format!(
        "checked   {} ticks agree; largest difference, as a share of the largest value: {}\n",
        comparison.ticks,
        largest.join(", ")
    )
}
