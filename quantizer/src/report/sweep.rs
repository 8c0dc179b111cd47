//! The table and the plot of a sweep.

use actq::pipeline::sweep::{Curve, Point, Sweep, drawn_error, frontier};

use super::plot::{Mark, Plot, Series, Vertical, stacked};
use super::table::table;
use super::time;

/// The horizontal axes: the image's size in kB (1000 bytes), and its predicted milliseconds.
const AXES: [fn(&Point) -> f64; 2] = [|point| point.report.bytes as f64 / 1e3, |point| point.milliseconds];

/// Returns the points of a curve, from small values of x to large ones, each image one time.
fn line(curve: &Curve, x: fn(&Point) -> f64) -> Vec<(f64, f64)> {
    let mut line: Vec<(f64, f64)> = curve.points.iter().flatten().map(|p| (x(p), drawn_error(p))).collect();
    line.sort_by(|a, b| a.0.total_cmp(&b.0));
    line.dedup();
    line
}

/// Returns the names of both axes, for predictions at a clock.
pub(super) fn x_labels(clock_hz: f64) -> Vec<String> {
    vec![
        "flash of the image, kB (1000 bytes)".to_owned(),
        format!("predicted ms of a step, Cortex-M4 at {} MHz", clock_hz / 1e6),
    ]
}

/// Draws a policy's errors.
pub(super) fn plot(sweep: &Sweep) -> Plot {
    let series = |curve: &Curve| Series {
        name: curve.method.clone(),
        points: AXES.map(|x| line(curve, x)).into_iter().collect(),
    };
    let all = |x| frontier(sweep.curves.iter().flat_map(|curve| line(curve, x)).collect());
    Plot {
        title: format!("{}: action error over flash and over time", sweep.policy),
        x_labels: x_labels(sweep.clock_hz),
        y_label: "NMSE of the actions, held-out observations".to_owned(),
        vertical: Vertical::Decades,
        series: sweep.curves.iter().map(series).collect(),
        mark: sweep.knee.as_ref().map(|knee| Mark {
            at: vec![(knee.bytes as f64 / 1e3, knee.nmse), (knee.milliseconds, knee.nmse)],
            label: format!("knee: {:.1} kB, {:.3} ms", knee.bytes as f64 / 1e3, knee.milliseconds),
        }),
        frontier: AXES.map(all).into_iter().collect(),
    }
}

/// Returns `true` if the point is the knee.
fn is_knee(sweep: &Sweep, curve: &Curve, point: &Point) -> bool {
    sweep.knee.as_ref().is_some_and(|knee| knee.method == curve.method && knee.bytes == point.report.bytes)
}

/// Formats a row for each policy, budget and method: bytes of the image, predicted time, error and true bits per
/// weight, and a star at each policy's knee. Below the table are the knees, and what the columns hold.
pub fn report(sweeps: &[Sweep]) -> String {
    let mut rows = table(&["policy", "method", "bytes", "ms", "NMSE ", "bits (limit)"]);
    let mut knees = String::new();
    for sweep in sweeps {
        let mut name = sweep.policy.as_str();
        for (b, budget) in sweep.budgets.iter().enumerate() {
            for curve in &sweep.curves {
                let figures = match &curve.points[b] {
                    Some(point) => {
                        let star = if is_knee(sweep, curve, point) { '*' } else { ' ' };
                        [
                            point.report.bytes.to_string(),
                            format!("{:.3}", point.milliseconds),
                            format!("{:.2e}{star}", point.report.nmse),
                            format!("{:.3} ({budget})", point.report.bpw),
                        ]
                    }
                    None => ["-".to_owned(), "-".to_owned(), "- ".to_owned(), format!("- ({budget})")],
                };
                rows.add_row([name.to_owned(), curve.method.clone()].into_iter().chain(figures));
                name = "";
            }
        }
        if let Some(knee) = &sweep.knee {
            knees += &format!(
                "\n* knee of {}: {} at {} bytes and {:.3} ms, NMSE {:.2e}",
                sweep.policy, knee.method, knee.bytes, knee.milliseconds, knee.nmse
            );
        }
    }
    let time = sweeps.first().map_or_else(String::new, |sweep| time::conditions(sweep.clock_hz));
    format!(
        "{rows}\n{knees}\n\nbytes: the whole image in flash. ms: predicted time of a step, {time}.\n\
         bits (limit): bits per weight, with scales and padding, and the most that were allowed. -: the limit is too small.\n"
    )
}

