//! The widths as a picture: a strip for every matrix, below the line of its rows' energies.

use std::fmt::Write as _;

use actq_kernels::Width;

use super::{ALL, Layer, Reasons, Row, Widths};
use crate::report::plot::{decade_label, document, text};

/// Size of the picture's parts, in SVG's units.
const WIDTH: f64 = 760.0;
const LEFT: f64 = 84.0;
const RIGHT: f64 = 28.0;
/// Title and legend.
const TOP: f64 = 88.0;
/// A layer: its name, the energies, the strip, its axis.
const NAME: f64 = 26.0;
const ENERGIES: f64 = 96.0;
const STRIP: f64 = 22.0;
const AXIS: f64 = 40.0;
const BOTTOM: f64 = 16.0;
/// Decades that are shown at most; what is smaller stands on the floor.
const DECADES: i32 = 8;

/// The decades that a picture's energies and removals span.
#[derive(Clone, Copy)]
struct Decades {
    top: i32,
    floor: i32,
}

impl Decades {
    /// Those of all `values` above 0; `None` without any.
    fn around(values: impl Iterator<Item = f64> + Clone) -> Option<Self> {
        let logs = || values.clone().filter(|v| *v > 0.0).map(f64::log10);
        let top = logs().reduce(f64::max)?.ceil() as i32;
        let floor = logs().reduce(f64::min)?.floor() as i32;
        Some(Self { top, floor: floor.clamp(top - DECADES, top - 1) })
    }

    /// Where a value stands between the upper end (0) and the lower (1).
    fn share(self, value: f64) -> f64 {
        let decades = f64::from(self.top - self.floor);
        ((f64::from(self.top) - value.max(f64::MIN_POSITIVE).log10()) / decades).clamp(0.0, 1.0)
    }
}

/// Okabe and Ito's palette, from cold (few bits) to warm (many).
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
    /// A strip per matrix, its rows coloured by width: with energies sorted by them and below their line, else in the
    /// order of the output.
    pub fn svg(&self) -> String {
        let reasons = self.layers.iter().flat_map(|l| &l.rows).filter_map(|r| r.reasons);
        let decades = Decades::around(reasons.clone().flat_map(|r| [r.energy, r.removal]));
        let removable = reasons.clone().any(Reasons::is_removable);
        let panel = NAME + STRIP + AXIS + if decades.is_some() { ENERGIES } else { 0.0 };
        let height = TOP + panel * self.layers.len() as f64 + BOTTOM;
        // Writing to a string can't fail.
        document(WIDTH, height, |svg| {
            let title = format!("{}: bits of every row", self.policy);
            let middle = 0.5 * (LEFT + WIDTH - RIGHT);
            text(svg, middle, 30.0, r#"text-anchor="middle" font-size="17" font-weight="bold""#, &title)?;
            legend(svg, decades.is_some(), removable)?;
            for (i, layer) in self.layers.iter().enumerate() {
                layer.draw(svg, TOP + panel * i as f64, decades)?;
            }
            Ok(())
        })
        .unwrap_or_default()
    }
}

/// What colours and marks mean, in a line.
fn legend(svg: &mut String, energies: bool, removable: bool) -> std::fmt::Result {
    let y = 60.0;
    let mut x = LEFT;
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
    /// Draws the layer below `y`, with its energies where there are any.
    fn draw(&self, svg: &mut String, y: f64, decades: Option<Decades>) -> std::fmt::Result {
        let bytes: usize = self.bytes.iter().map(|b| b.1).sum();
        let name = format!("{}, {} x {}, {bytes} bytes", self.name, self.shape.0, self.shape.1);
        text(svg, LEFT, y + 17.0, r#"font-size="14""#, &name)?;
        let mut rows: Vec<&Row> = self.rows.iter().collect();
        let energy = |row: &Row| row.reasons.map_or(0.0, |r| r.energy);
        // Stable: without energies rows stay as they are.
        rows.sort_by(|a, b| energy(b).total_cmp(&energy(a)));
        let across = (WIDTH - LEFT - RIGHT) / rows.len().max(1) as f64;
        let mut strip = y + NAME;
        if let Some(decades) = decades {
            energies(svg, &rows, across, strip, decades)?;
            strip += ENERGIES;
        }
        let mut from = 0;
        for run in rows.chunk_by(|a, b| a.width == b.width) {
            let x = LEFT + across * from as f64;
            swatch(svg, x, strip, across * run.len() as f64, STRIP, colour(run[0].width))?;
            from += run.len();
        }
        let (right, below) = (WIDTH - RIGHT, strip + STRIP);
        writeln!(
            svg,
            r##"<rect x="{LEFT}" y="{strip:.1}" width="{}" height="{STRIP}" fill="none" stroke="#888"/>"##,
            right - LEFT
        )?;
        let order = match decades {
            Some(_) => "rows, most energy first",
            None => "rows in the order of the output",
        };
        text(svg, LEFT, below + 17.0, "", "1")?;
        text(svg, 0.5 * (LEFT + right), below + 17.0, r#"text-anchor="middle""#, order)?;
        text(svg, right, below + 17.0, r#"text-anchor="end""#, &rows.len().to_string())
    }
}

/// The line of the rows' energies and the points of their removals, in the frame below `y`.
fn energies(svg: &mut String, rows: &[&Row], across: f64, y: f64, decades: Decades) -> std::fmt::Result {
    let right = WIDTH - RIGHT;
    let at = |value: f64| y + ENERGIES * decades.share(value);
    // Labels of neighbouring decades would touch where there are many.
    let every = if decades.top - decades.floor > 5 { 2 } else { 1 };
    for decade in decades.floor..=decades.top {
        let line = at(10f64.powi(decade));
        writeln!(svg, r##"<path d="M{LEFT} {line:.1}H{right}" stroke="#d0d0d0"/>"##)?;
        if (decades.top - decade) % every == 0 {
            text(svg, LEFT - 10.0, line + 4.5, r#"text-anchor="end""#, &decade_label(decade))?;
        }
    }
    let mut path = String::new();
    for (i, row) in rows.iter().enumerate() {
        let Some(reasons) = row.reasons else { continue };
        let x = LEFT + across * (i as f64 + 0.5);
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
        r##"<rect x="{LEFT}" y="{y:.1}" width="{}" height="{ENERGIES}" fill="none" stroke="#888"/>"##,
        right - LEFT
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn decades_hold_the_values_and_end_at_a_floor() {
        let decades = Decades::around([0.0, 2e-3, 0.5].into_iter()).expect("values above 0");
        assert_eq!((decades.top, decades.floor), (0, -3));
        assert_eq!((decades.share(1.0), decades.share(1e-3), decades.share(0.0)), (0.0, 1.0, 1.0));
        assert!(decades.share(0.5) < decades.share(2e-3), "larger values stand higher");
        // A value far below the others must not flatten them.
        let deep = Decades::around([1e-30, 3.0].into_iter()).expect("values above 0");
        assert_eq!((deep.top, deep.floor), (1, 1 - DECADES));
        assert!(Decades::around([0.0].into_iter()).is_none());
        let one = Decades::around([1.0].into_iter()).expect("a value above 0");
        assert_eq!((one.top, one.floor), (0, -1));
    }
}
