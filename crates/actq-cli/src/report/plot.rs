//! SVG pictures by plotters: their shared parts, and a line plot of one or more panels with a common vertical axis.
//!
//! plotters takes whole pixels. A picture is drawn `SCALE` times as large as it is shown, since a row of a matrix may
//! be narrower than a pixel.

mod axis;

use plotters::coord::Shift;
use plotters::element::{ComposedElement, DashedPathElement};
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

pub use axis::Vertical;
pub(crate) use axis::{Axis, label};

/// Units of the drawing in a pixel.
pub(crate) const SCALE: i32 = 10;
/// Sizes of a plot's parts, in pixels.
const HEIGHT: i32 = 480;
const TITLE: i32 = 44;
const LEGEND: i32 = 290;
const PANEL: i32 = 520;
const LABELS: i32 = 56;
/// Okabe and Ito's colour-blind safe palette, ordered by contrast on white.
const COLOURS: [RGBColor; 6] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(230, 159, 0),
    RGBColor(86, 180, 233),
];
pub(crate) const GREY: RGBColor = RGBColor(119, 119, 119);
pub(crate) const TEXT: RGBColor = RGBColor(51, 51, 51);

pub(crate) type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;
pub(crate) type Drawn = Result<(), DrawingAreaErrorKind<std::io::Error>>;

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

