//! Instructions of Armv7E-M with FPU (Thumb-2), as far as their cycles and the stack depend on them.

pub(crate) mod riscv;

/// A class of instructions with the same timing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Class {
    /// Data processing, and everything else that takes one cycle.
    Alu,
    /// Multiplication in one cycle, including the SIMD ones with accumulation.
    Multiply,
    /// MLA and MLS.
    MultiplyAccumulate,
    /// UDIV and SDIV take 2 to 12 cycles.
    Divide,
    /// A load of one register.
    Load,
    /// A store of one register.
    Store,
    /// A store to an address with a register offset.
    StoreIndexed,
    /// LDRD, and VLDR of a double.
    LoadDouble,
    /// STRD, and VSTR of a double.
    StoreDouble,
    /// LDM, POP and VLDM of this many registers.
    LoadMultiple(u32),
    /// STM, PUSH and VSTM of this many registers.
    StoreMultiple(u32),
    /// A load of this many registers, one of them the program counter.
    Return(u32),
    /// An unconditional branch.
    Branch,
    /// A conditional branch.
    Conditional,
    /// IT
    IfThen,
    /// A floating-point operation of one cycle, whose result is ready a cycle later.
    Float,
    /// Floating-point multiplication with accumulation.
    FloatAccumulate,
    /// VDIV and VSQRT.
    FloatDivide,
    /// VMOV, VMRS and VMSR.
    FloatMove,
    /// An instruction of Helium.
    Vector,
}

/// A kind of instructions, for reports.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Kind {
    /// Data processing.
    Alu,
    /// Multiplication, with or without accumulation, and division.
    Multiply,
    /// Loads, including floats.
    Load,
    /// Stores, including floats.
    Store,
    /// Branches, calls and returns.
    Branch,
    /// Floating-point arithmetic and moves.
    Float,
}

impl Kind {
    /// All kinds, in order.
    pub const ALL: [Self; 6] = [Self::Alu, Self::Multiply, Self::Load, Self::Store, Self::Branch, Self::Float];
}

impl Class {
    /// Returns the human-readable name.
    pub fn kind(self) -> Kind {
        match self {
            Self::Alu | Self::IfThen => Kind::Alu,
            Self::Multiply | Self::MultiplyAccumulate | Self::Divide => Kind::Multiply,
            Self::Load | Self::LoadDouble | Self::LoadMultiple(_) => Kind::Load,
            Self::Store | Self::StoreIndexed | Self::StoreDouble | Self::StoreMultiple(_) => Kind::Store,
            Self::Return(_) | Self::Branch | Self::Conditional => Kind::Branch,
            Self::Float | Self::FloatAccumulate | Self::FloatDivide | Self::FloatMove | Self::Vector => Kind::Float,
        }
    }
}

/// A decoded instruction. Registers are bit sets.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Instruction {
    /// Size, bytes: 2 or 4.
    pub size: u64,
    /// Class.
    pub class: Class,
    /// Core registers written.
    pub writes: u32,
    /// Core registers of the address; of RISC-V all that it reads.
    pub address: u32,
    /// Single-precision registers written.
    pub float_writes: u64,
    /// Single-precision registers read.
    pub float_reads: u64,
}

/// Extracts the bits `low ..= high` of a halfword.
pub(crate) fn bits(half: u16, high: u32, low: u32) -> u32 {
    (u32::from(half) >> low) & ((1 << (high - low + 1)) - 1)
}

/// Returns the set of register `n`.
fn set(n: u32) -> u32 {
    1 << n
}

impl Instruction {
    pub(crate) fn new(size: u64, class: Class) -> Self {
        Self { size, class, writes: 0, address: 0, float_writes: 0, float_reads: 0 }
    }

    fn writes(self, registers: u32) -> Self {
        Self { writes: registers, ..self }
    }

    fn address(self, registers: u32) -> Self {
        Self { address: registers, ..self }
    }

    /// Decodes a Thumb-2 instruction from its first halfword and the next one.
    pub fn decode(first: u16, second: u16) -> Self {
        if first >> 11 >= 0b11101 { Self::decode_wide(first, second) } else { Self::decode_narrow(first) }
    }

