//! The table and the plot of a sweep.

use actq::pipeline::sweep::{Curve, Point, Sweep, line};
use comfy_table::Table;

use super::plot::{Mark, Plot, Series, Vertical, stacked};
use super::table;

fn plot(sweep: &Sweep) -> Plot {
    let series = |curve: &Curve| Series { name: curve.method.clone(), points: line(curve) };
    Plot {
        title: format!("{}: action error over bits per weight", sweep.policy),
        x_label: "bits per weight, with scales and padding".to_owned(),
        y_label: "NMSE of the actions, held-out observations".to_owned(),
        vertical: Vertical::Decades,
        series: sweep.curves.iter().map(series).collect(),
        mark: sweep.knee.as_ref().map(|knee| Mark {
            at: (knee.bpw, knee.nmse),
            label: format!("knee: {:.2} bits, NMSE {:.2e}", knee.bpw, knee.nmse),
        }),
    }
}

/// Returns `true` if the point is the knee.
fn is_knee(sweep: &Sweep, curve: &Curve, point: &Point) -> bool {
    sweep.knee.as_ref().is_some_and(|knee| knee.method == curve.method && knee.bpw == point.report.bpw)
}

/// Formats a row for each policy and budget, with a column for each method: error and true bits per weight, and a star
/// at each policy's knee. All sweeps must have the same methods.
pub fn table(sweeps: &[Sweep]) -> Table {
    let methods = sweeps.first().map_or(&[][..], |sweep| &sweep.curves).iter().map(|c| c.method.as_str());
    let header: Vec<&str> = ["policy", "budget"].into_iter().chain(methods).collect();
    let mut table = table::table(&header);
    for sweep in sweeps {
        for (b, budget) in sweep.budgets.iter().enumerate() {
            let cell = |curve: &Curve| match &curve.points[b] {
                Some(point) => {
                    let star = if is_knee(sweep, curve, point) { '*' } else { ' ' };
                    format!("{:.2e} at {:.3}{star}", point.report.nmse, point.report.bpw)
                }
                None => "- ".to_owned(),
            };
            let name = if b == 0 { sweep.policy.clone() } else { String::new() };
            let front = [name, format!("{budget} bits")];
            table.add_row(front.into_iter().chain(sweep.curves.iter().map(cell)));
        }
    }
    table
}

/// Draws the error over true bits per weight, with a line for each method and a plot for each policy.
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
            let report =
                ErrorReport { nmse, worst_nmse: nmse, max_abs: 0.0, steps: 1, bpw, bytes: 1, worst_dimension: 0 };
            (nmse > 0.0).then_some(Point { budget: bpw, report, rows: Vec::new() })
        };
        Curve { method: method.to_owned(), points: points.iter().map(point).collect(), scores: Vec::new() }
    }

    #[test]
    fn table_lists_policies_and_marks_knees() {
        let sweep = |policy: &str, points| {
            let curves = vec![curve("distill", points)];
            let knee = knee(&curves);
            let budgets = vec![2.0, 2.5, 4.0];
            Sweep { policy: policy.into(), matrices: Vec::new(), budgets, curves, knee }
        };
        let sweeps = [
            sweep("arm", &[(2.0, 0.5), (2.5, 0.01), (4.0, 0.003)]),
            sweep("leg", &[(2.0, 0.5), (2.5, 0.4), (4.0, 0.003)]),
        ];
        let text = table(&sweeps).to_string();
        let line = |word: &str| text.lines().filter(|l| l.contains(word)).map(str::to_owned).collect::<Vec<_>>();
        assert!(line("arm")[0].contains("5.00e-1 at 2.000") && line("leg").len() == 1, "{text}");
        assert_eq!(line("*").len(), 1, "{text}");
        assert!(line("*")[0].contains("1.00e-2 at 2.500*"), "{text}");
        assert_eq!(svg(&sweeps).matches("<polyline").count(), 2);
    }

    #[test]
    fn budget_that_is_too_small_shows_a_dash() {
        let curves = vec![curve("a", &[(2.0, 0.0), (3.0, 0.1)])];
        let sweep = Sweep { policy: "p".into(), matrices: Vec::new(), budgets: vec![2.0, 3.0], curves, knee: None };
        let text = table(&[sweep]).to_string();
        assert!(text.contains('-') && text.contains("1.00e-1 at 3.000"), "{text}");
    }
}
