//! A three-phase motor in the tick: the current loop of `actq_controller::foc` drives a simulated motor, so that the
//! tick does the work of a real one. The first axis commands the current that produces torque.
//!
//! For a real motor, replace `Simulated`'s currents and sensor signals in `Motor::measure` by measured ones; the duty
//! cycles already go to the board's power stage.

use actq_boards::hal::Stage;
use actq_controller::foc::{CurrentLoop, Gains, Measured, Observer, Rotor, Stator};
use actq_controller::{Axis, Output};

use crate::output::Bridges;

/// A slow motor with a gear, which a tick of 1 kHz can also control: ohm, henry, volt second, pole pairs.
const RESISTANCE: f32 = 1.0;
const INDUCTANCE: f32 = 10e-3;
const FLUX: f32 = 0.02;
const PAIRS: f32 = 7.0;
/// In kilogram square metre, and newton metre second.
const INERTIA: f32 = 1e-3;
const FRICTION: f32 = 0.05;
/// Supply voltage in volt.
const SUPPLY: f32 = 24.0;
/// Current at the limit of an axis that is farther from 0, in ampere. A value of 0 is no current.
const CURRENT: f32 = 1.0;
/// Bandwidth of the current loop, in rad/s.
const BANDWIDTH: f32 = 300.0;
/// Bandwidth of the observer, in rad/s.
const OBSERVER_BANDWIDTH: f32 = 1000.0;
/// Ticks from a measurement to the middle of the tick in which its duty cycles act, which begins with the measurement.
const AHEAD: f32 = 0.5;

/// A power stage with its current loop and its motor.
#[derive(Debug)]
pub struct Motor<S> {
    bridges: Bridges<S>,
    observer: Observer,
    control: CurrentLoop,
    motor: Simulated,
}

impl<S: Stage> Motor<S> {
    /// Creates a motor at rest, on a stage that is off, for `tick_hz` ticks per second.
    pub fn new(stage: S, tick_hz: u32) -> Self {
        let tick = 1.0 / tick_hz as f32;
        let gains = Gains::for_motor(RESISTANCE, INDUCTANCE, BANDWIDTH, tick);
        Self {
            bridges: Bridges::new(stage),
            observer: Observer::new(OBSERVER_BANDWIDTH, tick),
            control: CurrentLoop::new(gains),
            motor: Simulated::new(tick),
        }
    }

    /// Applies the first output of a tick, as [`Bridges::apply`]; also returns `false` if the measurements are not
    /// those of a motor.
    pub fn apply(&mut self, outputs: &[Output], axes: &[Axis]) -> bool {
        // In every tick, so that the rotor's angle is known when the outputs are driven again.
        let measured = self.measure();
        let duties = match (outputs.first(), axes.first(), measured) {
            (Some(output @ Output::Drive(value)), Some(axis), Some(measured)) if output.is_within(axis) => {
                // An axis with a single value commands no current.
                let moves = axis.low() < axis.high();
                let q = if moves { value / largest(axis) * CURRENT } else { 0.0 };
                self.control.step(&measured, Rotor { d: 0.0, q }).map(|tick| tick.duties)
            }
            (Some(Output::Brake), ..) => {
                self.control.reset();
                Some([0.0; 3])
            }
            _ => None,
        };
        self.motor.run(duties);
        match duties {
            Some(duties) => self.bridges.drive(duties),
            None => {
                self.control.reset();
                if outputs.first() == Some(&Output::Coast) { self.bridges.coast() } else { self.bridges.fail() }
            }
        }
    }
}

/// Returns the largest magnitude within the limits. It compares, because `f32::max` would be a call on a Cortex-M4.
fn largest(axis: &Axis) -> f32 {
    if axis.high() > -axis.low() { axis.high() } else { -axis.low() }
}

impl<S> Motor<S> {
    fn measure(&mut self) -> Option<Measured> {
        let Simulated { current, flux, .. } = &self.motor;
        let angle = self.observer.step(flux.beta, flux.alpha, AHEAD)?;
        Some(Measured { phases: current.phases(), angle, supply: SUPPLY })
    }
}

/// A permanent-magnet synchronous motor in its stator's axes, which need no sine, integrated by explicit Euler steps of
/// a tick.
#[derive(Debug)]
struct Simulated {
    current: Stator,
    /// Unit vector along the flux: cosine and sine of the rotor's angle, the sensor's signals.
    flux: Stator,
    /// Electrical speed in rad/s.
    speed: f32,
    /// Control period in seconds.
    tick: f32,
}

impl Simulated {
    const fn new(tick: f32) -> Self {
        Self { current: Stator { alpha: 0.0, beta: 0.0 }, flux: Stator { alpha: 1.0, beta: 0.0 }, speed: 0.0, tick }
    }

