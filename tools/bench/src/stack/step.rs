//! The effect of a Thumb-2 instruction on the stack pointer and on the program counter (Arm DDI 0403E, chapters A5 and
//! A7; DDI 0553 for the additions of Armv8-M).

use crate::instruction::{Class, Instruction, bits};

/// Register numbers.
pub(super) const SP: u32 = 13;
pub(super) const LR: u32 = 14;
const PC: u32 = 15;

/// The effect of an instruction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Step {
    /// No effect: continues at the next instruction.
    Next,
    /// The stack grows by this many bytes; a negative number shrinks it.
    Stack(i32),
    /// A register's value becomes the main stack pointer.
    SetStack(u32),
    /// The stack shrinks by a register's value.
    AddToStack(u32),
    /// A register's value becomes the stack pointer in use.
    RestoreStack(u32),
    /// IT: this mask and the condition's last bit select which of the next instructions are executed.
    If {
        /// Bits 3 to 0 of the instruction.
        mask: u32,
        /// Bit 4.
        condition: u32,
    },
    /// A conditional branch.
    Conditional {
        /// Target.
        to: u32,
        /// The flag Z when the branch is taken, if Z is its condition.
        zero: Option<bool>,
    },
    /// An unconditional branch.
    Branch(u32),
    /// A branch to a register's value: a return or a tail call.
    BranchRegister(u32),
    /// A branch by a table after the instruction, with entries of this many bytes.
    Table(u32),
    /// A branch by this register's offset from a table after the instruction.
    Offset(u32),
    /// A branch to one of the branches after the instruction, or to an address from a table.
    Branches,
    /// A branch to one of the equal steps after the instruction, by the address in the third word of the stack.
    Steps,
    /// A call.
    Call(u32),
    /// A call of a register's value.
    CallRegister,
    /// A pop of the program counter, with this many bytes in all.
    Return(i32),
    /// UDF: a fault.
    Trap,
    /// The stack pointer or the program counter gets a value that is not followed here.
    Unknown,
}

/// Returns the bytes of this many words.
fn words(count: u32) -> i32 {
    4 * count as i32
}

impl Step {
    /// Decodes the instruction at `address`, from its first halfword and the next one.
    pub(crate) fn decode(address: u32, first: u16, second: u16) -> Self {
        let pc = address.wrapping_add(4);
        let instruction = Instruction::decode(first, second);
        let known = match instruction.size {
            2 => narrow(pc, first),
            _ => transfer(first, second).or_else(|| branch(pc, first, second)).or_else(|| adjust(first, second)),
        };
        let leaves = matches!(instruction.class, Class::Branch | Class::Conditional | Class::Return(_));
        known.unwrap_or(if leaves || instruction.writes & 1 << SP != 0 { Self::Unknown } else { Self::Next })
    }
}

/// Returns the flag Z under a condition that tests only Z: EQ and NE.
fn equal(condition: u32) -> Option<bool> {
    (condition < 2).then_some(condition == 0)
}

/// Returns the flag Z after an instruction outside IT, if known.
pub(super) fn zero_after(before: Option<bool>, first: u16, second: u16) -> Option<bool> {
    let sets = match Instruction::decode(first, second) {
        Instruction { size: 2, .. } => first < 0x4600,
        Instruction { class: Class::Alu, .. } if first >> 8 == 0xfa => first & 0x90 == 0x10 && second & 0xf0 == 0,
        // MSR may write the flags, VMRS does.
        Instruction { class: Class::Alu, .. } => first & 0x10 != 0 || first & 0xffe0 == 0xf380,
        Instruction { class: Class::FloatMove, writes, .. } => writes & 1 << PC != 0,
        _ => false,
    };
    match first {
        _ if !sets => before,
        // MOVS of a constant; CMP of a register with itself.
        _ if first >> 11 == 0b00100 => Some(first & 0xff == 0),
        _ if first & 0xffc0 == 0x4280 && bits(first, 5, 3) == bits(first, 2, 0) => Some(true),
        0xebb0..=0xebbf if second & 0xfff0 == 0x0f00 && first & 0xf == second & 0xf => Some(true),
        _ => None,
    }
}

