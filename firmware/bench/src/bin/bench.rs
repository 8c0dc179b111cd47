//! Counted kernel calls: each prints a line `name bits group rows cols`, in the order of the counted regions.
//!
//! A region is a whole call: activations from f32, the product, and the results back in f32 with row scales and biases.
//! The image's data is in the image slot, so that its cache lines count as fetched from flash. The baselines are a
//! naive loop in f32, and 8-bit rows with SXTB16 and SMLAD in the usual intrinsics style.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(not(target_os = "none"))]
use actq_firmware_bench::main;

#[cfg(target_os = "none")]
mod firmware {
    actq_firmware_support::panic_to_host!();

    use core::arch::asm;
    use core::fmt::Write as _;
    use core::hint::black_box;

    use actq_firmware_bench::random_words;
    use actq_firmware_support::{count, host};
    use actq_kernels::activations::{Plan, Scale};
    use actq_kernels::image::RowBlock;
    use actq_kernels::layout::{Block, BlockShape, Lanes, Width, pack};
    use cortex_m::singleton;

    const SHAPES: [(usize, usize); 5] = [(64, 256), (256, 256), (512, 512), (128, 1024), (28, 256)];
    const WEIGHTS: usize = 512 * 512;
    const ROWS: usize = 512;
    const COLS: usize = 1024;

    /// The data of an image.
    #[repr(C)]
    struct Flash {
        codes: [u8; WEIGHTS],
        scales: [u8; WEIGHTS / 32],
        weights: [f32; WEIGHTS],
        words: [u32; WEIGHTS / 4 + WEIGHTS / 128],
        row_scales: [u32; ROWS / 2],
        bias: [u32; ROWS],
    }

    struct Ram {
        x: [f32; COLS],
        prepared: [u32; COLS],
        y: [f32; ROWS],
    }

    unsafe extern "C" {
        static mut _image_slot_start: Flash;
        static _image_slot_end: u8;
    }

    #[cortex_m_rt::entry]
    fn main() -> ! {
        let ram = singleton!(: Ram = Ram { x: [0.0; COLS], prepared: [0; COLS], y: [0.0; ROWS] });
        let slot = (&raw const _image_slot_end as usize) - (&raw const _image_slot_start as usize);
        let fits = size_of::<Flash>() <= slot;
        // SAFETY: memory.x gives the slot's bounds, aligned to 4, in memory that nothing else uses; QEMU's code memory
        // is writable. Every bit pattern is valid for the arrays' types, and this is the only reference.
        let flash = unsafe { (&raw mut _image_slot_start).as_mut() };
        host::exit(fits && flash.zip(ram).is_some_and(|(flash, ram)| run(flash, ram).is_some()))
    }

    fn run(b: &mut Flash, ram: &mut Ram) -> Option<()> {
        let mut out = host::stdout()?;
        let mut random = random_words();
        b.codes.iter_mut().for_each(|c| *c = random() as u8);
        b.scales.iter_mut().for_each(|s| *s = random() as u8);
        b.weights.iter_mut().for_each(|w| *w = random() as i32 as f32);
        ram.x.iter_mut().for_each(|x| *x = random() as i32 as f32);
        b.bias.iter_mut().for_each(|x| *x = (random() as i32 as f32).to_bits());
        b.row_scales.fill(0x3c00_3c80);
        for (rows, cols) in SHAPES {
            let x = ram.x.get_mut(..cols)?;
            let (bias, y) = (b.bias.get(..rows)?, ram.y.get_mut(..rows)?);
            let weights = b.weights.get(..rows * cols)?;
            count::region(|| naive(weights, black_box(&*x), bias, y));
            writeln!(out, "naive-f32 32 0 {rows} {cols}").ok()?;
            let codes = b.codes.get(..rows * cols)?;
            let pairs = ram.prepared.get_mut(..cols / 2)?;
            count::region(|| int8(codes, black_box(&*x), &b.row_scales, bias, pairs, y))?;
            writeln!(out, "int8-smlad 8 0 {rows} {cols}").ok()?;
            for (name, x_max) in [("gemv-a8", 127), ("gemv-a16", 2047)] {
                for width in Width::ALL {
                    for group in [0, 32] {
                        let shape = BlockShape { width, lanes: Lanes::of(x_max, group), rows, cols, group };
                        let words = b.words.get_mut(..shape.words())?;
                        pack(shape, codes, b.scales.get(..rows * shape.groups())?, words).ok()?;
                        let block = Block::new(shape, words)?;
                        let scales = b.row_scales.get(..rows.div_ceil(2))?;
                        let block = RowBlock { block, scales, steps: &[], first_row: 0 };
                        count::region(|| product(&block, black_box(&mut *x), x_max, bias, &mut ram.prepared, y))?;
                        black_box(&y);
                        writeln!(out, "{name} {} {group} {rows} {cols}", width.bits()).ok()?;
                    }
                }
            }
        }
        Some(())
    }