    fn decode_narrow(half: u16) -> Self {
        let new = |class| Self::new(2, class);
        let alu = |register| new(Class::Alu).writes(set(register));
        let low = bits(half, 2, 0);
        let middle = bits(half, 10, 8);
        match half >> 12 {
            0x0 | 0x1 => alu(low),
            0x2 if bits(half, 11, 11) == 1 => new(Class::Alu), // CMP
            0x2 | 0x3 | 0xa => alu(middle),
            0x4 if bits(half, 11, 11) == 1 => new(Class::Load).writes(set(middle)),
            0x4 if bits(half, 10, 10) == 0 => match bits(half, 9, 6) {
                8 | 10 | 11 => new(Class::Alu), // TST, CMP, CMN
                13 => new(Class::Multiply).writes(set(low)),
                _ => alu(low),
            },
            0x4 => match (bits(half, 9, 8), low | bits(half, 7, 7) << 3) {
                (3, _) | (0 | 2, 15) => new(Class::Branch),
                (1, _) => new(Class::Alu),
                (_, register) => alu(register),
            },
            0x5 => {
                let address = set(bits(half, 5, 3)) | set(bits(half, 8, 6));
                match bits(half, 11, 9) {
                    0..=2 => new(Class::StoreIndexed).address(address),
                    _ => new(Class::Load).writes(set(low)).address(address),
                }
            }
            0x6..=0x9 => {
                let (register, base) = if half >> 12 == 9 { (middle, 13) } else { (low, bits(half, 5, 3)) };
                let load = bits(half, 11, 11) == 1;
                let class = if load { Class::Load } else { Class::Store };
                new(class).writes(if load { set(register) } else { 0 }).address(set(base))
            }
            0xb => match bits(half, 11, 8) {
                0 => alu(13),
                1 | 3 | 9 | 11 => new(Class::Conditional), // CBZ, CBNZ
                4 | 5 => new(Class::StoreMultiple(bits(half, 8, 0).count_ones())).address(set(13)),
                12 => new(Class::LoadMultiple(bits(half, 7, 0).count_ones())).writes(bits(half, 7, 0)).address(set(13)),
                13 => new(Class::Return(bits(half, 8, 0).count_ones())).writes(bits(half, 7, 0)),
                15 if bits(half, 3, 0) != 0 => new(Class::IfThen),
                2 | 10 => alu(low), // extensions, REV
                _ => new(Class::Alu),
            },
            0xc => {
                let list = bits(half, 7, 0);
                let (class, writes) = match bits(half, 11, 11) {
                    1 => (Class::LoadMultiple(list.count_ones()), list),
                    _ => (Class::StoreMultiple(list.count_ones()), 0),
                };
                new(class).writes(writes | set(middle)).address(set(middle))
            }
            0xd if bits(half, 11, 8) < 14 => new(Class::Conditional),
            0xe => new(Class::Branch),
            _ => new(Class::Alu),
        }
    }

