//! Tests of the analysis on programs of a few instructions, with functions 256 bytes apart.

use std::ops::Range;

use super::depth::Depths;
use super::flow::{Callee, frame};
use super::program::{Function, Program};
use super::*;

const PUSH_R4_LR: u16 = 0xb510;
const POP_R4_PC: u16 = 0xbd10;
const SUB_SP_8: u16 = 0xb082;
const ADD_SP_8: u16 = 0xb002;
const BX_LR: u16 = 0x4770;
const BLX_R3: u16 = 0x4798;
const BX_R3: u16 = 0x4718;
const NOP: u16 = 0xbf00;

/// Returns the address of a function.
const fn at(function: u32) -> u32 {
    0x1000 + 0x100 * function
}

/// Encodes BL (`link`) or B.W at an address.
fn far(from: u32, to: u32, link: bool) -> [u16; 2] {
    let offset = to.wrapping_sub(from + 4);
    let [sign, one, two] = [24, 23, 22].map(|bit| (offset >> bit & 1) as u16);
    let high = 0xf000 | sign << 10 | (offset >> 12 & 0x3ff) as u16;
    let jump = if link { 0xd000 } else { 0x9000 };
    [high, jump | (1 ^ one ^ sign) << 13 | (1 ^ two ^ sign) << 11 | (offset >> 1 & 0x7ff) as u16]
}

/// Builds a program of functions `f0`, `f1` and so on.
fn program(functions: &[&[u16]]) -> Program {
    let mut program = Program::default();
    for (i, halves) in functions.iter().enumerate() {
        let address = at(i as u32);
        program.memory.push((address, halves.iter().flat_map(|half| half.to_le_bytes()).collect()));
        let size = 2 * halves.len() as u32;
        program.functions.insert(address, Function { name: format!("f{i}"), address, size });
        program.marks.insert(address, true);
    }
    program
}

/// Returns a function with this many bytes of stack that calls nothing.
fn leaf(bytes: u16) -> [u16; 3] {
    let words = bytes / 4;
    [0xb080 | words, 0xb000 | words, BX_LR]
}

fn frame_of(halves: &[u16]) -> Result<u32> {
    let program = program(&[halves]);
    Ok(frame(&program, &program.functions[&at(0)])?.bytes)
}

fn refused(halves: &[u16]) -> String {
    format!("{:#}", frame_of(halves).expect_err("it is refused"))
}

type Named = (String, u32, bool);

/// Returns the stack of the first function, and its deepest path: names, bytes, and `true` for a call of the next one
/// by a pointer.
fn path(program: &Program) -> Result<(u32, Vec<Named>)> {
    let mut depths = Depths::new(program);
    let calls = depths.path(at(0))?.into_iter().map(|call| (call.function, call.frame, call.by_pointer)).collect();
    Ok((depths.of(at(0))?, calls))
}

#[test]
fn a_frame_is_the_deepest_of_all_paths() -> Result<()> {
    // cbz r0: one path takes 8 more bytes, and returns them.
    assert_eq!(frame_of(&[PUSH_R4_LR, 0xb108, SUB_SP_8, ADD_SP_8, POP_R4_PC])?, 16);
    // Single stores and loads, and floats: str r8, [sp, #-4]!; vpush {d8}; vpop {d8}; ldr r8, [sp], #4.
    assert_eq!(frame_of(&[0xf84d, 0x8d04, 0xed2d, 0x8b02, 0xecbd, 0x8b02, 0xf85d, 0x8b04, BX_LR])?, 12);
    // An endless loop.
    assert_eq!(frame_of(&[SUB_SP_8, 0xe7fe])?, 8);
    Ok(())
}

