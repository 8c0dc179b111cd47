//! A value's operations, one after the other.

use std::f32::consts::TAU;

use actq::error::{Result, bail};
use actq::graph::lowering::{Slice, StepData};
use actq_kernels::image::OpKind;
use actq_kernels::math::Function;

use super::operations::{Operations, words};
use crate::description::{Fill, First, History, Op, Orientation};
use crate::plan::{Arg, PlannedOp};

/// Adding this to a number below 2^22 and subtracting it again rounds to an integer.
const ROUND: f32 = 12_582_912.0;

/// A value under construction.
pub(super) struct Chain {
    value: Slice,
    /// Nothing else reads the value, so that an operation may overwrite it.
    is_writable: bool,
    /// Pending scale and offset.
    affine: Option<Affine>,
}

/// `(x - mean) * scale`
struct Affine {
    mean: Vec<f64>,
    scale: Vec<f64>,
}

/// Repeats a single number.
fn each(numbers: &[f64], len: usize) -> Vec<f64> {
    if numbers.len() == 1 { vec![numbers[0]; len] } else { numbers.to_vec() }
}

fn single(numbers: &[f64]) -> Vec<f32> {
    numbers.iter().map(|number| *number as f32).collect()
}

impl Chain {
    pub(super) fn of(value: Slice) -> Self {
        Self { value, is_writable: false, affine: None }
    }

    pub(super) fn len(&self) -> usize {
        self.value.len
    }

    /// Emits the pending scale and offset; returns the value.
    pub(super) fn end(mut self, to: &mut Operations) -> Slice {
        self.flush(to)
    }

    /// Emits or notes an operation; `operands` are the values that it reads beside this one.
    pub(super) fn step(&mut self, to: &mut Operations, step: &PlannedOp, operands: &[Slice]) -> Result<()> {
        let len = self.len();
        match (step, operands) {
            (Op::Add(Arg::Numbers(numbers)), _) => {
                self.shift(to, &numbers.iter().map(|number| -number).collect::<Vec<_>>());
            }
            (Op::Subtract(Arg::Numbers(numbers)), _) => self.shift(to, numbers),
            (Op::Scale(Arg::Numbers(numbers)), _) => self.scale(numbers),
            (Op::Divide(Arg::Numbers(numbers)), _) => {
                self.scale(&numbers.iter().map(|number| 1.0 / number).collect::<Vec<_>>());
            }
            (Op::Add(_), [other]) => {
                let value = self.make_writable(to);
                to.with(OpKind::Add, value, *other);
            }
            (Op::Subtract(_), [other]) => {
                let negative = to.times(*other, -1.0);
                let value = self.make_writable(to);
                to.with(OpKind::Add, value, negative);
            }
            (Op::Scale(_), [other]) => {
                let value = self.make_writable(to);
                to.with(OpKind::Mul, value, *other);
            }
            (Op::Clip(limits), _) => self.clip(to, limits, operands),
            (Op::Select(places), _) => {
                let value = self.flush(to);
                self.replace(to.select(value, places));
            }
            (Op::Place(places), _) => {
                let value = self.flush(to);
                let mut from = vec![0; len];
                places.iter().enumerate().for_each(|(i, place)| from[*place] = i);
                self.replace(to.select(value, &from));
            }
            (Op::Wrap, _) => {
                // x - tau * round(x / tau)
                let (zero, one) = (vec![0.0; len], vec![1.0; len]);
                let value = self.make_writable(to);
                let turns = to.normalize(value, &zero, &vec![1.0 / TAU; len], f32::INFINITY);
                let turns = to.normalize(turns, &vec![-ROUND; len], &one, f32::INFINITY);
                let turns = to.normalize(turns, &vec![ROUND; len], &vec![-TAU; len], f32::INFINITY);
                to.with(OpKind::Add, value, turns);
            }
            (Op::Sin, _) => self.function(to, Function::Sin),
            (Op::Cos, _) => self.function(to, Function::Cos),
            (Op::Norm, _) => {
                // The sum of x * x / |x|.
                let value = self.flush(to);
                let copy = to.writable_copy(value);
                let parts = direction(to, copy);
                to.with(OpKind::Mul, parts, value);
                let sum = Slice { len: 1, ..parts };
                for i in 1..len {
                    to.with(OpKind::Add, sum, Slice { offset: parts.offset + i, len: 1, ..parts });
                }
                self.replace(sum);
            }
            (Op::Gravity(orientation), _) => {
                let value = self.flush(to);
                let gravity = gravity(to, *orientation, value);
                self.replace(gravity);
            }
            (Op::History(history), _) => {
                let value = self.flush(to);
                let frames = frames(to, history, value);
                self.replace(frames);
            }
            (Op::Divide(_), _) => bail!("an image cannot divide by a value; compute it in the application"),
            (Op::Add(_) | Op::Subtract(_) | Op::Scale(_), _) => bail!("an operand is missing"),
        }
        Ok(())
    }

    fn replace(&mut self, value: Slice) {
        // It may be a part of what others read.
        (self.value, self.is_writable) = (value, false);
    }

    fn flush(&mut self, to: &mut Operations) -> Slice {
        if let Some(Affine { mean, scale }) = self.affine.take()
            && (mean.iter().any(|mean| *mean != 0.0) || scale.iter().any(|scale| *scale != 1.0))
        {
            self.value = to.normalize(self.value, &single(&mean), &single(&scale), f32::INFINITY);
            self.is_writable = true;
        }
        self.value
    }

