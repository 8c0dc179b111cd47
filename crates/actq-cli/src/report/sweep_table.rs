//! The table of a sweep.

use actq::emit::Core;
use actq_jobs::results::{Figures, Merged, MergedImage, MergedPolicy};

use super::{table, time};

/// Columns of the table that are always present.
const HEADER: [&str; 7] = ["policy", "method", "limit", "bytes", "ms", "NMSE ", "bits"];

/// Formats a row for each image, and the knee of each policy. A star marks images of the frontiers.
pub fn report(merged: &Merged) -> String {
    let is_driven = figures(merged).any(|figures| figures.driven.is_some());
    let mut header = HEADER.to_vec();
    if is_driven {
        header.extend(["episodes", "success ", "95% interval"]);
    }
    let mut rows = table::table(&header);
    for policy in &merged.policies {
        for (i, image) in policy.images.iter().enumerate() {
            let name = if i == 0 { policy.policy.clone() } else { String::new() };
            let mut row = vec![name, policy.curve(image), image.budget.to_string()];
            row.extend(cells(policy, i, image, merged.clock_hz, is_driven));
            rows.add_row(row);
        }
    }
    let mut text = format!("{rows}\n\n* on the frontier: no other image has fewer bytes and a smaller error");
    text += if is_driven { ", or more success\n" } else { "\n" };
    for policy in &merged.policies {
        let knee = policy.knee.map(|image| &policy.images[image]);
        if let Some((image, made)) = knee.and_then(|image| Some((image, image.made.as_ref()?))) {
            text += &format!(
                "knee of {}: {} at {} bytes and {:.3} ms, NMSE {:.2e}\n",
                policy.policy,
                policy.curve(image),
                made.image.bytes,
                made.milliseconds(merged.clock_hz),
                made.nmse
            );
        }
    }
    text + &format!(
        "bytes: the whole image in flash. ms: predicted time of a step, {}. bits: per weight, with scales and padding. -: no \
         image is within the limit.\n",
        time::conditions(Core::M4f, merged.clock_hz)
    )
}

fn figures(merged: &Merged) -> impl Iterator<Item = &Figures> {
    merged.policies.iter().flat_map(|policy| &policy.images).filter_map(|image| image.made.as_ref())
}

/// Returns the cells of an image from its bytes on.
fn cells(policy: &MergedPolicy, i: usize, image: &MergedImage, clock_hz: f64, is_driven: bool) -> Vec<String> {
    let star = |frontier: &[usize]| if frontier.contains(&i) { "*" } else { " " };
    let Some(made) = &image.made else { return vec!["- ".to_owned(); if is_driven { 7 } else { 4 }] };
    let mut cells = vec![
        made.image.bytes.to_string(),
        format!("{:.3}", made.milliseconds(clock_hz)),
        format!("{:.2e}{}", made.nmse, star(&policy.frontier)),
        format!("{:.3}", made.image.bpw),
    ];
    if is_driven {
        let or_dash = |text: Option<String>| text.unwrap_or_else(|| "-".to_owned());
        cells.push(or_dash(made.driven.as_ref().map(|driven| driven.episodes.to_string())));
        cells.push(or_dash(made.success().map(|share| format!("{share:.3}{}", star(&policy.success_frontier)))));
        cells.push(or_dash(made.interval.map(|[low, high]| format!("{low:.3}-{high:.3}"))));
    }
    cells
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use actq::budget::Budget;
    use actq_jobs::figures::JobResult;

    use super::*;

    fn image(bits: f64, bytes: usize, nmse: f64) -> MergedImage {
        let image = JobResult {
            image: String::new(),
            bytes,
            cycles: 84 * bytes as u64,
            bpw: bits,
            steps: 0,
            frames: 0,
            matrices: Vec::new(),
            rows: vec![BTreeMap::new()],
            scores: Vec::new(),
        };
        let made =
            Figures { image, nmse, worst_nmse: nmse, max_abs: 0.0, observations: 1, driven: None, interval: None };
        let made = (nmse > 0.0).then_some(made);
        let (method, budget) = ("distill".to_owned(), Budget::BitsPerWeight(bits));
        MergedImage { method, budget, seed: 1, round: 0, address: String::new(), made }
    }

    #[test]
    fn merged_rows_have_figures_and_named_knees() {
        let images = vec![image(1.0, 0, 0.0), image(2.0, 2000, 0.5), image(2.5, 2500, 0.01), image(4.0, 4000, 0.02)];
        let policy = MergedPolicy {
            policy: "arm".to_owned(),
            images,
            frontier: vec![1, 2],
            success_frontier: Vec::new(),
            knee: Some(2),
        };
        let merged = Merged { clock_hz: 168e6, policies: vec![policy] };
        let text = report(&merged);
        let words: Vec<Vec<&str>> = text.lines().map(|line| line.split_whitespace().collect()).collect();
        assert_eq!(words[1], ["arm", "distill", "1", "bits", "-", "-", "-", "-"]);
        assert_eq!(words[2], ["distill", "2", "bits", "2000", "1.000", "5.00e-1*", "2.000"]);
        assert_eq!(words[4], ["distill", "4", "bits", "4000", "2.000", "2.00e-2", "4.000"]);
        assert!(text.contains("knee of arm: distill at 2500 bytes and 1.250 ms, NMSE 1.00e-2\n"), "{text}");
        assert!(text.contains("at 168 MHz on a Cortex-M4"), "{text}");
    }
}
