//! What the tick tells the power stage: each of the first axes commands a half bridge, whose duty cycle is the value's place between the
//! limits. What a motor needs instead, as the current loop `actq_controller::foc`, has its place here.

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

    /// Tells the outputs of a tick; false where the stage is off and should not be. One switch is for all bridges: one axis that
    /// coasts lets all of them coast.
    pub fn tell(&mut self, outputs: &[Output], axes: &[Axis]) -> bool {
        let phases = self.stage.phases();
        if outputs.iter().take(phases.len()).any(|output| *output == Output::Coast) {
            self.stage.disable();
            self.on = false;
            return true;
        }
        let mut told = true;
        for ((phase, output), axis) in phases.iter_mut().zip(outputs).zip(axes) {
            let share = match output {
                Output::Drive(value) => (value - axis.low()) / (axis.high() - axis.low()),
                // The lower switches are on.
                Output::Brake | Output::Coast => 0.0,
            };
            // A share that is none, of an axis without a way, becomes 0; one above 1 is cut.
            let duty = (share * f32::from(phase.max_duty_cycle())) as u16;
            told &= phase.set_duty_cycle(duty.min(phase.max_duty_cycle())).is_ok();
        }
        // It is switched on once: what a break has switched off stays off until the controller was disarmed.
        let on = if self.on { self.stage.is_on() } else { self.stage.enable() };
        self.on = true;
        told && on
    }
}

#[cfg(test)]
mod tests {
    use core::convert::Infallible;

    use actq_controller::SafeAction;
    use embedded_hal::pwm::{ErrorType, SetDutyCycle};

    use super::*;

    #[derive(Default)]
    struct Phase(u16);

    impl ErrorType for Phase {
        type Error = Infallible;
    }

    impl SetDutyCycle for Phase {
        fn max_duty_cycle(&self) -> u16 {
            1000
        }

        fn set_duty_cycle(&mut self, duty: u16) -> Result<(), Infallible> {
            self.0 = duty;
            Ok(())
        }
    }

    #[derive(Default)]
    struct Mock {
        phases: [Phase; 3],
        on: bool,
    }

    impl Stage for Mock {
        type Phase = Phase;

        fn phases(&mut self) -> &mut [Phase; 3] {
            &mut self.phases
        }

        fn enable(&mut self) -> bool {
            self.on = true;
            true
        }

        fn is_on(&mut self) -> bool {
            self.on
        }

        fn disable(&mut self) {
            self.on = false;
        }

        fn currents(&mut self) -> Option<[u16; 2]> {
            None
        }
    }

    #[test]
    fn a_duty_cycle_is_the_place_between_the_limits() {
        let axis = Axis::new(-1.0, 3.0, 1.0, 0.0, SafeAction::Brake).expect("it fits");
        let (axes, mut bridges) = ([axis; 4], Bridges::new(Mock::default()));
        let duties = |bridges: &Bridges<Mock>| bridges.stage.phases.each_ref().map(|phase| phase.0);
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
