//! The linker's input: each board's firmware is in the memory of the script that the table of boards names.

use std::collections::BTreeMap;
use std::fs;
use std::ops::Range;

use actq_bench::{Target, firmware, root};
use anyhow::{Context as _, Result};
use object::{Object as _, ObjectSection as _, ObjectSymbol as _};

/// The regions of a linker script, by name.
fn regions(script: &str) -> Result<BTreeMap<String, Range<u64>>> {
    let regions = script.lines().filter_map(|line| line.split_once(" : ORIGIN = "));
    let region = |(name, rest): (&str, &str)| {
        let (origin, length) = rest.split_once(", LENGTH = ")?;
        let (number, unit) = length.trim().split_at(length.trim().len() - 1);
        let origin = u64::from_str_radix(origin.strip_prefix("0x")?, 16).ok()?;
        let length = number.parse::<u64>().ok()?
            << match unit {
                "K" => 10,
                "M" => 20,
                _ => return None,
            };
        Some((name.trim().to_owned(), origin..origin + length))
    };
    regions.map(|line| region(line).with_context(|| format!("cannot parse the region {line:?}"))).collect()
}

#[test]
fn every_board_is_linked_with_its_own_memory() -> Result<()> {
    let mut scripts = BTreeMap::new();
    for target in Target::ALL {
        let board = target.board();
        let regions = regions(&fs::read_to_string(root().join(board.memory))?).context(board.memory)?;
        let ram = regions.get("RAM").with_context(|| format!("{}: no RAM", board.memory))?;
        let program = regions.get("FLASH").unwrap_or(ram).start;
        let elf = fs::read(firmware::harness(target)?)?;
        let file = object::File::parse(&*elf)?;
        let code = file.sections().filter(|section| section.kind() == object::SectionKind::Text).map(|s| s.address());
        let vectors = file.section_by_name(".vector_table").map(|section| section.address());
        assert_eq!(vectors.or(code.min()), Some(program), "{target:?}: not the program memory of {}", board.memory);
        let end = regions.get("STACK").unwrap_or(ram).end;
        let stack = file.symbols().find(|symbol| symbol.name() == Ok("_stack_start")).map(|symbol| symbol.address());
        assert_eq!(stack, Some(end), "{target:?}: not the stack of {}", board.memory);
        scripts.insert(board.memory, (program, end));
    }
    let mut memories: Vec<_> = scripts.values().collect();
    memories.sort();
    memories.dedup();
    assert_eq!(memories.len(), scripts.len(), "two scripts have the same memory: {scripts:?}");
    Ok(())
}
