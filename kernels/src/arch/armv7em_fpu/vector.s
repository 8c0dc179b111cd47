@ Between f32 and integers on the FPU of the hard-float target: the arithmetic of kernels/src/activations/scale.rs and ops/linear.rs.

    .syntax unified
    .thumb
    .fpu fpv4-sp-d16

@ Eight floats at r0 become four pairs of integers r4-r7, shifted left by `shift`. s0 is the factor, s1 1.5 * 2^23.
.macro quantize_eight shift
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
.endm

.macro quantize_pair out, low, high, shift
    vmov \out, lr, \low, \high
    .if \shift
    lsl \out, \out, #\shift
    .endif
    pkhbt \out, \out, lr, lsl #(16 + \shift)
.endm

@ Quantizes r2 groups of r3 chunks of floats at r0; all counts are 1 or more. Writes to r1, for each chunk, its start words and
@ its pairs, and after the chunks of a group, if the layout needs it, the sum of the group's integers.
@
@ [sp] is the number of eights in the first chunk of a group, [sp+4] that in the others; [sp+8] and [sp+12] are the first start
@ word's bias and factor, [sp+16] the second one's factor, [sp+20] not 0 if sums are halves of a word, at shift 2 of the two
@ chunks of a pair of groups, at 3 twice the group's.
@
@ r4-r7 pairs, r8 sum of a chunk, r9 the address of its start words, r10 sum of a group, both sums times 2^shift, r11 remaining eights,
@ r12 a pair of ones. r3 is saved at the frame's start, so [sp] of the call is 40 bytes further.
.macro quantize shift, starts, sum
    .section .text.actq_quantize\shift, "ax", %progbits
    .global actq_quantize\shift
    .type actq_quantize\shift, %function
    .thumb_func
    .balign 4
actq_quantize\shift:
    push {r3-r11, lr}
    mov r12, #0x00010001
3:
    ldr r3, [sp]
    ldr r11, [sp, #40]
    .if \sum
    movs r10, #0
    .endif
2:
    mov r9, r1
    adds r1, r1, #(4 * \starts)
    movs r8, #0
    .balign 4
1:
    quantize_eight \shift
    smlad r8, r4, r12, r8
    smlad r8, r5, r12, r8
    smlad r8, r6, r12, r8
    smlad r8, r7, r12, r8
    stmia.w r1!, {r4-r7}
    subs r11, r11, #1
    bne.n 1b
    ldrd r4, r5, [sp, #48]
    .if \sum
    add r10, r10, r8
    .endif
    .if \shift
    asr r8, r8, #\shift
    .endif
    mla r4, r8, r5, r4
    .if \starts == 2
    ldr r5, [sp, #56]
    mul r5, r8, r5
    strd r4, r5, [r9]
    .else
    str r4, [r9]
    .endif
    ldr r11, [sp, #44]
    subs r3, r3, #1
    bne.n 2b
    .if \sum
    ldr r4, [sp, #60]
    asr r10, r10, #\shift
    cbz r4, 4f
    sub r10, r10, r8
    pkhbt r10, r10, r8, lsl #16
4:
    str r10, [r1], #4
    .endif
    subs r2, r2, #1
    bne.n 3b
    pop {r3-r11, pc}
    .size actq_quantize\shift, . - actq_quantize\shift
.endm

    quantize 0, 1, 0
    quantize 1, 2, 0
    quantize 2, 1, 1

@ As the others, for chunks of eight columns: a chunk is written in one pass, from its start word r3 on. r8 remaining chunks, r9 bias, r11
@ factor.
    .section .text.actq_quantize3, "ax", %progbits
    .global actq_quantize3
    .type actq_quantize3, %function
    .thumb_func
    .balign 4
actq_quantize3:
    push {r3-r11, lr}
    mov r12, #0x00010001
    ldrd r9, r11, [sp, #48]
2:
    ldr r8, [sp]
    movs r10, #0
    .balign 4
1:
    quantize_eight 3
    smuad r3, r4, r12
    smlad r3, r5, r12, r3
    smlad r3, r6, r12, r3
    smlad r3, r7, r12, r3
    asr r3, r3, #3
    add r10, r10, r3
    mla r3, r3, r11, r9
    stmia.w r1!, {r3-r7}
    subs r8, r8, #1
    bne.n 1b
    ldr r4, [sp, #60]
    cbz r4, 4f
    pkhbt r10, r10, r10, lsl #16
4:
    str r10, [r1], #4
    subs r2, r2, #1
    bne.n 2b
    pop {r3-r11, pc}
    .size actq_quantize3, . - actq_quantize3

@ two scales; a bf16 is the upper half of an f32
.macro scale_pair low, high, word
    lsl lr, \word, #16
    bfc \word, #0, #16
    vmov \low, \high, lr, \word
.endm

@ y[i] = start[i] + acc[i] * (scale[i] * s0) for [sp] sums at r0, bf16 scales at r1, start at r2 and y at r3; y may be at the
@ address of the sums or the start.
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
    subs r8, r8, #8
    blo.n 2f
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
    bhs.n 1b
2:
    adds r8, r8, #8
    beq.n 4f
3:
    ldrh lr, [r1], #2
    lsl lr, lr, #16
    vmov s0, lr
    vldmia r0!, {s8}
    vldmia r2!, {s16}
    vmul.f32 s0, s0, s24
    vcvt.f32.s32 s8, s8
    vmul.f32 s8, s8, s0
    vadd.f32 s8, s16, s8
    vstmia r3!, {s8}
    subs r8, r8, #1
    bne.n 3b
4:
    vpop {s16-s24}
    pop {r4-r8, pc}
    .size actq_scale_add, . - actq_scale_add

@ s0: the square root of s0
    .section .text.actq_sqrt, "ax", %progbits
    .global actq_sqrt
    .type actq_sqrt, %function
    .thumb_func
    .balign 4
actq_sqrt:
    vsqrt.f32 s0, s0
    bx lr
    .size actq_sqrt, . - actq_sqrt
    .text
