//! An axis of a plot: its scale, its range, the lines of its grid.

use std::ops::Range;

use plotters::coord::ranged1d::{DefaultFormatting, KeyPointHint, Ranged};
use plotters::coord::types::RangedCoordf64;

/// Ratio of the largest value to the smallest from which a horizontal axis is logarithmic.
const WIDE: f64 = 5.0;
/// Ratio below which it has more labels in a decade.
const DENSE: f64 = 15.0;
/// Space between the outermost points and the ends of a logarithmic axis, in decades.
const SPACE: f64 = 0.08;
/// The most labels of a linear axis.
const MAX_LABELS: usize = 9;

/// Scale of the vertical axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Vertical {
    /// Logarithmic, in decades around the points, which are above 0.
    Decades,
    /// Linear, from 0 to 100.
    Percent,
}

/// An axis. The places of a logarithmic one are logarithms to base 10.
#[derive(Clone, Debug)]
pub(crate) struct Axis {
    is_log: bool,
    range: Range<f64>,
    /// Places of the grid's lines with a label, and of all of a logarithmic grid.
    bold: Vec<f64>,
    light: Vec<f64>,
}

/// Returns the least and the largest value.
fn range(values: impl Iterator<Item = f64>) -> Option<(f64, f64)> {
    values.map(|value| (value, value)).reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)))
}

impl Axis {
    /// The vertical axis around these values.
    pub(super) fn vertical(vertical: Vertical, values: impl Iterator<Item = f64>) -> Self {
        if vertical == Vertical::Percent {
            return Self::linear(0.0..100.0);
        }
        let (low, high) = range(values.map(f64::log10)).unwrap_or((0.0, 1.0));
        let low = (low - SPACE).floor();
        Self::log(low..(high + SPACE).ceil().max(low + 1.0), &[1])
    }

    /// A horizontal axis around these values: logarithmic if they are above 0 and span a wide range, else linear.
    pub(super) fn horizontal(values: impl Iterator<Item = f64>) -> Self {
        let (low, high) = range(values).unwrap_or((0.0, 1.0));
        if low > 0.0 && high > WIDE * low {
            let digits: &[u8] = if high < DENSE * low { &[1, 2, 3, 4, 6, 8] } else { &[1, 2, 5] };
            return Self::log(low.log10() - SPACE..high.log10() + SPACE, digits);
        }
        // So that no marker is on the frame.
        let space = if high > low { 0.1 * (high - low) } else { 1.0 };
        Self::linear(low - space..high + space)
    }

    fn linear(range: Range<f64>) -> Self {
        let bold = RangedCoordf64::from(range.clone()).key_points(MAX_LABELS);
        Self { is_log: false, range, bold, light: Vec::new() }
    }

    /// A logarithmic axis between two exponents of 10, with labels at these multiples of powers of 10.
    pub(crate) fn log(range: Range<f64>, digits: &[u8]) -> Self {
        let lines = |digits: &[u8]| -> Vec<f64> {
            let decades = range.start.floor() as i32..=range.end.ceil() as i32;
            let of = |decade: i32| digits.iter().map(move |digit| f64::from(decade) + f64::from(*digit).log10());
            decades.flat_map(of).filter(|at| (range.start..=range.end).contains(at)).collect()
        };
        let light = lines(&[1, 2, 3, 4, 5, 6, 7, 8, 9]);
        Self { is_log: true, bold: lines(digits), light, range }
    }

    /// Returns the place of a value in the range.
    fn place(&self, value: f64) -> f64 {
        if self.is_log { value.log10() } else { value }
    }

    /// Returns the value at a place in the range.
    fn value(&self, place: f64) -> f64 {
        if self.is_log { 10f64.powf(place) } else { place }
    }
}

impl Ranged for Axis {
    type FormatOption = DefaultFormatting;
    type ValueType = f64;

    fn map(&self, value: &f64, (from, to): (i32, i32)) -> i32 {
        let share = (self.place(*value) - self.range.start) / (self.range.end - self.range.start);
        from + (f64::from(to - from) * share).round() as i32
    }

    fn key_points<Hint: KeyPointHint>(&self, hint: Hint) -> Vec<f64> {
        let lines = if hint.weight().allow_light_points() { &self.light } else { &self.bold };
        lines.iter().map(|place| self.value(*place)).collect()
    }

    fn range(&self) -> Range<f64> {
        self.value(self.range.start)..self.value(self.range.end)
    }
}

/// Formats a value of the grid, without the digits of rounding.
pub(crate) fn label(value: &f64) -> String {
    let value: f64 = format!("{value:.6e}").parse().unwrap_or(*value);
    match value.abs() {
        tiny if tiny < 1e-9 && value.fract() == 0.0 => "0".to_owned(),
        small if small < 1e-3 => format!("{value:e}"),
        _ => value.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(axis: &Axis) -> Vec<String> {
        axis.bold.iter().map(|place| label(&axis.value(*place))).collect()
    }

    #[test]
    fn wide_ranges_are_logarithmic() {
        let narrow = Axis::horizontal([20.0, 50.0, 80.0].into_iter());
        assert_eq!(labels(&narrow), ["20", "30", "40", "50", "60", "70", "80"]);
        let wide = Axis::horizontal([0.3, 12.0].into_iter());
        assert_eq!(labels(&wide), ["0.5", "1", "2", "5", "10"]);
        let dense = Axis::horizontal([19.0, 140.0].into_iter());
        assert_eq!(labels(&dense), ["20", "30", "40", "60", "80", "100"]);
        assert!(labels(&Axis::horizontal([0.0, 12.0].into_iter())).contains(&"0".to_owned()));
    }

    #[test]
    fn vertical_axes_have_whole_decades_or_percent() {
        let decades = Axis::vertical(Vertical::Decades, [0.7, 3e-4].into_iter());
        assert_eq!(labels(&decades), ["1e-4", "0.001", "0.01", "0.1", "1"]);
        assert_eq!((decades.range.start, decades.range.end), (-4.0, 0.0));
        let percent = Axis::vertical(Vertical::Percent, [].into_iter());
        assert!(labels(&percent).starts_with(&["0".into()]) && labels(&percent).ends_with(&["100".into()]));
    }
}
