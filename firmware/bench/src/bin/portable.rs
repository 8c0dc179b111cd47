//! Counted products of 256 x 256 weights by the compiled backend: each prints a line `backend bits lanes group`, in the
//! order of the counted regions.
//!
//! A region is a whole call: activations from f32, the product, and the results back in f32 with row scales and biases.
//! The results are compared with the plain reference's, bit for bit.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(not(target_os = "none"))]
use actq_firmware_bench::main;

#[cfg(target_os = "none")]
mod firmware {
    actq_firmware_support::panic_to_host!();

    use core::fmt::Write as _;
    use core::hint::black_box;

    use actq_firmware_bench::random_words;
    use actq_firmware_support::machine::{entry, singleton};
    use actq_firmware_support::{count, host};
    use actq_kernels::activations::{Plan, Prepared, Scale};
    use actq_kernels::arch::{BACKEND, Tables, reference};
    use actq_kernels::image::RowBlock;
    use actq_kernels::layout::{Block, BlockShape, Lanes, Width, pack};

    const ROWS: usize = 256;
    const COLS: usize = 256;

    struct Buffers {
        codes: [u8; ROWS * COLS],
        scales: [u8; ROWS * COLS / 32],
        words: [u32; ROWS * COLS / 4 + ROWS * COLS / 128],
        prepared: [u32; 5 * COLS],
    }

    #[entry]
    fn main() -> ! {
        let buffers = singleton!(: Buffers = Buffers {
            codes: [0; ROWS * COLS],
            scales: [0; ROWS * COLS / 32],
            words: [0; ROWS * COLS / 4 + ROWS * COLS / 128],
            prepared: [0; 5 * COLS],
        });
        host::exit(buffers.is_some_and(|buffers| run(buffers).is_some()))
    }

    fn run(b: &mut Buffers) -> Option<()> {
        let mut out = host::stdout()?;
        let mut random = random_words();
        b.codes.iter_mut().for_each(|c| *c = random() as u8);
        b.scales.iter_mut().for_each(|s| *s = random() as u8);
        let mut x: [f32; COLS] = core::array::from_fn(|_| random() as i32 as f32);
        let bias: [u32; ROWS] = core::array::from_fn(|_| (random() as i32 as f32).to_bits());
        let row_scales: [u32; ROWS / 2] = core::array::from_fn(|_| 0x3c00_3c00 | random() & 0x7f_007f);
        for lanes in Lanes::ALL {
            let x_max = if lanes == Lanes::Single { 2047 } else { 127 };
            for width in Width::ALL {
                for group in [0, 32] {
                    let shape = BlockShape { width, lanes, rows: ROWS, cols: COLS, group };
                    let words = b.words.get_mut(..shape.words())?;
                    pack(shape, &b.codes, b.scales.get(..ROWS * shape.groups())?, words).ok()?;
                    let block = Block::new(shape, words)?;
                    let rows = RowBlock { block, scales: &row_scales, steps: &[], first_row: 0 };
                    let (plan, prepared) = (Plan::of(&block), &mut b.prepared);
                    let mut y = [0.0; ROWS];
                    let scale = count::region(|| product(&rows, black_box(&mut x), x_max, &bias, prepared, &mut y))?;
                    let prepared = Prepared::new(prepared, &plan)?;
                    for (i, (y, bias)) in y.iter().zip(&bias).enumerate() {
                        let acc = reference::dot(&rows.block, &prepared, i) as f32;
                        let expected = f32::from_bits(*bias) + acc * (rows.scale(i) * scale.get());
                        if y.to_bits() != expected.to_bits() {
                            writeln!(out, "{shape:?}: row {i} is {y}, not {expected}").ok()?;
                            return None;
                        }
                    }
                    writeln!(out, "{:?} {} {lanes:?} {group}", BACKEND, width.bits()).ok()?;
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
    ) -> Option<Scale> {
        let scale = Scale::new(x, x_max).ok()?;
        let plan = Plan::of(&rows.block);
        scale.quantize(x, &plan, prepared)?;
        let (words, tables) = Tables::split(prepared.get_mut(..plan.work(x.len()))?, plan.words());
        rows.apply_with(&Prepared::new(words, &plan)?, tables, scale, Some(bias), y).ok()?;
        Some(scale)
    }
}
