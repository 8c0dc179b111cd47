//! Cycles of a core, modelled from counted instructions.
//!
//! The counter counts the executions of each instruction, and the jumps away from it. An instruction that was not
//! jumped to follows the one before it in memory, so the pairs of neighbours, on which pipeline stalls depend, are
//! known exactly as well. `timing.rs` has the cost of each. It is a model.
//!
//! A board's flash has wait states. The counter plays every instruction and load in order through the caches of an
//! STM32F4 (see `tools/xtask/insn-count`), so the missed lines are exact for initially empty caches. A line costs the
//! flash's wait states; the next line of code is prefetched while the current one is executed, one cycle per
//! instruction. That is a model, too: fetches of code and data do not delay each other, and RAM has no wait states. An
//! STM32F405 at 168 MHz has 5 wait states.

use std::collections::BTreeMap;
use std::path::Path;

use actq_kernels::cost::Cost;
use anyhow::{Context as _, Result, ensure};
use object::{Object as _, ObjectSection as _, ObjectSymbol as _, SectionKind, SymbolKind};

use crate::Target;
use crate::instruction::{Instruction, Kind, riscv};
use crate::qemu::Region;
use crate::stack::step::Step;
use crate::timing::Timing;

/// Bytes per line of the STM32F4's flash.
const LINE: u64 = 16;

/// Lines of its instruction cache.
pub const CODE_LINES: u64 = 64;

/// The code of a firmware.
#[derive(Clone, Debug)]
pub struct Code {
    sections: Vec<(u64, Vec<u8>)>,
    functions: Vec<Function>,
    timing: Timing,
}

/// A function of a firmware.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Function {
    /// Name, demangled, without its hash.
    pub name: String,
    /// Address, without the Thumb bit.
    pub address: u64,
    /// Size, bytes.
    pub size: u64,
}

impl Code {
    /// Reads the code of an ELF file for a Cortex-M4.
    pub fn read(elf: &Path) -> Result<Self> {
        Self::of(Target::Fpu, elf)
    }

    /// Reads the code of an ELF file for a target.
    pub fn of(target: Target, elf: &Path) -> Result<Self> {
        let data = std::fs::read(elf).with_context(|| format!("cannot read {}", elf.display()))?;
        let file = object::File::parse(&*data).with_context(|| format!("{}: not an ELF file", elf.display()))?;
        let code = file.sections().filter(|s| s.kind() == SectionKind::Text);
        let sections = code.map(|s| Ok((s.address(), s.data()?.to_vec()))).collect::<Result<_>>()?;
        let mut functions: Vec<Function> = file
            .symbols()
            .filter(|s| s.kind() == SymbolKind::Text && s.size() > 0)
            .map(|s| Function {
                name: format!("{:#}", rustc_demangle::demangle(s.name().unwrap_or("?"))),
                address: s.address() & !1,
                size: s.size(),
            })
            .collect();
        functions.sort_by_key(|f| f.address);
        Ok(Self { sections, functions, timing: Timing::of(target) })
    }

    /// Returns the bytes of all code.
    pub fn bytes(&self) -> u64 {
        self.sections.iter().map(|(_, bytes)| bytes.len() as u64).sum()
    }

    /// Returns all functions, by address.
    pub fn functions(&self) -> &[Function] {
        &self.functions
    }

    fn half(&self, address: u64) -> Option<u16> {
        self.sections.iter().find_map(|(start, bytes)| {
            let at = usize::try_from(address.checked_sub(*start)?).ok()?;
            Some(u16::from_le_bytes(bytes.get(at..at + 2)?.try_into().ok()?))
        })
    }

    fn instruction(&self, address: u64) -> Result<Instruction> {
        let first = self.half(address).with_context(|| format!("no code at {address:#x}"))?;
        let second = self.half(address + 2).unwrap_or(0);
        Ok(match self.timing {
            Timing::Hazard3 => riscv::decode(first, second),
            _ => Instruction::decode(first, second),
        })
    }

    /// Visits every executed instruction of a region with its address and its cost.
    fn walk(&self, region: &Region, mut visit: impl FnMut(u64, &Instruction, Cost)) -> Result<()> {
        let mut before: Option<(u64, u64, Instruction)> = None;
        for executed in &region.executed {
            let instruction = self.instruction(executed.address)?;
            // Executions that continued from the instruction before it in memory.
            let (previous, follows) = match &before {
                Some((next, count, instruction)) if *next == executed.address => (Some(instruction), *count),
                _ => (None, 0),
            };
            ensure!(follows <= executed.count, "the counts at {:#x} contradict each other", executed.address);
            let timing = self.timing;
            let mut cycles = (executed.count - follows) * timing.cycles(&instruction);
            cycles += follows * previous.map_or(0, |before| timing.cycles_after(&instruction, before));
            cycles += executed.jumps * timing.taken(&instruction);
            visit(executed.address, &instruction, Cost { instructions: executed.count, cycles });
            before = Some((executed.address + instruction.size, executed.count - executed.jumps, instruction));
        }
        Ok(())
    }

