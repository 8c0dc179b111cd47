//! Counted functions: each prints a line `name elements hash`, in the order of the counted regions. The hash is of the
//! bits of what was counted and, of functions and cells, of the results for values of every magnitude, which are not
//! counted; `host-tests/tests/all/functions.rs` computes the same on the host.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(not(target_os = "none"))]
use actq_firmware_bench::main;

#[cfg(target_os = "none")]
mod firmware {
    actq_firmware_support::panic_to_host!();

    use core::fmt::Write as _;
    use core::hint::black_box;

    use actq_firmware_support::{count, host};
    use actq_kernels::math::Function;
    use actq_kernels::ops::denoise::{Coefficients, denoise};
    use actq_kernels::ops::noise::normal;
    use actq_kernels::ops::{cells, elementwise, norm};

    const LEN: usize = 256;

    #[cortex_m_rt::entry]
    fn main() -> ! {
        host::exit(run().is_some())
    }

    /// From -6 up to 0, where no function has a shorter way.
    fn values<const N: usize>() -> [f32; N] {
        core::array::from_fn(|i| i as f32 * (6.0 / N as f32) - 6.0)
    }

    /// Every magnitude, with both signs.
    fn magnitudes<const N: usize>() -> [f32; N] {
        core::array::from_fn(|i| f32::from_bits(((i as u32) << 31) | (i as u32 * (0x7f80_0000 / N as u32))))
    }

    /// What leaves f32's range, is not in it, or is nothing.
    const EXTREMES: [f32; 13] = [
        f32::MAX,
        f32::MIN,
        1e38,
        -1e38,
        1.0,
        -1.0,
        f32::INFINITY,
        f32::NEG_INFINITY,
        f32::NAN,
        1e-40,
        -1e-40,
        0.0,
        -0.0,
    ];

    fn run() -> Option<()> {
        let mut out = host::stdout()?;
        let mut line = |name: &str, results: &[&[f32]]| {
            let bits = |v: &f32| if v.is_nan() { f32::NAN.to_bits() } else { v.to_bits() };
            let hash = results.iter().copied().flatten().map(bits).fold(0u32, |hash, bits| hash.rotate_left(5) ^ bits);
            writeln!(out, "{name} {LEN} {hash:08x}").ok()
        };
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
        for (name, sample, limit, noise) in [
            ("denoise", 0.0, f32::INFINITY, &[][..]),
            ("denoise with noise", 0.0, f32::INFINITY, &z),
            ("denoise, none limited", 0.4, 4.0, &[]),
            ("denoise, half limited", 0.4, 1.8, &[]),
            ("denoise, all limited", 0.4, 0.001, &[]),
            ("denoise with noise, none", 0.4, 4.0, &z),
            ("denoise with noise, half", 0.4, 1.8, &z),
            ("denoise with noise, all", 0.4, 0.001, &z),
        ] {
            let by = |x, v| Coefficients::from_array([x * sample, v * sample, 0.6, 0.2, sample, 0.1, 0.3]);
            let (mut next, mut y) = (EXTREMES, EXTREMES);
            denoise(&by(10.0, -9.0), limit, &EXTREMES, noise, &mut next, &mut y);
            let (extremes, by) = ([next, y], by(1.0, 0.5));
            let (mut next, mut y) = (values::<LEN>(), [0.0; LEN]);
            count::region(|| {
                denoise(black_box(&by), limit, black_box(&x), noise, black_box(&mut next), black_box(&mut y))
            });
            line(name, &[&next, &y[1..], extremes.as_flattened()])?;
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
