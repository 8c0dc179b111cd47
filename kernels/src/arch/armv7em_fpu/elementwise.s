@ Elements of vectors on the FPU of the hard-float target: the arithmetic of kernels/src/arch/portable/elementwise.rs and norm.rs.
@ Of up to three vectors, element i of a pass is in s<i>, s1<i> and s2<i>. VMLA rounds its product and so gives the bits of
@ VMUL and VADD, in one more cycle and half the code.

    .syntax unified
    .thumb
    .fpu fpv4-sp-d16

@ \len elements: \several takes \step of them, \one those of the rest.
.macro passes len, step, several, one
    subs \len, \len, #\step
    blo 2f
1:
    \several
    subs \len, \len, #\step
    bhs 1b
2:
    adds \len, \len, #\step
    beq 9f
3:
    \one
    subs \len, \len, #1
    bne 3b
9:
.endm

@ The bits \x: if their magnitude is above \limit, whose double is \twice, it becomes \limit. NaNs are above.
.macro limit x, limit, twice
    cmp.w \twice, \x, lsl #1
    it lo
    bfilo \x, \limit, #0, #31
.endm

@ s2<i> = s18 s2<i> + s19 s1<i> + s28 limit(s8 s2<i> + s9 s1<i>) of two elements.
.macro denoise_limited i, j
    vmul.f32 s30, s2\i, s8
    vmul.f32 s31, s2\j, s8
    vmla.f32 s30, s1\i, s9
    vmla.f32 s31, s1\j, s9
    vmul.f32 s2\i, s2\i, s18
    vmul.f32 s2\j, s2\j, s18
    vmov r6, r7, s30, s31
    vmla.f32 s2\i, s1\i, s19
    vmla.f32 s2\j, s1\j, s19
    limit r6, r8, r9
    limit r7, r8, r9
    vmov s30, s31, r6, r7
    vmla.f32 s2\i, s30, s28
    vmla.f32 s2\j, s31, s28
.endm

@ s2<i> += s29 s<vector><i>, elements 0 to \last of the vector 0, written without a number, or 1.
.macro stir vector, last
    .irp i, 0, 1, 2, 3, 4, 5, 6, 7
    .if \i <= \last
    vmla.f32 s2\i, s\vector\i, s29
    .endif
    .endr
.endm

@ Elements 0 to \last. With one element, limits also process a second, of any register content, which is not stored.
.macro denoise_pass last
    vldmia r1!, {s10-s1\last}
    vldmia r3, {s20-s2\last}
    cmp r0, #0
    beq 4f
    denoise_limited 0, 1
    .if \last
    denoise_limited 2, 3
    denoise_limited 4, 5
    denoise_limited 6, 7
    .endif
    b 5f
4:
    .irp i, 0, 1, 2, 3, 4, 5, 6, 7
    .if \i <= \last
    vmul.f32 s2\i, s2\i, s18
    vmla.f32 s2\i, s1\i, s19
    .endif
    .endr
5:
    cbz r2, 6f
    vldmia r2!, {s0-s\last}
    stir , \last
    vstmia r3!, {s20-s2\last}
    b 7f
6:
    vstmia r3!, {s20-s2\last}
    stir 1, \last
7:
    vstmia r4!, {s20-s2\last}
.endm

@ A denoising step of [sp+4] elements: r0 the coefficients in the order of ops/denoise.rs, s0 the limit, r1 the network's
@ outputs, r2 the noise or 0, r3 the iterates, [sp] the network's next input.
    .section .text.actq_denoise, "ax", %progbits
    .global actq_denoise
    .type actq_denoise, %function
    .thumb_func
    .balign 4