/// Decodes an instruction of 16 bits.
fn narrow(pc: u32, half: u16) -> Option<Step> {
    let to = |offset: i32| pc.wrapping_add_signed(offset);
    let signed = |width: u32| 2 * ((u32::from(half) << (32 - width)) as i32 >> (32 - width));
    Some(match half >> 8 {
        0xb0 if half & 0x80 == 0 => Step::Stack(-words(bits(half, 6, 0))),
        0xb0 => Step::Stack(words(bits(half, 6, 0))),
        0xb4 | 0xb5 => Step::Stack(words(bits(half, 8, 0).count_ones())),
        0xbc => Step::Stack(-words(bits(half, 7, 0).count_ones())),
        0xbd => Step::Return(words(bits(half, 8, 0).count_ones())),
        0xb1 | 0xb3 | 0xb9 | 0xbb => {
            Step::Conditional { to: pc + (bits(half, 9, 9) << 6 | bits(half, 7, 3) << 1), zero: None }
        }
        0xbf if half & 0xf != 0 => Step::If { mask: bits(half, 3, 0), condition: bits(half, 4, 4) },
        0xd0..=0xdd => Step::Conditional { to: to(signed(8)), zero: equal(bits(half, 11, 8)) },
        0xde => Step::Trap,
        0xe0..=0xe7 => Step::Branch(to(signed(11))),
        0x44 if half & 0x87 == 0x85 => Step::AddToStack(bits(half, 6, 3)),
        0x46 if half & 0x87 == 0x85 => Step::RestoreStack(bits(half, 6, 3)),
        0x44 if half & 0x87 == 0x87 => Step::Offset(bits(half, 6, 3)),
        // MOV to the program counter.
        0x46 if half & 0x87 == 0x87 => Step::Branches,
        // With bit 2 set they change the security state.
        0x47 if half & 0x87 == 0 => Step::BranchRegister(bits(half, 6, 3)),
        0x47 if half & 0x87 == 0x80 => Step::CallRegister,
        _ => return None,
    })
}

/// Decodes loads and stores of 32 bits whose address is the stack pointer.
fn transfer(first: u16, second: u16) -> Option<Step> {
    let (load, write_back) = (first & 0x10 != 0, first & 0x20 != 0);
    let by = |up: bool, bytes: i32| Step::Stack(if up { -bytes } else { bytes });
    if bits(first, 3, 0) != SP {
        return None;
    }
    if [first, second] == [0xf8dd, 0xf008] {
        return Some(Step::Steps);
    }
    let popped = second & 0x8000 != 0;
    Some(match first & 0xfe40 {
        // LDM and STM. Without writeback, the model's set of written registers still contains the stack pointer.
        0xe800 if write_back => match (first & 0x0190, words(u32::from(second).count_ones())) {
            (0x0100, bytes) => Step::Stack(bytes),
            (0x0090, bytes) if popped => Step::Return(bytes),
            (0x0090, bytes) => Step::Stack(-bytes),
            _ => Step::Unknown,
        },
        0xe800 if load && popped => Step::Unknown,
        0xe800 => Step::Next,
        // LDRD and STRD.
        0xe840 if write_back => by(first & 0x80 != 0, words(bits(second, 7, 0))),
        // LDR and STR with an offset of 8 bits and writeback.
        0xf800 | 0xf840 if first & 0x80 == 0 && second & 0x0900 == 0x0900 => {
            let (up, bytes) = (second & 0x0200 != 0, bits(second, 7, 0) as i32);
            match (load && bits(second, 15, 12) == PC, up) {
                (true, true) => Step::Return(bytes),
                (true, false) => Step::Unknown,
                _ => by(up, bytes),
            }
        }
        // VLDM and VSTM.
        0xec00 | 0xec40 if write_back && second & 0x0e00 == 0x0a00 => match first & 0x0190 {
            0x0100 => Step::Stack(words(bits(second, 7, 0))),
            0x0090 => Step::Stack(-words(bits(second, 7, 0))),
            _ => Step::Unknown,
        },
        _ => return None,
    })
}