#[test]
fn a_computed_branch_follows_all_its_branches() -> Result<()> {
    // adr r0, the first branch; add.w r0, r0, r1, lsl #2; mov pc, r0
    let choice = [0xa001, 0xeb00, 0x0081, 0x4687];
    let [first, second] = [far(at(0) + 8, at(0) + 16, false), far(at(0) + 12, at(0) + 22, false)];
    let code = [&choice[..], &first, &second, &leaf(8), &[BX_LR]].concat();
    assert_eq!(frame_of(&code)?, 8);
    assert!(refused(&[&[NOP], &choice[1..], &first[..], &[BX_LR; 6]].concat()).contains("is not followed here"));
    assert!(refused(&[&choice[..], &[BX_LR]].concat()).contains("not there"));
    Ok(())
}

#[test]
fn a_loop_may_be_entered_at_any_step() -> Result<()> {
    // and r4, r4, #7; adr.w r8, the first step; adds.w r8, r8, #1; mov.w r10, #4; mla r8, r4, r10, r8; sub sp, #16
    let choice = [0xf004, 0x0407, 0xf20f, 0x0824, 0xf118, 0x0801, 0xf04f, 0x0a04, 0xfb04, 0x880a, 0xb084];
    // strd r1, r3, [sp]; str.w r8, [sp, #8]; mov r1, r0; clrm {r0}; ldr r3, [sp]; ldr.w pc, [sp, #8]
    let branch = [0xe9cd, 0x1300, 0xf8cd, 0x8008, 0x4601, 0xe89f, 0x0001, 0x9b00, 0xf8dd, 0xf008];
    // Eight steps of two instructions, of which one at a time is 4 bytes; add sp, #16.
    let code = |choice: &[u16]| [choice, &branch, &[NOP], &[0x2001; 16], &[0xb004, BX_LR]].concat();
    assert_eq!(frame_of(&code(&choice))?, 16);
    for (place, half) in [(1, 0x040f), (3, 0x0828), (5, 0x0802), (7, 0x0904), (9, 0x8809)] {
        let mut other = choice;
        other[place] = half;
        assert!(refused(&code(&other)).contains("is not followed here"), "{place}");
    }
    Ok(())
}

#[test]
fn instructions_after_it_share_one_condition() -> Result<()> {
    // itt ne: addne sp, #8; popne {r4, pc}. Then the same without IT.
    let code = [PUSH_R4_LR, SUB_SP_8, 0xbf1c, ADD_SP_8, POP_R4_PC, SUB_SP_8, 0xb004, POP_R4_PC];
    assert_eq!(frame_of(&code)?, 24);
    // ite eq: subeq sp, #8; subne sp, #8.
    assert_eq!(frame_of(&[0xbf0c, SUB_SP_8, SUB_SP_8, ADD_SP_8, BX_LR])?, 8);
    // it eq: subeq sp, #8.
    assert!(refused(&[0xbf08, SUB_SP_8, ADD_SP_8, BX_LR]).contains("is reached with"));
    // itt eq: cmpeq r1, r0; popeq {r4, pc}.
    assert!(refused(&[PUSH_R4_LR, 0xbf04, 0x4281, POP_R4_PC, POP_R4_PC]).contains("flags that are set after IT"));
    Ok(())
}

#[test]
fn contradicting_paths_are_refused() {
    // cbz r0 skips the 8 bytes.
    assert_eq!(
        refused(&[0xb100, SUB_SP_8, NOP, ADD_SP_8, BX_LR]),
        "0x1004 is reached with 0 and with 8 bytes of stack"
    );
    // A loop that pushes.
    assert!(refused(&[NOP, SUB_SP_8, 0xe7fc]).contains("0x1000 is reached with"));
    assert_eq!(refused(&[SUB_SP_8, BX_LR]), "0x1002 returns with 8 bytes of stack left");
    assert_eq!(refused(&[ADD_SP_8, BX_LR]), "0x1000 pops what the function has not pushed");
    assert_eq!(refused(&[0x4774, BX_LR]), "0x1000: 4774 4770 is not understood"); // bxns lr
    assert_eq!(refused(&[0x46bd, BX_LR]), "0x1000 sets the stack pointer to what is not followed here"); // mov sp, r7
    assert_eq!(refused(&[0x4485, BX_LR]), "0x1000 adds what is not followed here"); // add sp, r0
    assert_eq!(refused(&[BX_LR, SUB_SP_8]), "0x1002 is not reached: a way into it is missing");
    assert_eq!(refused(&[SUB_SP_8]), "0x1002 is reached, where no code of the function is");
}