/// Draws a picture of this size in pixels.
pub(crate) fn document(width: i32, height: i32, draw: impl FnOnce(&Area<'_>) -> Drawn) -> String {
    let [wide, high] = [width, height].map(|pixels| (SCALE * pixels).unsigned_abs());
    let mut svg = String::new();
    let area = SVGBackend::with_string(&mut svg, (wide, high)).into_drawing_area();
    let drawn = area.fill(&WHITE).and_then(|()| draw(&area)).and_then(|()| area.present());
    drop(area);
    if drawn.is_err() {
        // Nothing fails in memory.
        svg.clear();
    }
    let shown = format!(r#"width="{width}" height="{height}""#);
    svg.replacen(&format!(r#"width="{wide}" height="{high}""#), &shown, 1)
}

/// Returns a style of text of this size in pixels, at a place of this side of it.
pub(crate) fn font(pixels: f64, side: HPos) -> TextStyle<'static> {
    // plotters divides the size by this factor.
    let size = 1.24 * pixels * f64::from(SCALE);
    ("Helvetica, Arial, sans-serif", size).into_font().color(&TEXT).pos(Pos::new(side, VPos::Center))
}

/// Returns a line of this width in tenths of a pixel.
pub(crate) fn stroke(colour: RGBColor, width: u32) -> ShapeStyle {
    colour.stroke_width(width)
}

/// Returns a point of the picture from pixels.
pub(crate) fn pixels(x: f64, y: f64) -> (i32, i32) {
    let unit = |pixels: f64| (f64::from(SCALE) * pixels).round() as i32;
    (unit(x), unit(y))
}

/// Draws plots below each other in one SVG document.
pub fn stacked(plots: &[Plot]) -> String {
    let width = plots.iter().map(|plot| PANEL * plot.x_labels.len() as i32).max().unwrap_or(0) + LEGEND;
    document(width, HEIGHT * plots.len() as i32, |area| {
        let areas = area.split_evenly((plots.len().max(1), 1));
        plots.iter().zip(&areas).try_for_each(|(plot, area)| plot.draw(area))
    })
}

impl Plot {
    fn draw(&self, area: &Area<'_>) -> Drawn {
        let (panels, legend) = area.split_horizontally(SCALE * PANEL * self.x_labels.len() as i32);
        let middle = 0.5 * f64::from(PANEL) * self.x_labels.len() as f64;
        panels.draw(&Text::new(self.title.as_str(), pixels(middle, 24.0), font(17.0, HPos::Center)))?;
        let panels = panels.margin(SCALE * TITLE, 0, 0, 0).split_evenly((1, self.x_labels.len().max(1)));
        (0..self.x_labels.len()).try_for_each(|panel| self.panel(&panels[panel], panel))?;
        self.legend(&legend)
    }

    fn panel(&self, area: &Area<'_>, panel: usize) -> Drawn {
        let points = |panel: usize| self.series.iter().filter_map(move |s| s.points.get(panel)).flatten();
        let x = Axis::horizontal(points(panel).map(|p| p.0));
        let y = Axis::vertical(self.vertical, (0..self.x_labels.len()).flat_map(points).map(|p| p.1));
        let is_first = panel == 0;
        let mut chart = ChartBuilder::on(area)
            .margin_left(SCALE * 6)
            .margin_right(SCALE * 8)
            .x_label_area_size(SCALE * LABELS)
            .y_label_area_size(SCALE * if is_first { LABELS + 24 } else { LABELS - 24 })
            .build_cartesian_2d(x, y)?;
        chart
            .configure_mesh()
            .x_desc(self.x_labels[panel].as_str())
            .y_desc(if is_first { self.y_label.as_str() } else { "" })
            .x_label_formatter(&label)
            .y_label_formatter(&|value| if is_first { label(value) } else { String::new() })
            .label_style(font(13.0, HPos::Center))
            .axis_desc_style(font(14.0, HPos::Center))
            .axis_style(stroke(GREY, 10))
            .set_all_tick_mark_size(4 * SCALE)
            .bold_line_style(stroke(RGBColor(208, 208, 208), 10))
            .light_line_style(stroke(RGBColor(240, 240, 240), 10))
            .draw()?;
        if let Some((first, rest)) = self.frontier.get(panel).and_then(|corners| corners.split_first()) {
            let mut corners = vec![*first];
            for corner in rest {
                corners.extend([(corner.0, corners[corners.len() - 1].1), *corner]);
            }
            chart.draw_series(DashedLineSeries::new(corners, 50, 40, stroke(GREY, 15)))?;
        }
        for (index, series) in self.series.iter().enumerate() {
            let points = || series.points.get(panel).into_iter().flatten().copied();
            chart.draw_series(LineSeries::new(points(), stroke(COLOURS[index % COLOURS.len()], 20)))?;
            chart.draw_series(points().map(|point| marker(index, point)))?;
        }
        let mark = self.mark.iter().filter_map(|mark| mark.at.get(panel));
        chart.draw_series(mark.map(|place| Circle::new(*place, 10 * SCALE, stroke(TEXT, 15))))?;
        Ok(())
    }

    fn legend(&self, area: &Area<'_>) -> Drawn {
        let mut row = 0;
        let mut next = |name: &str| {
            row += 1;
            let y = f64::from(TITLE + 20 * row);
            area.draw(&Text::new(name.to_owned(), pixels(60.0, y), font(13.0, HPos::Left)))?;
            Ok(y)
        };
        let line = |y: f64| vec![pixels(18.0, y), pixels(50.0, y)];
        for (index, series) in self.series.iter().enumerate() {
            let y = next(&series.name)?;
            area.draw(&PathElement::new(line(y), stroke(COLOURS[index % COLOURS.len()], 20)))?;
            area.draw(&marker(index, pixels(34.0, y)))?;
        }
        if let Some(mark) = &self.mark {
            let y = next(&mark.label)?;
            area.draw(&Circle::new(pixels(34.0, y), 7 * SCALE, stroke(TEXT, 15)))?;
        }
        if !self.frontier.is_empty() {
            let y = next("frontier of all methods")?;
            area.draw(&DashedPathElement::new(line(y), 50, 40, stroke(GREY, 15)))?;
        }
        Ok(())
    }
}

/// A shape on its rim.
type Marker<C, DB> = ComposedElement<C, DB, Polygon<(i32, i32)>, Polygon<(i32, i32)>>;

/// Returns a marker with the series' own shape and colour, on a white rim.
fn marker<DB: DrawingBackend, C: Clone>(index: usize, at: C) -> Marker<C, DB> {
    let shape = |radius: f64| {
        // The corners, and the angle of the first in parts of the angle between two.
        let (corners, first) = [(24, 0.0), (4, 0.5), (3, 0.25), (4, 0.0)][index % 4];
        let corner = |i: i32| std::f64::consts::TAU * (f64::from(i) + first) / f64::from(corners);
        (0..corners).map(|i| pixels(radius * corner(i).cos(), radius * corner(i).sin())).collect::<Vec<_>>()
    };
    let radius = [5.0, 6.2, 6.4, 6.2][index % 4];
    let rim = Polygon::new(shape(radius + 1.2), WHITE.filled());
    EmptyElement::at(at) + rim + Polygon::new(shape(radius), COLOURS[index % COLOURS.len()].filled())
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
    fn every_point_has_a_marker_and_text_is_escaped() {
        let points = vec![(2.0, 0.7), (2.5, 0.05), (40.0, 3e-4)];
        let mut plot = plot(points.clone());
        plot.mark = Some(Mark { at: vec![points[1], (25.0, 0.05)], label: "knee".into() });
        plot.frontier = plot.series[0].points.clone();
        let svg = stacked(std::slice::from_ref(&plot));
        assert!(svg.contains("a &lt; b &amp; c") && svg.contains("frontier of all methods"), "{svg}");
        // Three points and a ring in two panels, and one of each in the legend. A marker has a rim.
        assert_eq!((svg.matches("<polygon").count(), svg.matches("<circle").count()), (2 * 7, 3));
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