/// Decodes branches of 32 bits, and the instructions encoded beside them.
fn branch(pc: u32, first: u16, second: u16) -> Option<Step> {
    if first & 0xfff0 == 0xe8d0 && second & 0xffe0 == 0xf000 {
        return Some(if bits(first, 3, 0) == PC { Step::Table(1 + bits(second, 4, 4)) } else { Step::Unknown });
    }
    if first & 0xf800 != 0xf000 || second & 0x8000 == 0 {
        return None;
    }
    let sign = bits(first, 10, 10);
    let [one, two] = [bits(second, 13, 13), bits(second, 11, 11)];
    let to = |offset: u32, width: u32| pc.wrapping_add_signed((offset << (32 - width)) as i32 >> (32 - width));
    let far = || {
        let high = sign << 24 | (1 ^ one ^ sign) << 23 | (1 ^ two ^ sign) << 22;
        to(high | bits(first, 9, 0) << 12 | bits(second, 10, 0) << 1, 25)
    };
    if let Some(step) = low_overhead_loop(pc, first, second) {
        return Some(step);
    }
    Some(match second & 0x5000 {
        0x5000 => Step::Call(far()),
        0x1000 => Step::Branch(far()),
        // BLX to Arm's instruction set, which these processors lack.
        0x4000 => Step::Unknown,
        _ if bits(first, 9, 7) < 7 => {
            let high = sign << 20 | two << 19 | one << 18;
            let to = to(high | bits(first, 5, 0) << 12 | bits(second, 10, 0) << 1, 21);
            Step::Conditional { to, zero: equal(bits(first, 9, 6)) }
        }
        _ if first & 0xfff0 == 0xf7f0 && second & 0xf000 == 0xa000 => Step::Trap,
        // MSR: the main stack pointer; the process stack pointer, and the choice between them.
        _ if first & 0xfff0 == 0xf380 => match bits(second, 7, 0) {
            8 => Step::SetStack(bits(first, 3, 0)),
            9 | 20 => Step::Unknown,
            _ => return None,
        },
        _ => return None,
    })
}

/// Decodes the loops of Armv8.1-M: DLS counts, WLS counts or skips the loop, and LE goes back to its begin or leaves it;
/// also in their forms that end in predicated vectors.
fn low_overhead_loop(pc: u32, first: u16, second: u16) -> Option<Step> {
    if first & 0xff80 != 0xf000 || second & 1 == 0 {
        return None;
    }
    let offset = bits(second, 10, 1) << 2 | bits(second, 11, 11) << 1;
    match (second & 0xf000, bits(first, 3, 0)) {
        (0xc000, PC) => Some(Step::Conditional { to: pc.wrapping_sub(offset), zero: None }),
        (0xc000, _) => Some(Step::Conditional { to: pc.wrapping_add(offset), zero: None }),
        _ if second == 0xe001 => Some(Step::Next),
        _ => None,
    }
}

/// Decodes ADD and SUB of a constant to the stack pointer.
fn adjust(first: u16, second: u16) -> Option<Step> {
    if second & 0x8f00 != 0x0d00 || bits(first, 3, 0) != SP {
        return None;
    }
    let plain = bits(first, 10, 10) << 11 | bits(second, 14, 12) << 8 | bits(second, 7, 0);
    let bytes = match (first & 0xfbe0, plain) {
        (0xf200 | 0xf2a0, _) | (0xf100 | 0xf1a0, 0..0x100) => plain as i32,
        // A constant of repeated bytes is no frame size.
        (0xf100 | 0xf1a0, 0x400..) => i32::try_from((0x80 | plain & 0x7f).rotate_right(plain >> 7)).ok()?,
        _ => return None,
    };
    Some(Step::Stack(if first & 0x00a0 == 0x00a0 { bytes } else { -bytes }))
}

