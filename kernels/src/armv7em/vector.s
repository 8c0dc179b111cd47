@ The largest magnitude of a vector of f32, without an FPU.

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

    .text
