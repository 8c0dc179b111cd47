//! Orders of values in which a reference differs from a description.

use actq::error::Result;
use actq::numbers::square;

use crate::description::Description;
use crate::label::{Label, labels};
use crate::plan::{Plan, PlannedTarget};
use crate::reference::Reference;
use crate::sources::Sources;

/// Largest rest of a column that another one explains, as a share of its deviation.
const REST: f64 = 1e-4;
/// Least offset that is another one, in the unit of the value.
const OFFSET: f64 = 1e-4;
/// Ticks that tell columns from each other.
const FEWEST_TICKS: usize = 8;
/// Most values of an order that are listed.
const MAX_LISTED: usize = 8;

/// Finds values that the reference has in another order than the description: each column of a term or target of the
/// reference is, but for a factor and an offset, another column of it in the description. Finds other offsets, too, which
/// are those of joints whose names are in another order. Returns a sentence for each term or target.
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
            let sentence = order(&labels[start..end], &own[start..end], &given[start..end]);
            // The frames of a history have one order.
            found.extend(sentence.filter(|sentence| !found.contains(sentence)));
            start = end;
        }
    }
    Ok(found)
}

fn target_labels(plan: &Plan, target: &PlannedTarget) -> Vec<Label> {
    let len = plan.values[target.value].labels.len();
    labels(&plan.names[target.value], len, (!target.joints.is_empty()).then_some(&target.joints[..]))
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
    let of = &labels.first()?.value;
    let name = |place: usize| &labels[place].element;
    if moved.is_empty() {
        let offset = |place: &usize| (given[*place].mean - own[*place].mean, name(*place));
        let same = |place: &usize| given[*place].factor(&own[*place]).is_some_and(|factor| (factor - 1.0).abs() < REST);
        let offsets: Vec<_> = (0..own.len()).filter(same).map(|place| offset(&place)).collect();
        let offsets = offsets.into_iter().filter(|(offset, _)| offset.abs() > OFFSET);
        let listed = list(offsets.map(|(offset, name)| format!("{name} {offset:+.4}")).collect())?;
        return Some(format!(
            "the reference has {of} with other offsets: {listed}; names of joints in another order move their default pose so"
        ));
    }
    let listed = list(
        moved
            .iter()
            .map(|(place, from)| format!("its {} is the description's {}", name(*place), name(*from)))
            .collect(),
    )?;
    Some(format!("the reference has {of} in another order: {listed}"))
}

/// Lists the first texts; nothing if there are none.
fn list(texts: Vec<String>) -> Option<String> {
    let more = texts.len().saturating_sub(MAX_LISTED);
    let more = if more > 0 { format!(", and {more} more") } else { String::new() };
    (!texts.is_empty()).then(|| format!("{}{more}", texts[..texts.len().min(MAX_LISTED)].join(", ")))
}

/// A value over all ticks, without its mean.
struct Column {
    mean: f64,
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
        let varies = energy > square(1e-6 * largest) * values.len() as f64;
        Self { mean, values, energy: if varies { energy } else { 0.0 } }
    }

    /// Returns the factor of another column that explains it best; nothing if one of them does not vary.
    fn factor(&self, other: &Self) -> Option<f64> {
        let product = self.values.iter().zip(&other.values).map(|(a, b)| a * b).sum::<f64>();
        (self.energy > 0.0 && other.energy > 0.0).then(|| product / other.energy)
    }

    /// Returns the deviation that is left of it if another column times the best factor explains it, as a share of its
    /// own; nothing if one of them does not vary.
    fn rest(&self, other: &Self) -> Option<f64> {
        let factor = self.factor(other)?;
        let left = self.values.iter().zip(&other.values).map(|(a, b)| square(a - factor * b)).sum::<f64>();
        Some((left / self.energy).sqrt())
    }
}