#[cfg(test)]
mod tests {
    use super::*;

    const AT: u32 = 0x100;

    fn check(code: [u16; 2], step: Step) {
        assert_eq!(Step::decode(AT, code[0], code[1]), step, "{code:04x?}");
    }

    #[test]
    fn the_stack_pointer_moves_by_constants() {
        check([0xb5f0, 0], Step::Stack(20)); // push {r4-r7, lr}
        check([0xbc30, 0], Step::Stack(-8)); // pop {r4, r5}
        check([0xb082, 0], Step::Stack(8)); // sub sp, #8
        check([0xb002, 0], Step::Stack(-8)); // add sp, #8
        check([0xe92d, 0x4ff0], Step::Stack(36)); // push.w {r4-r11, lr}
        check([0xe8bd, 0x4010], Step::Stack(-8)); // pop.w {r4, lr}
        check([0xf84d, 0x8d04], Step::Stack(4)); // str r8, [sp, #-4]!
        check([0xf85d, 0x8b04], Step::Stack(-4)); // ldr r8, [sp], #4
        check([0xe96d, 0x2302], Step::Stack(8)); // strd r2, r3, [sp, #-8]!
        check([0xe8fd, 0x3402], Step::Stack(-8)); // ldrd r3, r4, [sp], #8
        check([0xed2d, 0x8b02], Step::Stack(8)); // vpush {d8}
        check([0xed2d, 0x8a09], Step::Stack(36)); // vpush {s16-s24}
        check([0xecbd, 0x8b02], Step::Stack(-8)); // vpop {d8}
        check([0xf5ad, 0x6d9e], Step::Stack(1264)); // sub.w sp, sp, #1264
        check([0xf6ad, 0x2df8], Step::Stack(2808)); // subw sp, sp, #2808
        check([0xf50d, 0x6d9e], Step::Stack(-1264)); // add.w sp, sp, #1264
        check([0xf60d, 0x2df8], Step::Stack(-2808)); // addw sp, sp, #2808
        check([0x46b5, 0], Step::RestoreStack(6)); // mov sp, r6
        check([0x44b5, 0], Step::AddToStack(6)); // add sp, r6
    }

    #[test]
    fn uses_of_the_stack_pointer_leave_it_unchanged() {
        check([0xf1ad, 0x0008], Step::Next); // sub.w r0, sp, #8
        check([0x46ec, 0], Step::Next); // mov r12, sp
        check([0xe88d, 0x5140], Step::Next); // stm.w sp, {r6, r8, r12, lr}
        check([0xe9cd, 0x2302], Step::Next); // strd r2, r3, [sp, #8]
        check([0xf8dd, 0xe024], Step::Next); // ldr.w lr, [sp, #36]
        check([0xf380, 0x8811], Step::Next); // msr basepri, r0
        check([0xf3ef, 0x8008], Step::Next); // mrs r0, msp
    }

    #[test]
    fn unsupported_changes_are_unknown() {
        check([0xebad, 0x0d00], Step::Unknown); // sub.w sp, sp, r0
        check([0xe8ad, 0x5140], Step::Unknown); // stmia sp!, {r6, r8, r12, lr}
        check([0xf382, 0x8809], Step::Unknown); // msr psp, r2
        check([0xf382, 0x8814], Step::Unknown); // msr control, r2
        check([0xf8d0, 0xf000], Step::Unknown); // ldr.w pc, [r0]
        check([0x4774, 0], Step::Unknown); // bxns lr
        check([0xf000, 0xe800], Step::Unknown); // blx, to Arm's instruction set
    }

