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
        line("layernorm", &[&x])?;
        let mut x = values::<LEN>();
        count::region(|| norm::rms_norm(black_box(&mut x), &constants, 1e-5));
        line("rmsnorm", &[&x])?;
        let (x, mut y) = (values::<LEN>(), [0.0; LEN]);
        count::region(|| elementwise::normalize(black_box(&x), &constants, &constants, 1.0, 5.0, black_box(&mut y)));
        line("normalize", &[&y])?;
        for (name, of) in [("add", elementwise::add as fn(&[f32], &mut [f32])), ("mul", elementwise::mul)] {
            let mut y = values::<LEN>();
            count::region(|| of(black_box(&x), black_box(&mut y)));
            line(name, &[&y])?;
        }
        let z: [f32; LEN] = core::array::from_fn(|i| normal(1, 2, i as u32));
        for (name, sample, limit, noise) in [
            ("denoise", 0.0, f32::INFINITY, &[][..]),
            ("denoise with noise", 0.0, f32::INFINITY, &z),
            ("denoise by a limit", 0.4, 2.0, &[]),
            ("denoise by a limit with noise", 0.4, 2.0, &z),
        ] {
            let by = [sample, 0.5 * sample, 0.6, 0.2, sample, 0.1, 0.3];
            let (by, mut next, mut y) = (Coefficients::from_array(by), values::<LEN>(), [0.0; LEN]);
            count::region(|| {
                denoise(black_box(&by), limit, black_box(&x), noise, black_box(&mut next), black_box(&mut y))
            });
            line(name, &[&next, &y[1..]])?;
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
