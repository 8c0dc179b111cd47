//! A power stage without hardware, for emulated boards and for tests.

use core::convert::Infallible;

use embedded_hal::pwm::{ErrorType, SetDutyCycle};

use crate::hal::Stage;

/// A power stage that only stores its settings. `TOP` is the duty cycle of a switch that is always on.
#[derive(Debug, Default)]
pub struct NoStage<const TOP: u16> {
    phases: [NoPhase<TOP>; 3],
    /// `true` if the stage is enabled.
    pub on: bool,
    /// `true` if the break input is active.
    pub broken: bool,
}

impl<const TOP: u16> NoStage<TOP> {
    /// Returns the phases' duty cycles, from 0 to `TOP`.
    pub fn duties(&self) -> [u16; 3] {
        self.phases.each_ref().map(|phase| phase.0)
    }
}

/// A phase of [`NoStage`].
#[derive(Debug, Default)]
pub struct NoPhase<const TOP: u16>(u16);

impl<const TOP: u16> ErrorType for NoPhase<TOP> {
    type Error = Infallible;
}

impl<const TOP: u16> SetDutyCycle for NoPhase<TOP> {
    fn max_duty_cycle(&self) -> u16 {
        TOP
    }

    fn set_duty_cycle(&mut self, duty: u16) -> Result<(), Infallible> {
        self.0 = duty;
        Ok(())
    }
}

impl<const TOP: u16> Stage for NoStage<TOP> {
    type Phase = NoPhase<TOP>;

    fn phases(&mut self) -> &mut [NoPhase<TOP>; 3] {
        &mut self.phases
    }

    fn enable(&mut self) -> bool {
        self.on = !self.broken;
        self.on
    }

    fn is_on(&mut self) -> bool {
        self.on
    }

    fn is_broken(&mut self) -> bool {
        self.broken
    }

    fn disable(&mut self) {
        self.on = false;
    }

    fn currents(&mut self) -> Option<[u16; 2]> {
        None
    }
}
