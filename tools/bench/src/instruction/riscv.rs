//! Instructions of RV32IMAC with Zba and Zbb (The RISC-V Instruction Set Manual, volume I, chapters 34 and 27).

use super::{Class, Instruction, bits};

/// Returns the set of register `n`; the register 0 is in none.
fn set(n: u32) -> u32 {
    if n == 0 { 0 } else { 1 << n }
}

/// Decodes an instruction from its first halfword and the next one.
pub(crate) fn decode(first: u16, second: u16) -> Instruction {
    if first & 3 != 3 {
        return decode_compressed(first);
    }
    let word = u32::from(second) << 16 | u32::from(first);
    let field = |low: u32, len: u32| word >> low & ((1 << len) - 1);
    let (to, one, two) = (set(field(7, 5)), set(field(15, 5)), set(field(20, 5)));
    let (class, writes, address) = match (field(0, 7), field(25, 7), field(12, 3)) {
        (0x03, ..) => (Class::Load, to, one),
        (0x23, ..) => (Class::Store, 0, one | two),
        (0x33, 1, 0..4) => (Class::Multiply, to, one | two),
        (0x33, 1, _) => (Class::Divide, to, one | two),
        (0x33, ..) => (Class::Alu, to, one | two),
        (0x13, ..) => (Class::Alu, to, one),
        (0x63, ..) => (Class::Conditional, 0, one | two),
        (0x67, ..) => (Class::Branch, to, one),
        (0x6f, ..) => (Class::Branch, to, 0),
        (0x2f, ..) => (Class::Load, to, one | two),
        // LUI, AUIPC, fences and system instructions.
        _ => (Class::Alu, to, 0),
    };
    Instruction { writes, address, ..Instruction::new(4, class) }
}

fn decode_compressed(half: u16) -> Instruction {
    // Registers of three bits are 8 to 15.
    let short = |low: u32| set(8 + bits(half, low + 2, low));
    let (full, last) = (set(bits(half, 11, 7)), set(bits(half, 6, 2)));
    let sp = set(2);
    let (class, writes, address) = match (half & 3, bits(half, 15, 13)) {
        (0, 0) => (Class::Alu, short(2), sp),
        (0, 2) => (Class::Load, short(2), short(7)),
        (0, _) => (Class::Store, 0, short(7) | short(2)),
        (1, 1) => (Class::Branch, set(1), 0),
        (1, 2) => (Class::Alu, full, 0),
        (1, 5) => (Class::Branch, 0, 0),
        (1, 6 | 7) => (Class::Conditional, 0, short(7)),
        (1, 4) if bits(half, 11, 10) == 3 => (Class::Alu, short(7), short(7) | short(2)),
        (1, 4) => (Class::Alu, short(7), short(7)),
        (1, _) => (Class::Alu, full, full),
        (_, 2) => (Class::Load, full, sp),
        (_, 6) => (Class::Store, 0, sp | last),
        (_, 4) if last == 0 && full != 0 => (Class::Branch, if bits(half, 12, 12) == 1 { set(1) } else { 0 }, full),
        (_, 4) if bits(half, 12, 12) == 0 => (Class::Alu, full, last),
        (_, 4) => (Class::Alu, full, full | last),
        _ => (Class::Alu, full, full),
    };
    Instruction { writes, address, ..Instruction::new(2, class) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn classes_and_registers_are_those_of_the_manual() {
        // The words are those of GNU as for rv32imac_zba.
        let cases: [(u32, Class, u32, u32); 14] = [
            (0x0005_2583, Class::Load, 11, 10),       // lw a1, 0(a0)
            (0x00b5_2223, Class::Store, 0, 10),       // sw a1, 4(a0)
            (0x02b5_0633, Class::Multiply, 12, 10),   // mul a2, a0, a1
            (0x02b5_4633, Class::Divide, 12, 10),     // div a2, a0, a1
            (0x20b5_2633, Class::Alu, 12, 10),        // sh1add a2, a0, a1
            (0xfeb5_1ee3, Class::Conditional, 0, 10), // bne a0, a1, -4
            (0x0000_00ef, Class::Branch, 1, 0),       // jal ra, 0
            (0x0000_8067, Class::Branch, 0, 1),       // jalr x0, 0(ra)
            (0x410c, Class::Load, 11, 10),            // c.lw a1, 0(a0)
            (0xc10c, Class::Store, 0, 10),            // c.sw a1, 0(a0)
            (0x4592, Class::Load, 11, 2),             // c.lwsp a1, 4(sp)
            (0x8082, Class::Branch, 0, 1),            // c.jr ra
            (0x952e, Class::Alu, 10, 10),             // c.add a0, a1
            (0xfd7d, Class::Conditional, 0, 10),      // c.bnez a0, -2
        ];
        for (word, class, writes, address) in cases {
            let instruction = decode(word as u16, (word >> 16) as u16);
            assert_eq!(instruction.class, class, "{word:x}");
            assert_eq!(instruction.size, if word & 3 == 3 { 4 } else { 2 }, "{word:x}");
            assert_eq!(instruction.writes, set(writes), "{word:x}");
            assert!(instruction.address & set(address) == set(address), "{word:x}");
        }
    }
}