    /// Copies the value if others read it; returns a value that may be overwritten.
    fn make_writable(&mut self, to: &mut Operations) -> Slice {
        let value = self.flush(to);
        if !self.is_writable {
            (self.value, self.is_writable) = (to.writable_copy(value), true);
        }
        self.value
    }

    fn function(&mut self, to: &mut Operations, function: Function) {
        let value = self.make_writable(to);
        to.emit(OpKind::Function(function), value, None, None, StepData::None);
    }

    fn affine(&mut self) -> &mut Affine {
        let len = self.len();
        self.affine.get_or_insert_with(|| Affine { mean: vec![0.0; len], scale: vec![1.0; len] })
    }

    fn scale(&mut self, numbers: &[f64]) {
        let numbers = each(numbers, self.len());
        self.affine().scale.iter_mut().zip(numbers).for_each(|(scale, number)| *scale *= number);
    }

    /// Subtracts numbers.
    fn shift(&mut self, to: &mut Operations, numbers: &[f64]) {
        let numbers = each(numbers, self.len());
        // A mean beyond f32, as that of a scale of 0, is no mean.
        let is_mean = |(scale, number): (&f64, &f64)| (number / scale).abs() < 1e30;
        if self.affine.as_ref().is_some_and(|affine| !affine.scale.iter().zip(&numbers).all(is_mean)) {
            self.flush(to);
        }
        let Affine { mean, scale } = self.affine();
        for ((mean, scale), number) in mean.iter_mut().zip(scale).zip(numbers) {
            *mean += number / *scale;
        }
    }

    fn clip(&mut self, to: &mut Operations, limits: &[Arg; 2], operands: &[Slice]) {
        let len = self.len();
        if let [Arg::Numbers(low), Arg::Numbers(high)] = limits
            && let ([low], [high]) = (&low[..], &high[..])
            && *low == -high
            && *high > 0.0
        {
            let Affine { mean, scale } = self.affine();
            let (mean, scale) = (single(mean), single(scale));
            self.affine = None;
            self.value = to.normalize(self.value, &mean, &scale, *high as f32);
            self.is_writable = true;
            return;
        }
        let mut operands = operands.iter().copied();
        let [low, high] = limits.each_ref().map(|limit| match limit {
            Arg::Numbers(numbers) => to.constant(&single(&each(numbers, len))),
            Arg::Value(_) => operands.next().unwrap_or(self.value),
        });
        // An operation takes no two operands of the same memory.
        let high = if low.overlaps(high) { to.writable_copy(high) } else { high };
        let value = self.make_writable(to);
        to.emit(OpKind::Clip, value, Some(low), Some(high), StepData::None);
    }
}

/// Divides a vector by its Euclidean norm, in place.
fn direction(to: &mut Operations, vector: Slice) -> Slice {
    // An RMS norm divides by the norm over the root of the length.
    let weight = 1.0 / (vector.len as f32).sqrt();
    let mut constants = vec![f32::MIN_POSITIVE];
    constants.extend(std::iter::repeat_n(weight, vector.len));
    to.emit(OpKind::RmsNorm, vector, None, None, StepData::Constants(constants));
    vector
}

/// Computes the direction of gravity, as [`crate::run`] does.
fn gravity(to: &mut Operations, orientation: Orientation, value: Slice) -> Slice {
    let infinity = f32::INFINITY;
    let product = |to: &mut Operations, a: [Slice; 2], places: [[usize; 3]; 2]| {
        let [first, second] = [0, 1].map(|i| to.select(a[i], &places[i]));
        let product = to.writable_copy(first);
        to.with(OpKind::Mul, product, second);
        product
    };
    let [w, x, y, z] = match orientation {
        Orientation::Wxyz => [0, 1, 2, 3],
        Orientation::Xyzw => [3, 0, 1, 2],
        Orientation::Rpy => {
            // (sin p, -sin r cos p, -cos r cos p), of the sines of r and p and then their cosines.
            let mut waves = Vec::new();
            for function in [Function::Sin, Function::Cos] {
                let angles = to.writable_copy(Slice { len: 2, ..value });
                to.emit(OpKind::Function(function), angles, None, None, StepData::None);
                waves.push(angles);
            }
            waves.push(to.constant(&[1.0]));
            let all = to.concatenated(&waves);
            let product = product(to, [all, all], [[1, 0, 2], [4, 3, 3]]);
            return to.normalize(product, &[0.0; 3], &[1.0, -1.0, -1.0], infinity);
        }
    };
    // 2 (wy - xz), -2 (yz + wx), 2 (xx + yy) - 1
    let orientation = to.orientation(value);
    let unit = direction(to, orientation);
    let first = product(to, [unit, unit], [[w, y, x], [y, z, x]]);
    let second = product(to, [unit, unit], [[x, w, y], [z, x, y]]);
    let first = to.normalize(first, &[0.0, 0.0, 0.5], &[2.0, -2.0, 2.0], infinity);
    let second = to.normalize(second, &[0.0; 3], &[-2.0, -2.0, 2.0], infinity);
    to.with(OpKind::Add, first, second);
    first
}

/// Puts the frames of several ticks one after the other.
fn frames(to: &mut Operations, history: &History, frame: Slice) -> Slice {
    let newest = usize::from(!history.current);
    let slots = ((history.length - 1) * history.stride + newest).max(1);
    let flags = usize::from(history.first == First::Newest) | usize::from(history.fill == Fill::First) << 1;
    let (frames, ring) = (to.value(history.length * frame.len), to.state(slots * frame.len + 1));
    let sizes = words(&[frame.len, slots, history.length, history.stride, newest, flags]);
    to.emit(OpKind::History, frames, Some(frame), Some(ring), StepData::Words(sizes));
    frames
}
