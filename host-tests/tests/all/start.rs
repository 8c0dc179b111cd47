//! The watchdog outlasts each piece of what holds the application up, at its slowest clock, with signatures.

use std::fs;

use actq_bench::Target;
use actq_bench::cycles::Code;
use actq_bench::firmware::{self, built_in};
use actq_bench::qemu::{self, Counter};
use actq_boards::stm32f405::patience;
use actq_device::keys;
use actq_firmware_demo::patience::PATIENCE;
use anyhow::{Context as _, Result, ensure};

/// An STM32F405 whose crystal is dead: kHz, and the wait states of its flash where the crystal has died late.
const SLOWEST: u64 = 16_000;
const WAIT_STATES: u64 = 5;

/// The oscillator of its watchdog may be faster than it says, as `boards/src/stm32f405/patience.rs` has it.
#[test]
fn the_watchdog_waits_for_each_piece_of_a_start_and_of_a_check() -> Result<()> {
    let (elf, counter) = (firmware::binary("start", Target::Fpu)?, Counter::build()?);
    let (code, image) = (Code::read(&elf)?, fs::read(built_in()?)?);
    let key = keys::generate()?;
    let mut input = key.verifying_key().to_bytes().to_vec();
    input.extend(keys::sign(&key, &image, 1)?.check(&image)?);
    let mut command = qemu::command(&elf, Some(built_in()?), "")?;
    counter.attach(&mut command, &elf)?;
    let output = qemu::run(command, &input)?;
    ensure!(output.status.success(), "{output:?}");
    let (names, regions) = (String::from_utf8(output.stdout)?, counter.regions()?);
    ensure!(names.lines().count() == regions.len(), "{} regions: {names}", regions.len());
    for piece in ["key", "turn", "long", "start", "image"] {
        let of_piece = names.lines().zip(&regions).filter(|(name, _)| *name == piece).map(|(_, region)| region);
        let longest = of_piece.max_by_key(|region| region.instructions).context("it has run")?;
        let (instructions, cycles) = (longest.instructions, code.cycles(longest, WAIT_STATES)?);
        let (took, waits) = (cycles / SLOWEST, if piece == "turn" { PATIENCE.turn } else { PATIENCE.long });
        println!("{piece:6} {instructions:9} instructions {cycles:9} cycles {took:5} ms");
        assert!(took < patience::milliseconds(waits).into(), "{piece}: {took} ms");
        // Where a signature is checked, by the update and by the start, it takes most.
        assert!(!["long", "start"].contains(&piece) || instructions > 2_000_000, "{piece}: {instructions}");
    }
    Ok(())
}