    #[test]
    fn branches_and_calls_follow_the_encoding() {
        check([0xd0fe, 0], Step::Conditional { to: AT, zero: Some(true) }); // beq.n
        check([0xd1f7, 0], Step::Conditional { to: AT - 14, zero: Some(false) }); // bne.n
        check([0xd3fe, 0], Step::Conditional { to: AT, zero: None }); // blo.n
        check([0xf47f, 0xaffd], Step::Conditional { to: AT - 2, zero: Some(false) }); // bne.w
        check([0xf47f, 0xae00], Step::Conditional { to: AT.wrapping_sub(0x3fc), zero: Some(false) }); // bne.w
        check([0xb101, 0], Step::Conditional { to: AT + 4, zero: None }); // cbz r1
        check([0xe7f7, 0], Step::Branch(AT - 14)); // b.n
        check([0xf7ff, 0xbffb], Step::Branch(AT - 6)); // b.w
        check([0xf7ff, 0xfff9], Step::Call(AT - 10)); // bl
        check([0xf00c, 0xff2c], Step::Call(AT + 4 + 0xce58)); // bl
        check([0x4770, 0], Step::BranchRegister(14)); // bx lr
        check([0x4718, 0], Step::BranchRegister(3)); // bx r3
        check([0x4798, 0], Step::CallRegister); // blx r3
        check([0xe8df, 0xf000], Step::Table(1)); // tbb [pc, r0]
        check([0xe8df, 0xf010], Step::Table(2)); // tbh [pc, r0, lsl #1]
        check([0x46b7, 0], Step::Branches); // mov pc, r6
        check([0x4487, 0], Step::Offset(0)); // add pc, r0
        check([0xf8dd, 0xf008], Step::Steps); // ldr.w pc, [sp, #8]
        check([0xf8dd, 0xf00c], Step::Unknown); // ldr.w pc, [sp, #12]
        check([0xbd10, 0], Step::Return(8)); // pop {r4, pc}
        check([0xe8bd, 0x8ff0], Step::Return(36)); // pop.w {r4-r11, pc}
        check([0xf85d, 0xfb04], Step::Return(4)); // ldr pc, [sp], #4
        check([0xde00, 0], Step::Trap); // udf
        check([0xf7f0, 0xa000], Step::Trap); // udf.w
        check([0xbf08, 0], Step::If { mask: 8, condition: 0 }); // it eq
        check([0xbf1c, 0], Step::If { mask: 12, condition: 1 }); // itt ne
        check([0xf382, 0x8808], Step::SetStack(2)); // msr msp, r2
        check([0xf003, 0xe001], Step::Next); // dlstp.8 lr, r3
        check([0xf042, 0xc015], Step::Conditional { to: AT + 4 + 0x28, zero: None }); // wls lr, r2
        check([0xf00f, 0xc803], Step::Conditional { to: AT + 4 - 6, zero: None }); // le lr
        check([0xf01f, 0xc803], Step::Conditional { to: AT + 4 - 6, zero: None }); // letp lr
    }

    #[test]
    fn flag_z_is_known_only_after_constants() {
        for before in [None, Some(false), Some(true)] {
            let after = |first, second| zero_after(before, first, second);
            assert_eq!([after(0x2401, 0), after(0x2400, 0)], [Some(false), Some(true)]); // movs
            assert_eq!([after(0x4280, 0), after(0xebb0, 0x0f00)], [Some(true); 2]); // cmp r0, r0
            // cmp r1, r0; adds.w r4, r5, r6; vmrs APSR_nzcv, fpscr; msr apsr_nzcvq, r0
            let unknown = [after(0x4281, 0), after(0xeb15, 0x0406), after(0xeef1, 0xfa10), after(0xf380, 0x8800)];
            assert_eq!(unknown, [None; 4]);
            // uxtb16 r2, r3; smlawb r2, r3, r4, r5; stmdb sp!, {r2, r7-r9}; mov r4, r5
            let kept = [after(0xfa3f, 0xf283), after(0xfb33, 0x5204), after(0xe92d, 0x0384), after(0x462c, 0)];
            assert_eq!(kept, [before; 4]);
        }
    }
}
