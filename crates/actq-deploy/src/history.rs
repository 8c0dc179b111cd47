//! Frames of several ticks.

use std::collections::VecDeque;

use crate::description::{Fill, First, History};

/// The frames that a history needs, oldest first.
#[derive(Clone, Debug)]
pub(crate) struct Frames {
    spec: History,
    frames: VecDeque<Vec<f64>>,
}

impl Frames {
    pub(crate) fn new(spec: History) -> Self {
        Self { spec, frames: VecDeque::new() }
    }

    pub(crate) fn reset(&mut self) {
        self.frames.clear();
    }

    /// Takes this tick's frame; returns the history as one vector.
    pub(crate) fn step(&mut self, frame: &[f64]) -> Vec<f64> {
        let depth = (self.spec.length - 1) * self.spec.stride + 1;
        let kept = depth + usize::from(!self.spec.current);
        if self.frames.is_empty() {
            let fill = if self.spec.fill == Fill::First { frame.to_vec() } else { vec![0.0; frame.len()] };
            self.frames = vec![fill; kept].into();
        }
        self.frames.pop_front();
        self.frames.push_back(frame.to_vec());
        let oldest_first = self.frames.iter().take(depth).step_by(self.spec.stride);
        match self.spec.first {
            First::Oldest => oldest_first.flatten().copied().collect(),
            First::Newest => oldest_first.rev().flatten().copied().collect(),
        }
    }
}

/// Returns the ticks between now and each frame of a history, in its order.
pub(crate) fn ages(spec: &History) -> Vec<usize> {
    let newest = usize::from(!spec.current);
    let newest_first = (0..spec.length).map(|i| newest + i * spec.stride);
    match spec.first {
        First::Oldest => newest_first.rev().collect(),
        First::Newest => newest_first.collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn run(spec: History, ticks: usize) -> Vec<f64> {
        let mut frames = Frames::new(spec);
        (1..=ticks).map(|t| frames.step(&[t as f64])).last().unwrap_or_default()
    }

    #[test]
    fn histories_hold_the_frames_that_their_description_says() {
        let plain = History { length: 3, stride: 1, first: First::Oldest, fill: Fill::Zero, current: true };
        let cases: [(&str, History, usize, &[f64]); 7] = [
            ("zero fill", plain, 1, &[0.0, 0.0, 1.0]),
            ("first-frame fill", History { fill: Fill::First, ..plain }, 1, &[1.0, 1.0, 1.0]),
            ("oldest first", plain, 5, &[3.0, 4.0, 5.0]),
            ("newest first", History { first: First::Newest, ..plain }, 5, &[5.0, 4.0, 3.0]),
            ("stride", History { stride: 2, ..plain }, 6, &[2.0, 4.0, 6.0]),
            ("without this tick", History { current: false, ..plain }, 5, &[2.0, 3.0, 4.0]),
            ("without this tick, at first", History { current: false, fill: Fill::First, ..plain }, 1, &[1.0; 3]),
        ];
        for (name, spec, ticks, expected) in cases {
            assert_eq!(run(spec, ticks), expected, "{name}");
            let newest = ticks as f64;
            if ticks > 4 {
                let by_age: Vec<f64> = ages(&spec).iter().map(|age| newest - *age as f64).collect();
                assert_eq!(by_age, expected, "{name}: ages");
            }
        }
    }
}
