//! The plots of a sweep: errors and success over bytes and over predicted milliseconds.

use actq_jobs::frontier::{drawn_error, frontier};
use actq_jobs::results::{Figures, Merged, MergedPolicy};

use super::plot::{Mark, Plot, Series, Vertical, stacked};

/// Draws the error of each policy, with a line for each method, and the success if there is one.
pub fn svg(merged: &Merged) -> String {
    let clock = merged.clock_hz;
    let errors = merged.policies.iter().map(|policy| errors(policy, clock));
    let driven = merged.policies.iter().filter(|policy| !policy.success_frontier.is_empty());
    stacked(&errors.chain(driven.map(|policy| success(policy, clock))).collect::<Vec<_>>())
}

fn errors(policy: &MergedPolicy, clock_hz: f64) -> Plot {
    let error = |made: &Figures| Some(drawn_error(made.nmse));
    let knee = policy.knee.and_then(|image| policy.images[image].made.as_ref());
    let series = series(policy, clock_hz, error);
    Plot {
        title: format!("{}: action error over flash and over time", policy.policy),
        x_labels: x_labels(clock_hz),
        y_label: "NMSE of the actions, held-out observations".to_owned(),
        vertical: Vertical::Decades,
        frontier: frontiers(&series, |error| error),
        series,
        mark: knee.map(|made| {
            let [kilobytes, milliseconds] = places(made, clock_hz);
            Mark {
                at: vec![(kilobytes, made.nmse), (milliseconds, made.nmse)],
                label: format!("knee: {kilobytes:.1} kB, {milliseconds:.3} ms"),
            }
        }),
    }
}

fn success(policy: &MergedPolicy, clock_hz: f64) -> Plot {
    let percent = |made: &Figures| made.success().map(|share| 100.0 * share);
    let series = series(policy, clock_hz, percent);
    Plot {
        title: format!("{}: success over flash and over time", policy.policy),
        x_labels: x_labels(clock_hz),
        y_label: "successful episodes, percent".to_owned(),
        vertical: Vertical::Percent,
        frontier: frontiers(&series, |percent| -percent),
        series,
        mark: None,
    }
}

/// Returns the names of both axes, for predictions at a clock.
fn x_labels(clock_hz: f64) -> Vec<String> {
    vec![
        "flash of the image, kB (1000 bytes)".to_owned(),
        format!("predicted ms of a step, Cortex-M4 at {} MHz", clock_hz / 1e6),
    ]
}

/// Returns an image's place on both horizontal axes: its size in kB (1000 bytes), and its predicted milliseconds.
fn places(made: &Figures, clock_hz: f64) -> [f64; 2] {
    [made.image.bytes as f64 / 1e3, made.milliseconds(clock_hz)]
}

/// Returns a line for each curve, from small values of x to large ones, each image once.
fn series(policy: &MergedPolicy, clock_hz: f64, y: impl Fn(&Figures) -> Option<f64>) -> Vec<Series> {
    let line = |(name, images): (String, Vec<&actq_jobs::results::MergedImage>)| {
        let made = || images.iter().filter_map(|image| image.made.as_ref());
        let panel = |axis: usize| {
            let mut points: Vec<(f64, f64)> =
                made().filter_map(|made| Some((places(made, clock_hz)[axis], y(made)?))).collect();
            points.sort_by(|a, b| a.0.total_cmp(&b.0));
            points.dedup();
            points
        };
        Series { name, points: [0, 1].map(panel).into_iter().collect() }
    };
    policy.curves().into_iter().map(line).collect()
}

/// Returns the points of each panel that no other one beats in x and `cost`.
fn frontiers(series: &[Series], cost: impl Fn(f64) -> f64) -> Vec<Vec<(f64, f64)>> {
    let panel = |panel: usize| {
        let points: Vec<(f64, f64)> = series.iter().flat_map(|series| series.points[panel].clone()).collect();
        let costs: Vec<(f64, f64)> = points.iter().map(|&(x, y)| (x, cost(y))).collect();
        frontier(&costs).into_iter().map(|i| points[i]).collect()
    };
    [0, 1].map(panel).into_iter().collect()
}
