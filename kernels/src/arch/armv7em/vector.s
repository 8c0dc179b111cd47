@ Vectors of words: the largest magnitude of f32 without an FPU, the exclusive or, and a copy.

    .syntax unified
    .thumb

@ r0: the largest magnitude of r1 (a multiple of 8, > 0) floats at r0, as bits shifted left by 1, which drops the sign.
    .section .text.actq_magnitude, "ax", %progbits
    .global actq_magnitude
    .type actq_magnitude, %function
    .thumb_func
    .balign 4
actq_magnitude:
    push {r4-r9}
    mov r12, r0
    movs r0, #0
    .balign 4
1:
    ldmia.w r12!, {r2-r9}
    .irp x, r2, r3, r4, r5, r6, r7, r8, r9
    cmp.w r0, \x, lsl #1
    it lo
    lsllo.w r0, \x, #1
    .endr
    subs r1, r1, #8
    bne.n 1b
    pop {r4-r9}
    bx lr
    .size actq_magnitude, . - actq_magnitude

@ r0: the exclusive or of r1 (a multiple of 16, > 0) words at r0.
    .section .text.actq_xor, "ax", %progbits
    .global actq_xor
    .type actq_xor, %function
    .thumb_func
    .balign 4
actq_xor:
    push {r4-r9}
    mov r12, r0
    movs r0, #0
    .balign 4
1:
    .rept 2
    ldmia.w r12!, {r2-r9}
    .irp x, r2, r3, r4, r5, r6, r7, r8, r9
    eor.w r0, r0, \x
    .endr
    .endr
    subs r1, r1, #16
    bne.n 1b
    pop {r4-r9}
    bx lr
    .size actq_xor, . - actq_xor

@ Copies r2 words (> 0) from r0 to r1.
    .section .text.actq_copy, "ax", %progbits
    .global actq_copy
    .type actq_copy, %function
    .thumb_func
    .balign 4
actq_copy:
    push {r4-r7}
    subs r2, r2, #4
    blo.n 2f
    .balign 4
1:
    ldmia r0!, {r4-r7}
    stmia r1!, {r4-r7}
    subs r2, r2, #4
    bhs.n 1b
2:
    adds r2, r2, #4
    beq.n 4f
3:
    ldr r4, [r0], #4
    str r4, [r1], #4
    subs r2, r2, #1
    bne.n 3b
4:
    pop {r4-r7}
    bx lr
    .size actq_copy, . - actq_copy

    .text
