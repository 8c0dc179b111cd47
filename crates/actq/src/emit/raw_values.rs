//! Raw values for a self-test: within the ranges of their inputs, and orientations where operations need them.

use actq_kernels::PortKind;
use actq_kernels::image::OpKind;

use crate::around::Around;
use crate::graph::lowering::{Slice, Step, StepData};
use crate::random::Random;

/// Attempts to draw a quaternion within its range.
const ATTEMPTS: usize = 64;

/// A raw value that an operation reads as `(raw - offset) / factor`.
#[derive(Clone, Copy)]
struct Read {
    raw: usize,
    factor: f32,
    offset: f32,
}

/// Draws the raw values of some steps: from -1 to 1, or as near as their range allows. From the tenth on, all but
/// quaternions are 0 in every fifth step if `has_zeros`, or the nearest in their range.
pub fn raw_values(around: &Around, random: &mut Random, steps: usize, has_zeros: bool) -> Vec<Vec<f32>> {
    let inputs = around.ports.iter().filter(|port| port.kind == PortKind::Input);
    let mut ranges: Vec<[f32; 2]> = inputs.flat_map(|port| vec![port.range; port.len]).collect();
    ranges.resize(around.raw_len(), [f32::NEG_INFINITY, f32::INFINITY]);
    let quaternions = quaternions(around);
    let draw = |step: usize| {
        let mut values: Vec<f32> = ranges.iter().map(|range| within(*range, random.unit())).collect();
        if has_zeros && step >= 10 && step.is_multiple_of(5) {
            values.iter_mut().zip(&ranges).for_each(|(value, [low, high])| *value = 0f32.max(*low).min(*high));
        }
        for quaternion in &quaternions {
            for _ in 0..ATTEMPTS {
                let q = [0; 4].map(|_| random.unit());
                let length = q.iter().map(|x| x * x).sum::<f32>().sqrt();
                if length < 0.1 {
                    continue;
                }
                let raw = |(read, x): (&Read, f32)| (read.raw, x / length * read.factor + read.offset);
                let raw: Vec<_> = quaternion.iter().zip(q).map(raw).collect();
                raw.iter().for_each(|(i, x)| values[*i] = *x);
                if raw.iter().all(|(i, x)| (ranges[*i][0]..=ranges[*i][1]).contains(x)) {
                    break;
                }
            }
        }
        values
    };
    (0..steps).map(draw).collect()
}

/// Moves a number from -1 to 1 into a range, which is at most 2 wide then.
fn within([low, high]: [f32; 2], unit: f32) -> f32 {
    if low <= -1.0 && high >= 1.0 {
        return unit;
    }
    let width = (high - low).min(2.0);
    let first = (-1f32).max(low).min(high - width);
    (first + (unit + 1.0) / 2.0 * width).clamp(low, high)
}

/// Finds the raw values of each quaternion that must be an orientation. Those of a quaternion that is computed of
/// others are not found.
fn quaternions(around: &Around) -> Vec<[Read; 4]> {
    let steps: Vec<&Step<Slice>> = around.before.iter().chain(&around.after).collect();
    let found = steps.iter().enumerate().filter_map(|(i, step)| {
        let (OpKind::Select, StepData::Words(words), Some(src)) = (step.kind, &step.data, step.src) else {
            return None;
        };
        let reads = (words[0] >> 16 == 1).then(|| [0, 1, 2, 3].map(|e| read(&steps[..i], src.buffer, src.offset + e)));
        reads.filter(|reads| reads.iter().all(Option::is_some)).map(|reads| reads.map(Option::unwrap))
    });
    found.collect()
}

/// Follows a value back to the raw value that it is a copy or a scaled copy of.
fn read(steps: &[&Step<Slice>], mut buffer: usize, mut at: usize) -> Option<Read> {
    let (mut factor, mut offset) = (1.0, 0.0);
    for step in steps.iter().rev() {
        let Some(i) = at.checked_sub(step.dst.offset).filter(|i| step.dst.buffer == buffer && *i < step.dst.len) else {
            continue;
        };
        let mut place = i;
        match (step.kind, &step.data) {
            (OpKind::Copy, _) => {}
            (OpKind::Select, StepData::Words(words)) => {
                let half = 2 + i;
                place = (words[half / 2] >> (16 * (half % 2)) & 0xffff) as usize;
            }
            (OpKind::Normalize { .. }, StepData::Constants(constants)) => {
                let [mean, scale] = [2 + i, 2 + step.dst.len + i].map(|c| constants[c]);
                (factor, offset) = (factor / scale, offset / scale + mean);
            }
            // It limits in place.
            (OpKind::Clip, _) => continue,
            _ => return None,
        }
        let src = step.src?;
        (buffer, at) = (src.buffer, src.offset + place);
    }
    (buffer == 0).then_some(Read { raw: at, factor, offset })
}

#[cfg(test)]
mod tests {
    use super::within;

    #[test]
    fn values_stay_within_their_range() {
        for unit in [-1.0, -0.3, 0.0, 0.999] {
            assert_eq!(within([f32::NEG_INFINITY, f32::INFINITY], unit), unit);
            for [low, high] in [[0.0, f32::INFINITY], [5.0, 5.5], [f32::NEG_INFINITY, -3.0], [-0.5, 100.0]] {
                let value = within([low, high], unit);
                assert!((low..=high).contains(&value) && value.abs() <= 5.5, "{value} of {low} to {high}");
            }
        }
        assert_eq!([-1.0, 1.0].map(|unit| within([5.0, 5.5], unit)), [5.0, 5.5]);
    }
}
