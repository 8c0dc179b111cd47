//! SVG pictures: their shared parts, and a line plot with a vertical axis that is logarithmic or in percent.
//!
//! This module writes SVG itself. We tried plotters 0.3.7 with its SVG backend only. Its three dependencies are
//! acceptable, but its backends take whole pixels. In the strip of [`super::widths`], a row of a layer with 1,024 rows
//! has a width of 0.6 pixels: rows would merge or vanish. Points of a plot would be up to half a pixel off.

use std::fmt::Write as _;

/// Size of the picture, and the margins around the axes, in SVG's units (pixels at 96 dpi).
const WIDTH: f64 = 980.0;
const HEIGHT: f64 = 480.0;
const MARGIN_LEFT: f64 = 84.0;
/// The margin that holds the legend.
const MARGIN_RIGHT: f64 = 264.0;
const MARGIN_TOP: f64 = 56.0;
const MARGIN_BOTTOM: f64 = 64.0;

/// Okabe and Ito's colour-blind safe palette, ordered by contrast on white.
const COLOURS: [&str; 6] = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9"];

/// Creates an SVG document of this size with a white background, and draws on it by `draw`.
pub(crate) fn document(
    width: f64,
    height: f64,
    draw: impl FnOnce(&mut String) -> std::fmt::Result,
) -> Result<String, std::fmt::Error> {
    let mut svg = String::new();
    writeln!(
        svg,
        r##"<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}" viewBox="0 0 {width} {height}" font-family="Helvetica, Arial, 'Liberation Sans', sans-serif" font-size="13" fill="#333">"##
    )?;
    writeln!(svg, r##"<rect width="100%" height="100%" fill="#fff"/>"##)?;
    draw(&mut svg)?;
    writeln!(svg, "</svg>")?;
    Ok(svg)
}

/// Appends escaped text.
pub(crate) fn text(svg: &mut String, x: f64, y: f64, attributes: &str, content: &str) -> std::fmt::Result {
    let content = content.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;");
    writeln!(svg, r#"<text x="{x:.1}" y="{y:.1}" {attributes}>{content}</text>"#)
}

/// Formats a power of ten as a label.
pub(crate) fn decade_label(decade: i32) -> String {
    match decade {
        -3..=3 => format!("{}", 10f64.powi(decade)),
        _ => format!("1e{decade}"),
    }
}

/// A line with a marker at every point.
#[derive(Clone, Debug)]
pub struct Series {
    /// Its name in the legend.
    pub name: String,
    /// Points (x, y) in the order of the line.
    pub points: Vec<(f64, f64)>,
}

/// A highlighted point.
#[derive(Clone, Debug)]
pub struct Mark {
    /// Its place (x, y).
    pub at: (f64, f64),
    /// Its text in the legend.
    pub label: String,
}

/// Scale of the vertical axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Vertical {
    /// Logarithmic, in decades around the points, which are above 0.
    Decades,
    /// Linear, from 0 to 100.
    Percent,
}

/// A line plot.
#[derive(Clone, Debug)]
pub struct Plot {
    /// Text above the axes.
    pub title: String,
    /// Text below the horizontal axis.
    pub x_label: String,
    /// Text beside the vertical axis.
    pub y_label: String,
    /// Scale of the vertical axis.
    pub vertical: Vertical,
    /// The lines.
    pub series: Vec<Series>,
    /// A point with a ring.
    pub mark: Option<Mark>,
}

/// The ranges of both axes.
struct Axes {
    x: (f64, f64),
    /// In decades, or in percent.
    y: (i32, i32),
    vertical: Vertical,
}

impl Axes {
    fn around(series: &[Series], vertical: Vertical) -> Self {
        let points = || series.iter().flat_map(|s| &s.points);
        let range = |values: &mut dyn Iterator<Item = f64>| {
            values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)))
        };
        let (mut x, mut y) = (range(&mut points().map(|p| p.0)), range(&mut points().map(|p| p.1.log10())));
        if x.0 > x.1 {
            (x, y) = ((0.0, 1.0), (0.0, 1.0));
        }
        let step = tick_step(x.1 - x.0);
        // Half a step of space, so that no marker is on the frame.
        let x = (x.0 - 0.5 * step, x.1 + 0.5 * step);
        let y = ((y.0 - 0.08).floor() as i32, (y.1 + 0.08).ceil() as i32);
        let y = match vertical {
            Vertical::Decades => (y.0, y.1.max(y.0 + 1)),
            Vertical::Percent => (0, 100),
        };
        Self { x, y, vertical }
    }

    fn x(&self, value: f64) -> f64 {
        MARGIN_LEFT + (WIDTH - MARGIN_LEFT - MARGIN_RIGHT) * (value - self.x.0) / (self.x.1 - self.x.0)
    }

    fn y(&self, value: f64) -> f64 {
        let value = match self.vertical {
            Vertical::Decades => value.log10(),
            Vertical::Percent => value,
        };
        let share = (value - f64::from(self.y.0)) / f64::from(self.y.1 - self.y.0);
        HEIGHT - MARGIN_BOTTOM - (HEIGHT - MARGIN_TOP - MARGIN_BOTTOM) * share
    }
}

