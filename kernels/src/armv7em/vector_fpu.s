@ Between f32 and integers on the FPU of the hard-float target: the arithmetic of kernels/src/activations.rs and linear.rs.

    .syntax unified
    .thumb
    .fpu fpv4-sp-d16

@ Quantizes r2 (a multiple of 8, > 0) floats at r0 to pairs at r1, shifted left by `shift`; s0 is the factor, s1 1.5 * 2^23.
@ r0: the sum of the integers.
.macro quantize shift
    .section .text.actq_quantize\shift, "ax", %progbits
    .global actq_quantize\shift
    .type actq_quantize\shift, %function
    .thumb_func
    .balign 4
actq_quantize\shift:
    push {r4-r7, lr}
    movs r3, #0
    mov r12, #0x00010001
    .balign 4
1:
    vldmia r0!, {s8-s15}
    .irp x, s8, s9, s10, s11, s12, s13, s14, s15
    vmul.f32 \x, \x, s0
    .endr
    .irp x, s8, s9, s10, s11, s12, s13, s14, s15
    vadd.f32 \x, \x, s1
    .endr
    quantize_pair r4, s8, s9, \shift
    quantize_pair r5, s10, s11, \shift
    quantize_pair r6, s12, s13, \shift
    quantize_pair r7, s14, s15, \shift
    stmia.w r1!, {r4-r7}
    subs r2, r2, #8
    bne.n 1b
    .if \shift
    asrs r0, r3, #\shift
    .else
    mov r0, r3
    .endif
    pop {r4-r7, pc}
    .size actq_quantize\shift, . - actq_quantize\shift
.endm

.macro quantize_pair out, low, high, shift
    vmov \out, lr, \low, \high
    .if \shift
    lsl \out, \out, #\shift
    .endif
    pkhbt \out, \out, lr, lsl #(16 + \shift)
    smlad r3, \out, r12, r3
.endm

    quantize 0
    quantize 1
    quantize 2
    quantize 3

@ y[i] += acc[i] * (scale[i] * s0) for r3 (a multiple of 4, > 0) sums at r0, bf16 scales at r1, y at r2.
    .section .text.actq_scale_add, "ax", %progbits
    .global actq_scale_add
    .type actq_scale_add, %function
    .thumb_func
    .balign 4
actq_scale_add:
    push {r4, r5}
    .balign 4
1:
    vldmia r0!, {s8-s11}
    ldrd r4, r5, [r1], #8
    @ a bf16 is the upper half of an f32
    lsl r12, r4, #16
    bfc r4, #0, #16
    vmov s4, s5, r12, r4
    lsl r12, r5, #16
    bfc r5, #0, #16
    vmov s6, s7, r12, r5
    vldmia r2, {s12-s15}
    vmul.f32 s4, s4, s0
    vmul.f32 s5, s5, s0
    vmul.f32 s6, s6, s0
    vmul.f32 s7, s7, s0
    vcvt.f32.s32 s8, s8
    vcvt.f32.s32 s9, s9
    vcvt.f32.s32 s10, s10
    vcvt.f32.s32 s11, s11
    vmul.f32 s8, s8, s4
    vmul.f32 s9, s9, s5
    vmul.f32 s10, s10, s6
    vmul.f32 s11, s11, s7
    vadd.f32 s12, s12, s8
    vadd.f32 s13, s13, s9
    vadd.f32 s14, s14, s10
    vadd.f32 s15, s15, s11
    vstmia r2!, {s12-s15}
    subs r3, r3, #4
    bne.n 1b
    pop {r4, r5}
    bx lr
    .size actq_scale_add, . - actq_scale_add
    .text
