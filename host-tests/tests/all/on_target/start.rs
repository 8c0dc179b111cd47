//! The watchdog timeout exceeds each piece that blocks the application, at its slowest clock, with signatures.

use std::fs;
use std::path::Path;

use actq::graph::ops::Linear;
use actq::methods::Activations;
use actq::runtime::ImageBuffer;
use actq_bench::Target;
use actq_bench::cycles::Code;
use actq_bench::firmware::{self, built_in};
use actq_bench::networks::Builder;
use actq_bench::qemu::{self, Counter, Region};
use actq_boards::hal::Watchdog;
use actq_boards::stm32f405::watchdog_time;
use actq_client::keys;
use actq_firmware_demo::image;
use actq_firmware_demo::running::SLICE;
use actq_firmware_demo::timeouts::{MAX_SLICE, TIMEOUTS};
use actq_kernels::Width;
use actq_link::code::Refusal;
use anyhow::{Context as _, Result, ensure};

/// An STM32F405 with a dead crystal: kHz, and the wait states of its flash if the crystal has died late.
const SLOWEST: u64 = 16_000;
const WAIT_STATES: u64 = 5;

/// The program of the pieces of a start and of a check, and the cost of each piece of an image, by its name.
fn pieces(image: &Path) -> Result<(Code, Vec<(String, Region)>)> {
    let elf = firmware::binary("start", Target::Fpu)?;
    let (code, bytes) = (Code::read(&elf)?, fs::read(image)?);
    let key = keys::generate()?;
    let mut input = key.verifying_key().to_bytes().to_vec();
    input.extend(keys::sign(&key, &bytes, 1)?.check(&bytes)?);
    let (names, regions) = Counter::build()?.run(Target::Fpu, &elf, Some(image), &input)?;
    ensure!(names.lines().count() == regions.len(), "{} regions: {names}", regions.len());
    Ok((code, names.lines().map(str::to_owned).zip(regions).collect()))
}

/// The oscillator of its watchdog may be faster than its nominal rate, see `boards/src/stm32f405/watchdog_time.rs`.
#[test]
fn the_watchdog_outlasts_start_and_check() -> Result<()> {
    let (code, regions) = pieces(built_in()?)?;
    for piece in ["key", "turn", "long", "start", "image", "slice"] {
        let of_piece = regions.iter().filter(|(name, _)| name == piece).map(|(_, region)| region);
        let longest = of_piece.max_by_key(|region| region.instructions).context("the piece did not run")?;
        let (instructions, cycles) = (longest.instructions, code.cycles(longest, WAIT_STATES)?);
        let (took, waits) = (cycles / SLOWEST, if piece == "turn" { TIMEOUTS.turn } else { TIMEOUTS.long });
        println!("{piece:6} {instructions:9} instructions {cycles:9} cycles {took:5} ms");
        assert!(took < watchdog_time::milliseconds(waits).into(), "{piece}: {took} ms");
        // A signature check, in the update and at the start, takes the most.
        assert!(!["long", "start"].contains(&piece) || instructions > 2_000_000, "{piece}: {instructions}");
        if piece == "slice" {
            // This is the time between two feeds of the watchdog for any length of a self-test; the longest that an
            // image may need, at the cycles of these instructions, is within a turn of the loop, too.
            assert!((SLICE / 2..=SLICE).contains(&(instructions as u32)), "{instructions}");
            let most = u64::from(MAX_SLICE) * cycles / instructions / SLOWEST;
            assert!(most < watchdog_time::milliseconds(TIMEOUTS.turn).into(), "{most} ms");
        }
    }
    Ok(())
}

/// Counts the feeds of the watchdog.
struct Feeds(usize);

impl Watchdog for Feeds {
    fn start(&mut self, _: u16) -> bool {
        true
    }

    fn feed(&mut self) {
        self.0 += 1;
    }
}

/// An image of one product with a wide row, which is the longest piece: it runs in pieces up to the rule's length, and
/// not beyond it.
#[test]
fn images_with_too_long_pieces_are_refused() -> Result<()> {
    for (cols, outcome) in [(2_000, Ok(())), (24_000, Err(Refusal::Unfit))] {
        let mut builder = Builder::new(cols);
        builder.linear((8, cols), Activations::Int16, |_| Some(Width::W8), 0, false)?;
        let buffer = ImageBuffer::new(&builder.image("wide")?);
        let made = buffer.image(Path::new("wide"))?;
        let (mut scratch, mut feeds) = (vec![0; made.scratch_words()], Feeds(0));
        let lengths = [made.obs_len(), made.act_len()];
        let opened = image::open(buffer.bytes(), &mut scratch, lengths, &mut feeds).map(drop);
        assert_eq!((opened, made.least_budget() > MAX_SLICE), (outcome, outcome.is_err()), "{}", made.least_budget());
        // Before the check; and before a slice that would reach it.
        assert!(if outcome.is_ok() { feeds.0 > made.self_test_steps() } else { feeds.0 == 1 }, "{}", feeds.0);
    }
    Ok(())
}

/// Otherwise 500 operations could make the check of a small image take seconds.
#[test]
fn a_shared_matrix_is_checked_once() -> Result<()> {
    // Groups at 8 bits, and so many columns that the bound from the shape does not suffice: every weight is read.
    const ROWS: usize = 32;
    const COLS: usize = 768;
    const PAIRS: usize = 12;
    let check = |pairs: usize| -> Result<u64> {
        let mut builder = Builder::new(COLS);
        let matrix = |builder: &mut Builder, rows, cols| {
            builder.matrix(rows, cols, Activations::Int8, &vec![Some(Width::W8); rows], 32)
        };
        let (narrow, wide) = (matrix(&mut builder, ROWS, COLS)?, matrix(&mut builder, COLS, ROWS)?);
        let mut value = 0;
        for _ in 0..pairs {
            value = builder.node(Linear { matrix: narrow, bias: vec![0.0; ROWS] }, &[value])?;
            value = builder.node(Linear { matrix: wide, bias: vec![0.0; COLS] }, &[value])?;
        }
        let image = qemu::slot(&builder.image("shared")?)?;
        let (_, regions) = pieces(image.path())?;
        let (_, region) = regions.iter().find(|(name, _)| name == "image").context("the image was not checked")?;
        Ok(region.instructions)
    };
    let (one, many) = (check(1)?, check(PAIRS)?);
    println!("{one} instructions for a pair of operations, {many} for {PAIRS} pairs");
    // More than one for each weight, once; a check for each operation would take 12 times as many.
    assert!(one > (ROWS * COLS) as u64 && many < 3 * one, "{many} for {PAIRS} pairs, {one} for one");
    Ok(())
}
