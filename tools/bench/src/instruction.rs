//! Instructions of Armv7E-M with FPU (Thumb-2), as far as their cycles and the stack depend on them.
//!
//! The cycles of each class are from the Cortex-M4 Technical Reference Manual, tables 3-1 and 7-1, for memory without
//! wait states.

/// Cycles to refill the pipeline after a taken branch; the manual gives 1 to 3.
pub(crate) const REFILL: u64 = 2;

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
            Self::Float | Self::FloatAccumulate | Self::FloatDivide | Self::FloatMove => Kind::Float,
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
    /// Core registers of the address.
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
    fn new(size: u64, class: Class) -> Self {
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
        match bits(first, 12, 11) {
            _ if bits(first, 12, 11) != 2 && op & 0x40 != 0 => Self::decode_float(first, second),
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

    /// Returns the cycles after a jump, except for a taken conditional branch.
    pub(crate) fn cycles(&self) -> u64 {
        match self.class {
            Class::Alu | Class::Multiply | Class::IfThen | Class::Float | Class::FloatMove => 1,
            Class::Store | Class::Conditional => 1,
            Class::MultiplyAccumulate | Class::Load | Class::StoreIndexed => 2,
            Class::LoadDouble | Class::StoreDouble | Class::FloatAccumulate => 3,
            Class::Divide => 7,
            Class::FloatDivide => 14,
            Class::LoadMultiple(n) | Class::StoreMultiple(n) => 1 + u64::from(n),
            Class::Return(n) => 1 + u64::from(n) + REFILL,
            Class::Branch => 1 + REFILL,
        }
    }

    /// Returns the cycles after `before`.
    pub(crate) fn cycles_after(&self, before: &Self) -> u64 {
        let memory = matches!(self.class.kind(), Kind::Load | Kind::Store);
        let address_comes_late = before.writes & self.address != 0;
        let computed = matches!(before.class.kind(), Kind::Alu | Kind::Multiply) || before.class == Class::FloatMove;
        let single = matches!(self.class, Class::Load | Class::StoreIndexed);
        let mut cycles = self.cycles();
        if single && before.class == Class::Load && !address_comes_late {
            cycles -= 1; // pipelined
        }
        if memory && computed && address_comes_late {
            cycles += 1;
        }
        if before.class == Class::Float && before.float_writes & self.float_reads != 0 {
            cycles += 1;
        }
        cycles
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(halves: [u16; 2], size: u64, class: Class, writes: u32, address: u32) {
        let decoded = Instruction::decode(halves[0], halves[1]);
        let expected = (size, class, writes, address);
        assert_eq!((decoded.size, decoded.class, decoded.writes, decoded.address), expected, "{halves:x?}");
    }

    #[test]
    fn known_encodings_decode() {
        check([0x18d1, 0x0000], 2, Class::Alu, 0x0002, 0x0000); // adds r1, r2, r3
        check([0x2b04, 0x0000], 2, Class::Alu, 0x0000, 0x0000); // cmp r3, #4
        check([0x4211, 0x0000], 2, Class::Alu, 0x0000, 0x0000); // tst r1, r2
        check([0x4699, 0x0000], 2, Class::Alu, 0x0200, 0x0000); // mov r9, r3
        check([0x4351, 0x0000], 2, Class::Multiply, 0x0002, 0x0000); // muls r1, r2, r1
        check([0x4770, 0x0000], 2, Class::Branch, 0x0000, 0x0000); // bx lr
        check([0x4a02, 0x0000], 2, Class::Load, 0x0004, 0x0000); // ldr r2, [pc, #8]
        check([0x50d1, 0x0000], 2, Class::StoreIndexed, 0x0000, 0x000c); // str r1, [r2, r3]
        check([0x5cd1, 0x0000], 2, Class::Load, 0x0002, 0x000c); // ldrb r1, [r2, r3]
        check([0x9901, 0x0000], 2, Class::Load, 0x0002, 0x2000); // ldr r1, [sp, #4]
        check([0x8063, 0x0000], 2, Class::Store, 0x0000, 0x0010); // strh r3, [r4, #2]
        check([0xb5f0, 0x0000], 2, Class::StoreMultiple(5), 0x0000, 0x2000); // push {r4, r5, r6, r7, lr}
        check([0xbd10, 0x0000], 2, Class::Return(2), 0x0010, 0x0000); // pop {r4, pc}
        check([0xbc30, 0x0000], 2, Class::LoadMultiple(2), 0x0030, 0x2000); // pop {r4, r5}
        check([0xbf08, 0x0000], 2, Class::IfThen, 0x0000, 0x0000); // it eq
        check([0xb2d1, 0x0000], 2, Class::Alu, 0x0002, 0x0000); // uxtbeq r1, r2
        check([0xcb03, 0x0000], 2, Class::LoadMultiple(2), 0x000b, 0x0008); // ldmia r3!, {r0, r1}
        check([0xbf00, 0x0000], 2, Class::Alu, 0x0000, 0x0000); // nop
        check([0xe8b1, 0x0078], 4, Class::LoadMultiple(4), 0x007a, 0x0002); // ldmia.w r1!, {r3, r4, r5, r6}
        check([0xe8bd, 0x8ff0], 4, Class::Return(9), 0xaff0, 0x2000); // ldmia.w sp!, {r4, r5, r6, r7, r8, r9, sl, fp, pc}
        check([0xe8a8, 0x0078], 4, Class::StoreMultiple(4), 0x0100, 0x0100); // stmia.w r8!, {r3, r4, r5, r6}
        check([0xe8f0, 0xab02], 4, Class::LoadDouble, 0x0c00, 0x0001); // ldrd sl, fp, [r0], #8
        check([0xe9cd, 0x2302], 4, Class::StoreDouble, 0x0000, 0x2000); // strd r2, r3, [sp, #8]
        check([0xe8df, 0xf000], 4, Class::Branch, 0x0000, 0x0000); // tbb [pc, r0]
        check([0xea02, 0x1e39], 4, Class::Alu, 0x4000, 0x0000); // and.w lr, r2, r9, ror #4
        check([0xebb1, 0x0f0e], 4, Class::Alu, 0x0000, 0x0000); // cmp.w r1, lr
        check([0xf24c, 0x0203], 4, Class::Alu, 0x0004, 0x0000); // movw r2, #49155
        check([0xf5a7, 0x4700], 4, Class::Alu, 0x0080, 0x0000); // sub.w r7, r7, #32768
        check([0xf34e, 0x0e13], 4, Class::Alu, 0x4000, 0x0000); // sbfx lr, lr, #0, #20
        check([0xfb2e, 0x5503], 4, Class::Multiply, 0x0020, 0x0000); // smlad r5, lr, r3, r5
        check([0xfb05, 0x9904], 4, Class::MultiplyAccumulate, 0x0200, 0x0000); // mla r9, r5, r4, r9
        check([0xfb02, 0xf103], 4, Class::Multiply, 0x0002, 0x0000); // mul.w r1, r2, r3
        check([0xfb3e, 0x220c], 4, Class::Multiply, 0x0004, 0x0000); // smlawb r2, lr, ip, r2
        check([0xfb17, 0x442a], 4, Class::Multiply, 0x0010, 0x0000); // smlatb r4, r7, sl, r4
        check([0xeac6, 0x4c29], 4, Class::Alu, 0x1000, 0x0000); // pkhtb ip, r6, r9, asr #16
        check([0xfa9c, 0xfc0e], 4, Class::Alu, 0x1000, 0x0000); // sadd16 ip, ip, lr
        check([0xfa3f, 0xfe99], 4, Class::Alu, 0x4000, 0x0000); // uxtb16 lr, r9, ror #8
        check([0xfa07, 0xf78c], 4, Class::Alu, 0x0080, 0x0000); // sxtah r7, r7, ip
        check([0xfbb2, 0xf1f3], 4, Class::Divide, 0x0002, 0x0000); // udiv r1, r2, r3
        check([0xfba3, 0x1204], 4, Class::Multiply, 0x0006, 0x0000); // umull r1, r2, r3, r4
        check([0xf8dd, 0xe024], 4, Class::Load, 0x4000, 0x2000); // ldr.w lr, [sp, #36]
        check([0xf852, 0x1029], 4, Class::Load, 0x0002, 0x0204); // ldr.w r1, [r2, r9, lsl #2]
        check([0xf842, 0x1029], 4, Class::StoreIndexed, 0x0000, 0x0204); // str.w r1, [r2, r9, lsl #2]
        check([0xf8c2, 0x9004], 4, Class::Store, 0x0000, 0x0004); // str.w r9, [r2, #4]
        check([0xecb0, 0x4a08], 4, Class::LoadMultiple(8), 0x0000, 0x0001); // vldmia r0!, {s8-s15}
        check([0xed2d, 0x8a09], 4, Class::StoreMultiple(9), 0x0000, 0x2000); // vpush {s16-s24}
        check([0xed93, 0x1a02], 4, Class::Load, 0x0000, 0x0008); // vldr s2, [r3, #8]
        check([0xed83, 0x1a02], 4, Class::Store, 0x0000, 0x0008); // vstr s2, [r3, #8]
        check([0xec5e, 0x4a14], 4, Class::FloatMove, 0x4010, 0x0000); // vmov r4, lr, s8, s9
        check([0xec44, 0xca10], 4, Class::FloatMove, 0x0000, 0x0000); // vmov s0, s1, ip, r4
        check([0xee11, 0x0a90], 4, Class::FloatMove, 0x0001, 0x0000); // vmov r0, s3
        check([0xee24, 0x4a80], 4, Class::Float, 0x0000, 0x0000); // vmul.f32 s8, s9, s0
        check([0xee38, 0x4a04], 4, Class::Float, 0x0000, 0x0000); // vadd.f32 s8, s16, s8
        check([0xeef8, 0x4ae4], 4, Class::Float, 0x0000, 0x0000); // vcvt.f32.s32 s9, s9
        check([0xee41, 0x0a21], 4, Class::FloatAccumulate, 0x0000, 0x0000); // vmla.f32 s1, s2, s3
        check([0xeee1, 0x0a21], 4, Class::FloatAccumulate, 0x0000, 0x0000); // vfma.f32 s1, s2, s3
        check([0xeec1, 0x0a21], 4, Class::FloatDivide, 0x0000, 0x0000); // vdiv.f32 s1, s2, s3
        check([0xeef1, 0x0ac1], 4, Class::FloatDivide, 0x0000, 0x0000); // vsqrt.f32 s1, s2
        check([0xeef4, 0x0a41], 4, Class::Float, 0x0000, 0x0000); // vcmp.f32 s1, s2
        check([0xeeb0, 0xca40], 4, Class::FloatMove, 0x0000, 0x0000); // vmov.f32 s24, s0
        check([0xeef0, 0x0ac1], 4, Class::Float, 0x0000, 0x0000); // vabs.f32 s1, s2
        check([0xeef1, 0xfa10], 4, Class::FloatMove, 0x8000, 0x0000); // vmrs APSR_nzcv, fpscr
        check([0xd0fe, 0x0000], 2, Class::Conditional, 0x0000, 0x0000); // beq.n d2
        check([0xf47f, 0xaffd], 4, Class::Conditional, 0x0000, 0x0000); // bne.w d2
        check([0xf7ff, 0xbffb], 4, Class::Branch, 0x0000, 0x0000); // b.w d2
        check([0xf7ff, 0xfff9], 4, Class::Branch, 0x0000, 0x0000); // bl d2
        check([0xe7f7, 0x0000], 2, Class::Branch, 0x0000, 0x0000); // b.n d2
        check([0xb101, 0x0000], 2, Class::Conditional, 0x0000, 0x0000); // cbz r1
        check([0xbf00, 0x0000], 2, Class::Alu, 0x0000, 0x0000); // nop
    }

    #[test]
    fn floating_point_registers_follow_the_encoding() {
        let decoded = Instruction::decode(0xee24, 0x4a80); // vmul.f32 s8, s9, s0
        assert_eq!((decoded.float_writes, decoded.float_reads), (1 << 8, 1 << 9 | 1));
        let decoded = Instruction::decode(0xee38, 0x4a04); // vadd.f32 s8, s16, s8
        assert_eq!((decoded.float_writes, decoded.float_reads), (1 << 8, 1 << 16 | 1 << 8));
    }

    #[test]
    fn neighbours_stall_and_overlap() {
        let ldr = |halves: [u16; 2]| Instruction::decode(halves[0], halves[1]);
        let load = ldr([0x9901, 0]); // ldr r1, [sp, #4]
        let other = ldr([0x9a01, 0]); // ldr r2, [sp, #4]
        let chained = ldr([0x680a, 0]); // ldr r2, [r1]
        let address = ldr([0x1889, 0]); // adds r1, r1, r2
        assert_eq!((load.cycles(), other.cycles_after(&load), chained.cycles_after(&load)), (2, 1, 2));
        assert_eq!(chained.cycles_after(&address), 3);
        let multiply = ldr([0xee24, 0x4a80]); // vmul.f32 s8, s9, s0
        let add = ldr([0xee38, 0x4a04]); // vadd.f32 s8, s16, s8
        assert_eq!((add.cycles(), add.cycles_after(&multiply)), (1, 2));
    }
}
