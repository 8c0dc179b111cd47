//! What the tick tells the power stage: each of the first axes commands a half bridge, whose duty cycle is the value's
//! place between the limits. What a motor needs instead is in `motor.rs`.

use actq_boards::seams::Stage;
use actq_controller::{Axis, Output};
use embedded_hal::pwm::SetDutyCycle as _;

/// A power stage, and whether it was switched on.
#[derive(Debug)]
pub struct Bridges<S> {
    stage: S,
    on: bool,
}

impl<S: Stage> Bridges<S> {
    /// Of a stage that is off.
    pub const fn new(stage: S) -> Self {
        Self { stage, on: false }
    }

    /// Tells the outputs of a tick; false where the stage is off and should not be. One switch is for all bridges: one
    /// axis that coasts lets all of them coast.
    pub fn tell(&mut self, outputs: &[Output], axes: &[Axis]) -> bool {
        let mut shares = [0.0; 3];
        for ((place, output), axis) in shares.iter_mut().zip(outputs).zip(axes) {
            *place = match output {
                Output::Drive(value) => share(*value, axis),
                // The lower switches are on.
                Output::Brake => 0.0,
                Output::Coast => {
                    self.coast();
                    return true;
                }
            };
        }
        self.drive(shares)
    }

    /// Switches all bridges off.
    pub(crate) fn coast(&mut self) {
        self.stage.disable();
        self.on = false;
    }

    /// Gives the bridges these duty cycles, 0 to 1; false where the stage is off and should not be.
    pub(crate) fn drive(&mut self, duties: [f32; 3]) -> bool {
        let mut told = true;
        for (phase, duty) in self.stage.phases().iter_mut().zip(duties) {
            // One that is NaN becomes 0; one above 1 is cut.
            let most = phase.max_duty_cycle();
            told &= phase.set_duty_cycle(((duty * f32::from(most)) as u16).min(most)).is_ok();
        }
        // It is switched on once: what a break has switched off stays off until the controller was disarmed.
        let on = if self.on { self.stage.is_on() } else { self.stage.enable() };
        self.on = true;
        told && on
    }

    #[cfg(all(test, feature = "foc"))]
    pub(crate) fn stage(&self) -> &S {
        &self.stage
    }
}

/// The place of a value between its axis' limits, 0 to 1; of an axis without a way, NaN.
pub(crate) fn share(value: f32, axis: &Axis) -> f32 {
    (value - axis.low()) / (axis.high() - axis.low())
}

#[cfg(test)]
mod tests {
    extern crate std;

    use std::io::ErrorKind;

    use actq_boards::no_stage::NoStage;
    use actq_controller::SafeAction;
    use embedded_hal_mock::eh1::MockError;
    use embedded_hal_mock::eh1::pwm::{Mock as Phase, Transaction};

    use super::*;

    type Mock = NoStage<1000>;

    /// A power stage that is always on, of phases that know what they will be told.
    struct Told([Phase; 3]);

    impl Stage for Told {
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

        fn disable(&mut self) {}

        fn currents(&mut self) -> Option<[u16; 2]> {
            None
        }
    }

    /// The others get theirs all the same: what follows is the machine's decision.
    #[test]
    fn a_phase_that_does_not_take_its_duty_cycle_is_a_fault() {
        let axis = Axis::new(0.0, 1.0, 1.0, 0.0, SafeAction::Brake).expect("it fits");
        for failing in [None, Some(0), Some(1), Some(2)] {
            let mut phase = 0;
            let phases = [100, 200, 300].map(|duty| {
                let told = Transaction::set_duty_cycle(duty);
                let refused = MockError::Io(ErrorKind::NotConnected);
                let told = if failing == Some(phase) { told.with_error(refused) } else { told };
                phase += 1;
                Phase::new(&[Transaction::max_duty_cycle(400), told])
            });
            let mut bridges = Bridges::new(Told(phases));
            assert_eq!(bridges.tell(&[0.25, 0.5, 0.75].map(Output::Drive), &[axis; 3]), failing.is_none());
            bridges.stage.0.iter_mut().for_each(Phase::done);
        }
    }

    #[test]
    fn a_duty_cycle_is_the_place_between_the_limits() {
        let axis = Axis::new(-1.0, 3.0, 1.0, 0.0, SafeAction::Brake).expect("it fits");
        let (axes, mut bridges) = ([axis; 4], Bridges::new(Mock::default()));
        let duties = |bridges: &Bridges<Mock>| bridges.stage.duties();
        assert!(bridges.tell(&[-1.0, 0.0, 3.0, 2.0].map(Output::Drive), &axes));
        assert_eq!((duties(&bridges), bridges.stage.on), ([0, 250, 1000], true));
        assert!(bridges.tell(&[Output::Drive(1.0), Output::Brake, Output::Drive(f32::NAN), Output::Coast], &axes));
        assert_eq!((duties(&bridges), bridges.stage.on), ([500, 0, 0], true));
        assert!(bridges.tell(&[Output::Drive(0.0), Output::Coast, Output::Brake, Output::Brake], &axes));
        assert!(!bridges.stage.on);
    }

    #[test]
    fn what_a_break_has_switched_off_stays_off_until_disarmed() {
        let mut bridges = Bridges::new(Mock::default());
        let axes = [Axis::STILL; 3];
        let outputs = [Output::Brake; 3];
        assert!(bridges.tell(&outputs, &axes));
        bridges.stage.on = false;
        assert!(!bridges.tell(&outputs, &axes) && !bridges.stage.on);
        assert!(bridges.tell(&[Output::Coast; 3], &axes) && bridges.tell(&outputs, &axes) && bridges.stage.on);
    }
}
