//! The observer and the current loop: ten thousand ticks, of which every hundredth is a counted region. It prints the
//! CRC-32 of all duty cycles' bits, which the test in `crates/actq-controller/tests/all/foc/motor.rs` computes from the same
//! inputs.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(not(target_os = "none"))]
use actq_firmware_bench::main;

#[cfg(target_os = "none")]
mod firmware {
    actq_firmware_support::panic_to_host!();

    use core::fmt::Write as _;
    use core::hint::black_box;

    use actq_controller::foc::{CurrentLoop, Gains, Measured, Observer, Rotor};
    use actq_firmware_support::{count, host};
    use actq_link::frame::CRC;

    #[cortex_m_rt::entry]
    fn main() -> ! {
        host::exit(run().is_some())
    }

    fn run() -> Option<()> {
        let mut control = CurrentLoop::new(Gains { proportional: 0.188_5, integral: 0.039_27 });
        let (mut digest, mut phases) = (CRC.digest(), [0.0f32; 3]);
        let (mut observer, mut sin, mut cos) = (Observer::new(1000.0, 125e-6), 0.0f32, 1.0f32);
        for i in 0..10_000u16 {
            (sin, cos) = (0.999_315_6 * sin + 0.036_991_56 * cos, 0.999_315_6 * cos - 0.036_991_56 * sin);
            let target = Rotor { d: 0.0, q: f32::from(i % 997) * 0.04 - 20.0 };
            let mut step = || {
                let angle = observer.step(black_box(sin), black_box(cos), 1.5)?;
                control.step(&Measured { phases: black_box(phases), angle, supply: 24.0 }, target)
            };
            let tick = if i % 100 == 0 { count::region(step) } else { step() }?;
            for (phase, duty) in phases.iter_mut().zip(tick.duties) {
                digest.update(&duty.to_bits().to_le_bytes());
                *phase = 0.9 * *phase + 3.0 * (duty - 0.5);
            }
        }
        writeln!(host::stdout()?, "{:08x}", digest.finalize()).ok()
    }
}
