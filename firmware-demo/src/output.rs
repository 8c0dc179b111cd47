//! The tick's outputs to the power stage: each of the first axes commands a half bridge, whose duty cycle is the
//! value's position between the limits. `motor.rs` drives a three-phase motor instead.

use actq_boards::hal::Stage;
use actq_controller::{Axis, Output};
use embedded_hal::pwm::SetDutyCycle as _;

/// A power stage.
#[derive(Debug)]
pub struct Bridges<S> {
    stage: S,
    /// It was switched on, or failed, and the outputs have not coasted since: it is not switched on again.
    on: bool,
}

impl<S: Stage> Bridges<S> {
    /// Wraps a stage that is off.
    pub const fn new(stage: S) -> Self {
        Self { stage, on: false }
    }

    /// Applies the outputs of a tick; returns `false` if the stage is off and should be on, or coasts and the break
    /// input is active, or if a value is outside its limits, which switches the stage off. All bridges share one enable:
    /// if one axis coasts, all of them do.
    pub fn apply(&mut self, outputs: &[Output], axes: &[Axis]) -> bool {
        if !outputs.iter().zip(axes).all(|(output, axis)| output.is_within(axis)) {
            return self.fail();
        }
        let mut shares = [0.0; 3];
        for ((place, output), axis) in shares.iter_mut().zip(outputs).zip(axes) {
            *place = match output {
                Output::Drive(value) => share(*value, axis),
                // The lower switches are on.
                Output::Brake => 0.0,
                Output::Coast => return self.coast(),
            };
        }
        self.drive(shares)
    }

    /// Switches all bridges off; returns `false` if the break input is active.
    pub(crate) fn coast(&mut self) -> bool {
        self.stage.disable();
        self.on = false;
        !self.stage.is_broken()
    }

    /// Switches all bridges off until the outputs coast; returns `false`.
    pub(crate) fn fail(&mut self) -> bool {
        self.stage.disable();
        self.on = true;
        false
    }

    /// Sets the bridges' duty cycles, 0 to 1; returns `false` if the stage is off and should be on.
    pub(crate) fn drive(&mut self, duties: [f32; 3]) -> bool {
        let mut accepted = true;
        for (phase, duty) in self.stage.phases().iter_mut().zip(duties) {
            // NaN becomes 0; a value above 1 is limited.
            let most = phase.max_duty_cycle();
            accepted &= phase.set_duty_cycle(((duty * f32::from(most)) as u16).min(most)).is_ok();
        }
        // It is switched on once: after a break it stays off until the controller is disarmed.
        let on = if self.on { self.stage.is_on() } else { self.stage.enable() };
        self.on = true;
        accepted && on
    }

    #[cfg(all(test, feature = "foc"))]
    pub(crate) fn stage(&mut self) -> &mut S {
        &mut self.stage
    }
}

/// Returns a value's position between its axis' limits, 0 to 1; NaN for an axis with a single value. It takes halves,
/// because the range itself may be too large for f32.
fn share(value: f32, axis: &Axis) -> f32 {
    let low = axis.low() / 2.0;
    (value / 2.0 - low) / (axis.high() / 2.0 - low)
}

#[cfg(test)]
mod tests {
    extern crate std;

    use std::io::ErrorKind;

    use actq_boards::no_stage::NoStage;
    use actq_controller::{Check, SafeAction, Safety};
    use actq_link::code::Parameter;
    use embedded_hal_mock::eh1::MockError;
    use embedded_hal_mock::eh1::pwm::{Mock as Phase, Transaction};

    use super::*;

    type Mock = NoStage<1000>;

    /// A power stage that is always on, with mock phases that expect their duty cycles.
    struct MockStage([Phase; 3]);

    impl Stage for MockStage {
        type Phase = Phase;

        fn phases(&mut self) -> &mut [Phase; 3] {
            &mut self.0
        }

        fn enable(&mut self) -> bool {
            true
        }

        fn is_on(&mut self) -> bool {
            true
        }

        fn is_broken(&mut self) -> bool {
            false
        }

        fn disable(&mut self) {}

        fn currents(&mut self) -> Option<[u16; 2]> {
            None
        }
    }

    /// The other phases still get their duty cycles: the state machine decides what follows.
    #[test]
    fn a_refused_duty_cycle_is_a_fault() {
        let axis = Axis::new(0.0, 1.0, 1.0, 0.0, SafeAction::Brake).expect("the axis is valid");
        for failing in [None, Some(0), Some(1), Some(2)] {
            let mut phase = 0;
            let phases = [100, 200, 300].map(|duty| {
                let accepted = Transaction::set_duty_cycle(duty);
                let refused = MockError::Io(ErrorKind::NotConnected);
                let expected = if failing == Some(phase) { accepted.with_error(refused) } else { accepted };
                phase += 1;
                Phase::new(&[Transaction::max_duty_cycle(400), expected])
            });
            let mut bridges = Bridges::new(MockStage(phases));
            assert_eq!(bridges.apply(&[0.25, 0.5, 0.75].map(Output::Drive), &[axis; 3]), failing.is_none());
            bridges.stage.0.iter_mut().for_each(Phase::done);
        }
    }

