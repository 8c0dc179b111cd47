//! Orders of values in which a reference differs from a description.

use actq::error::Result;

use crate::description::Description;
use crate::label::{Label, labels};
use crate::plan::{Plan, PlannedTarget};
use crate::reference::Reference;
use crate::sources::Sources;

/// Largest rest of a column that another one explains, as a share of its deviation.
const REST: f64 = 1e-4;
/// Ticks that tell columns from each other.
const FEWEST_TICKS: usize = 8;
/// Most values of an order that are listed.
const MOST_LISTED: usize = 8;

/// Finds values that the reference has in another order than the description: each column of a term or target of the
/// reference is, but for a factor and an offset, another column of it in the description. Returns a sentence for each
/// term or target.
///
/// # Errors
///
/// If the reference does not fit the description.
pub fn orders(description: &Description, sources: &dyn Sources, reference: &Reference) -> Result<Vec<String>> {
    let plan = Plan::new(description, sources)?;
    let of_targets: Vec<Label> = plan.targets.iter().flat_map(|target| target_labels(&plan, target)).collect();
    let named = [("observation", plan.observation_labels()), ("action", Vec::new()), ("target", of_targets)];
    let ticks = reference.values(plan)?;
    let mut found = Vec::new();
    for (i, (kind, labels)) in named.iter().enumerate() {
        let Some(array) = reference.array(kind).filter(|_| ticks.len() >= FEWEST_TICKS) else { continue };
        let (_, row) = array.rows()?;
        if row != labels.len() || ticks.iter().any(|values| values[i].len() != row) {
            continue;
        }
        let own: Vec<Column> = (0..row).map(|c| Column::of(ticks.iter().map(|values| values[i][c]))).collect();
        let given: Vec<Column> =
            (0..row).map(|c| Column::of(array.values.iter().skip(c).step_by(row).copied())).collect();
        let mut start = 0;
        while start < row {
            // Values of one term and one tick.
            let is_same = |label: &&Label| label.value == labels[start].value && label.age == labels[start].age;
            let end = start + labels[start..].iter().take_while(is_same).count();
            found.extend(order(&labels[start..end], &own[start..end], &given[start..end]));
            start = end;
        }
    }
    Ok(found)
}

fn target_labels(plan: &Plan, target: &PlannedTarget) -> Vec<Label> {
    let name = format!("target {}", plan.names[target.value]);
    let len = plan.values[target.value].labels.len();
    labels(&name, len, (!target.joints.is_empty()).then_some(&target.joints[..]))
}

/// Describes the order of one term's columns in the reference, if it is another.
fn order(labels: &[Label], own: &[Column], given: &[Column]) -> Option<String> {
    let mut moved = Vec::new();
    for (place, column) in given.iter().enumerate() {
        let rest = |other: &Column| column.rest(other).unwrap_or(f64::INFINITY);
        if rest(&own[place]) <= REST {
            continue;
        }
        let mut of_others = (0..own.len()).filter(|&other| rest(&own[other]) <= REST);
        // Columns that are alike tell nothing.
        let (Some(from), None) = (of_others.next(), of_others.next()) else { continue };
        if moved.iter().any(|(_, other)| *other == from) {
            return None;
        }
        moved.push((place, from));
    }
    if moved.is_empty() {
        return None;
    }
    let name = |place: usize| &labels[place].element;
    let listed = moved.iter().take(MOST_LISTED).map(|(place, from)| format!("{} is {}", name(*place), name(*from)));
    let more =
        if moved.len() > MOST_LISTED { format!(", and {} more", moved.len() - MOST_LISTED) } else { String::new() };
    let of = labels.first().map_or("", |label| label.value.as_str());
    Some(format!(
        "the reference has {of} in another order: what the description calls {}{more}",
        listed.collect::<Vec<_>>().join(", ")
    ))
}

/// A value over all ticks, without its mean.
struct Column {
    values: Vec<f64>,
    energy: f64,
}

impl Column {
    fn of(values: impl Iterator<Item = f64>) -> Self {
        let values: Vec<f64> = values.collect();
        let mean = values.iter().sum::<f64>() / values.len().max(1) as f64;
        let largest = values.iter().fold(0f64, |most, value| most.max(value.abs()));
        let values: Vec<f64> = values.into_iter().map(|value| value - mean).collect();
        let energy: f64 = values.iter().map(|value| value * value).sum();
        // What is only rounding does not vary.
        let varies = energy > (1e-6 * largest).powi(2) * values.len() as f64;
        Self { values, energy: if varies { energy } else { 0.0 } }
    }

    /// Returns the deviation that is left of it if another column times the best factor explains it, as a share of its
    /// own; nothing if one of them does not vary.
    fn rest(&self, other: &Self) -> Option<f64> {
        if self.energy == 0.0 || other.energy == 0.0 {
            return None;
        }
        let factor = self.values.iter().zip(&other.values).map(|(a, b)| a * b).sum::<f64>() / other.energy;
        let left = self.values.iter().zip(&other.values).map(|(a, b)| (a - factor * b).powi(2)).sum::<f64>();
        Some((left / self.energy).sqrt())
    }
}
