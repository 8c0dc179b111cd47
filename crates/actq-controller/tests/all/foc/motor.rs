//! A simulated motor that the current loop drives.

use actq_controller::foc::{CurrentLoop, Gains, Measured, Observer, Rotor, Tick};

/// A permanent-magnet synchronous motor of the size of a quadruped's, in the rotor's axes, in f64. It is integrated by
/// the midpoint rule in 50 steps per control tick.
struct Motor {
    d: f64,
    q: f64,
    /// Electrical angle in radians.
    angle: f64,
    /// Electrical speed in rad/s.
    speed: f64,
    /// `true` if the rotor is held.
    locked: bool,
}

const RESISTANCE: f64 = 0.1;
const INDUCTANCE: f64 = 60e-6;
const FLUX: f64 = 5e-3;
const PAIRS: f64 = 14.0;
const INERTIA: f64 = 2e-4;
const SUPPLY: f64 = 24.0;
/// Control period in seconds: 8 kHz.
const TICK: f64 = 125e-6;

impl Motor {
    fn new(locked: bool) -> Self {
        Self { d: 0.0, q: 0.0, angle: 0.3, speed: 0.0, locked }
    }

    fn slopes(&self, [vd, vq]: [f64; 2], d: f64, q: f64) -> (f64, f64) {
        let d_slope = (vd - RESISTANCE * d + self.speed * INDUCTANCE * q) / INDUCTANCE;
        (d_slope, (vq - RESISTANCE * q - self.speed * (INDUCTANCE * d + FLUX)) / INDUCTANCE)
    }

    /// Simulates one tick with these duty cycles.
    fn run(&mut self, duties: [f32; 3]) {
        const STEPS: usize = 50;
        let step = TICK / STEPS as f64;
        let [a, b, c] = duties.map(|duty| f64::from(duty) * SUPPLY);
        let (alpha, beta) = ((2.0 * a - b - c) / 3.0, (b - c) / 3f64.sqrt());
        for _ in 0..STEPS {
            let (sin, cos) = self.angle.sin_cos();
            let voltage = [alpha * cos + beta * sin, beta * cos - alpha * sin];
            let (d, q) = self.slopes(voltage, self.d, self.q);
            let (d, q) = self.slopes(voltage, self.d + 0.5 * step * d, self.q + 0.5 * step * q);
            (self.d, self.q) = (self.d + step * d, self.q + step * q);
            if !self.locked {
                self.speed += step * PAIRS * 1.5 * PAIRS * FLUX * self.q / INERTIA;
                self.angle = (self.angle + step * self.speed).rem_euclid(std::f64::consts::TAU);
            }
        }
    }

    fn measure(&self) -> Measured {
        let phase = |k: f64| {
            let angle = self.angle - k * std::f64::consts::TAU / 3.0;
            (self.d * angle.cos() - self.q * angle.sin()) as f32
        };
        Measured { phases: [phase(0.0), phase(1.0), phase(2.0)], angle: self.angle as f32, supply: SUPPLY as f32 }
    }
}

fn current_loop() -> CurrentLoop {
    // A bandwidth of 500 Hz.
    CurrentLoop::new(Gains::for_motor(RESISTANCE as f32, INDUCTANCE as f32, 3141.6, TICK as f32))
}

/// Runs the loop; returns each tick with the motor's true currents after it.
fn run(motor: &mut Motor, control: &mut CurrentLoop, ticks: usize, q: f32) -> Vec<(Tick, f64, f64)> {
    let tick = |_| {
        let tick = control.step(&motor.measure(), Rotor { d: 0.0, q }).expect("all values are finite");
        motor.run(tick.duties);
        (tick, motor.d, motor.q)
    };
    (0..ticks).map(tick).collect()
}

#[test]
fn current_follows_a_step_without_overshoot() {
    let (mut motor, mut control) = (Motor::new(true), current_loop());
    let ticks = run(&mut motor, &mut control, 80, 20.0);
    // Five time constants of 500 Hz, 1.6 ms.
    for (i, (_, d, q)) in ticks.iter().enumerate() {
        assert!(d.abs() < 0.1 && *q < 20.0 * 1.05, "tick {i}: {d} {q}");
        assert!(i < 13 || (q - 20.0).abs() < 1.0, "tick {i}: {q}");
    }
    assert!((motor.q - 20.0).abs() < 0.02, "no error remains");
}

#[test]
fn a_free_motor_reaches_top_speed_and_brakes() {
    let (mut motor, mut control) = (Motor::new(false), current_loop());
    let ticks = run(&mut motor, &mut control, 160, 10.0);
    let late = &ticks[40..];
    assert!(
        late.iter().all(|(_, d, q)| d.abs() < 3.0 && (q - 10.0).abs() < 2.5),
        "the currents are held while it speeds up"
    );
    run(&mut motor, &mut control, 8000, 10.0);
    // The flux' voltage takes all of the supply.
    let top = SUPPLY / 3f64.sqrt() / FLUX;
    assert!((0.8..1.1).contains(&(motor.speed / top)), "{} of {top} rad/s", motor.speed);
    // The loop was at its limit for a second; the current still turns within a few ticks.
    let ticks = run(&mut motor, &mut control, 16, -10.0);
    assert!(ticks[15].2 < -5.0, "{}", ticks[15].2);
    let speed = motor.speed;
    run(&mut motor, &mut control, 400, -10.0);
    assert!(motor.speed < 0.9 * speed, "it brakes");
}

/// The CRC-32 of all duty cycles' bits in ten thousand ticks is the same on every machine. The inputs are computed in
/// f32 only.
#[test]
fn ticks_have_the_same_bits_everywhere() {
    let mut control = CurrentLoop::new(Gains { proportional: 0.188_5, integral: 0.039_27 });
    let crc = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC);
    let mut digest = crc.digest();
    let mut phases = [0.0f32; 3];
    let (mut observer, mut sin, mut cos) = (Observer::new(1000.0, 125e-6), 0.0f32, 1.0f32);
    for i in 0..10_000u16 {
        // The rotor turns by 0.037 rad.
        (sin, cos) = (0.999_315_6 * sin + 0.036_991_56 * cos, 0.999_315_6 * cos - 0.036_991_56 * sin);
        let angle = observer.step(sin, cos, 1.5).expect("a turning magnet");
        let target = Rotor { d: 0.0, q: f32::from(i % 997) * 0.04 - 20.0 };
        let tick = control.step(&Measured { phases, angle, supply: 24.0 }, target).expect("all values are finite");
        for (phase, duty) in phases.iter_mut().zip(tick.duties) {
            digest.update(&duty.to_bits().to_le_bytes());
            *phase = 0.9 * *phase + 3.0 * (duty - 0.5);
        }
    }
    assert_eq!(digest.finalize(), 0xfc3d_4550);
}
