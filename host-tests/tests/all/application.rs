//! The application on its boards under QEMU: it starts, refuses, acts, is reset, and tells why.

use std::fs;
use std::path::Path;

use actq::runtime::ImageBuffer;
use actq_bench::Target;
use actq_bench::console::Console;
use actq_bench::cycles::Code;
use actq_bench::firmware::{self, built_in, halfword_at};
use anyhow::{Context, Result, ensure};

/// The boards that the application has a device for.
const BOARDS: [Target; 4] = [Target::Fpu, Target::M33, Target::M7, Target::F405];

/// Starts it and waits until it is ready; gives what it said.
fn ready(target: Target, elf: &Path) -> Result<(Console, Vec<String>)> {
    let mut console = Console::start(target, elf, None)?;
    let said = console.lines_until("self-test passed, ready")?;
    Ok((console, said))
}

/// The number that follows `name` in a line.
fn number(line: &str, name: &str) -> Result<u32> {
    let (_, rest) = line.split_once(name).with_context(|| format!("{name:?} is not in {line:?}"))?;
    let number = rest.trim_start().split(|c: char| !c.is_ascii_digit()).next().unwrap_or_default();
    number.parse().with_context(|| format!("{name:?} in {line:?}"))
}

#[test]
fn every_board_starts_and_acts_with_the_bits_of_the_host() -> Result<()> {
    let buffer = ImageBuffer::read(built_in()?)?;
    let image = buffer.image(built_in()?)?;
    for target in BOARDS {
        let (mut console, said) = ready(target, &firmware::controller(target, "")?)?;
        let clock = match target {
            Target::M33 => "clock 20000000 Hz, watchdog runs",
            // QEMU has no clocks for it: the wait for the crystal has ended.
            Target::F405 => "clock 16000000 Hz, without its crystal, watchdog runs",
            _ => "clock 25000000 Hz, watchdog runs",
        };
        let expected = [
            "actq controller, reset by unknown",
            clock,
            &format!("image {}, crc32 {:08x}", image.name(), image.crc()),
            "self-test passed, ready",
        ];
        assert_eq!(said, expected, "{target:?}");
        for step in 0..image.self_test_steps() {
            let (_, action) = image.self_test(step).context("a self-test step is missing")?;
            let bits: String = action.iter().map(|word| format!(" {:08x}", u32::from_le(*word))).collect();
            console.send(b"s")?;
            assert_eq!(console.line()?, format!("action{bits}"), "{target:?}, step {step}");
        }
        console.send(b"?")?;
        let status = console.line()?;
        assert!(status.starts_with("ready, ticks "), "{target:?}: {status}");
        assert!(number(&status, "ticks ")? > 10, "{target:?}: {status}");
        assert_eq!((number(&status, "overruns ")?, number(&status, "lost bytes ")?), (0, 0), "{target:?}: {status}");
    }
    Ok(())
}

/// At 8 kHz, with a head of 330 thousand weights below: no tick is lost, and none begins later or takes longer than a tenth of a
/// period. An instruction takes QEMU 32 ns, and a period 3125 cycles of 40 ns. Twenty steps play chunks of several evaluations.
#[test]
fn a_head_below_leaves_the_tick_alone() -> Result<()> {
    let (mut console, _) = ready(Target::Fpu, &firmware::controller(Target::Fpu, "tick-8khz")?)?;
    for _ in 0..20 {
        console.send(b"s")?;
        assert!(console.line()?.starts_with("action "));
    }
    console.send(b"?")?;
    let status = console.line()?;
    let [ticks, longest, jitter, overruns] =
        ["ticks ", "longest ", "jitter ", "overruns "].map(|name| number(&status, name));
    assert!(ticks? > 800, "{status}");
    assert!(longest? < 312 && jitter? < 312, "{status}");
    assert_eq!(overruns?, 0, "{status}");
    Ok(())
}

