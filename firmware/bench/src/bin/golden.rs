//! Replays golden kernel cases from standard input (see `tools/bench/src/golden.rs`) through the compiled backend and
//! the portable one, and fails at the first sum that differs.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(not(target_os = "none"))]
use actq_firmware_bench::main;

#[cfg(target_os = "none")]
mod firmware {
    actq_firmware_support::panic_to_host!();

    use core::fmt::Write as _;

    use actq_firmware_support::host::{self, File};
    use actq_firmware_support::machine::{entry, singleton};
    use actq_kernels::activations::{Plan, Prepared, Scale};
    use actq_kernels::arch::{BACKEND, Product, gemv, portable};
    use actq_kernels::image::RowBlock;
    use actq_kernels::layout::{Block, BlockShape, Lanes, Width};

    /// Words of the largest case's weights and activations.
    const WORDS: usize = if cfg!(actq_small) { 1536 } else { 16 * 1024 };
    const ROWS: usize = if cfg!(actq_small) { 32 } else { 256 };
    const COLS: usize = if cfg!(actq_small) { 256 } else { 2048 };

    #[entry]
    fn main() -> ! {
        let outcome = run();
        if let Some(mut out) = host::stdout() {
            let _ = match outcome {
                Ok(cases) => writeln!(out, "{:?}: {cases} cases", BACKEND),
                Err((case, why)) => writeln!(out, "{:?}: case {case}: {why}", BACKEND),
            };
        }
        host::exit(outcome.is_ok())
    }

    fn run() -> Result<usize, (usize, &'static str)> {
        let input = File::open(c"/dev/stdin", false).ok_or((0, "standard input cannot be opened"))?;
        let buffer = singleton!(: [u32; WORDS] = [0; WORDS]).ok_or((0, "buffer"))?;
        let mut case = 0;
        loop {
            match play(&input, buffer) {
                Ok(true) => case += 1,
                Ok(false) => return Ok(case),
                Err(why) => return Err((case, why)),
            }
        }
    }

    fn read(input: &File, words: &mut [u32]) -> Result<(), &'static str> {
        if input.read_exact(bytemuck::cast_slice_mut(words)) { Ok(()) } else { Err("the stream is truncated") }
    }

    /// Replays a case; returns `false` at the end of the stream.
    fn play(input: &File, buffer: &mut [u32]) -> Result<bool, &'static str> {
        let mut head = [0u32; 6];
        read(input, &mut head[..1])?;
        if head[0] == 0 {
            return Ok(false);
        }
        read(input, &mut head[1..])?;
        let [bits, lanes, rows, cols, group, start] = head.map(|w| w as usize);
        let width = Width::from_bits(bits as u32).ok_or("width")?;
        let lanes = Lanes::from_code(lanes as u8).ok_or("lanes")?;
        let shape = BlockShape { width, lanes, rows, cols, group };
        let plan = Plan::new(shape).ok_or("shape")?;
        let weights = start..start + shape.words();
        let x = weights.end + start..weights.end + start + plan.words();
        read(input, buffer.get_mut(weights.clone()).ok_or("the case is too large")?)?;
        read(input, buffer.get_mut(x.clone()).ok_or("the case is too large")?)?;
        let mut expected = [0i32; ROWS];
        let expected = expected.get_mut(..shape.padded_rows()).ok_or("the case is too large")?;
        if !input.read_exact(bytemuck::cast_slice_mut(expected)) {
            return Err("the stream is truncated");
        }
        let block = Block::new(shape, &buffer[weights]).ok_or("shape")?;
        let x = Prepared::new(&buffer[x], &plan).ok_or("activations")?;
        // The sums of padding rows have no meaning.
        let same = |sums: &[i32]| sums.iter().zip(&*expected).take(rows).all(|(a, b)| a == b);
        let mut sums = [0x5555_5555; ROWS];
        gemv(&block, &x, 0, &mut sums[..shape.padded_rows()]).map_err(|_| "mismatch")?;
        if !same(&sums) {
            return Err("sums of the compiled backend differ");
        }
        if sums[shape.padded_rows()..].iter().any(|s| *s != 0x5555_5555) {
            return Err("the compiled backend wrote past its output");
        }
        sums = [0; ROWS];
        portable::gemv(Product::new(&block, &x, 0, &mut sums[..shape.padded_rows()]).map_err(|_| "mismatch")?);
        if !same(&sums) {
            return Err("sums of the portable backend differ");
        }
        float_path(&block, &x, &expected[..rows])?;
        Ok(true)
    }

    /// Checks the path from f32 to f32 with the case's numbers. Integers whose largest magnitude is the limit have the
    /// scale 1, so the prepared vector must equal the case's, word for word.
    fn float_path(block: &Block<'_>, x: &Prepared<'_>, sums: &[i32]) -> Result<(), &'static str> {
        let shape = block.shape();
        let mut floats = [0f32; COLS];
        let floats = floats.get_mut(..shape.cols).ok_or("the case is too large")?;
        floats.iter_mut().enumerate().for_each(|(col, f)| *f = f32::from(x.value(col)));
        let limit = floats.iter().fold(1, |limit, f| (f.abs() as u16).max(limit));
        let scale = Scale::new(floats, limit).map_err(|_| "the largest magnitude is not finite")?;
        let mut words = [0x5555_5555; 2 * COLS];
        let prepared = scale.quantize(floats, x.plan(), &mut words).ok_or("the case is too large")?;
        if prepared.words() != x.words() {
            return Err("the quantized vector differs");
        }
        let room = x.plan().room(shape.cols);
        if words[room..].iter().any(|w| *w != 0x5555_5555) {
            return Err("the quantizer wrote past its buffer");
        }
        let scales: [u32; ROWS / 2] = core::array::from_fn(|i| 0x3c80_3f00 + 0x0001_0003 * i as u32);
        let start: [u32; ROWS] = core::array::from_fn(|i| (i as f32 - 7.5).to_bits());
        let rows = RowBlock { block: *block, scales: &scales, steps: &[], first_row: 3 };
        for in_y in [false, true] {
            let mut y = start.map(f32::from_bits);
            rows.apply(x, scale, (!in_y).then_some(&start), &mut y).map_err(|_| "the block's rows do not fit")?;
            for (i, y) in y.iter().enumerate() {
                let start = f32::from_bits(start[i]);
                let sum = i.checked_sub(3).and_then(|row| Some((row, *sums.get(row)?)));
                let expected = sum.map_or(start, |(row, sum)| start + sum as f32 * (rows.scale(row) * scale.get()));
                if y.to_bits() != expected.to_bits() {
                    return Err("the results in f32 differ");
                }
            }
        }
        Ok(())
    }
}
