//! SVG pictures: their shared parts, and a line plot of one or more panels with a common vertical axis.
//!
//! This module writes SVG itself. We tried plotters 0.3.7 with its SVG backend only. Its three dependencies are
//! acceptable, but its backends take whole pixels. In the strip of [`super::widths`], a row of a layer with 1,024 rows
//! has a width of 0.6 pixels: rows would merge or vanish. Points of a plot would be up to half a pixel off.

mod axis;
mod drawing;

use std::fmt::Write as _;

use axis::Axis;
pub use axis::Vertical;
use drawing::{colour, dashes, marker, ring};
pub(crate) use drawing::{decade_label, document, text};

/// Sizes of a plot's parts, in SVG's units (pixels at 96 dpi).
const HEIGHT: f64 = 480.0;
const MARGIN_LEFT: f64 = 84.0;
/// The margin that holds the legend.
const MARGIN_RIGHT: f64 = 284.0;
const MARGIN_TOP: f64 = 56.0;
const MARGIN_BOTTOM: f64 = 64.0;
const PANEL: f64 = 440.0;
/// Space between two panels.
const GAP: f64 = 36.0;

/// A line with a marker at every point.
#[derive(Clone, Debug)]
pub struct Series {
    /// Its name in the legend.
    pub name: String,
    /// Points (x, y) of each panel, in the order of the line.
    pub points: Vec<Vec<(f64, f64)>>,
}

/// A highlighted point.
#[derive(Clone, Debug)]
pub struct Mark {
    /// Its place (x, y) in each panel.
    pub at: Vec<(f64, f64)>,
    /// Its text in the legend.
    pub label: String,
}

/// A line plot. All panels have the vertical axis, series and legend in common.
#[derive(Clone, Debug)]
pub struct Plot {
    /// Text above the axes.
    pub title: String,
    /// Text below the horizontal axis of each panel, from left to right.
    pub x_labels: Vec<String>,
    /// Text beside the vertical axis.
    pub y_label: String,
    /// Scale of the vertical axis.
    pub vertical: Vertical,
    /// The lines.
    pub series: Vec<Series>,
    /// A point with a ring.
    pub mark: Option<Mark>,
    /// Corners of a dashed staircase in each panel, from left to right; without panels it is not drawn.
    pub frontier: Vec<Vec<(f64, f64)>>,
}