/// Like the kernels that take groups in pairs: movs r4, #1; b; stmdb sp!, {r2, r7-r9}; cmp.w r0, r0; bne; ldmia sp!,
/// {r2, r7-r9}.
#[test]
fn paths_with_and_without_flag_z_stay_apart() -> Result<()> {
    let mut code = [0x2401, 0xe003, 0xe92d, 0x0384, 0xebb0, 0x0f00, 0xd1fa, 0xe8bd, 0x0384, BX_LR];
    assert_eq!(frame_of(&code)?, 16);
    code[0] = 0x2c00; // cmp r4, #0
    assert!(refused(&code).contains("pops what the function has not pushed"));
    Ok(())
}

#[test]
fn all_entries_of_a_table_are_followed() -> Result<()> {
    // tbb [pc, r0] by 2, 3 and 4, and the filler of the last word.
    let mut program = program(&[&[0xe8df, 0xf000, 0x0302, 0x0004, BX_LR, BX_LR, BX_LR]]);
    program.marks.extend([(0x1004, false), (0x1008, true)]);
    let f0 = &program.functions[&at(0)];
    assert_eq!(frame(&program, f0)?.bytes, 0);
    program.memory[0].1[6] = 9;
    assert!(frame(&program, f0).is_err(), "it leads beyond the function");
    program.memory[0].1[6] = 3;
    assert!(format!("{:#}", frame(&program, f0).expect_err("an entry is missing")).contains("0x100c is not reached"));
    program.marks.clear();
    program.marks.insert(at(0), true);
    assert!(format!("{:#}", frame(&program, f0).expect_err("no data")).contains("not marked as data"));
    Ok(())
}

/// Returns the frame of code of Armv6-M with data at the halves `data`.
fn frame_with_data(halves: &[u16], data: Range<u32>) -> Result<u32> {
    let mut program = program(&[halves]);
    program.marks.extend([(at(0) + 2 * data.start, false), (at(0) + 2 * data.end, true)]);
    Ok(frame(&program, &program.functions[&at(0)])?.bytes)
}

#[test]
fn large_frames_of_armv6m_are_constants_in_data() -> Result<()> {
    // push {r4-r7, lr}; add r7, sp, #12; ldr r6, the constant; add sp, r6; subs r6, r7, #7; subs r6, #5; mov sp, r6;
    // pop {r4-r7, pc}; -1024.
    let code = [0xb5f0, 0xaf03, 0x4e02, 0x44b5, 0x1ffe, 0x3e05, 0x46b5, 0xbdf0, 0xfc00, 0xffff];
    assert_eq!(frame_with_data(&code, 8..10)?, 20 + 1024);
    for (place, half) in [(1, NOP), (2, NOP), (4, NOP), (5, NOP), (5, 0x3e01)] {
        let mut other = code;
        other[place] = half;
        assert!(frame_with_data(&other, 8..10).is_err(), "{place}");
    }
    Ok(())
}

#[test]
fn tables_of_armv6m_are_followed() -> Result<()> {
    // add r0, pc; ldrh r0, [r0, #4]; lsls r0, r0, #1; add pc, r0; two halfwords; a constant.
    let offsets = [&[0x4478, 0x8880, 0x0040, 0x4487, 2, 5, 0x7fff][..], &leaf(8), &[BX_LR]].concat();
    assert_eq!(frame_with_data(&offsets, 4..7)?, 8);
    // adr r3, the words; ldr r3, [r3, r2]; mov pc, r3; a filler; two words.
    let words = [&[0xa301, 0x589b, 0x469f, 0x46c0, 0x1011, 0, 0x1017, 0][..], &leaf(8), &[BX_LR]].concat();
    assert_eq!(frame_with_data(&words, 4..8)?, 8);
    for (code, data, place) in [(&offsets, 4..7, 0), (&offsets, 4..7, 1), (&offsets, 4..7, 2), (&words, 4..8, 0)] {
        let mut other = code.clone();
        other[place] = NOP;
        assert!(frame_with_data(&other, data).is_err(), "{place}");
    }
    Ok(())
}