/// Returns 1, 2 or 5 times a power of ten that divides a range of this length into 4 to 10 steps.
fn tick_step(length: f64) -> f64 {
    if length <= 0.0 {
        return 1.0;
    }
    let power = 10f64.powf((length / 4.0).log10().floor());
    [5.0, 2.0, 1.0].into_iter().map(|m| m * power).find(|step| length / step >= 4.0).unwrap_or(power)
}

/// Draws plots below each other in one SVG document.
pub fn stacked(plots: &[Plot]) -> String {
    // Writing to a string can't fail.
    document(WIDTH, HEIGHT * plots.len() as f64, |svg| {
        for (i, plot) in plots.iter().enumerate() {
            writeln!(svg, r#"<g transform="translate(0 {})">"#, HEIGHT * i as f64)?;
            plot.write(svg)?;
            writeln!(svg, "</g>")?;
        }
        Ok(())
    })
    .unwrap_or_default()
}

impl Plot {
    /// Draws the plot as an SVG document.
    pub fn svg(&self) -> String {
        stacked(std::slice::from_ref(self))
    }

    fn write(&self, svg: &mut String) -> std::fmt::Result {
        let axes = &Axes::around(&self.series, self.vertical);
        let middle = 0.5 * (MARGIN_LEFT + WIDTH - MARGIN_RIGHT);
        text(svg, middle, 30.0, r#"text-anchor="middle" font-size="17" font-weight="bold""#, &self.title)?;
        text(svg, middle, HEIGHT - 18.0, r#"text-anchor="middle" font-size="14""#, &self.x_label)?;
        let beside = 0.5 * (MARGIN_TOP + HEIGHT - MARGIN_BOTTOM);
        let turned = format!(r#"text-anchor="middle" font-size="14" transform="rotate(-90 24 {beside})""#);
        text(svg, 24.0, beside, &turned, &self.y_label)?;
        grid(svg, axes)?;
        for (index, series) in self.series.iter().enumerate() {
            line(svg, axes, index, series)?;
        }
        if let Some(mark) = &self.mark {
            writeln!(svg, "{}", ring(axes.x(mark.at.0), axes.y(mark.at.1), 10.0))?;
        }
        self.legend(svg)
    }

    fn legend(&self, svg: &mut String) -> std::fmt::Result {
        let names: Vec<&str> =
            self.series.iter().map(|s| s.name.as_str()).chain(self.mark.iter().map(|m| m.label.as_str())).collect();
        let longest = names.iter().map(|name| name.chars().count()).max().unwrap_or(0) as f64;
        let (width, height) = (62.0 + 7.0 * longest, 12.0 + 20.0 * names.len() as f64);
        let (left, top) = (WIDTH - MARGIN_RIGHT + 14.0, MARGIN_TOP);
        writeln!(
            svg,
            r##"<rect x="{left:.1}" y="{top:.1}" width="{width:.1}" height="{height:.1}" rx="3" fill="#fff" fill-opacity="0.9" stroke="#ccc"/>"##
        )?;
        let (from, to) = (left + 10.0, left + 42.0);
        for (index, name) in names.iter().enumerate() {
            let y = top + 16.0 + 20.0 * index as f64;
            if index < self.series.len() {
                let colour = COLOURS[index % COLOURS.len()];
                writeln!(svg, r#"<path d="M{from:.1} {y:.1}H{to:.1}" stroke="{colour}" stroke-width="2"/>"#)?;
                writeln!(svg, "{}", marker(index, 0.5 * (from + to), y))?;
            } else {
                writeln!(svg, "{}", ring(0.5 * (from + to), y, 7.0))?;
            }
            text(svg, left + 50.0, y + 4.5, "", name)?;
        }
        Ok(())
    }
}

fn grid(svg: &mut String, axes: &Axes) -> std::fmt::Result {
    let (right, bottom) = (WIDTH - MARGIN_RIGHT, HEIGHT - MARGIN_BOTTOM);
    let strong = |svg: &mut String, y: f64, label: &str| {
        writeln!(svg, r##"<path d="M{MARGIN_LEFT} {y:.1}H{right}" stroke="#d0d0d0"/>"##)?;
        text(svg, MARGIN_LEFT - 10.0, y + 4.5, r#"text-anchor="end""#, label)
    };
    match axes.vertical {
        Vertical::Percent => {
            for percent in (axes.y.0..=axes.y.1).step_by(20) {
                strong(svg, axes.y(f64::from(percent)), &percent.to_string())?;
            }
        }
        Vertical::Decades => {
            for decade in axes.y.0..=axes.y.1 {
                strong(svg, axes.y(10f64.powi(decade)), &decade_label(decade))?;
                for digit in (2..10).filter(|_| decade < axes.y.1) {
                    let y = axes.y(f64::from(digit) * 10f64.powi(decade));
                    writeln!(svg, r##"<path d="M{MARGIN_LEFT} {y:.1}H{right}" stroke="#f0f0f0"/>"##)?;
                }
            }
        }
    }
    let step = tick_step(axes.x.1 - axes.x.0);
    let decimals = (-step.log10().floor()).max(0.0) as usize;
    for tick in (axes.x.0 / step).ceil() as i64..=(axes.x.1 / step).floor() as i64 {
        let value = tick as f64 * step;
        let x = axes.x(value);
        writeln!(svg, r##"<path d="M{x:.1} {MARGIN_TOP}V{bottom}" stroke="#e4e4e4"/>"##)?;
        text(svg, x, bottom + 20.0, r#"text-anchor="middle""#, &format!("{value:.decimals$}"))?;
    }
    writeln!(
        svg,
        r##"<rect x="{MARGIN_LEFT}" y="{MARGIN_TOP}" width="{}" height="{}" fill="none" stroke="#888"/>"##,
        right - MARGIN_LEFT,
        bottom - MARGIN_TOP
    )
}

fn line(svg: &mut String, axes: &Axes, index: usize, series: &Series) -> std::fmt::Result {
    let colour = COLOURS[index % COLOURS.len()];
    let at: Vec<(f64, f64)> = series.points.iter().map(|p| (axes.x(p.0), axes.y(p.1))).collect();
    let path: Vec<String> = at.iter().map(|(x, y)| format!("{x:.1},{y:.1}")).collect();
    writeln!(
        svg,
        r#"<polyline points="{}" fill="none" stroke="{colour}" stroke-width="2" stroke-linejoin="round"/>"#,
        path.join(" ")
    )?;
    for (x, y) in at {
        writeln!(svg, "{}", marker(index, x, y))?;
    }
    Ok(())
}

fn ring(x: f64, y: f64, radius: f64) -> String {
    format!(r##"<circle cx="{x:.1}" cy="{y:.1}" r="{radius}" fill="none" stroke="#333" stroke-width="1.5"/>"##)
}

/// Returns a marker with the series' own shape and colour.
fn marker(index: usize, x: f64, y: f64) -> String {
    let style = format!(r##"fill="{}" stroke="#fff" stroke-width="1.2""##, COLOURS[index % COLOURS.len()]);
    let polygon = |corners: &[(f64, f64)]| {
        let points: Vec<String> = corners.iter().map(|(dx, dy)| format!("{:.1},{:.1}", x + dx, y + dy)).collect();
        format!(r#"<polygon points="{}" {style}/>"#, points.join(" "))
    };
    match index % 4 {
        0 => format!(r#"<circle cx="{x:.1}" cy="{y:.1}" r="5" {style}/>"#),
        1 => polygon(&[(-4.6, -4.6), (4.6, -4.6), (4.6, 4.6), (-4.6, 4.6)]),
        2 => polygon(&[(0.0, -6.2), (5.8, 4.4), (-5.8, 4.4)]),
        _ => polygon(&[(0.0, -6.2), (6.2, 0.0), (0.0, 6.2), (-6.2, 0.0)]),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plot(series: Vec<Series>) -> Plot {
        Plot {
            title: "a < b & c".into(),
            x_label: "x".into(),
            y_label: "y".into(),
            vertical: Vertical::Decades,
            series,
            mark: None,
        }
    }

    #[test]
    fn markers_are_inside_the_frame_and_text_escaped() {
        let points = vec![(2.0, 0.7), (2.5, 0.05), (4.0, 3e-4)];
        let mut plot = plot(vec![Series { name: "one".into(), points: points.clone() }]);
        plot.mark = Some(Mark { at: points[1], label: "knee".into() });
        let svg = plot.svg();
        assert!(svg.contains("a &lt; b &amp; c"));
        // Three points and a ring, and one of each in the legend.
        assert_eq!(svg.matches("<circle").count(), 6);
        let axes = Axes::around(&plot.series, plot.vertical);
        for (x, y) in points {
            assert!(
                (MARGIN_LEFT..WIDTH - MARGIN_RIGHT).contains(&axes.x(x))
                    && (MARGIN_TOP..=HEIGHT - MARGIN_BOTTOM).contains(&axes.y(y))
            );
        }
        assert!(axes.y(0.7) < axes.y(0.05), "larger values are higher");
    }

    #[test]
    fn plot_takes_no_points_and_one_point() {
        for points in [vec![], vec![(3.0, 1.0)]] {
            let svg = plot(vec![Series { name: "s".into(), points }]).svg();
            assert!(svg.ends_with("</svg>\n") && !svg.contains("NaN") && !svg.contains("inf"), "{svg}");
        }
    }

    #[test]
    fn percent_axis_runs_from_0_to_100() {
        let plot = Plot {
            vertical: Vertical::Percent,
            ..plot(vec![Series { name: "s".into(), points: vec![(2.0, 0.0), (3.0, 100.0)] }])
        };
        let axes = Axes::around(&plot.series, plot.vertical);
        assert_eq!((axes.y(0.0), axes.y(100.0)), (HEIGHT - MARGIN_BOTTOM, MARGIN_TOP));
        let svg = plot.svg();
        assert!(svg.contains(">20</text>") && svg.contains(">100</text>") && !svg.contains("NaN"), "{svg}");
    }

    #[test]
    fn ticks_are_round() {
        for (length, step) in [(2.0, 0.5), (1.0, 0.2), (6.0, 1.0), (10.0, 2.0), (0.0, 1.0)] {
            assert!((tick_step(length) - step).abs() < 1e-12, "{length}: {}", tick_step(length));
        }
    }
}
