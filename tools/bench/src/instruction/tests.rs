//! Instructions as the manual decodes them.

use super::*;
use crate::timing::Timing;

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
    let (cycles, after) = (|i| Timing::M4.cycles(i), |i, before| Timing::M4.cycles_after(i, before));
    assert_eq!((cycles(&load), after(&other, &load), after(&chained, &load)), (2, 1, 2));
    assert_eq!(after(&chained, &address), 3);
    let multiply = ldr([0xee24, 0x4a80]); // vmul.f32 s8, s9, s0
    let add = ldr([0xee38, 0x4a04]); // vadd.f32 s8, s16, s8
    assert_eq!((cycles(&add), after(&add, &multiply)), (1, 2));
}