#[test]
fn a_damaged_image_is_refused_with_its_reason() -> Result<()> {
    let mut bytes = fs::read(built_in()?)?;
    let middle = bytes.len() / 2;
    bytes[middle] ^= 4;
    let slot = tempfile::NamedTempFile::new()?;
    fs::write(slot.path(), bytes)?;
    for target in BOARDS {
        let mut console = Console::start(target, &firmware::controller(target, "")?, Some(slot.path()))?;
        let said = console.lines_until("image refused")?;
        let last = said.last().map(String::as_str);
        assert_eq!(last, Some("image refused: image checksum differs: the image is damaged, error 7"), "{target:?}");
        console.send(b"s?")?;
        assert_eq!(console.line()?, "no action: not ready", "{target:?}");
        assert!(console.line()?.starts_with("not ready, ticks "), "{target:?}");
    }
    Ok(())
}

/// An image that was checked well, and whose self-test vector is another's.
#[test]
fn an_image_that_fails_its_self_test_is_refused() -> Result<()> {
    let mut bytes = fs::read(built_in()?)?;
    let buffer = ImageBuffer::new(&bytes);
    let image = buffer.image(built_in()?)?;
    let (_, action) = image.self_test(0).context("the image has a self-test")?;
    let action: Vec<u8> = action.iter().flat_map(|word| word.to_ne_bytes()).collect();
    let at = bytes.windows(action.len()).position(|window| window == action).context("its action is in the image")?;
    bytes[at] ^= 1;
    let crc = actq_kernels::image::checksum(&bytes);
    bytes[4 * actq_kernels::image::header::W_CRC..][..4].copy_from_slice(&crc.to_le_bytes());
    let slot = tempfile::NamedTempFile::new()?;
    fs::write(slot.path(), bytes)?;
    let mut console = Console::start(Target::F405, &firmware::controller(Target::F405, "")?, Some(slot.path()))?;
    let said = console.lines_until("image refused")?;
    assert_eq!(said.last().map(String::as_str), Some("image refused: its self-test fails, error 84"));
    Ok(())
}

/// The boards whose watchdog QEMU has. The loop that no longer feeds it goes on, so what it interrupts is somewhere in it.
#[test]
fn the_watchdog_resets_a_loop_without_progress() -> Result<()> {
    for target in [Target::Fpu, Target::M33, Target::M7] {
        let elf = firmware::controller(target, "faults")?;
        let (mut console, _) = ready(target, &elf)?;
        console.send(b"w")?;
        let said = console.lines_until("self-test passed, ready")?;
        assert_eq!(said[0], "actq controller, reset by watchdog", "{target:?}");
        let at = said[1].strip_prefix("before it: watchdog at ").with_context(|| format!("{target:?}: {said:?}"))?;
        halfword_at(&elf, at.get(..8).context("an address")?)?;
        // A crumb is told once.
        console.send(b"p")?;
        assert_eq!(console.line()?, "actq controller, reset by software", "{target:?}");
        assert!(console.line()?.starts_with("before it: panic in line "), "{target:?}");
    }
    Ok(())
}

#[test]
fn a_hard_fault_leaves_its_address() -> Result<()> {
    for target in BOARDS {
        let elf = firmware::controller(target, "faults")?;
        let (mut console, _) = ready(target, &elf)?;
        console.send(b"h")?;
        let said = console.lines_until("self-test passed, ready")?;
        assert_eq!(said[0], "actq controller, reset by software", "{target:?}");
        let at = said[1].strip_prefix("before it: hard fault at ").with_context(|| format!("{target:?}: {said:?}"))?;
        let instruction = halfword_at(&elf, at.get(..8).context("an address")?)? & 0xff00;
        ensure!(instruction == 0xde00, "{target:?}: {said:?} is {instruction:04x}, not the UDF");
        console.send(b"?")?;
        assert!(console.line()?.starts_with("ready"), "{target:?}");
    }
    Ok(())
}

/// There is nothing in the application that panics, nor the text of a panic.
#[test]
fn no_panic_is_in_the_application() -> Result<()> {
    for target in BOARDS {
        let code = Code::read(&firmware::controller(target, "")?)?;
        let names = || code.functions().iter().map(|function| function.name.as_str());
        let telling = ["panic", "core::fmt", "unwind"];
        let found: Vec<&str> = names().filter(|name| telling.iter().any(|part| name.contains(part))).collect();
        assert!(found.is_empty(), "{target:?}: {found:?}");
        assert!(names().any(|name| name.contains("Head")), "{target:?}: nothing is in it");
    }
    Ok(())
}
