//! An axis of a plot: its scale, its range, its ticks.

use super::drawing::decade_label;

/// Ratio of the largest value to the smallest from which a horizontal axis is logarithmic.
const WIDE: f64 = 5.0;
/// Ratio below which it has more labels in a decade.
const DENSE: f64 = 15.0;
/// Space between the outermost points and the ends of a logarithmic axis, in decades.
const SPACE: f64 = 0.08;

/// Scale of the vertical axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Vertical {
    /// Logarithmic, in decades around the points, which are above 0.
    Decades,
    /// Linear, from 0 to 100.
    Percent,
}

/// A line of the grid.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Tick {
    /// Its value.
    pub(super) value: f64,
    /// Its label; the lines between labels have none.
    pub(super) label: Option<String>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Scale {
    /// With a label at each multiple of the step.
    Linear { step: f64 },
    /// With a label at each power of ten.
    Decades,
    /// With labels at these multiples of a power of ten.
    Log { digits: &'static [u8] },
}

/// An axis.
#[derive(Clone, Copy, Debug)]
pub(super) struct Axis {
    scale: Scale,
    /// The ends: values, or their logarithms to base 10.
    range: (f64, f64),
    /// Places of the ends in the picture.
    pixels: (f64, f64),
}

/// Returns the least and the largest value.
fn range(values: impl Iterator<Item = f64>) -> Option<(f64, f64)> {
    values.map(|value| (value, value)).reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)))
}

impl Axis {
    /// The vertical axis around these values.
    pub(super) fn vertical(vertical: Vertical, values: impl Iterator<Item = f64>, pixels: (f64, f64)) -> Self {
        let (scale, range) = match vertical {
            Vertical::Percent => (Scale::Linear { step: 20.0 }, (0.0, 100.0)),
            Vertical::Decades => {
                let (low, high) = range(values.map(f64::log10)).unwrap_or((0.0, 1.0));
                let low = (low - SPACE).floor();
                (Scale::Decades, (low, (high + SPACE).ceil().max(low + 1.0)))
            }
        };
        Self { scale, range, pixels }
    }

    /// A horizontal axis around these values: logarithmic if they are above 0 and span a wide range, else linear.
    pub(super) fn horizontal(values: impl Iterator<Item = f64>, pixels: (f64, f64)) -> Self {
        let (low, high) = range(values).unwrap_or((0.0, 1.0));
        if low > 0.0 && high > WIDE * low {
            let digits: &[u8] = if high < DENSE * low { &[1, 2, 3, 4, 6, 8] } else { &[1, 2, 5] };
            return Self { scale: Scale::Log { digits }, range: (low.log10() - SPACE, high.log10() + SPACE), pixels };
        }
        let step = tick_step(high - low);
        // Half a step of space, so that no marker is on the frame.
        Self { scale: Scale::Linear { step }, range: (low - 0.5 * step, high + 0.5 * step), pixels }
    }

    /// Returns the place of a value.
    pub(super) fn at(&self, value: f64) -> f64 {
        let value = if matches!(self.scale, Scale::Linear { .. }) { value } else { value.log10() };
        let share = (value - self.range.0) / (self.range.1 - self.range.0);
        self.pixels.0 + (self.pixels.1 - self.pixels.0) * share
    }

    /// Returns the lines of the grid, in the order of values.
    pub(super) fn ticks(&self) -> Vec<Tick> {
        let (low, high) = self.range;
        if let Scale::Linear { step } = self.scale {
            let decimals = (-step.log10().floor()).max(0.0) as usize;
            let multiples = (low / step).ceil() as i64..=(high / step).floor() as i64;
            return multiples
                .map(|multiple| multiple as f64 * step)
                .map(|value| Tick { value, label: Some(format!("{value:.decimals$}")) })
                .collect();
        }
        let digits = (low.floor() as i32..=high.ceil() as i32).flat_map(|decade| (1..10).map(move |d| (decade, d)));
        let tick = |(decade, digit): (i32, u8)| {
            let value = f64::from(digit) * 10f64.powi(decade);
            let decimals = (-decade).max(0) as usize;
            let label = match (self.scale, digit) {
                (Scale::Decades, 1) => Some(decade_label(decade)),
                (Scale::Log { digits }, digit) if digits.contains(&digit) => Some(format!("{value:.decimals$}")),
                _ => None,
            };
            // Rounding of a logarithm must not lose the tick at an end.
            let inside = (low - 1e-9..=high + 1e-9).contains(&value.log10());
            inside.then_some(Tick { value, label })
        };
        digits.filter_map(tick).collect()
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

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(axis: &Axis) -> Vec<String> {
        axis.ticks().into_iter().filter_map(|tick| tick.label).collect()
    }

    #[test]
    fn ticks_are_round() {
        for (length, step) in [(2.0, 0.5), (1.0, 0.2), (6.0, 1.0), (10.0, 2.0), (0.0, 1.0)] {
            assert!((tick_step(length) - step).abs() < 1e-12, "{length}: {}", tick_step(length));
        }
    }

    #[test]
    fn wide_ranges_are_logarithmic() {
        let narrow = Axis::horizontal([20.0, 50.0, 80.0].into_iter(), (0.0, 100.0));
        assert_eq!(labels(&narrow), ["20", "30", "40", "50", "60", "70", "80"]);
        let wide = Axis::horizontal([0.3, 12.0].into_iter(), (0.0, 100.0));
        assert_eq!(labels(&wide), ["0.5", "1", "2", "5", "10"]);
        let dense = Axis::horizontal([19.0, 140.0].into_iter(), (0.0, 100.0));
        assert_eq!(labels(&dense), ["20", "30", "40", "60", "80", "100"]);
        let middle = wide.at((0.3f64 * 12.0).sqrt());
        assert!((middle - 50.0).abs() < 1e-9, "{middle}");
        let with_zero = Axis::horizontal([0.0, 12.0].into_iter(), (0.0, 100.0));
        assert!(labels(&with_zero).contains(&"0".to_owned()));
    }

    #[test]
    fn vertical_axes_have_whole_decades_or_percent() {
        let decades = Axis::vertical(Vertical::Decades, [0.7, 3e-4].into_iter(), (400.0, 40.0));
        assert_eq!(labels(&decades), ["1e-4", "0.001", "0.01", "0.1", "1"]);
        assert_eq!((decades.at(1e-4), decades.at(1.0)), (400.0, 40.0));
        assert!(decades.at(0.7) < decades.at(0.05), "larger values are higher");
        let percent = Axis::vertical(Vertical::Percent, [].into_iter(), (400.0, 40.0));
        assert_eq!(labels(&percent), ["0", "20", "40", "60", "80", "100"]);
        assert_eq!((percent.at(0.0), percent.at(100.0)), (400.0, 40.0));
    }
}
