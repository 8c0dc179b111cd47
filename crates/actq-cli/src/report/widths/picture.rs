//! The widths as a picture: a strip for every matrix, with the curve of its rows' energies above.

use std::ops::Range;

use actq_kernels::Width;
use plotters::prelude::*;
use plotters::style::text_anchor::HPos;

use super::{ALL, Layer, Reasons, Row, Widths};
use crate::report::plot::{Area, Axis, Drawn, GREY, SCALE, TEXT, document, font, label, pixels, stroke};

/// Width of the picture and sizes of its parts, in pixels.
const WIDTH: i32 = 760;
const LEFT: f64 = 84.0;
const RIGHT: f64 = 732.0;
/// Height of title and legend.
const HEAD: i32 = 88;
/// Heights of a layer's parts.
const NAME: i32 = 26;
const ENERGIES: i32 = 96;
const STRIP: i32 = 22;
const LABELS: i32 = 40;
const BOTTOM: i32 = 16;
/// The most decades of the axis; smaller values are drawn at its lower end.
const MAX_DECADES: i32 = 8;

/// Returns the exponents of 10 around all `values` above 0; `None` if there are none.
fn decades(values: impl Iterator<Item = f64>) -> Option<Range<i32>> {
    let logs = values.filter(|value| *value > 0.0).map(|value| (value.log10(), value.log10()));
    let (low, high) = logs.reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)))?;
    let top = high.ceil() as i32;
    Some((low.floor() as i32).clamp(top - MAX_DECADES, top - 1)..top)
}

/// Returns the width's colour in Okabe and Ito's palette, from cold (few bits) to warm (many).
fn colour(width: Option<Width>) -> RGBColor {
    match width {
        None => RGBColor(204, 204, 204),
        Some(Width::W2) => RGBColor(86, 180, 233),
        Some(Width::W3) => RGBColor(0, 158, 115),
        Some(Width::W4) => RGBColor(240, 228, 66),
        Some(Width::W8) => RGBColor(213, 94, 0),
    }
}

impl Widths {
    /// Draws a strip for each matrix, with rows coloured by width. With energies, rows are sorted by them, below their
    /// curve; otherwise rows are in the order of the output.
    pub fn svg(&self) -> String {
        let reasons = self.layers.iter().flat_map(|l| &l.rows).filter_map(|r| r.reasons);
        let decades = decades(reasons.clone().flat_map(|r| [r.energy, r.removal]));
        let removable = reasons.clone().any(Reasons::is_removable);
        let layer = NAME + STRIP + LABELS + if decades.is_some() { ENERGIES } else { 0 };
        document(WIDTH, HEAD + layer * self.layers.len() as i32 + BOTTOM, |area| {
            let title = format!("{}: bits of every row", self.policy);
            area.draw(&Text::new(title, pixels(0.5 * (LEFT + RIGHT), 24.0), font(17.0, HPos::Center)))?;
            legend(area, decades.is_some(), removable)?;
            let (_, mut rest) = area.split_vertically(SCALE * HEAD);
            for matrix in &self.layers {
                let (own, below) = rest.split_vertically(SCALE * layer);
                matrix.draw(&own, decades.clone())?;
                rest = below;
            }
            Ok(())
        })
    }
}

/// Draws the legend of colours and marks, in a line.
fn legend(area: &Area<'_>, energies: bool, removable: bool) -> Drawn {
    let y = 56.0;
    let label = |x: f64, name: String| area.draw(&Text::new(name, pixels(x, y), font(13.0, HPos::Left)));
    let mut x = LEFT;
    for width in ALL {
        area.draw(&Rectangle::new([pixels(x, y - 7.0), pixels(x + 14.0, y + 7.0)], colour(width).filled()))?;
        label(x + 20.0, width.map_or("no bits".to_owned(), |w| format!("{} bits", w.bits())))?;
        x += if width.is_none() { 88.0 } else { 76.0 };
    }
    if energies {
        area.draw(&PathElement::new([pixels(x + 8.0, y), pixels(x + 30.0, y)], stroke(TEXT, 15)))?;
        label(x + 36.0, "energy".to_owned())?;
    }
    if removable {
        area.draw(&Circle::new(pixels(x + 98.0, y), 2 * SCALE, GREY.filled()))?;
        label(x + 106.0, "cost of removal".to_owned())?;
    }
    Ok(())
}

