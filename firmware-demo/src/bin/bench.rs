//! Counted kernel calls: each prints a line `name bits group rows cols`, in the order of the counted regions.
//!
//! A region is a whole call: activations from f32, the product, and the results back in f32. The naive loop in f32 is the
//! yardstick.
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
    use actq_kernels::activations::{Prepared, Scale, prepared_words};
    use actq_kernels::format::{Block, BlockShape, Lanes, Width, pack};
    use actq_kernels::linear::RowBlock;
    use cortex_m::singleton;
    use cortex_m_semihosting::hio;

    const ROWS: usize = 256;
    const COLS: usize = 256;

    struct Buffers {
        codes: [u8; ROWS * COLS],
        scales: [u8; ROWS * COLS / 32],
        weights: [f32; ROWS * COLS],
        words: [u32; ROWS * COLS / 4 + ROWS * COLS / 128],
        x: [f32; COLS],
        prepared: [u32; COLS],
        y: [f32; ROWS],
        bias: [f32; ROWS],
        row_scales: [u32; ROWS / 2],
    }

    #[cortex_m_rt::entry]
    fn main() -> ! {
        let buffers = singleton!(: Buffers = Buffers {
            codes: [0; ROWS * COLS],
            scales: [0; ROWS * COLS / 32],
            weights: [0.0; ROWS * COLS],
            words: [0; ROWS * COLS / 4 + ROWS * COLS / 128],
            x: [0.0; COLS],
            prepared: [0; COLS],
            y: [0.0; ROWS],
            bias: [0.5; ROWS],
            row_scales: [0x3c00_3c00; ROWS / 2],
        });
        host::exit(buffers.is_some_and(|buffers| run(buffers).is_some()))
    }

    fn run(b: &mut Buffers) -> Option<()> {
        let mut out = hio::hstdout().ok()?;
        let mut seed = 0x1234_5678u32;
        let mut random = move || {
            seed ^= seed << 13;
            seed ^= seed >> 17;
            seed ^= seed << 5;
            seed
        };
        b.codes.iter_mut().for_each(|c| *c = random() as u8);
        b.scales.iter_mut().for_each(|s| *s = random() as u8);
        b.weights.iter_mut().for_each(|w| *w = random() as i32 as f32);
        b.x.iter_mut().for_each(|x| *x = random() as i32 as f32);
        count::region(|| naive(&b.weights, black_box(&b.x), &mut b.y));
        black_box(&b.y);
        writeln!(out, "naive-f32 32 0 {ROWS} {COLS}").ok()?;
        for width in Width::ALL {
            for group in [0, 32] {
                let shape = BlockShape { width, lanes: Lanes::of(127, group), rows: ROWS, cols: COLS, group };
                let words = b.words.get_mut(..shape.words())?;
                pack(shape, &b.codes, b.scales.get(..ROWS * shape.groups())?, words)?;
                let block = Block::new(shape, words)?;
                let prepared = b.prepared.get_mut(..prepared_words(shape))?;
                let rows = RowBlock { block, scales: &b.row_scales, index: &[], first_row: 0 };
                count::region(|| product(&rows, black_box(&b.x), &b.bias, prepared, &mut b.y))?;
                black_box(&b.y);
                writeln!(out, "gemv {} {group} {ROWS} {COLS}", width.bits()).ok()?;
            }
        }
        Some(())
    }

    fn product(rows: &RowBlock<'_>, x: &[f32], bias: &[f32], prepared: &mut [u32], y: &mut [f32]) -> Option<()> {
        let shape = rows.block.shape();
        let scale = Scale::new(x, 127).ok()?;
        y.copy_from_slice(bias);
        scale.quantize(x, shape, prepared);
        rows.accumulate(&Prepared::new(prepared, shape)?, scale, y);
        Some(())
    }

    #[inline(never)]
    fn naive(weights: &[f32], x: &[f32], y: &mut [f32]) {
        for (row, y) in weights.chunks_exact(COLS).zip(y) {
            *y = row.iter().zip(x).fold(0.0, |sum, (w, x)| sum + w * x);
        }
    }
}