/// Draws the error over bytes and over predicted milliseconds, with a line for each method and a plot for each policy.
pub fn svg(sweeps: &[Sweep]) -> String {
    stacked(&sweeps.iter().map(plot).collect::<Vec<_>>())
}

#[cfg(test)]
mod tests {
    use super::*;
    use actq::measure::eval::ErrorReport;
    use actq::pipeline::sweep::knee;

    fn curve(method: &str, points: &[(f64, f64)]) -> Curve {
        let point = |&(bpw, nmse): &(f64, f64)| {
            let bytes = (1000.0 * bpw) as usize;
            let report = ErrorReport { nmse, worst_nmse: nmse, max_abs: 0.0, steps: 1, bpw, bytes, worst_dimension: 0 };
            let (budget, milliseconds) = (bpw, 0.5 * bpw);
            (nmse > 0.0).then_some(Point { budget, report, milliseconds, rows: Vec::new() })
        };
        Curve { method: method.to_owned(), points: points.iter().map(point).collect(), scores: Vec::new() }
    }

    fn sweep(policy: &str, curves: Vec<Curve>, budgets: &[f64]) -> Sweep {
        let knee = knee(&curves);
        let matrices = Vec::new();
        Sweep { policy: policy.into(), matrices, budgets: budgets.to_vec(), clock_hz: 168e6, curves, knee }
    }

    #[test]
    fn rows_hold_bytes_time_and_error_and_mark_knees() {
        let budgets = [2.0, 2.5, 4.0];
        let sweeps = [
            sweep("arm", vec![curve("distill", &[(2.0, 0.5), (2.5, 0.01), (4.0, 0.003)])], &budgets),
            sweep("leg", vec![curve("distill", &[(2.0, 0.5), (2.5, 0.4), (4.0, 0.003)])], &budgets),
        ];
        let text = report(&sweeps);
        let line = |word: &str| text.lines().filter(|l| l.contains(word)).map(str::to_owned).collect::<Vec<_>>();
        let words = |line: &str| line.split_whitespace().map(str::to_owned).collect::<Vec<_>>();
        assert_eq!(words(&line("arm")[0]), ["arm", "distill", "2000", "1.000", "5.00e-1", "2.000", "(2)"]);
        assert_eq!(line("leg").len(), 1, "{text}");
        assert_eq!(words(&line("e-2*")[0]), ["distill", "2500", "1.250", "1.00e-2*", "2.500", "(2.5)"]);
        assert_eq!(line("* knee"), ["* knee of arm: distill at 2500 bytes and 1.250 ms, NMSE 1.00e-2"]);
        assert!(text.contains("at 168 MHz on a Cortex-M4"), "{text}");
        let svg = svg(&sweeps);
        assert_eq!(svg.matches("<polyline").count(), 4, "two panels for each policy");
        assert!(svg.contains("flash of the image, kB") && svg.contains("knee: 2.5 kB, 1.250 ms"), "{svg}");
    }

    #[test]
    fn budget_that_is_too_small_shows_a_dash() {
        let text = report(&[sweep("p", vec![curve("a", &[(2.0, 0.0), (3.0, 0.1)])], &[2.0, 3.0])]);
        let words: Vec<&str> = text.lines().nth(1).expect("a row").split_whitespace().collect();
        assert_eq!(words, ["p", "a", "-", "-", "-", "-", "(2)"]);
        assert!(text.contains("1.00e-1") && text.contains("3.000 (3)"), "{text}");
    }
}
