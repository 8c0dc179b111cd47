//! The tables and the plots of `actq merge`.

use actq::pipeline::sweep::line;
use actq_jobs::merged::{Figures, Merged, MergedImage, MergedPolicy};

use super::plot::{Mark, Plot, Series, Vertical, stacked};
use super::table;

/// Columns of the table that are always present.
const HEADER: [&str; 5] = ["policy", "image", "budget", "bytes", "bits"];

/// Formats a row for each image, and the knee of each policy. A star marks images of the frontiers.
pub fn report(merged: &Merged) -> String {
    let is_driven = figures(merged).any(|figures| figures.driven.is_some());
    let mut header = HEADER.to_vec();
    header.push("NMSE");
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
                "knee of {}: {} at {:.3} bits per weight, NMSE {:.2e}\n",
                policy.policy, knee.method, knee.bpw, knee.nmse
            );
        }
    }
    text
}

fn figures(merged: &Merged) -> impl Iterator<Item = &Figures> {
    merged.policies.iter().flat_map(|policy| &policy.images).filter_map(|image| image.made.as_ref())
}

/// Returns the cells of an image from its bytes on.
fn cells(policy: &MergedPolicy, i: usize, image: &MergedImage, is_driven: bool) -> Vec<String> {
    let star = |frontier: &[usize]| if frontier.contains(&i) { "*" } else { " " };
    let Some(made) = &image.made else { return vec!["-".to_owned(); if is_driven { 6 } else { 3 }] };
    let mut cells = vec![
        made.image.bytes.to_string(),
        format!("{:.3}", made.image.bpw),
        format!("{:.3e}{}", made.nmse, star(&policy.frontier)),
    ];
    if is_driven {
        let or_dash = |text: Option<String>| text.unwrap_or_else(|| "-".to_owned());
        cells.push(or_dash(made.driven.as_ref().map(|driven| driven.episodes.to_string())));
        cells.push(or_dash(made.success().map(|share| format!("{share:.3}{}", star(&policy.success_frontier)))));
        cells.push(or_dash(made.interval.map(|[low, high]| format!("{low:.3}-{high:.3}"))));
    }
    cells
}

/// Draws the error over true bits per weight for each policy, with the frontier; and the success, if there is one.
pub fn svg(merged: &Merged) -> String {
    let success = merged.policies.iter().filter(|policy| !policy.success_frontier.is_empty()).map(success_plot);
    stacked(&merged.policies.iter().map(error_plot).chain(success).collect::<Vec<_>>())
}

const BITS: &str = "bits per weight, with scales and padding";

fn error_plot(policy: &MergedPolicy) -> Plot {
    let sweep = policy.sweep();
    let mut series: Vec<Series> =
        sweep.curves.iter().map(|curve| Series { name: curve.method.clone(), points: line(curve) }).collect();
    series.push(frontier(policy, &policy.frontier, |figures| Some(figures.nmse.max(1e-14))));
    Plot {
        title: format!("{}: action error over bits per weight", policy.policy),
        x_label: BITS.to_owned(),
        y_label: "NMSE of the actions, held-out observations".to_owned(),
        vertical: Vertical::Decades,
        series,
        mark: sweep.knee.as_ref().map(|knee| Mark {
            at: (knee.bpw, knee.nmse),
            label: format!("knee: {:.2} bits, NMSE {:.2e}", knee.bpw, knee.nmse),
        }),
    }
}

fn success_plot(policy: &MergedPolicy) -> Plot {
    let percent = |figures: &Figures| Some(100.0 * figures.success()?);
    let mut series: Vec<Series> = Vec::new();
    for image in &policy.images {
        let name = policy.curve(image);
        let Some(point) = image.made.as_ref().and_then(|made| Some((made.image.bpw, percent(made)?))) else { continue };
        match series.iter_mut().find(|series| series.name == name) {
            Some(series) => series.points.push(point),
            None => series.push(Series { name, points: vec![point] }),
        }
    }
    series.push(frontier(policy, &policy.success_frontier, percent));
    Plot {
        title: format!("{}: success over bits per weight", policy.policy),
        x_label: BITS.to_owned(),
        y_label: "successful episodes, percent".to_owned(),
        vertical: Vertical::Percent,
        series,
        mark: None,
    }
}

fn frontier(policy: &MergedPolicy, images: &[usize], height: impl Fn(&Figures) -> Option<f64>) -> Series {
    let of = |i: &usize| {
        let made = policy.images[*i].made.as_ref()?;
        Some((made.image.bpw, height(made)?))
    };
    Series { name: "frontier".to_owned(), points: images.iter().filter_map(of).collect() }
}
