//! Counted functions: each prints a line `name elements hash`, in the order of the counted regions. The hash covers the
//! counted results and, for functions and cells, the uncounted results for values of all magnitudes.
//! `host-tests/tests/all/on_target/functions.rs` computes the same on the host.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(not(target_os = "none"))]
use actq_firmware_bench::main;

#[cfg(target_os = "none")]
mod firmware {
    actq_firmware_support::panic_to_host!();

    use core::fmt::Write as _;
    use core::hint::black_box;

    use actq_firmware_bench::functions::{DENOISED, EXTREMES, LEN, hash, magnitudes, values};
    use actq_firmware_support::{count, host};
    use actq_kernels::math::Function;
    use actq_kernels::ops::denoise::{Coefficients, denoise};
    use actq_kernels::ops::noise::normal;
    use actq_kernels::ops::{cells, elementwise, norm};

    #[cortex_m_rt::entry]
    fn main() -> ! {
        host::exit(run().is_some())
    }

    fn run() -> Option<()> {
        let mut out = host::stdout()?;
        let mut line = |name: &str, results: &[&[f32]]| writeln!(out, "{name} {LEN} {:08x}", hash(results)).ok();
        let constants = values::<LEN>().map(f32::to_bits);
        for function in Function::ALL {
            let (mut x, mut y) = (values::<LEN>(), magnitudes::<LEN>());
            count::region(|| function.apply(black_box(&mut x)));
            function.apply(&mut y);
            line(function.name(), &[&x, &y])?;
        }
        let mut x = values::<LEN>();
        count::region(|| norm::layer_norm(black_box(&mut x), &constants, &constants, 1e-5));
        let mut rest = values::<13>();
        norm::layer_norm(&mut rest, &constants, &constants, 1e-5);
        line("layernorm", &[&x, &rest])?;
        let mut x = values::<LEN>();
        count::region(|| norm::rms_norm(black_box(&mut x), &constants, 1e-5));
        let mut rest = values::<13>();
        norm::rms_norm(&mut rest, &constants, 1e-5);
        line("rmsnorm", &[&x, &rest])?;
        let x = values::<LEN>();
        for (name, of) in [("add", elementwise::add as fn(&[f32], &mut [f32])), ("mul", elementwise::mul)] {
            let mut y = values::<LEN>();
            count::region(|| of(black_box(&x), black_box(&mut y)));
            let mut rest = values::<13>();
            of(&x, &mut rest);
            line(name, &[&y, &rest])?;
        }
        let mut y = [0.0; LEN];
        count::region(|| elementwise::normalize(black_box(&x), &constants, &constants, 1.0, 5.0, black_box(&mut y)));
        let [mut limited, mut free] = [EXTREMES; 2];
        elementwise::normalize(&EXTREMES, &constants, &constants, 1e37, 5.0, &mut limited);
        elementwise::normalize(&EXTREMES, &constants, &constants, f32::INFINITY, f32::INFINITY, &mut free);
        line("normalize", &[&y, &limited, &free])?;
        let z: [f32; LEN] = core::array::from_fn(|i| normal(1, 2, i as u32));
        for case in &DENOISED {
            let by = |x, v| Coefficients::from_array(case.coefficients(x, v));
            let (limit, noise) = (case.limit, if case.noise { &z[..] } else { &[] });
            let (mut next, mut y) = (EXTREMES, EXTREMES);
            denoise(&by(10.0, -9.0), limit, &EXTREMES, noise, &mut next, &mut y);
            let (extremes, by) = ([next, y], by(1.0, 0.5));
            let (mut next, mut y) = (values::<LEN>(), [0.0; LEN]);
            count::region(|| {
                denoise(black_box(&by), limit, black_box(&x), noise, black_box(&mut next), black_box(&mut y))
            });
            line(case.name, &[&next, &y[1..], extremes.as_flattened()])?;
        }
        let mut z = [0.0; LEN];
        count::region(|| black_box(&mut z).iter_mut().zip(0..).for_each(|(z, i)| *z = normal(1, 2, i)));
        line("noise", &[&z])?;
        let (gates, mut c, mut h) = (values::<{ 4 * LEN }>(), values::<LEN>(), [0.0; LEN]);
        count::region(|| cells::lstm_cell(black_box(&gates), &mut c, black_box(&mut h)));
        let (mut all_c, mut all_h) = (values::<LEN>(), [0.0; LEN]);
        cells::lstm_cell(&magnitudes::<{ 4 * LEN }>(), &mut all_c, &mut all_h);
        line("lstm", &[&h, &c, &all_h, &all_c])?;
        let (a, b, mut h) = (values::<{ 3 * LEN }>(), values::<{ 3 * LEN }>(), values::<LEN>());
        count::region(|| cells::gru_cell(black_box(&a), &b, black_box(&mut h)));
        let mut all = values::<LEN>();
        cells::gru_cell(&magnitudes::<{ 3 * LEN }>(), &b, &mut all);
        line("gru", &[&h, &all])
    }
}