    fn decode_wide(first: u16, second: u16) -> Self {
        let new = |class| Self::new(4, class);
        let base = bits(first, 3, 0);
        let result = bits(second, 11, 8);
        let data = bits(second, 15, 12);
        let load = bits(first, 4, 4) == 1;
        let op = bits(first, 10, 4);
        // Comparisons have no result and set the flags.
        let alu = || new(Class::Alu).writes(if result == 15 && load { 0 } else { set(result) });
        // The FPU's coprocessors are 10 and 11; vectors have the other numbers, or none.
        let is_vector = bits(first, 11, 8) == 15 || !matches!(bits(second, 11, 8), 10 | 11);
        match bits(first, 12, 11) {
            1 | 3 if op & 0x40 != 0 && is_vector => new(Class::Vector),
            1 | 3 if op & 0x40 != 0 => Self::decode_float(first, second),
            1 if op & 0x64 == 0 => {
                let list = u32::from(second);
                let class = match (load, list >> 15) {
                    (true, 1) => Class::Return(list.count_ones()),
                    (true, _) => Class::LoadMultiple(list.count_ones()),
                    _ => Class::StoreMultiple(list.count_ones()),
                };
                new(class).writes(if load { list | set(base) } else { set(base) }).address(set(base))
            }
            1 if op & 0x64 == 4 => match load {
                // Table branches, and exclusive accesses, which are like others.
                _ if first & 0xfff0 == 0xe8d0 && second & 0xffe0 == 0xf000 => new(Class::Branch),
                _ if matches!(first & 0xfff0, 0xe840 | 0xe8c0) => new(Class::Store).address(set(base)),
                _ if matches!(first & 0xfff0, 0xe850 | 0xe8d0) => new(Class::Load).writes(set(data)).address(set(base)),
                true => new(Class::LoadDouble).writes(set(data) | set(result)).address(set(base)),
                false => new(Class::StoreDouble).address(set(base)),
            },
            1 => alu(),
            2 if bits(second, 15, 15) == 0 => alu(),
            2 => match (bits(second, 14, 14), bits(second, 12, 12), bits(first, 9, 7)) {
                (1, _, _) | (0, 1, _) => new(Class::Branch),
                (0, 0, 0..7) => new(Class::Conditional),
                // MRS has a result; MSR, hints and barriers have none.
                _ if first & 0xffe0 == 0xf3e0 => new(Class::Alu).writes(set(result)),
                _ => new(Class::Alu),
            },
            _ if op & 0x60 == 0 => {
                let indexed = bits(first, 7, 7) == 0 && bits(second, 11, 6) == 0 && base != 15;
                let address = set(base) | if indexed { set(bits(second, 3, 0)) } else { 0 };
                match (load, data) {
                    (true, 15) => new(Class::Return(1)).address(address),
                    (true, _) => new(Class::Load).writes(set(data)).address(address),
                    _ if indexed => new(Class::StoreIndexed).address(address),
                    _ => new(Class::Store).address(address),
                }
            }
            _ if op & 0x70 == 0x20 => new(Class::Alu).writes(set(result)),
            _ if op & 0x78 == 0x30 => {
                let class = if op == 0x30 && data != 15 { Class::MultiplyAccumulate } else { Class::Multiply };
                new(class).writes(set(result))
            }
            // Long multiplication and division.
            _ => match op & 7 {
                1 | 3 => new(Class::Divide).writes(set(result)),
                _ => new(Class::Multiply).writes(set(result) | set(data)),
            },
        }
    }

    fn decode_float(first: u16, second: u16) -> Self {
        let new = |class| Self::new(4, class);
        let base = bits(first, 3, 0);
        let load = bits(first, 4, 4) == 1;
        let core = bits(second, 15, 12);
        let double = bits(second, 8, 8) == 1;
        // A single's number is its four bits and one more; the modelled code has no doubles.
        let d = 1u64 << (core << 1 | bits(first, 6, 6));
        let n = 1u64 << (base << 1 | bits(second, 7, 7));
        let m = 1u64 << (bits(second, 3, 0) << 1 | bits(second, 5, 5));
        if first & 0xffe0 == 0xec40 {
            let (writes, reads) = if load { (set(core) | set(base), m | m << 1) } else { (0, 0) };
            return Self { float_reads: reads, ..new(Class::FloatMove).writes(writes) };
        }
        if first & 0xfe00 == 0xec00 {
            if bits(first, 8, 8) == 1 && bits(first, 5, 5) == 0 {
                let class = match (double, load) {
                    (true, true) => Class::LoadDouble,
                    (true, false) => Class::StoreDouble,
                    (false, true) => Class::Load,
                    (false, false) => Class::Store,
                };
                return Self { float_writes: if load { d } else { 0 }, ..new(class).address(set(base)) };
            }
            let registers = bits(second, 7, 0);
            let class = if load { Class::LoadMultiple(registers) } else { Class::StoreMultiple(registers) };
            return new(class).address(set(base));
        }
        if bits(second, 4, 4) == 1 {
            let (writes, reads) = if load { (set(core), n) } else { (0, 0) };
            return Self { float_reads: reads, ..new(Class::FloatMove).writes(writes) };
        }
        let (class, float_writes, float_reads) = match bits(first, 7, 4) & 0b1011 {
            0b0000 | 0b0001 | 0b1001 | 0b1010 => (Class::FloatAccumulate, d, n | m),
            0b0010 | 0b0011 => (Class::Float, d, n | m),
            0b1000 => (Class::FloatDivide, d, n | m),
            _ => match (base, bits(second, 7, 6)) {
                (0, 1) | (_, 0 | 2) => (Class::FloatMove, 0, m),
                (1, 3) => (Class::FloatDivide, d, m),
                (4 | 5, _) => (Class::Float, 0, d | m), // VCMP
                _ => (Class::Float, d, m),
            },
        };
        Self { float_writes, float_reads, ..new(class) }
    }
}

#[cfg(test)]
mod tests;
