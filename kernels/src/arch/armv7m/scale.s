@ Scaling of sums to f32 on ARMv7-M without an FPU: the arithmetic of `math/soft.rs`, `scaled`, which takes what this
@ leaves.
@
@ Mantissas have their leading bit at bit 31 until the addition, where it is at bit 29, with the sign as two's complement.

    .syntax unified
    .thumb

@ Moves the leading bit of \m from bit 30 or 31 to bit 31, and adds \more and 1, if it was there, to r8.
    .macro  actq_up m, more
    adds    r9, \m, \m
    it      cc
    movcc   \m, r9
    adc     r8, r8, \more
    .endm

@ Rounds \m to nearest even, to 24 bits; 33 bits are left.
    .macro  actq_round m
    ubfx    r9, \m, #8, #1
    add     r9, r9, #0x7f
    adds    \m, \m, r9
    bcs     6f
    bic     \m, \m, #0xff
    .endm

@ Adds \small, r10 places down, to \large as r5. A bit that falls out sets the last one.
    .macro  actq_sum large, small
    cmp     r10, #30
    bhi     6f
    rsb     r9, r10, #32
    lsls    r9, \small, r9
    asr     \small, \small, r10
    it      ne
    orrne   \small, \small, #1
    add     r5, \large, \small
    .endm

@ f32 *(sums, start, scales, x_scale, y, end): computes y up to the first value that it leaves, and returns its address.
@ r0-r2: operands; r3: the mantissa of x_scale; r12: its exponent; r11: y; lr: 2^29. Then r4: the sum; r5: the factor, the
@ term, the result; r8: its exponent.
    .section .text.actq_scale, "ax", %progbits
    .balign 4
    .global actq_scale
    .type   actq_scale, %function
    .thumb_func
actq_scale:
    push    {r4-r11, lr}
    ldr     r11, [sp, #36]
    lsr     r12, r3, #23
    sub     r12, r12, #96
    bfc     r3, #23, #9
    orr     r3, r3, #0x800000
    mov     lr, #0x20000000
1:  ldr     r4, [r0], #4
    ldrh    r5, [r2], #2
    eor     r6, r4, r4, asr #31
    sub     r6, r6, r4, asr #31
    clz     r7, r6
    sub     r8, r7, #8
    cmp     r8, #24                 @ not 0, and below 2^24
    bhs     6f
    lsl     r6, r6, r7
    lsr     r8, r5, #7
    sub     r9, r8, #80
    cmp     r9, #95                 @ positive, and of a usual exponent
    bhs     6f
    orr     r5, r5, #0x80
    uxtb    r5, r5
    mul     r5, r5, r3
    actq_up r5, r12
    actq_round r5
    sub     r8, r8, r7
    umull   r9, r5, r6, r5
    cmp     r9, #0
    it      ne
    orrne   r5, r5, #1
    actq_up r5, #0
    actq_round r5
    lsr     r5, r5, #2
    eor     r5, r5, r4, asr #31
    sub     r5, r5, r4, asr #31
    ldr     r6, [r1], #4
    ubfx    r9, r6, #23, #8
    sub     r10, r9, #30
    cmp     r10, #221
    bhs     5f
    lsl     r7, r6, #9
    orr     r7, lr, r7, lsr #3
    eor     r7, r7, r6, asr #31
    sub     r7, r7, r6, asr #31
    subs    r10, r8, r9
    bmi     2f
    actq_sum r5, r7
    b       3f
2:  mov     r8, r9
    rsb     r10, r10, #0
    actq_sum r7, r5
3:  eor     r6, r5, r5, asr #31
    sub     r6, r6, r5, asr #31
    cbz     r6, 6f
    clz     r7, r6
    sub     r7, r7, #1
    sub     r8, r8, r7
    lsl     r6, r6, r7
    ubfx    r9, r6, #7, #1
    add     r9, r9, #0x3f
    add     r6, r6, r9
    lsl     r8, r8, #23
    add     r6, r8, r6, lsr #7
    and     r5, r5, #0x80000000
    orr     r6, r6, r5
    str     r6, [r11], #4
    ldr     r9, [sp, #40]
    cmp     r11, r9
    bne     1b
    b       6f
@ A start of 0, or one that is left.
5:  lsls    r10, r6, #1
    beq     3b
6:  mov     r0, r11
    pop     {r4-r11, pc}
    .size   actq_scale, . - actq_scale
