//! The tables and the plots of `actq merge`.

use actq::measure::time::CLOCK;
use actq::pipeline::sweep::frontier;
use actq_jobs::merged::{Figures, Merged, MergedImage, MergedPolicy};

use super::plot::{Plot, Series, Vertical, stacked};
use super::sweep::{plot, x_labels};
use super::{table, time};

/// Columns of the table that are always present.
const HEADER: [&str; 7] = ["policy", "image", "limit", "bytes", "ms", "NMSE", "bits"];

/// Formats a row for each image, and the knee of each policy. A star marks images of the frontiers.
pub fn report(merged: &Merged) -> String {
    let is_driven = figures(merged).any(|figures| figures.driven.is_some());
    let mut header = HEADER.to_vec();
    if is_driven {
        header.extend(["episodes", "success", "95% interval"]);
    }
    let mut rows = table::table(&header);
    for policy in &merged.policies {
        for (i, image) in policy.images.iter().enumerate() {
            let name = if i == 0 { policy.policy.clone() } else { String::new() };
            let mut row = vec![name, policy.curve(image), format!("{} bits", image.budget)];
            row.extend(cells(policy, i, image, is_driven));
            rows.add_row(row);
        }
    }
    let mut text = format!("{rows}\n\n* on the frontier: no other image has fewer bytes and a smaller error");
    text += if is_driven { ", or more success\n" } else { "\n" };
    for policy in &merged.policies {
        if let Some(knee) = policy.sweep().knee {
            text += &format!(
                "knee of {}: {} at {} bytes and {:.3} ms, NMSE {:.2e}\n",
                policy.policy, knee.method, knee.bytes, knee.milliseconds, knee.nmse
            );
        }
    }
    text + &format!("ms: predicted time of a step, {}\n", time::conditions(CLOCK))
}

fn figures(merged: &Merged) -> impl Iterator<Item = &Figures> {
    merged.policies.iter().flat_map(|policy| &policy.images).filter_map(|image| image.made.as_ref())
}

/// Returns the cells of an image from its bytes on.
fn cells(policy: &MergedPolicy, i: usize, image: &MergedImage, is_driven: bool) -> Vec<String> {
    let star = |frontier: &[usize]| if frontier.contains(&i) { "*" } else { " " };
    let Some(made) = &image.made else { return vec!["-".to_owned(); if is_driven { 7 } else { 4 }] };
    let mut cells = vec![
        made.image.bytes.to_string(),
        format!("{:.3}", milliseconds(made)),
        format!("{:.3e}{}", made.nmse, star(&policy.frontier)),
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

fn milliseconds(made: &Figures) -> f64 {
    1e3 * made.image.cycles as f64 / CLOCK
}

/// Draws the error of each policy over bytes and over predicted milliseconds; and the success, if there is one.
pub fn svg(merged: &Merged) -> String {
    let errors = merged.policies.iter().map(|policy| plot(&policy.sweep()));
    let success = merged.policies.iter().filter(|policy| !policy.success_frontier.is_empty()).map(success_plot);
    stacked(&errors.chain(success).collect::<Vec<_>>())
}

fn success_plot(policy: &MergedPolicy) -> Plot {
    let mut series: Vec<Series> = Vec::new();
    for image in &policy.images {
        let name = policy.curve(image);
        let Some(made) = &image.made else { continue };
        let Some(percent) = made.success().map(|share| 100.0 * share) else { continue };
        let points = [(made.image.bytes as f64 / 1e3, percent), (milliseconds(made), percent)];
        match series.iter_mut().find(|series| series.name == name) {
            Some(series) => series.points.iter_mut().zip(points).for_each(|(panel, point)| panel.push(point)),
            None => series.push(Series { name, points: points.map(|point| vec![point]).into_iter().collect() }),
        }
    }
    let failures = |panel: usize| {
        let points = series.iter().flat_map(|series| &series.points[panel]);
        let least = frontier(points.map(|(x, percent)| (*x, 100.0 - percent)).collect());
        least.into_iter().map(|(x, failed)| (x, 100.0 - failed)).collect()
    };
    Plot {
        title: format!("{}: success over flash and over time", policy.policy),
        x_labels: x_labels(CLOCK),
        y_label: "successful episodes, percent".to_owned(),
        vertical: Vertical::Percent,
        frontier: [0, 1].map(failures).into_iter().collect(),
        series,
        mark: None,
    }
}
