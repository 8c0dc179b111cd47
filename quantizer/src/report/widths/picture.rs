//! The widths as a picture: a strip for every matrix, with the curve of its rows' energies above.

use std::fmt::Write as _;

use actq_kernels::Width;

use super::{ALL, Layer, Reasons, Row, Widths};
use crate::report::plot::{decade_label, document, text};

/// Width of the picture and sizes of its parts, in SVG's units.
const WIDTH: f64 = 760.0;
const MARGIN_LEFT: f64 = 84.0;
const MARGIN_RIGHT: f64 = 28.0;
/// Height of title and legend.
const HEAD_HEIGHT: f64 = 88.0;
/// Heights of a layer's parts.
const NAME_HEIGHT: f64 = 26.0;
const ENERGIES_HEIGHT: f64 = 96.0;
const STRIP_HEIGHT: f64 = 22.0;
const AXIS_HEIGHT: f64 = 40.0;
const MARGIN_BOTTOM: f64 = 16.0;
/// The most decades of the axis; smaller values are drawn at its lower end.
const MOST_DECADES: i32 = 8;

/// The decades that energies and removal costs span.
#[derive(Clone, Copy)]
struct Decades {
    top: i32,
    floor: i32,
}

impl Decades {
    /// Returns the decades of all `values` above 0; `None` if there are none.
    fn around(values: impl Iterator<Item = f64> + Clone) -> Option<Self> {
        let logs = || values.clone().filter(|v| *v > 0.0).map(f64::log10);
        let top = logs().reduce(f64::max)?.ceil() as i32;
        let floor = logs().reduce(f64::min)?.floor() as i32;
        Some(Self { top, floor: floor.clamp(top - MOST_DECADES, top - 1) })
    }

    /// Returns a value's place between the upper end (0) and the lower end (1).
    fn share(self, value: f64) -> f64 {
        let decades = f64::from(self.top - self.floor);
        ((f64::from(self.top) - value.max(f64::MIN_POSITIVE).log10()) / decades).clamp(0.0, 1.0)
    }
}

/// Returns the width's colour in Okabe and Ito's palette, from cold (few bits) to warm (many).
fn colour(width: Option<Width>) -> &'static str {
    match width {
        None => "#cccccc",
        Some(Width::W2) => "#56b4e9",
        Some(Width::W3) => "#009e73",
        Some(Width::W4) => "#f0e442",
        Some(Width::W8) => "#d55e00",
    }
}

