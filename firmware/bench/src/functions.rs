//! Counted functions and their operands, for `src/bin/functions.rs` on the target and
//! `host-tests/tests/all/on_target/functions.rs` on the host.

use core::hint::black_box;

#[cfg(target_os = "none")]
use actq_firmware_support::count::region;
use actq_kernels::activations::{Plan, Scale};
use actq_kernels::image::RowBlock;
use actq_kernels::layout::{Block, BlockShape, Lanes, Width, pack};
use actq_kernels::math::Function;
use actq_kernels::ops::denoise::{Coefficients, denoise};
use actq_kernels::ops::noise::normal;
use actq_kernels::ops::{cells, elementwise, norm};

/// Number of elements.
pub const LEN: usize = 256;

/// Values near or outside f32's range, subnormal numbers, and zeros.
const EXTREMES: [f32; 13] =
    [f32::MAX, f32::MIN, 1e38, -1e38, 1.0, -1.0, f32::INFINITY, f32::NEG_INFINITY, f32::NAN, 1e-40, -1e-40, 0.0, -0.0];

/// A denoising step.
struct Denoised {
    name: &'static str,
    /// Factor of the limited sample; 0 for a step without a limit.
    sample: f32,
    /// Limit of the sample.
    limit: f32,
    /// `true` if noise is added.
    noise: bool,
}

/// Steps with limits that affect none, half and all of [`values`].
const DENOISED: [Denoised; 8] = [
    Denoised { name: "denoise", sample: 0.0, limit: f32::INFINITY, noise: false },
    Denoised { name: "denoise with noise", sample: 0.0, limit: f32::INFINITY, noise: true },
    Denoised { name: "denoise, none limited", sample: 0.4, limit: 4.0, noise: false },
    Denoised { name: "denoise, half limited", sample: 0.4, limit: 1.8, noise: false },
    Denoised { name: "denoise, all limited", sample: 0.4, limit: 0.001, noise: false },
    Denoised { name: "denoise with noise, none", sample: 0.4, limit: 4.0, noise: true },
    Denoised { name: "denoise with noise, half", sample: 0.4, limit: 1.8, noise: true },
    Denoised { name: "denoise with noise, all", sample: 0.4, limit: 0.001, noise: true },
];

impl Denoised {
    /// Returns the step's coefficients in the image's order, with the shares of iterate and output in the sample.
    fn coefficients(&self, x: f32, v: f32) -> [f32; 7] {
        [x * self.sample, v * self.sample, 0.6, 0.2, self.sample, 0.1, 0.3]
    }
}

/// Returns values from -6 to 0, for which no function takes a shortcut.
fn values<const N: usize>() -> [f32; N] {
    core::array::from_fn(|i| i as f32 * (6.0 / N as f32) - 6.0)
}

/// Returns values of all magnitudes with both signs.
fn magnitudes<const N: usize>() -> [f32; N] {
    core::array::from_fn(|i| f32::from_bits(((i as u32) << 31) | (i as u32 * (0x7f80_0000 / N as u32))))
}

/// Returns a hash of all results' bits; all NaNs count as one value.
pub fn hash(results: &[&[f32]]) -> u32 {
    let bits = |v: &f32| if v.is_nan() { f32::NAN.to_bits() } else { v.to_bits() };
    results.iter().copied().flatten().map(bits).fold(0, |hash: u32, bits| hash.rotate_left(5) ^ bits)
}

/// Runs `work`; on the host, nothing counts it.
#[cfg(not(target_os = "none"))]
fn region<T>(work: impl FnOnce() -> T) -> T {
    work()
}

/// Columns of a product.
const COLS: usize = 16;

