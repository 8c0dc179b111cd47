//! The parts of an ELF file that determine the stack of its program.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;
use std::path::Path;

use crate::instruction::Instruction;
use anyhow::{Context as _, Result};
use object::{FileFlags, Object as _, ObjectSection as _, ObjectSymbol as _, SectionFlags, SymbolKind, elf};

/// The section of the vector table, whose addresses the processor calls.
const VECTORS: &str = ".vector_table";

/// Constants that hold no addresses for a call: the built-in image (`firmware-demo/src/bin/controller/start.rs`), the
/// tables of the cost model, and of the examples in C the image, its golden run and the vectors, which the processor
/// calls.
const NUMBERS: [&str; 4] = ["controller::start::BUILT_IN", "actq_kernels::cost::", "policy_", "vectors"];

/// A function.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct Function {
    /// Name, demangled.
    pub(super) name: String,
    /// Address, without the Thumb bit.
    pub(super) address: u32,
    /// Size, bytes.
    pub(super) size: u32,
}

/// A program.
#[derive(Clone, Debug, Default)]
pub(super) struct Program {
    /// Memory content by address: code, constants and initial values.
    pub(super) memory: Vec<(u32, Vec<u8>)>,
    /// Functions by address.
    pub(super) functions: BTreeMap<u32, Function>,
    /// Begins of code (true) and of data within it: the mapping symbols of Arm's ELF (IHI 0044, section 5.5.5).
    pub(super) marks: BTreeMap<u32, bool>,
    /// Address ranges without pointers.
    pub(super) numbers: Vec<Range<u32>>,
    /// Symbols of the linker script.
    pub(super) symbols: BTreeMap<String, u32>,
    /// The vector table: the stack's begin, then the addresses of the handlers, with the Thumb bit.
    pub(super) vectors: Vec<u32>,
    /// `true` if FPU registers pass floats.
    pub(super) has_fpu: bool,
}

impl Program {
    /// Reads an ELF file.
    pub(super) fn read(path: &Path) -> Result<Self> {
        let data = std::fs::read(path).with_context(|| format!("cannot read {}", path.display()))?;
        let file = object::File::parse(&*data).with_context(|| format!("{}: not an ELF file", path.display()))?;
        let mut program = Self::default();
        for section in file.sections() {
            let bytes = section.data()?;
            if section.name() == Ok(VECTORS) {
                program.vectors = bytes.chunks_exact(4).map(word).collect();
            } else if matches!(section.flags(), SectionFlags::Elf { sh_flags, .. } if sh_flags & u64::from(elf::SHF_ALLOC) != 0)
            {
                program.memory.push((u32::try_from(section.address())?, bytes.to_vec()));
            }
        }
        for symbol in file.symbols() {
            let (name, address, size) = (symbol.name()?, symbol.address() as u32, symbol.size() as u32);
            let demangled = format!("{:#}", rustc_demangle::demangle(name));
            if symbol.kind() == SymbolKind::Text {
                let (name, address) = (demangled, address & !1);
                // A function may have several names: take the one with its size.
                if size > 0 || !program.functions.contains_key(&address) {
                    program.functions.insert(address, Function { name, address, size });
                }
            } else if let Some(is_code @ ("t" | "d")) = name.strip_prefix('$').and_then(|name| name.get(..1)) {
                program.marks.insert(address, is_code == "t");
            } else if NUMBERS.iter().any(|name| demangled.starts_with(name)) {
                program.numbers.push(address..address.saturating_add(size));
            } else {
                program.symbols.insert(name.to_owned(), address);
            }
        }
        program.has_fpu =
            matches!(file.flags(), FileFlags::Elf { e_flags, .. } if e_flags & elf::EF_ARM_ABI_FLOAT_HARD != 0);
        Ok(program)
    }

    /// Returns the bytes at an address.
    pub(super) fn bytes<const N: usize>(&self, address: u32) -> Option<[u8; N]> {
        self.memory.iter().find_map(|(start, bytes)| {
            let at = address.checked_sub(*start)? as usize;
            bytes.get(at..at.checked_add(N)?)?.try_into().ok()
        })
    }

    /// Returns the halfword at an address, and the next one, or 0.
    pub(super) fn halves(&self, address: u32) -> Option<[u16; 2]> {
        let half = |address| Some(u16::from_le_bytes(self.bytes(address)?));
        Some([half(address)?, half(address.wrapping_add(2)).unwrap_or(0)])
    }

    /// Returns `true` for an address in a function's code.
    pub(super) fn is_code(&self, address: u32) -> bool {
        let function = self.functions.range(..=address).next_back();
        function.is_some_and(|(start, function)| address - start < function.size)
            && self.marks.range(..=address).next_back().is_some_and(|(_, is_code)| *is_code)
    }

    /// Returns the end of the data that begins at an address or before it.
    pub(super) fn data_end(&self, address: u32) -> Option<u32> {
        self.marks.range(address + 1..).find(|(_, is_code)| **is_code).map(|(end, _)| *end)
    }

    /// Returns a symbol of the linker script.
    pub(super) fn symbol(&self, name: &str) -> Result<u32> {
        self.symbols.get(name).copied().with_context(|| format!("the ELF file has no symbol {name}"))
    }

    /// Returns the possible targets of a pointer: every function whose address occurs among constants or initial
    /// values, or is built by a function's MOVW and MOVT of one register. Functions of the vector table belong to the
    /// processor.
    pub(super) fn taken(&self) -> BTreeSet<u32> {
        let mut taken = BTreeSet::new();
        let mut note = |value: u32| {
            if value & 1 == 1 && self.functions.contains_key(&(value - 1)) {
                taken.insert(value - 1);
            }
        };
        for (start, bytes) in &self.memory {
            let skip = (start.next_multiple_of(4) - start) as usize;
            let words = bytes.get(skip..).unwrap_or_default().chunks_exact(4).map(word);
            for (address, value) in (start.next_multiple_of(4)..).step_by(4).zip(words) {
                if !self.is_code(address) && !self.numbers.iter().any(|range| range.contains(&address)) {
                    note(value);
                }
            }
        }
        for function in self.functions.values() {
            // The lower half of the constant in each register: MOVT completes the latest one.
            let mut low = [None; 16];
            let mut at = function.address;
            while at < function.address + function.size {
                let halves = self.halves(at).filter(|_| self.is_code(at));
                at += halves.map_or(2, |[first, second]| Instruction::decode(first, second).size as u32);
                match halves.and_then(Half::decode) {
                    Some(Half { register, value, is_high: false }) => low[register] = Some(value),
                    Some(Half { register, value: high, .. }) => low[register].map_or((), |low| note(high << 16 | low)),
                    None => {}
                }
            }
        }
        taken
    }
}

/// Half of a constant, from MOVW or MOVT.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Half {
    pub(super) register: usize,
    pub(super) value: u32,
    /// `true` for the upper half.
    pub(super) is_high: bool,
}

impl Half {
    pub(super) fn decode([first, second]: [u16; 2]) -> Option<Self> {
        let is_high = match (first & 0xfbf0, second >> 15) {
            (0xf240, 0) => false,
            (0xf2c0, 0) => true,
            _ => return None,
        };
        let upper = u32::from(first & 0xf) << 12 | u32::from(first & 0x400) << 1;
        let value = upper | u32::from(second & 0x7000) >> 4 | u32::from(second & 0xff);
        Some(Self { register: usize::from(second >> 8 & 0xf), value, is_high })
    }
}

fn word(bytes: &[u8]) -> u32 {
    bytes.iter().rev().fold(0, |word, byte| word << 8 | u32::from(*byte))
}