#[test]
fn a_far_branch_of_armv6m_is_no_call() -> Result<()> {
    let [high, low] = far(at(0) + 2, at(0) + 8, true);
    let program = program(&[&[PUSH_R4_LR, high, low, 0x46c0, POP_R4_PC]]);
    let frame = frame(&program, &program.functions[&at(0)])?;
    assert_eq!((frame.bytes, frame.calls.len()), (8, 0));
    // cmp r0, r0; beq past a branch, which no path reaches.
    assert_eq!(frame_of(&[0x4280, 0xd000, 0xe7fe, BX_LR])?, 0);
    assert!(refused(&[0x4280, 0xd000, 0x2001, BX_LR]).contains("is not reached"));
    Ok(())
}

#[test]
fn calls_and_tail_calls_count_at_their_depth() -> Result<()> {
    let [call, jump] = [far(at(0) + 4, at(1), true), far(at(0) + 12, at(2), false)];
    // pop.w {r4, lr}; b.w: the second callee replaces the first.
    let f0 = [PUSH_R4_LR, NOP, call[0], call[1], 0xe8bd, 0x4010, jump[0], jump[1]];
    let program = program(&[&f0, &[SUB_SP_8, ADD_SP_8, BX_LR], &[0xb085, 0xb005, BX_LR]]);
    let frame = frame(&program, &program.functions[&at(0)])?;
    assert_eq!(frame.calls, [(Callee::Function(at(1)), 8), (Callee::Function(at(2)), 0)].into());
    let names = [("f0", 0, false), ("f2", 20, false)].map(|(name, bytes, by)| (name.to_owned(), bytes, by));
    assert_eq!(path(&program)?, (20, names.to_vec()));
    Ok(())
}

#[test]
fn a_callee_that_never_returns_ends_the_path() -> Result<()> {
    let [one, two] = far(at(0) + 2, at(1), true);
    let program = program(&[&[SUB_SP_8, one, two], &[0xe7fe]]);
    assert_eq!(path(&program)?.0, 8);
    Ok(())
}

#[test]
fn pointers_reach_every_function_with_a_taken_address() -> Result<()> {
    let f0 = [PUSH_R4_LR, BLX_R3, POP_R4_PC];
    let mut by_constant = program(&[&f0, &leaf(16), &leaf(32), &leaf(64)]);
    let error = format!("{:#}", path(&by_constant).expect_err("there is nothing to point to"));
    assert_eq!(error, "f0 calls by a pointer, and no function's address is taken");
    let word = |function: u32| (at(function) | 1).to_le_bytes().to_vec();
    by_constant.memory.push((0x8000, [word(1), word(2)].concat()));
    assert_eq!(path(&by_constant)?.0, 8 + 32);
    by_constant.numbers.push(0x8004..0x8008);
    assert_eq!(path(&by_constant)?.0, 8 + 16);
    // movw r3, #0x1301; movt r3, #0; bx r3.
    let by_code = program(&[&[0xf241, 0x3301, 0xf2c0, 0x0300, BX_R3], &leaf(16), &leaf(32), &leaf(64)]);
    let names = [("f0", 0, true), ("f3", 64, false)].map(|(name, bytes, by)| (name.to_owned(), bytes, by));
    assert_eq!(path(&by_code)?, (64, names.to_vec()));
    // mov r3, lr; bx r3: a return.
    assert_eq!(path(&program(&[&[0x4673, BX_R3]]))?.0, 0);
    // mov r3, lr; adds r3, #1; bx r3: anything.
    assert!(path(&program(&[&[0x4673, 0x3301, BX_R3]])).is_err());
    Ok(())
}