impl Layer {
    /// Draws the layer, with its energies if known.
    fn draw(&self, area: &Area<'_>, decades: Option<Range<i32>>) -> Drawn {
        let bytes: usize = self.bytes.iter().map(|b| b.1).sum();
        let name = format!("{}, {} x {}, {bytes} bytes", self.name, self.shape.0, self.shape.1);
        area.draw(&Text::new(name, pixels(LEFT, 13.0), font(14.0, HPos::Left)))?;
        let mut rows: Vec<&Row> = self.rows.iter().collect();
        let energy = |row: &Row| row.reasons.map_or(0.0, |r| r.energy);
        // The sort is stable: without energies, rows keep their order.
        rows.sort_by(|a, b| energy(b).total_cmp(&energy(a)));
        let mut top = f64::from(NAME);
        let order = match decades {
            Some(decades) => {
                let (_, below) = area.split_vertically(SCALE * NAME);
                energies(&below.split_vertically(SCALE * ENERGIES).0, &rows, decades)?;
                top += f64::from(ENERGIES);
                "rows, most energy first"
            }
            None => "rows in the order of the output",
        };
        let bottom = top + f64::from(STRIP);
        let across = |row: usize| LEFT + (RIGHT - LEFT) * row as f64 / rows.len().max(1) as f64;
        let mut from = 0;
        for run in rows.chunk_by(|a, b| a.width == b.width) {
            let corners = [pixels(across(from), top), pixels(across(from + run.len()), bottom)];
            area.draw(&Rectangle::new(corners, colour(run[0].width).filled()))?;
            from += run.len();
        }
        let corners = [(LEFT, top), (RIGHT, top), (RIGHT, bottom), (LEFT, bottom), (LEFT, top)];
        area.draw(&PathElement::new(corners.map(|(x, y)| pixels(x, y)), stroke(GREY, 10)))?;
        let last = rows.len().to_string();
        for (x, side, text) in
            [(LEFT, HPos::Left, "1"), (0.5 * (LEFT + RIGHT), HPos::Center, order), (RIGHT, HPos::Right, &last)]
        {
            area.draw(&Text::new(text, pixels(x, bottom + 13.0), font(13.0, side)))?;
        }
        Ok(())
    }
}

/// Draws the curve of the rows' energies and the points of their removal costs.
fn energies(area: &Area<'_>, rows: &[&Row], decades: Range<i32>) -> Drawn {
    let floor = 10f64.powi(decades.start);
    let y = Axis::log(f64::from(decades.start)..f64::from(decades.end), &[1]);
    // With many decades, neighbouring labels would touch.
    let every = if decades.len() > 5 { 2 } else { 1 };
    let mut chart = ChartBuilder::on(area)
        .margin_right(pixels(f64::from(WIDTH) - RIGHT, 0.0).0)
        .y_label_area_size(pixels(LEFT, 0.0).0)
        .build_cartesian_2d(0.0..rows.len() as f64, y)?;
    chart
        .configure_mesh()
        .disable_x_mesh()
        .y_label_formatter(&|value| match (decades.end - value.log10().round() as i32) % every {
            0 => label(value),
            _ => String::new(),
        })
        .label_style(font(13.0, HPos::Right))
        .axis_style(stroke(GREY, 10))
        .set_all_tick_mark_size(4 * SCALE)
        .bold_line_style(stroke(RGBColor(208, 208, 208), 10))
        .light_line_style(TRANSPARENT)
        .draw()?;
    let known = || rows.iter().zip(0..).filter_map(|(row, i)| Some((f64::from(i) + 0.5, row.reasons?)));
    let at = |value: f64| value.max(floor);
    chart.draw_series(
        known()
            .filter(|(_, reasons)| reasons.is_removable())
            .map(|(x, reasons)| Circle::new((x, at(reasons.removal)), pixels(1.2, 0.0).0, GREY.filled())),
    )?;
    chart.draw_series(LineSeries::new(known().map(|(x, reasons)| (x, at(reasons.energy))), stroke(TEXT, 15)))?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn decades_span_the_values_down_to_a_floor() {
        assert_eq!(decades([0.0, 2e-3, 0.5].into_iter()), Some(-3..0));
        // A value far below the others must not flatten them.
        assert_eq!(decades([1e-30, 3.0].into_iter()), Some(1 - MAX_DECADES..1));
        assert_eq!(decades([0.0].into_iter()), None);
        assert_eq!(decades([1.0].into_iter()), Some(-1..0));
    }
}
