@ Between f32 and integers. Helium's floats flush subnormal numbers and give default NaNs: each function says why its results do not
@ differ, or stops where they might.

    .syntax unified
    .thumb
    .arch armv8.1-m.main
    .arch_extension mve.fp
    .arch_extension lob

.macro function name
    .section .text.\name, "ax", %progbits
    .global \name
    .type \name, %function
    .thumb_func
    .balign 4
\name:
.endm

@ r0: the largest magnitude of r1 (> 0) floats at r0, as bits shifted left by 1, which drops the sign.
function actq_helium_magnitude
    push {r7, lr}
    movs r2, #0
    lsr lr, r1, #3
    wls lr, lr, 2f
1:
    vldrw.u32 q0, [r0], #16
    vldrw.u32 q1, [r0], #16
    vshl.i32 q0, q0, #1
    vmaxv.u32 r2, q0
    vshl.i32 q1, q1, #1
    vmaxv.u32 r2, q1
    le lr, 1b
2:
    ands r1, r1, #7
    beq 4f
    dlstp.32 lr, r1
3:
    vldrw.u32 q0, [r0], #16
    vshl.i32 q0, q0, #1
    vmaxv.u32 r2, q0
    letp lr, 3b
4:
    mov r0, r2
    pop {r7, pc}
    .size actq_helium_magnitude, . - actq_helium_magnitude

@ Quantizes r1 (> 0) floats at r0 with the factor r3, a normal number or 0, to bytes at r2; r0: their sum. A product is at most
@ 127: a subnormal value or product rounds to 0 anyway.
function actq_helium_quantize
    push {r7, lr}
    mov r12, #0
    lsr lr, r1, #3
    wls lr, lr, 2f
1:
    vldrw.u32 q0, [r0], #16
    vldrw.u32 q1, [r0], #16
    vmul.f32 q0, q0, r3
    vmul.f32 q1, q1, r3
    vcvtn.s32.f32 q0, q0
    vcvtn.s32.f32 q1, q1
    vaddva.s32 r12, q0
    vstrb.32 q0, [r2], #4
    vaddva.s32 r12, q1
    vstrb.32 q1, [r2], #4
    le lr, 1b
2:
    ands r1, r1, #7
    beq 4f
    dlstp.32 lr, r1
3:
    vldrw.u32 q0, [r0], #16
    vmul.f32 q0, q0, r3
    vcvtn.s32.f32 q0, q0
    vaddva.s32 r12, q0
    vstrb.32 q0, [r2], #4
    letp lr, 3b
4:
    mov r0, r12
    pop {r7, pc}
    .size actq_helium_quantize, . - actq_helium_quantize

@ y[i] = start[i] + acc[i] * (scale[i] * x_scale): r0 sums, r1 start, r2 bf16 scales, r3 y, which may be at the address of the sums;
@ [sp] eights of values (> 0), [sp+4] the bits of x_scale. Stops before eight values if one of their numbers was subnormal or
@ became one, which the FPU's flags tell, or if a result is a NaN, for which the comparison sets the flag of an invalid
@ operation. r0: the eights that are left.
function actq_helium_scale
    push {r4, r5, r7, lr}
    ldrd r4, r5, [sp, #16]
    vmrs r12, fpscr
    bic r12, r12, #0x89
    vmsr fpscr, r12
    dls lr, r4
1:
    vldrh.u32 q0, [r2], #8
    vldrh.u32 q1, [r2], #8
    vshl.i32 q0, q0, #16
    vldrw.u32 q2, [r0], #16
    vshl.i32 q1, q1, #16
    vldrw.u32 q3, [r0], #16
    vmul.f32 q0, q0, r5
    vcvt.f32.s32 q2, q2
    vmul.f32 q1, q1, r5
    vcvt.f32.s32 q3, q3
    vmul.f32 q0, q0, q2
    vldrw.u32 q2, [r1], #16
    vmul.f32 q1, q1, q3
    vldrw.u32 q3, [r1], #16
    vadd.f32 q0, q2, q0
    vadd.f32 q1, q3, q1
    vcmp.f32 ge, q0, q1
    vmrs r12, fpscr
    tst r12, #0x89
    bne 2f
    vstrw.32 q0, [r3], #16
    vstrw.32 q1, [r3], #16
    le lr, 1b
    movs r0, #0
    pop {r4, r5, r7, pc}
2:
    mov r0, lr
    pop {r4, r5, r7, pc}
    .size actq_helium_scale, . - actq_helium_scale

@ Sets those of r1 (> 0) floats at r0 to 0 that are negative and finite, by their bits (`relu` in math/functions.rs).
function actq_helium_relu
    push {r7, lr}
    movw r2, #0
    movt r2, #0xff80
    lsr lr, r1, #3
    wls lr, lr, 2f
1:
    vldrw.u32 q0, [r0]
    vldrw.u32 q1, [r0, #16]
    vpt.s32 lt, q0, r2
    vmovt.i32 q0, #0
    vpt.s32 lt, q1, r2
    vmovt.i32 q1, #0
    vstrw.32 q0, [r0], #16
    vstrw.32 q1, [r0], #16
    le lr, 1b
2:
    ands r1, r1, #7
    beq 4f
    dlstp.32 lr, r1
3:
    vldrw.u32 q0, [r0]
    vpt.s32 lt, q0, r2
    vmovt.i32 q0, #0
    vstrw.32 q0, [r0], #16
    letp lr, 3b
4:
    pop {r7, pc}
    .size actq_helium_relu, . - actq_helium_relu

@ ELU of r1 (> 0) floats at r0 (`Ratio` in math/functions.rs); r2: factor, rounding number, p1, p0 and q0. Positive numbers and NaNs
@ stay: they are above minus infinity as signed numbers. For all others the exponent is at most 0. A subnormal value, factor or
@ product is next to numbers of which it changes no bit: the result is 0.
function actq_helium_elu
    push {r4-r9, lr}
    vpush {d8-d9}
    ldm r2, {r3-r7}
    movw r8, #0
    movt r8, #0xff80
    mov r9, #0x3f800000
    dlstp.32 lr, r1
1:
    vldrw.u32 q4, [r0]
    vmul.f32 q1, q4, r3
    vadd.f32 q2, q1, r4
    vsub.f32 q2, q2, r4
    vsub.f32 q1, q1, q2
    vmul.f32 q3, q1, q1
    vmul.f32 q0, q3, r5
    vadd.f32 q0, q0, r6
    vcvt.s32.f32 q2, q2, #28
    vmul.f32 q0, q0, q1
    vadd.f32 q3, q3, r7
    vshr.s32 q2, q2, #3
    vadd.f32 q1, q3, q0
    vadd.i32 q2, q2, r9
    vsub.f32 q3, q3, q0
    vmul.f32 q1, q1, q2
    vsub.f32 q1, q1, q3
    vdiv.f32 s4, s4, s12
    vdiv.f32 s5, s5, s13
    vdiv.f32 s6, s6, s14
    vdiv.f32 s7, s7, s15
    vpt.s32 le, q4, r8
    vmovt q4, q1
    vstrw.32 q4, [r0], #16
    letp lr, 1b
    vpop {d8-d9}
    pop {r4-r9, pc}
    .size actq_helium_elu, . - actq_helium_elu

    .text