#[test]
fn recursion_is_refused() {
    let [one, two] = far(at(0) + 2, at(1), true);
    let [back, to] = far(at(1) + 2, at(0), true);
    let cycle = program(&[&[PUSH_R4_LR, one, two, POP_R4_PC], &[PUSH_R4_LR, back, to, POP_R4_PC]]);
    let error = format!("{:#}", path(&cycle).expect_err("it is recursive"));
    assert_eq!(error, "called by f0: called by f1: f0 is recursive: its stack has no bound");
    let mut by_pointer = program(&[&[PUSH_R4_LR, BLX_R3, POP_R4_PC]]);
    by_pointer.memory.push((0x8000, (at(0) | 1).to_le_bytes().to_vec()));
    assert!(format!("{:#}", path(&by_pointer).expect_err("it may be recursive")).contains("f0 is recursive"));
    let [one, two] = far(at(0), 0x5000, true);
    let nowhere = program(&[&[one, two, BX_LR]]);
    let error = format!("{:#}", path(&nowhere).expect_err("there is nothing"));
    assert!(error.contains("a call goes to 0x5000, where no function begins"), "{error}");
}

/// Code that ends the program may reset the pointer to the stack's begin, and to nothing else.
#[test]
fn the_stack_pointer_may_be_reset() -> Result<()> {
    // sub sp, #8; movw r2, #0x8000; movt r2, #0x2000; msr msp, r2; sub sp, #8; b .
    let mut program = program(&[&[SUB_SP_8, 0xf248, 0x0200, 0xf2c2, 0x0200, 0xf382, 0x8808, SUB_SP_8, 0xe7fe]]);
    program.symbols.insert("_stack_start".to_owned(), 0x2000_8000);
    assert_eq!(path(&program)?.0, 16);
    program.symbols.insert("_stack_start".to_owned(), 0x2000_4000);
    assert!(path(&program).is_err());
    Ok(())
}

#[test]
fn every_priority_adds_its_deepest_handler() -> Result<()> {
    let mut program = program(&[&leaf(100), &leaf(8), &leaf(16), &leaf(32), &leaf(64), &leaf(4), &leaf(12)]);
    let vectors =
        [at(0), at(1), at(2), at(3), at(3), at(4), 0, at(5), at(6)].map(|address| address | u32::from(address != 0));
    program.vectors = [&[0x2000_8000][..], &vectors].concat();
    program.symbols = [("_stack_start".to_owned(), 0x2000_8000), ("_stack_end".to_owned(), 0x2000_0104)].into();
    let tasks: BTreeMap<_, _> = [("f5".to_owned(), 2), ("f6".to_owned(), 1)].into();
    let found = worst(&program, &tasks)?;
    let levels: Vec<_> = found.levels.iter().map(|level| (level.priority, level.bytes())).collect();
    let expected = [
        (Priority::Thread, 100),
        (Priority::Task(1), 36 + 12),
        (Priority::Task(2), 36 + 4),
        (Priority::Fault, 36 + 64),
        (Priority::HardFault, 36 + 16),
        (Priority::Nmi, 36 + 8),
    ];
    assert_eq!(levels, expected);
    assert_eq!((found.bytes(), found.room), (100 + 5 * 36 + 12 + 4 + 64 + 16 + 8, 0x8000 - 0x2000));
    program.has_fpu = true;
    assert_eq!(worst(&program, &tasks)?.bytes(), found.bytes() + 5 * 72);
    let missing = [("f7".to_owned(), 2)].into();
    assert!(format!("{:#}", worst(&program, &missing).expect_err("there is no f7")).contains("f7"));
    Ok(())
}

#[test]
fn task_priorities_come_from_the_source() -> Result<()> {
    assert_eq!(tasks()?, [("SERIAL".to_owned(), 2), ("SysTick".to_owned(), 4)].into());
    assert_eq!(bound("#[task(binds = UART0, local = [x])]")?, [("UART0".to_owned(), 1)].into());
    assert!(bound("#[task(priority = 1)]").is_err());
    assert!(bound("").is_err());
    Ok(())
}
