@ Between f32 and integers on the FPU of the hard-float target: the arithmetic of kernels/src/activations.rs and linear.rs.

    .syntax unified
    .thumb
    .fpu fpv4-sp-d16

@ Quantizes r2 (> 0) chunks of r3 (> 0) times eight floats at r0. Writes to r1, for each chunk, a start word and its pairs,
@ shifted left by `shift`. s0 is the factor, s1 1.5 * 2^23; the start word is [sp] + [sp+4] * the sum of the chunk's integers.
@ r0: the sum of all integers.
.macro quantize shift
    .section .text.actq_quantize\shift, "ax", %progbits
    .global actq_quantize\shift
    .type actq_quantize\shift, %function
    .thumb_func
    .balign 4
actq_quantize\shift:
    push {r4-r11, lr}
    movs r10, #0
    mov r12, #0x00010001
2:
    mov r9, r1
    adds r1, r1, #4
    movs r8, #0
    mov r11, r3
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
    subs r11, r11, #1
    bne.n 1b
    ldrd r4, r5, [sp, #36]
    .if \shift
    asr r8, r8, #\shift
    .endif
    add r10, r10, r8
    mla r4, r8, r5, r4
    str r4, [r9]
    subs r2, r2, #1
    bne.n 2b
    mov r0, r10
    pop {r4-r11, pc}
    .size actq_quantize\shift, . - actq_quantize\shift
.endm

.macro quantize_pair out, low, high, shift
    vmov \out, lr, \low, \high
    .if \shift
    lsl \out, \out, #\shift
    .endif
    pkhbt \out, \out, lr, lsl #(16 + \shift)
    smlad r8, \out, r12, r8
.endm

    quantize 0
    quantize 1
    quantize 2
    quantize 3

@ two scales; a bf16 is the upper half of an f32
.macro scale_pair low, high, word
    lsl lr, \word, #16
    bfc \word, #0, #16
    vmov \low, \high, lr, \word
.endm

@ y[i] = start[i] + acc[i] * (scale[i] * s0) for [sp] (a multiple of 8, > 0) sums at r0, bf16 scales at r1, start at r2 and y at
@ r3; y may be where the sums or the start are.
    .section .text.actq_scale_add, "ax", %progbits
    .global actq_scale_add
    .type actq_scale_add, %function
    .thumb_func
    .balign 4
actq_scale_add:
    push {r4-r8, lr}
    vpush {s16-s24}
    ldr r8, [sp, #60]
    vmov.f32 s24, s0
    .balign 4
1:
    ldmia.w r1!, {r4-r7}
    vldmia r0!, {s8-s15}
    scale_pair s0, s1, r4
    scale_pair s2, s3, r5
    scale_pair s4, s5, r6
    scale_pair s6, s7, r7
    .irp x, s0, s1, s2, s3, s4, s5, s6, s7
    vmul.f32 \x, \x, s24
    .endr
    .irp x, s8, s9, s10, s11, s12, s13, s14, s15
    vcvt.f32.s32 \x, \x
    .endr
    vldmia r2!, {s16-s23}
    vmul.f32 s8, s8, s0
    vmul.f32 s9, s9, s1
    vmul.f32 s10, s10, s2
    vmul.f32 s11, s11, s3
    vmul.f32 s12, s12, s4
    vmul.f32 s13, s13, s5
    vmul.f32 s14, s14, s6
    vmul.f32 s15, s15, s7
    vadd.f32 s8, s16, s8
    vadd.f32 s9, s17, s9
    vadd.f32 s10, s18, s10
    vadd.f32 s11, s19, s11
    vadd.f32 s12, s20, s12
    vadd.f32 s13, s21, s13
    vadd.f32 s14, s22, s14
    vadd.f32 s15, s23, s15
    vstmia r3!, {s8-s15}
    subs r8, r8, #8
    bne.n 1b
    vpop {s16-s24}
    pop {r4-r8, pc}
    .size actq_scale_add, . - actq_scale_add
    .text