    #[test]
    fn duty_cycles_are_positions_between_the_limits() {
        let axis = Axis::new(-1.0, 3.0, 1.0, 0.0, SafeAction::Brake).expect("the axis is valid");
        let (axes, mut bridges) = ([axis; 4], Bridges::new(Mock::default()));
        let duties = |bridges: &Bridges<Mock>| bridges.stage.duties();
        assert!(bridges.apply(&[-1.0, 0.0, 3.0, 2.0].map(Output::Drive), &axes));
        assert_eq!((duties(&bridges), bridges.stage.on), ([0, 250, 1000], true));
        assert!(bridges.apply(&[Output::Drive(1.0), Output::Brake, Output::Drive(3.0), Output::Coast], &axes));
        assert_eq!((duties(&bridges), bridges.stage.on), ([500, 0, 1000], true));
        assert!(bridges.apply(&[Output::Drive(0.0), Output::Coast, Output::Brake, Output::Brake], &axes));
        assert!(!bridges.stage.on);
    }

    /// No controller gives such values, and a processor that has jumped may.
    #[test]
    fn values_outside_the_limits_switch_the_stage_off_until_it_coasts() {
        let axes = [Axis::new(-1.0, 3.0, 1.0, 0.0, SafeAction::Brake).expect("the axis is valid"); 4];
        for value in [f32::NAN, f32::INFINITY, -1.0 - f32::EPSILON, 3.1] {
            for axis in 0..4 {
                let mut bridges = Bridges::new(Mock::default());
                let mut outputs = [Output::Drive(0.0); 4];
                assert!(bridges.apply(&outputs, &axes) && bridges.stage.on);
                outputs[axis] = Output::Drive(value);
                assert!(!bridges.apply(&outputs, &axes) && !bridges.stage.on, "{value}");
                assert!(!bridges.apply(&[Output::Drive(0.0); 4], &axes) && !bridges.stage.on, "{value}");
                assert!(bridges.apply(&[Output::Coast; 4], &axes));
                assert!(bridges.apply(&[Output::Drive(0.0); 4], &axes) && bridges.stage.on, "{value}");
            }
        }
    }

    #[test]
    fn the_widest_limits_have_duty_cycles() {
        let axis = Axis::new(-2e38, 2e38, 1.0e38, 0.0, SafeAction::Brake).expect("the axis is valid");
        let mut bridges = Bridges::new(Mock::default());
        assert!(bridges.apply(&[-1e38, 0.0, 2e38].map(Output::Drive), &[axis; 3]));
        assert_eq!(bridges.stage.duties(), [250, 500, 1000]);
    }

    #[test]
    fn break_inputs_are_faults_while_coasting() {
        let mut bridges = Bridges::new(Mock::default());
        bridges.stage.broken = true;
        assert!(!bridges.apply(&[Output::Coast; 3], &[Axis::STILL; 3]));
        bridges.stage.broken = false;
        assert!(bridges.apply(&[Output::Coast; 3], &[Axis::STILL; 3]));
    }

    /// A host narrows the limits of the second controller: an action within both has the same duty cycle.
    #[test]
    fn stricter_limits_keep_the_meaning_of_values() {
        let axis = Axis::new(-1.0, 1.0, 2.0, 0.0, SafeAction::Ramp { step: 2.0 }).expect("the axis is valid");
        let duty = |limits: &[(Parameter, f32)], action: f32| {
            let mut safety = Safety::new([axis], 1..=100, 1);
            Check::ALL.into_iter().for_each(|check| safety.check(check, true));
            for &(parameter, value) in limits {
                safety.set(safety.token(), parameter, 0, value).expect("stricter");
            }
            safety.observed();
            safety.arm(safety.token()).expect("armed");
            safety.act(&[action]).expect("applied");
            let (outputs, mut bridges) = (safety.tick(), Bridges::new(Mock::default()));
            assert!(bridges.apply(&outputs, safety.built_axes()));
            bridges.stage.duties()[0]
        };
        let stricter = [(Parameter::Low, -0.5), (Parameter::High, 0.5)];
        for (action, wide, narrow) in [(0.25, 625, 625), (0.0, 500, 500), (1.0, 1000, 750), (-1.0, 0, 250)] {
            assert_eq!((duty(&[], action), duty(&stricter, action)), (wide, narrow), "{action}");
        }
    }

    #[test]
    fn after_a_break_outputs_stay_off_until_disarmed() {
        let mut bridges = Bridges::new(Mock::default());
        let axes = [Axis::STILL; 3];
        let outputs = [Output::Brake; 3];
        assert!(bridges.apply(&outputs, &axes));
        bridges.stage.on = false;
        assert!(!bridges.apply(&outputs, &axes) && !bridges.stage.on);
        assert!(bridges.apply(&[Output::Coast; 3], &axes) && bridges.apply(&outputs, &axes) && bridges.stage.on);
    }
}