actq_denoise:
    push {r4-r9, lr}
    vpush {s16-s31}
    ldrd r4, r5, [sp, #92]
    vmov r8, s0
    lsl r9, r8, #1
    vldmia r0!, {s8-s9}
    vldmia r0!, {s18-s19}
    vldmia r0!, {s28-s29}
    cbnz r2, 0f
    vldr s29, [r0]
0:
    @ From here on r0 is 0 if both coefficients of the sample are.
    vmov r6, r7, s8, s9
    orrs r6, r7
    lsls r0, r6, #1
    passes r5, 8, "denoise_pass 7", "denoise_pass 0"
    vpop {s16-s31}
    pop {r4-r9, pc}
    .size actq_denoise, . - actq_denoise

@ s1<i> = limit((limit(s<i>) - s1<i>) s2<i>) + s8 s<i> of two elements.
.macro normalize i, j
    vmov r4, r5, s\i, s\j
    limit r4, r6, r7
    limit r5, r6, r7
    vmov s30, s31, r4, r5
    vsub.f32 s30, s30, s1\i
    vsub.f32 s31, s31, s1\j
    vmul.f32 s30, s30, s2\i
    vmul.f32 s31, s31, s2\j
    vmov r4, r5, s30, s31
    limit r4, r8, r9
    limit r5, r8, r9
    vmov s1\i, s1\j, r4, r5
    vmla.f32 s1\i, s\i, s8
    vmla.f32 s1\j, s\j, s8
.endm

@ As denoise_pass.
.macro normalize_pass last
    vldmia r0!, {s0-s\last}
    vldmia r1!, {s10-s1\last}
    vldmia r2!, {s20-s2\last}
    normalize 0, 1
    .if \last
    normalize 2, 3
    normalize 4, 5
    normalize 6, 7
    .endif
    vstmia r3!, {s10-s1\last}
.endm

@ Normalizes [sp] elements at r0 to r3: r1 means, r2 factors, s0 the limit before and s1 the limit after.
    .section .text.actq_normalize, "ax", %progbits
    .global actq_normalize
    .type actq_normalize, %function
    .thumb_func
    .balign 4
actq_normalize:
    push {r4-r9, lr}
    vpush {s16-s31}
    ldr lr, [sp, #92]
    vmov r6, s0
    vmov r8, s1
    lsls r7, r6, #1
    lsl r9, r8, #1
    movs r4, #0
    vmov s8, r4
    passes lr, 8, "normalize_pass 7", "normalize_pass 0"
    vpop {s16-s31}
    pop {r4-r9, pc}
    .size actq_normalize, . - actq_normalize

.macro sum last
    vldmia r0!, {s8-s\last}
    .irp i, 8, 9, 10, 11, 12, 13, 14, 15
    .if \i <= \last
    vadd.f32 s0, s0, s\i
    .endif
    .endr
.endm

@ s0: s0 plus, in order, r1 floats at r0.
    .section .text.actq_sum, "ax", %progbits
    .global actq_sum
    .type actq_sum, %function
    .thumb_func
    .balign 4
actq_sum:
    passes r1, 8, "sum 15", "sum 8"
    bx lr
    .size actq_sum, . - actq_sum

.macro sum_squares last
    vldmia r0!, {s8-s\last}
    .irp i, 8, 9, 10, 11, 12, 13, 14, 15
    .if \i <= \last
    vsub.f32 s\i, s\i, s1
    .endif
    .endr
    .irp i, 8, 9, 10, 11, 12, 13, 14, 15
    .if \i <= \last
    vmla.f32 s0, s\i, s\i
    .endif
    .endr
.endm

@ s0: s0 plus, in order, the squared differences from s1 of r1 floats at r0.
    .section .text.actq_sum_squares, "ax", %progbits
    .global actq_sum_squares
    .type actq_sum_squares, %function
    .thumb_func
    .balign 4
actq_sum_squares:
    passes r1, 8, "sum_squares 15", "sum_squares 8"
    bx lr
    .size actq_sum_squares, . - actq_sum_squares

.macro standardize last
    vldmia r0, {s0-s\last}
    vldmia r1!, {s10-s1\last}
    vldmia r2!, {s20-s2\last}
    .irp i, 0, 1, 2, 3
    .if \i <= \last
    vsub.f32 s\i, s\i, s8
    .endif
    .endr
    .irp i, 0, 1, 2, 3
    .if \i <= \last
    vmul.f32 s\i, s\i, s9
    .endif
    .endr
    .irp i, 0, 1, 2, 3
    .if \i <= \last
    vmul.f32 s\i, s\i, s1\i
    .endif
    .endr
    .irp i, 0, 1, 2, 3
    .if \i <= \last
    vadd.f32 s\i, s\i, s2\i
    .endif
    .endr
    vstmia r0!, {s0-s\last}
.endm

@ r3 floats at r0 become (x - s0) s1 weight + bias: weights at r1, biases at r2.
    .section .text.actq_standardize, "ax", %progbits
    .global actq_standardize
    .type actq_standardize, %function
    .thumb_func
    .balign 4
actq_standardize:
    vpush {s20-s23}
    vmov.f32 s8, s0
    vmov.f32 s9, s1
    passes r3, 4, "standardize 3", "standardize 0"
    vpop {s20-s23}
    bx lr
    .size actq_standardize, . - actq_standardize
    .text
