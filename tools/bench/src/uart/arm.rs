//! The arm at the controller's outputs.

use actq_controller::{Axis, SafeAction};
use actq_link::code::State;
use actq_ur3::ACT_DIM;
use actq_ur3::task::{CONTROL_HZ, Outcome, Task};

/// Ticks of the controller in a control step of the arm: 20 ms.
pub(crate) const TICKS: u32 = 1000 / CONTROL_HZ as u32;

/// Joint velocities that the outputs command. A disabled drive stands still: its brake closes.
pub(crate) struct Arm {
    pub(crate) task: Task,
    pub(crate) state: State,
    pub(crate) target: [f32; ACT_DIM],
    axes: [Axis; ACT_DIM],
    outputs: [f32; ACT_DIM],
    /// Sum of the outputs since the last control step, and number of ticks.
    driven: ([f32; ACT_DIM], u32),
}

impl Arm {
    pub(crate) fn new(axes: [Axis; ACT_DIM], seed: u64) -> Self {
        Self {
            task: Task::new(seed),
            state: State::Disarmed,
            target: [0.0; ACT_DIM],
            axes,
            outputs: [0.0; ACT_DIM],
            driven: ([0.0; ACT_DIM], 0),
        }
    }

    /// Starts another episode; the outputs keep their values.
    pub(crate) fn begin(&mut self, seed: u64) {
        self.task = Task::new(seed);
    }

    /// Starts the episode's time, and discards earlier motion.
    pub(crate) fn start(&mut self) {
        self.driven = ([0.0; ACT_DIM], 0);
    }

    /// Returns the largest output, rad/s.
    pub(crate) fn fastest(&self) -> f32 {
        self.outputs.iter().fold(0.0, |most, output| most.max(output.abs()))
    }

    /// Advances by a tick of the controller.
    pub(crate) fn tick(&mut self) {
        for ((output, axis), target) in self.outputs.iter_mut().zip(&self.axes).zip(self.target) {
            let toward = |to: f32, step: f32| *output + (to - *output).clamp(-step, step);
            *output = match (self.state, axis.safe()) {
                (State::Armed, _) => toward(target, axis.rate()),
                (State::Latched, SafeAction::Ramp { step }) => toward(0.0, step),
                (State::Latched, SafeAction::Hold) => *output,
                (State::Latched, SafeAction::Brake | SafeAction::Coast) | (State::Disarmed, _) => 0.0,
            };
        }
        self.driven.1 += 1;
        self.driven.0.iter_mut().zip(self.outputs).for_each(|(sum, output)| *sum += output);
    }

    /// Advances by a control step with the mean output of the ticks since the last one.
    pub(crate) fn step(&mut self) {
        let (sum, ticks) = std::mem::take(&mut self.driven);
        self.task.step(&sum.map(|sum| sum / ticks.max(1) as f32));
    }

    pub(crate) fn outcome(&self) -> Outcome {
        self.task.result()
    }
}