/// Draws plots below each other in one SVG document.
pub fn stacked(plots: &[Plot]) -> String {
    let width = plots.iter().map(Plot::width).fold(0.0, f64::max);
    // Writing to a string can't fail.
    document(width, HEIGHT * plots.len() as f64, |svg| {
        for (i, plot) in plots.iter().enumerate() {
            writeln!(svg, r#"<g transform="translate(0 {})">"#, HEIGHT * i as f64)?;
            plot.write(svg)?;
            writeln!(svg, "</g>")?;
        }
        Ok(())
    })
    .unwrap_or_default()
}

/// Returns the left and right edges of a panel.
fn edges(panel: usize) -> (f64, f64) {
    let left = MARGIN_LEFT + (PANEL + GAP) * panel as f64;
    (left, left + PANEL)
}

impl Plot {
    /// Returns the right edge of the last panel.
    fn right(&self) -> f64 {
        edges(self.x_labels.len().saturating_sub(1)).1
    }

    fn width(&self) -> f64 {
        self.right() + MARGIN_RIGHT
    }

    /// Returns the axes of a panel.
    fn axes(&self, panel: usize) -> (Axis, Axis) {
        let points = |panel: usize| self.series.iter().filter_map(move |s| s.points.get(panel)).flatten();
        let all = (0..self.x_labels.len()).flat_map(points);
        let x = Axis::horizontal(points(panel).map(|p| p.0), edges(panel));
        (x, Axis::vertical(self.vertical, all.map(|p| p.1), (HEIGHT - MARGIN_BOTTOM, MARGIN_TOP)))
    }

    fn write(&self, svg: &mut String) -> std::fmt::Result {
        let middle = 0.5 * (MARGIN_LEFT + self.right());
        text(svg, middle, 30.0, r#"text-anchor="middle" font-size="17" font-weight="bold""#, &self.title)?;
        let beside = 0.5 * (MARGIN_TOP + HEIGHT - MARGIN_BOTTOM);
        let turned = format!(r#"text-anchor="middle" font-size="14" transform="rotate(-90 24 {beside})""#);
        text(svg, 24.0, beside, &turned, &self.y_label)?;
        for panel in 0..self.x_labels.len() {
            self.write_panel(svg, panel)?;
        }
        self.legend(svg)
    }

    fn write_panel(&self, svg: &mut String, panel: usize) -> std::fmt::Result {
        let (x, y) = &self.axes(panel);
        let (left, right) = edges(panel);
        let middle = r#"text-anchor="middle" font-size="14""#;
        text(svg, 0.5 * (left + right), HEIGHT - 18.0, middle, &self.x_labels[panel])?;
        grid(svg, (x, y), panel)?;
        if let Some((first, rest)) = self.frontier.get(panel).and_then(|corners| corners.split_first()) {
            let mut path = format!("M{:.1} {:.1}", x.at(first.0), y.at(first.1));
            rest.iter().try_for_each(|corner| write!(path, "H{:.1}V{:.1}", x.at(corner.0), y.at(corner.1)))?;
            writeln!(svg, "{}", dashes(&path))?;
        }
        for (index, series) in self.series.iter().enumerate() {
            if let Some(points) = series.points.get(panel) {
                line(svg, (x, y), index, points)?;
            }
        }
        if let Some((at_x, at_y)) = self.mark.as_ref().and_then(|mark| mark.at.get(panel)) {
            writeln!(svg, "{}", ring(x.at(*at_x), y.at(*at_y), 10.0))?;
        }
        Ok(())
    }

    fn legend(&self, svg: &mut String) -> std::fmt::Result {
        let frontier = if self.frontier.is_empty() { None } else { Some("frontier of all methods") };
        let series = self.series.iter().map(|s| s.name.as_str());
        let names: Vec<&str> = series.chain(self.mark.as_ref().map(|m| m.label.as_str())).chain(frontier).collect();
        let longest = names.iter().map(|name| name.chars().count()).max().unwrap_or(0) as f64;
        let (width, height) = (62.0 + 7.0 * longest, 12.0 + 20.0 * names.len() as f64);
        let (left, top) = (self.right() + 14.0, MARGIN_TOP);
        writeln!(
            svg,
            r##"<rect x="{left:.1}" y="{top:.1}" width="{width:.1}" height="{height:.1}" rx="3" fill="#fff" fill-opacity="0.9" stroke="#ccc"/>"##
        )?;
        let (from, to) = (left + 10.0, left + 42.0);
        for (index, name) in names.iter().enumerate() {
            let y = top + 16.0 + 20.0 * index as f64;
            if index < self.series.len() {
                writeln!(svg, r#"<path d="M{from:.1} {y:.1}H{to:.1}" stroke="{}" stroke-width="2"/>"#, colour(index))?;
                writeln!(svg, "{}", marker(index, 0.5 * (from + to), y))?;
            } else if frontier == Some(*name) {
                writeln!(svg, "{}", dashes(&format!("M{from:.1} {y:.1}H{to:.1}")))?;
            } else {
                writeln!(svg, "{}", ring(0.5 * (from + to), y, 7.0))?;
            }
            text(svg, left + 50.0, y + 4.5, "", name)?;
        }
        Ok(())
    }
}

/// Draws the grid and the frame of a panel; the first panel has the labels of the vertical axis.
fn grid(svg: &mut String, (x, y): (&Axis, &Axis), panel: usize) -> std::fmt::Result {
    let ((left, right), bottom) = (edges(panel), HEIGHT - MARGIN_BOTTOM);
    let colour = |label: &Option<String>| if label.is_some() { "#d0d0d0" } else { "#f0f0f0" };
    for tick in y.ticks() {
        let y = y.at(tick.value);
        writeln!(svg, r##"<path d="M{left} {y:.1}H{right}" stroke="{}"/>"##, colour(&tick.label))?;
        if let Some(label) = tick.label.filter(|_| panel == 0) {
            text(svg, left - 10.0, y + 4.5, r#"text-anchor="end""#, &label)?;
        }
    }
    for tick in x.ticks() {
        let x = x.at(tick.value);
        writeln!(svg, r##"<path d="M{x:.1} {MARGIN_TOP}V{bottom}" stroke="{}"/>"##, colour(&tick.label))?;
        if let Some(label) = tick.label {
            text(svg, x, bottom + 20.0, r#"text-anchor="middle""#, &label)?;
        }
    }
    writeln!(
        svg,
        r##"<rect x="{left}" y="{MARGIN_TOP}" width="{}" height="{}" fill="none" stroke="#888"/>"##,
        right - left,
        bottom - MARGIN_TOP
    )
}

fn line(svg: &mut String, (x, y): (&Axis, &Axis), index: usize, points: &[(f64, f64)]) -> std::fmt::Result {
    let at: Vec<(f64, f64)> = points.iter().map(|p| (x.at(p.0), y.at(p.1))).collect();
    let path: Vec<String> = at.iter().map(|(x, y)| format!("{x:.1},{y:.1}")).collect();
    writeln!(
        svg,
        r#"<polyline points="{}" fill="none" stroke="{}" stroke-width="2" stroke-linejoin="round"/>"#,
        path.join(" "),
        colour(index)
    )?;
    at.into_iter().try_for_each(|(x, y)| writeln!(svg, "{}", marker(index, x, y)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plot(points: Vec<(f64, f64)>) -> Plot {
        // The second panel has the x of the first times ten.
        let wide = points.iter().map(|(x, y)| (10.0 * x, *y)).collect();
        Plot {
            title: "a < b & c".into(),
            x_labels: vec!["x".into(), "ten x".into()],
            y_label: "y".into(),
            vertical: Vertical::Decades,
            series: vec![Series { name: "one".into(), points: vec![points, wide] }],
            mark: None,
            frontier: Vec::new(),
        }
    }

    #[test]
    fn markers_are_inside_their_panel_and_text_escaped() {
        let points = vec![(2.0, 0.7), (2.5, 0.05), (40.0, 3e-4)];
        let mut plot = plot(points.clone());
        plot.mark = Some(Mark { at: vec![points[1], (25.0, 0.05)], label: "knee".into() });
        plot.frontier = plot.series[0].points.clone();
        let svg = stacked(std::slice::from_ref(&plot));
        assert!(svg.contains("a &lt; b &amp; c"));
        // Three points and a ring in two panels, and one of each in the legend.
        assert_eq!(svg.matches("<circle").count(), 10);
        assert_eq!(svg.matches("stroke-dasharray").count(), 3, "a staircase in each panel, and a dash in the legend");
        for panel in [0, 1] {
            let (x, y) = plot.axes(panel);
            let (left, right) = edges(panel);
            for &(at_x, at_y) in &plot.series[0].points[panel] {
                assert!((left..right).contains(&x.at(at_x)));
                assert!((MARGIN_TOP..=HEIGHT - MARGIN_BOTTOM).contains(&y.at(at_y)));
            }
        }
        assert_eq!(plot.width(), edges(1).1 + MARGIN_RIGHT);
    }

    #[test]
    fn plot_takes_no_points_and_one_point() {
        for vertical in [Vertical::Decades, Vertical::Percent] {
            for points in [vec![], vec![(3.0, 1.0)]] {
                let mut plot = Plot { vertical, ..plot(points) };
                // A panel that a series has no points for.
                plot.series.push(Series { name: "less".into(), points: vec![vec![(1.0, 1.0)]] });
                let svg = stacked(&[plot]);
                assert!(svg.ends_with("</svg>\n") && !svg.contains("NaN") && !svg.contains("inf"), "{svg}");
            }
        }
    }
}
