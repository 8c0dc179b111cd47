//! Counted functions: each prints a line `name elements`, in the order of the counted regions.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(not(target_os = "none"))]
fn main() {
    eprintln!("this is firmware: build it with --target thumbv7em-none-eabihf");
    std::process::exit(1);
}

#[cfg(target_os = "none")]
mod firmware {
    use core::fmt::Write as _;
    use core::hint::black_box;

    use actq_firmware_demo::{count, host};
    use actq_kernels::math::Function;
    use actq_kernels::{norm, recurrent};
    use cortex_m_semihosting::hio;

    const LEN: usize = 256;

    #[cortex_m_rt::entry]
    fn main() -> ! {
        host::exit(run().is_some())
    }

    /// From -6 up to 0, where no function has a shorter way.
    fn values<const N: usize>() -> [f32; N] {
        core::array::from_fn(|i| i as f32 * (6.0 / N as f32) - 6.0)
    }

    fn run() -> Option<()> {
        let mut out = hio::hstdout().ok()?;
        for function in Function::ALL {
            let mut x = values::<LEN>();
            count::region(|| function.apply(black_box(&mut x)));
            black_box(x);
            writeln!(out, "{} {LEN}", function.name()).ok()?;
        }
        let (mut x, constants) = (values::<LEN>(), values::<LEN>().map(f32::to_bits));
        count::region(|| norm::layer_norm(black_box(&mut x), &constants, &constants, 1e-5));
        writeln!(out, "layernorm {LEN}").ok()?;
        count::region(|| norm::rms_norm(black_box(&mut x), &constants, 1e-5));
        writeln!(out, "rmsnorm {LEN}").ok()?;
        let mut h = [0.0; LEN];
        count::region(|| norm::normalize(black_box(&x), &constants, &constants, 1.0, 5.0, black_box(&mut h)));
        writeln!(out, "normalize {LEN}").ok()?;
        let (a, b) = (values::<{ 4 * LEN }>(), values::<{ 3 * LEN }>());
        count::region(|| recurrent::lstm_cell(black_box(&a), &mut x, black_box(&mut h)));
        writeln!(out, "lstm {LEN}").ok()?;
        let a = a.get(..3 * LEN)?;
        count::region(|| recurrent::gru_cell(black_box(a), &b, black_box(&mut h)));
        black_box((x, h));
        writeln!(out, "gru {LEN}").ok()
    }
}
