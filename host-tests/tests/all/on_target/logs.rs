//! The application's log at its start, by defmt over semihosting in QEMU.
//!
//! This module decodes the frames with the crates below defmt-decoder, whose own dependencies take longer to build than
//! all of these tests may.

use std::collections::BTreeMap;
use std::fs;
use std::io::{BufRead as _, BufReader};
use std::path::Path;
use std::process::{Child, Stdio};

use actq::runtime::ImageBuffer;
use actq_bench::Target;
use actq_bench::firmware::{self, built_in};
use actq_link::report::BUILT_IN;
use anyhow::{Context, Result, anyhow, bail, ensure};
use defmt_parser::{DisplayHint, Fragment, ParserMode, Type};
use object::{Object as _, ObjectSection as _, ObjectSymbol as _};

/// The format strings of an ELF file by their index: the names of symbols in a section of their own (defmt's book,
/// Interning).
fn formats(elf: &Path) -> Result<BTreeMap<u16, String>> {
    let data = fs::read(elf)?;
    let file = object::File::parse(&*data)?;
    let section = file.section_by_name(".defmt").context("the ELF file has no section .defmt")?.index();
    let names = file.symbols().filter(|symbol| symbol.section_index() == Some(section));
    let interned = names.filter_map(|symbol| {
        let json: serde_json::Value = serde_json::from_str(symbol.name().ok()?).ok()?;
        Some((symbol.address() as u16, json.get("data")?.as_str()?.to_owned()))
    });
    Ok(interned.collect())
}

/// The text of a frame: the index of its format string, then the arguments, all little-endian.
fn text(formats: &BTreeMap<u16, String>, frame: &[u8]) -> Result<String> {
    let frame = rzcobs::decode(frame).map_err(|error| anyhow!("{error:?}: {frame:02x?}"))?;
    let (index, mut arguments) = frame.split_first_chunk().context("the frame has no index")?;
    let format = formats.get(&u16::from_le_bytes(*index)).context("the ELF file lacks the frame's format string")?;
    let mut text = String::new();
    for fragment in defmt_parser::parse(format, ParserMode::Strict)? {
        match fragment {
            Fragment::Literal(literal) => text += &literal,
            Fragment::Parameter(parameter) => {
                let len = match parameter.ty {
                    Type::U8 => 1,
                    Type::U32 => 4,
                    other => bail!("{other:?} in {format:?}"),
                };
                let (argument, rest) = arguments.split_at_checked(len).context("the frame lacks an argument")?;
                let value = argument.iter().rev().fold(0, |value, byte| value << 8 | u64::from(*byte));
                text += &match parameter.hint {
                    None => value.to_string(),
                    Some(DisplayHint::Hexadecimal { zero_pad, .. }) => format!("{value:0zero_pad$x}"),
                    Some(other) => bail!("{other:?} in {format:?}"),
                };
                arguments = rest;
            }
        }
    }
    // rzCOBS fills the last seven bytes with zeros.
    ensure!(arguments.len() < 7 && arguments.iter().all(|byte| *byte == 0), "{format:?} leaves {arguments:02x?}");
    Ok(text)
}

/// A program that dropping the value ends.
struct Running(Child);

impl Drop for Running {
    fn drop(&mut self) {
        // Nothing to do if it has ended already.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

#[test]
fn the_start_is_logged() -> Result<()> {
    logs_its_start(Target::Fpu, 25_000_000)?;
    logs_its_start(Target::Riscv, 10_000_000)
}

fn logs_its_start(target: Target, clock_hz: u32) -> Result<()> {
    let elf = firmware::controller(target, "defmt-semihosting")?;
    let formats = formats(&elf)?;
    let mut command = target.run(&elf);
    // The watchdog counts the board's time, not that of a machine that may stop QEMU for seconds.
    command.args(["-icount", "shift=5"]);
    let mut running = Running(command.stdin(Stdio::null()).stdout(Stdio::piped()).spawn()?);
    let stream = running.0.stdout.take().context("the program has no output")?;
    // One or more zeros separate frames.
    let frames = BufReader::new(stream).split(0);
    let mut frames = frames.filter(|frame| !frame.as_ref().is_ok_and(Vec::is_empty));
    let crc = ImageBuffer::read(built_in()?)?.image(built_in()?)?.crc();
    let image = format!("image {crc:08x} of slot {BUILT_IN}, refusal 0");
    for expected in [format!("start 1, reset cause 0, {clock_hz} Hz"), image] {
        let frame = frames.next().context("QEMU has ended")??;
        assert_eq!(text(&formats, &frame)?, expected, "{target:?}");
    }
    Ok(())
}