    /// Simulates one tick with duty cycles; without them no current flows.
    fn run(&mut self, duties: Option<[f32; 3]>) {
        let Stator { alpha, beta } = self.flux;
        match duties.map(Stator::of_phases) {
            Some(voltage) => {
                let (by, back) = (self.tick / INDUCTANCE, self.speed * FLUX);
                self.current.alpha += by * (SUPPLY * voltage.alpha - RESISTANCE * self.current.alpha + back * beta);
                self.current.beta += by * (SUPPLY * voltage.beta - RESISTANCE * self.current.beta - back * alpha);
            }
            None => self.current = Stator::default(),
        }
        let torque = 1.5 * PAIRS * FLUX * (alpha * self.current.beta - beta * self.current.alpha);
        self.speed += self.tick / INERTIA * (PAIRS * torque - FRICTION * self.speed);
        // The angle is so small that these terms of sine and cosine suffice; the length is then normalized against
        // rounding.
        let turn = self.tick * self.speed;
        let (sin, cos) = (turn - turn * turn * turn / 6.0, 1.0 - 0.5 * turn * turn);
        let (alpha, beta) = (cos * alpha - sin * beta, sin * alpha + cos * beta);
        let length = 1.5 - 0.5 * (alpha * alpha + beta * beta);
        self.flux = Stator { alpha: length * alpha, beta: length * beta };
    }
}

#[cfg(test)]
mod tests {
    use actq_boards::no_stage::NoStage;
    use actq_controller::SafeAction;

    use super::*;

    type Mock = NoStage<1000>;

    /// Returns the motor's current along the torque axis.
    fn torque_current(motor: &Motor<Mock>) -> f32 {
        let Simulated { current, flux, .. } = &motor.motor;
        flux.alpha * current.beta - flux.beta * current.alpha
    }

    #[test]
    fn the_current_follows_the_output() {
        let axes = [Axis::new(-2.0, 2.0, 1.0, 0.0, SafeAction::Brake).expect("the axis is valid")];
        for tick_hz in [1000, 8000] {
            let mut motor = Motor::new(Mock::default(), tick_hz);
            for (value, current) in [(1.0, 0.5), (-2.0, -1.0), (0.0, 0.0)] {
                for _ in 0..tick_hz / 2 {
                    assert!(motor.apply(&[Output::Drive(value)], &axes));
                }
                assert!((torque_current(&motor) - current).abs() < 0.03, "{tick_hz} Hz: {}", torque_current(&motor));
                // Friction balances the torque.
                let speed = PAIRS * 1.5 * PAIRS * FLUX * current / FRICTION;
                assert!((motor.motor.speed - speed).abs() < 1.0, "{tick_hz} Hz: {} of {speed}", motor.motor.speed);
            }
            let Stator { alpha, beta } = motor.motor.flux;
            let (sin, cos) = motor.observer.step(beta, alpha, 0.0).expect("a turning magnet").sin_cos();
            assert!((cos - alpha).abs() < 4e-3 && (sin - beta).abs() < 4e-3, "the observer lost the rotor");
        }
    }

    #[test]
    fn zero_is_no_current_whatever_the_limits() {
        for (low, high, half) in [(0.0, 1.0, 0.5f32), (-0.5, 2.0, 1.0), (-2.0, 0.0, -1.0)] {
            let axes = [Axis::new(low, high, 1.0, 0.0, SafeAction::Ramp { step: 0.1 }).expect("the axis is valid")];
            let mut motor = Motor::new(Mock::default(), 1000);
            for (value, current) in [(half, 0.5 * half.signum()), (0.0, 0.0)] {
                for _ in 0..2000 {
                    assert!(motor.apply(&[Output::Drive(value)], &axes));
                }
                assert!((torque_current(&motor) - current).abs() < 0.03, "{}", torque_current(&motor));
            }
            assert!(motor.motor.speed.abs() < 0.1, "{}", motor.motor.speed);
        }
    }

    #[test]
    fn coasting_disables_and_braking_shorts_the_bridges() {
        let axes = [Axis::STILL];
        let mut motor = Motor::new(Mock::default(), 1000);
        assert!(motor.apply(&[Output::Brake], &axes) && motor.bridges.stage().on);
        assert_eq!(motor.bridges.stage().duties(), [0; 3]);
        assert!(motor.apply(&[Output::Coast], &axes) && !motor.bridges.stage().on);
        // An axis with a single value.
        assert!(motor.apply(&[Output::Drive(0.0)], &axes) && motor.bridges.stage().on);
        assert_eq!((torque_current(&motor), motor.bridges.stage().duties()), (0.0, [500; 3]));
        let single = [Axis::new(3.0, 3.0, 1.0, 3.0, SafeAction::Coast).expect("the axis is valid")];
        assert!(motor.apply(&[Output::Drive(3.0)], &single));
        assert_eq!((torque_current(&motor), motor.bridges.stage().duties()), (0.0, [500; 3]));
        // A lost sensor.
        motor.motor.flux = Stator::default();
        assert!(!motor.apply(&[Output::Drive(0.0)], &axes) && !motor.bridges.stage().on);
        // A sensor that works again: off until the controller is disarmed.
        motor.motor.flux = Stator { alpha: 1.0, beta: 0.0 };
        for output in [Output::Drive(0.0), Output::Brake] {
            assert!(!motor.apply(&[output], &axes) && !motor.bridges.stage().on);
        }
        assert!(motor.apply(&[Output::Coast], &axes) && !motor.bridges.stage().on);
        assert!(motor.apply(&[Output::Drive(0.0)], &axes) && motor.bridges.stage().on);
        // The break input.
        motor.bridges.stage().broken = true;
        assert!(!motor.apply(&[Output::Coast], &axes) && !motor.apply(&[Output::Brake], &axes));
        motor.bridges.stage().broken = false;
        // Outputs that no controller gives.
        assert!(!motor.apply(&[Output::Drive(f32::NAN)], &[Axis::STILL; 0]) && !motor.bridges.stage().on);
    }
}