    #[inline(never)]
    fn product(
        rows: &RowBlock<'_>,
        x: &mut [f32],
        x_max: u16,
        bias: &[u32],
        prepared: &mut [u32],
        y: &mut [f32],
    ) -> Option<()> {
        let scale = Scale::new(x, x_max).ok()?;
        rows.apply(&scale.quantize(x, &Plan::of(&rows.block), prepared)?, scale, Some(bias), y).ok()
    }

    #[inline(never)]
    fn naive(weights: &[f32], x: &[f32], bias: &[u32], y: &mut [f32]) {
        for ((row, y), bias) in weights.chunks_exact(x.len()).zip(y).zip(bias) {
            *y = row.iter().zip(x).fold(f32::from_bits(*bias), |sum, (w, x)| sum + w * x);
        }
    }

    /// Sign-extends bytes 0 and 2, or 1 and 3, to halfwords.
    macro_rules! sxtb16 {
        ($word:expr $(, $rotate:literal)?) => {{
            let pair: u32;
            // SAFETY: computes from registers to a register.
            unsafe {
                asm!(
                    concat!("sxtb16 {0}, {1}", $($rotate)?),
                    out(reg) pair, in(reg) $word, options(pure, nomem, nostack)
                );
            }
            pair
        }};
    }

    #[inline(always)]
    fn smlad(a: u32, b: u32, c: i32) -> i32 {
        let sum;
        // SAFETY: computes from registers to a register, and may set the Q flag, which `preserves_flags` would deny.
        unsafe {
            asm!("smlad {0}, {1}, {2}, {3}", out(reg) sum, in(reg) a, in(reg) b, in(reg) c, options(pure, nomem, nostack));
        }
        sum
    }

    /// Computes four columns per step: a word of weights becomes the pairs (0, 2) and (1, 3), the order in which the
    /// activations are prepared.
    #[inline(never)]
    fn int8(
        weights: &[u8],
        x: &[f32],
        row_scales: &[u32],
        bias: &[u32],
        pairs: &mut [u32],
        y: &mut [f32],
    ) -> Option<()> {
        let scale = Scale::new(x, 127).ok()?;
        let inverse = 1.0 / scale.get();
        for (x, pair) in x.chunks_exact(4).zip(pairs.chunks_exact_mut(2)) {
            let q = |i: usize| u32::from((x[i] * inverse + actq_kernels::round::ROUND).to_bits() as u16);
            pair[0] = q(0) | q(2) << 16;
            pair[1] = q(1) | q(3) << 16;
        }
        let weights: &[u32] = bytemuck::try_cast_slice(weights).ok()?;
        for (i, ((row, y), bias)) in weights.chunks_exact(x.len() / 4).zip(y).zip(bias).enumerate() {
            let sum = row
                .iter()
                .zip(pairs.chunks_exact(2))
                .fold(0, |sum, (&w, pair)| smlad(sxtb16!(w, ", ror #8"), pair[1], smlad(sxtb16!(w), pair[0], sum)));
            let row_scale = f32::from_bits(row_scales.get(i / 2)? >> (16 * (i % 2)) << 16);
            *y = f32::from_bits(*bias) + sum as f32 * (row_scale * scale.get());
        }
        Some(())
    }
}