    /// Models the cycles of a region, with flash that delays the fetch of a line by `wait_states` cycles.
    pub fn cycles(&self, region: &Region, wait_states: u64) -> Result<u64> {
        // The fetch of a line takes one cycle more than its wait; an instruction before it takes at least one.
        let fetch = |executed: u64| (wait_states + 1).saturating_sub(executed).min(wait_states);
        let next: u64 = region.next_lines.iter().zip(1..).map(|(lines, executed)| lines * fetch(executed)).sum();
        let mut cycles = wait_states * (region.code_lines + region.data_lines) + next;
        self.walk(region, |_, _, cost| cycles += cost.cycles)?;
        Ok(cycles)
    }

    /// Counts the instructions of a region by kind, in the order of [`Kind::ALL`].
    pub fn by_kind(&self, region: &Region) -> Result<[u64; Kind::ALL.len()]> {
        let mut counts = [0; Kind::ALL.len()];
        self.walk(region, |_, instruction, cost| counts[instruction.class.kind() as usize] += cost.instructions)?;
        Ok(counts)
    }

    /// Computes the cost of a region in each of its functions, the most instructions first.
    pub fn by_function(&self, region: &Region) -> Result<Vec<(String, Cost)>> {
        let mut costs: BTreeMap<&str, Cost> = BTreeMap::new();
        self.walk(region, |address, _, cost| {
            let before = self.functions.partition_point(|f| f.address <= address);
            let function = before.checked_sub(1).and_then(|i| self.functions.get(i));
            let name = function.filter(|f| address < f.address + f.size).map_or("?", |f| &f.name);
            let sum = costs.entry(name).or_default();
            sum.instructions += cost.instructions;
            sum.cycles += cost.cycles;
        })?;
        let mut costs: Vec<_> = costs.into_iter().map(|(name, cost)| (name.to_owned(), cost)).collect();
        costs.sort_by_key(|(_, cost)| std::cmp::Reverse(cost.instructions));
        Ok(costs)
    }

    /// Computes the flash lines of the longest innermost loop of a function that starts at a line: from the target of a
    /// conditional branch back to that branch, with no other such loop inside; 0 without loops. A loop of more than
    /// [`CODE_LINES`] misses at every line of a cache that replaces the least recently used line.
    pub fn longest_inner_loop(&self, function: &Function) -> Result<u64> {
        let mut loops: Vec<(u64, u64)> = Vec::new();
        let mut address = function.address;
        while address < function.address + function.size {
            let instruction = self.instruction(address)?;
            let (first, second) = (self.half(address).unwrap_or(0), self.half(address + 2).unwrap_or(0));
            // CBZ, too, but it only goes forward.
            if let Step::Conditional { to, .. } = Step::decode(u32::try_from(address)?, first, second)
                && (function.address..=address).contains(&to.into())
            {
                loops.push((u64::from(to) - function.address, address - function.address + instruction.size));
            }
            address += instruction.size;
        }
        let contains = |outer: &(u64, u64), inner: &(u64, u64)| outer.0 <= inner.0 && inner.1 <= outer.1;
        let innermost = |at: &&(u64, u64)| !loops.iter().any(|other| other != *at && contains(at, other));
        let lines = |(start, end): &(u64, u64)| end.div_ceil(LINE) - start / LINE;
        Ok(loops.iter().filter(innermost).map(lines).max().unwrap_or(0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::qemu::Executed;

    /// Nested loops, and one that begins in a line's last halfword.
    #[test]
    fn the_longest_inner_loop_has_no_other_inside() -> Result<()> {
        let mut halves = [0xbf00u16; 24];
        halves[3] = 0xd1fd; // bne.n to 0x102
        halves[20] = 0xd1ea; // bne.n to 0x100
        let lines = |halves: &[u16]| {
            let bytes = halves.iter().flat_map(|h| h.to_le_bytes()).collect();
            let function = Function { name: "f".into(), address: 0x100, size: 48 };
            Code { sections: vec![(0x100, bytes)], functions: vec![], timing: Timing::M4 }.longest_inner_loop(&function)
        };
        assert_eq!(lines(&halves)?, 1);
        halves[16] = 0xd1f5; // bne.n to 0x10e
        assert_eq!(lines(&halves)?, 3);
        Ok(())
    }

    #[test]
    fn costs_go_to_kinds_functions_and_lines() -> Result<()> {
        // ldr r1, [sp, #4]; muls r1, r2, r1 | bne.n back to the start
        let bytes = [0x9901u16, 0x4351, 0xd1fc].iter().flat_map(|h| h.to_le_bytes()).collect();
        let function = |name: &str, address, size| Function { name: name.into(), address, size };
        let functions = vec![function("first", 0x100, 4), function("second", 0x104, 2)];
        let code = Code { sections: vec![(0x100, bytes)], functions, timing: Timing::M4 };
        let at = |address, jumps| Executed { address, count: 3, jumps };
        let executed = vec![at(0x100, 0), at(0x102, 0), at(0x104, 2)];
        let region =
            Region { instructions: 9, data_lines: 2, code_lines: 1, next_lines: vec![0, 1, 0, 3, 0, 7], executed };
        assert_eq!(code.by_kind(&region)?, [0, 3, 3, 0, 3, 0]);
        let costs = [
            ("first".to_owned(), Cost { instructions: 6, cycles: 3 * (2 + 1) }),
            ("second".to_owned(), Cost { instructions: 3, cycles: 3 + 2 * 2 }),
        ];
        assert_eq!(code.by_function(&region)?, costs);
        assert_eq!((code.cycles(&region, 0)?, code.cycles(&region, 5)?), (16, 16 + 3 * 5 + 4 + 3 * 2));
        Ok(())
    }
}