/// Computes a product of rows whose biases and scales have every combination of magnitudes, with activations up to
/// `largest`, and adds it to itself. It is counted for 1.
fn product(largest: f32, y: &mut [f32; LEN]) -> Option<()> {
    // The results do not depend on the layout: it is the one for Helium in builds that have it.
    let lanes = Lanes::from_code(3).unwrap_or(Lanes::Paired);
    let shape = BlockShape { width: Width::W8, lanes, rows: LEN, cols: COLS, group: 0 };
    let mut words = [0; LEN * COLS / 4];
    let mut codes = [0; LEN * COLS];
    codes.iter_mut().zip(0u32..).for_each(|(code, i)| *code = (i.wrapping_mul(0x9e37_79b9) >> 24) as u8);
    // Sums of 0.
    codes.iter_mut().step_by(7 * COLS).for_each(|code| *code = 0);
    pack(shape, &codes, &[], &mut words).ok()?;
    let block = Block::new(shape, &words)?;
    // Zero, subnormal, normal and almost infinite.
    const SCALES: [u16; 8] = [0, 1, 0x7f, 0x80, 0x0d00, 0x3b83, 0x3f80, 0x7f7f];
    let scales: [u32; LEN / 2] =
        core::array::from_fn(|i| u32::from(SCALES[2 * i % 8]) | u32::from(SCALES[(2 * i + 1) % 8]) << 16);
    let start: [u32; LEN] = core::array::from_fn(|i| EXTREMES[(i / 8) % EXTREMES.len()].to_bits());
    let rows = RowBlock { block, scales: &scales, steps: &[], first_row: 0 };
    let mut x: [f32; COLS] = core::array::from_fn(|i| match i {
        0..4 => [largest, -largest, 1e-40, -0.0][i],
        _ => largest * (i as f32 / COLS as f32 - 0.5),
    });
    let mut work = [0; 2 * COLS];
    let plan = Plan::of(&block);
    let mut apply = || {
        let scale = Scale::new(black_box(&x), 127).ok()?;
        let prepared = scale.quantize(&mut x, &plan, &mut work)?;
        rows.apply(&prepared, scale, Some(&start), y).ok()?;
        rows.apply(&prepared, scale, None, y).ok()
    };
    if largest == 1.0 { region(apply) } else { apply() }
}

/// Calls every function in a counted region, and reports its name and the hash of its results: the counted ones and, for
/// functions and cells, those for values of all magnitudes. Stops when `report` returns `None`.
pub fn each(mut report: impl FnMut(&'static str, u32) -> Option<()>) -> Option<()> {
    let mut line = |name, results: &[&[f32]]| report(name, hash(results));
    let constants = values::<LEN>().map(f32::to_bits);
    for function in Function::ALL {
        let (mut x, mut y) = (values::<LEN>(), magnitudes::<LEN>());
        region(|| function.apply(black_box(&mut x)));
        function.apply(&mut y);
        line(function.name(), &[&x, &y])?;
    }
    let mut x = values::<LEN>();
    region(|| norm::layer_norm(black_box(&mut x), &constants, &constants, 1e-5));
    let mut rest = values::<13>();
    norm::layer_norm(&mut rest, &constants, &constants, 1e-5);
    line("layernorm", &[&x, &rest])?;
    let mut x = values::<LEN>();
    region(|| norm::rms_norm(black_box(&mut x), &constants, 1e-5));
    let mut rest = values::<13>();
    norm::rms_norm(&mut rest, &constants, 1e-5);
    line("rmsnorm", &[&x, &rest])?;
    let x = values::<LEN>();
    for (name, of) in [("add", elementwise::add as fn(&[f32], &mut [f32])), ("mul", elementwise::mul)] {
        let mut y = values::<LEN>();
        region(|| of(black_box(&x), black_box(&mut y)));
        let mut rest = values::<13>();
        of(&x, &mut rest);
        line(name, &[&y, &rest])?;
    }
    let mut y = [0.0; LEN];
    region(|| elementwise::normalize(black_box(&x), &constants, &constants, 1.0, 5.0, black_box(&mut y)));
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
        region(|| denoise(black_box(&by), limit, black_box(&x), noise, black_box(&mut next), black_box(&mut y)));
        line(case.name, &[&next, &y[1..], extremes.as_flattened()])?;
    }
    let mut y = [[0.0; LEN]; 6];
    for (y, largest) in y.iter_mut().zip([1.0, f32::MAX, 1e-29, 8e-31, 1e-31, 1e-40]) {
        product(largest, y)?;
    }
    line("linear", &[y.as_flattened()])?;
    let mut z = [0.0; LEN];
    region(|| black_box(&mut z).iter_mut().zip(0..).for_each(|(z, i)| *z = normal(1, 2, i)));
    line("noise", &[&z])?;
    let (gates, mut c, mut h) = (values::<{ 4 * LEN }>(), values::<LEN>(), [0.0; LEN]);
    region(|| cells::lstm_cell(black_box(&gates), &mut c, black_box(&mut h)));
    let (mut all_c, mut all_h) = (values::<LEN>(), [0.0; LEN]);
    cells::lstm_cell(&magnitudes::<{ 4 * LEN }>(), &mut all_c, &mut all_h);
    line("lstm", &[&h, &c, &all_h, &all_c])?;
    let (a, b, mut h) = (values::<{ 3 * LEN }>(), values::<{ 3 * LEN }>(), values::<LEN>());
    region(|| cells::gru_cell(black_box(&a), &b, black_box(&mut h)));
    let mut all = values::<LEN>();
    cells::gru_cell(&magnitudes::<{ 3 * LEN }>(), &b, &mut all);
    line("gru", &[&h, &all])
}