impl Widths {
    /// Draws a strip for each matrix, with rows coloured by width. With energies, rows are sorted by them, below their
    /// curve; otherwise rows are in the order of the output.
    pub fn svg(&self) -> String {
        let reasons = self.layers.iter().flat_map(|l| &l.rows).filter_map(|r| r.reasons);
        let decades = Decades::around(reasons.clone().flat_map(|r| [r.energy, r.removal]));
        let removable = reasons.clone().any(Reasons::is_removable);
        let panel = NAME_HEIGHT + STRIP_HEIGHT + AXIS_HEIGHT + if decades.is_some() { ENERGIES_HEIGHT } else { 0.0 };
        let height = HEAD_HEIGHT + panel * self.layers.len() as f64 + MARGIN_BOTTOM;
        // Writing to a string can't fail.
        document(WIDTH, height, |svg| {
            let title = format!("{}: bits of every row", self.policy);
            let middle = 0.5 * (MARGIN_LEFT + WIDTH - MARGIN_RIGHT);
            text(svg, middle, 30.0, r#"text-anchor="middle" font-size="17" font-weight="bold""#, &title)?;
            legend(svg, decades.is_some(), removable)?;
            for (i, layer) in self.layers.iter().enumerate() {
                layer.draw(svg, HEAD_HEIGHT + panel * i as f64, decades)?;
            }
            Ok(())
        })
        .unwrap_or_default()
    }
}

/// Draws the legend of colours and marks, in a line.
fn legend(svg: &mut String, energies: bool, removable: bool) -> std::fmt::Result {
    let y = 60.0;
    let mut x = MARGIN_LEFT;
    for width in ALL {
        let name = width.map_or("no bits".to_owned(), |w| format!("{} bits", w.bits()));
        swatch(svg, x, y - 11.0, 14.0, 14.0, colour(width))?;
        text(svg, x + 20.0, y, "", &name)?;
        x += if width.is_none() { 88.0 } else { 76.0 };
    }
    if energies {
        x += 8.0;
        writeln!(svg, r##"<path d="M{x} {:.1}h22" stroke="#333" stroke-width="1.5"/>"##, y - 4.0)?;
        text(svg, x + 28.0, y, "", "energy")?;
        x += 90.0;
    }
    if removable {
        writeln!(svg, r##"<circle cx="{x}" cy="{:.1}" r="2" fill="#888"/>"##, y - 4.0)?;
        text(svg, x + 8.0, y, "", "cost of removal")?;
    }
    Ok(())
}

fn swatch(svg: &mut String, x: f64, y: f64, width: f64, height: f64, colour: &str) -> std::fmt::Result {
    writeln!(svg, r#"<rect x="{x:.2}" y="{y:.1}" width="{width:.2}" height="{height:.1}" fill="{colour}"/>"#)
}

impl Layer {
    /// Draws the layer below `y`, with its energies if known.
    fn draw(&self, svg: &mut String, y: f64, decades: Option<Decades>) -> std::fmt::Result {
        let bytes: usize = self.bytes.iter().map(|b| b.1).sum();
        let name = format!("{}, {} x {}, {bytes} bytes", self.name, self.shape.0, self.shape.1);
        text(svg, MARGIN_LEFT, y + 17.0, r#"font-size="14""#, &name)?;
        let mut rows: Vec<&Row> = self.rows.iter().collect();
        let energy = |row: &Row| row.reasons.map_or(0.0, |r| r.energy);
        // The sort is stable: without energies, rows keep their order.
        rows.sort_by(|a, b| energy(b).total_cmp(&energy(a)));
        let across = (WIDTH - MARGIN_LEFT - MARGIN_RIGHT) / rows.len().max(1) as f64;
        let mut strip = y + NAME_HEIGHT;
        if let Some(decades) = decades {
            energies(svg, &rows, across, strip, decades)?;
            strip += ENERGIES_HEIGHT;
        }
        let mut from = 0;
        for run in rows.chunk_by(|a, b| a.width == b.width) {
            let x = MARGIN_LEFT + across * from as f64;
            swatch(svg, x, strip, across * run.len() as f64, STRIP_HEIGHT, colour(run[0].width))?;
            from += run.len();
        }
        let (right, below) = (WIDTH - MARGIN_RIGHT, strip + STRIP_HEIGHT);
        writeln!(
            svg,
            r##"<rect x="{MARGIN_LEFT}" y="{strip:.1}" width="{}" height="{STRIP_HEIGHT}" fill="none" stroke="#888"/>"##,
            right - MARGIN_LEFT
        )?;
        let order = match decades {
            Some(_) => "rows, most energy first",
            None => "rows in the order of the output",
        };
        text(svg, MARGIN_LEFT, below + 17.0, "", "1")?;
        text(svg, 0.5 * (MARGIN_LEFT + right), below + 17.0, r#"text-anchor="middle""#, order)?;
        text(svg, right, below + 17.0, r#"text-anchor="end""#, &rows.len().to_string())
    }
}

/// Draws the curve of the rows' energies and the points of their removal costs, in the frame below `y`.
fn energies(svg: &mut String, rows: &[&Row], across: f64, y: f64, decades: Decades) -> std::fmt::Result {
    let right = WIDTH - MARGIN_RIGHT;
    let at = |value: f64| y + ENERGIES_HEIGHT * decades.share(value);
    // With many decades, neighbouring labels would touch.
    let every = if decades.top - decades.floor > 5 { 2 } else { 1 };
    for decade in decades.floor..=decades.top {
        let line = at(10f64.powi(decade));
        writeln!(svg, r##"<path d="M{MARGIN_LEFT} {line:.1}H{right}" stroke="#d0d0d0"/>"##)?;
        if (decades.top - decade) % every == 0 {
            text(svg, MARGIN_LEFT - 10.0, line + 4.5, r#"text-anchor="end""#, &decade_label(decade))?;
        }
    }
    let mut path = String::new();
    for (i, row) in rows.iter().enumerate() {
        let Some(reasons) = row.reasons else { continue };
        let x = MARGIN_LEFT + across * (i as f64 + 0.5);
        if reasons.is_removable() {
            writeln!(svg, r##"<circle cx="{x:.1}" cy="{:.1}" r="1.2" fill="#888"/>"##, at(reasons.removal))?;
        }
        let _ = write!(path, "{x:.1},{:.1} ", at(reasons.energy));
    }
    writeln!(
        svg,
        r##"<polyline points="{}" fill="none" stroke="#333" stroke-width="1.5" stroke-linejoin="round"/>"##,
        path.trim_end()
    )?;
    writeln!(
        svg,
        r##"<rect x="{MARGIN_LEFT}" y="{y:.1}" width="{}" height="{ENERGIES_HEIGHT}" fill="none" stroke="#888"/>"##,
        right - MARGIN_LEFT
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn decades_span_the_values_down_to_a_floor() {
        let decades = Decades::around([0.0, 2e-3, 0.5].into_iter()).expect("values above 0");
        assert_eq!((decades.top, decades.floor), (0, -3));
        assert_eq!((decades.share(1.0), decades.share(1e-3), decades.share(0.0)), (0.0, 1.0, 1.0));
        assert!(decades.share(0.5) < decades.share(2e-3), "larger values are higher");
        // A value far below the others must not flatten them.
        let deep = Decades::around([1e-30, 3.0].into_iter()).expect("values above 0");
        assert_eq!((deep.top, deep.floor), (1, 1 - MOST_DECADES));
        assert!(Decades::around([0.0].into_iter()).is_none());
        let one = Decades::around([1.0].into_iter()).expect("a value above 0");
        assert_eq!((one.top, one.floor), (0, -1));
    }
}
