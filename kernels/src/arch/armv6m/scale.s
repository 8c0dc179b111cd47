@ Scaling of sums to f32 on ARMv6-M: the arithmetic of `math/soft.rs`, `scaled`, which takes what this leaves.
@
@ A product of 24 bits is made of those of 12 and at most 16 bits. In the addition, the leading bit of a mantissa is at bit
@ 29 or 30, with the sign as two's complement.

    .syntax unified
    .thumb

@ Moves the leading bit of \m from bit \top or the one below to \top, and adds 1, if it was there, to r2.
    .macro  actq_up m, top, by
    lsrs    \by, \m, #\top
    bne     70f
    lsls    \m, \m, #1
70: adds    r2, r2, \by
    .endm

@ Rounds \m to nearest even, without its last \bits bits.
    .macro  actq_round m, bits, by
    lsls    \by, \m, #(31 - \bits)
    lsrs    \by, \by, #31
    adds    \by, \by, #((1 << (\bits - 1)) - 1)
    adds    \m, \m, \by
    .endm

@ Adds \small, r4 places down, to \large as r3. A bit that falls out sets the last one.
    .macro  actq_sum large, small
    cmp     r4, #30
    bhi     90f
    movs    r1, \small
    asrs    r1, r1, r4
    movs    r0, r1
    lsls    r0, r0, r4
    cmp     r0, \small
    beq     71f
    movs    r0, #1
    orrs    r1, r1, r0
71: adds    r3, \large, r1
    .endm

@ f32 *(sums, start, scales, x_scale, y, end): computes y up to the first value that it leaves, and returns its address.
@ r8-r10, r12: operands and y; r11: the mantissa of x_scale; r7: the place in bytes; lr: the sum. On the stack: the
@ exponent of x_scale, the last place. Then r3: the term, the result; r2: its exponent.
    .section .text.actq_scale, "ax", %progbits
    .balign 4
    .global actq_scale
    .type   actq_scale, %function
    .thumb_func
actq_scale:
    push    {r4-r7, lr}
    mov     r4, r8
    mov     r5, r9
    mov     r6, r10
    mov     r7, r11
    push    {r4-r7}
    mov     r8, r0
    mov     r9, r1
    mov     r10, r2
    ldr     r4, [sp, #36]
    mov     r12, r4
    ldr     r5, [sp, #40]
    subs    r5, r5, r4
    lsrs    r4, r3, #23
    subs    r4, r4, #112
    push    {r4, r5}
    lsls    r3, r3, #9
    lsrs    r3, r3, #9
    movs    r4, #1
    lsls    r4, r4, #23
    orrs    r3, r3, r4
    mov     r11, r3
    movs    r7, #0
10: mov     r0, r8
    ldr     r0, [r0, r7]
    mov     lr, r0
    asrs    r1, r0, #31
    eors    r0, r0, r1
    subs    r0, r0, r1
    beq     13f
    lsrs    r2, r7, #1
    mov     r1, r10
    ldrh    r1, [r1, r2]
    lsrs    r2, r1, #7
    movs    r3, r2
    subs    r3, r3, #80
    cmp     r3, #95                 @ positive, and of a usual exponent
    bhs     13f
    movs    r3, #128
    orrs    r1, r1, r3
    uxtb    r1, r1
    mov     r3, r11
    muls    r1, r3, r1
    actq_up r1, 31, r3
    actq_round r1, 8, r3
    bcs     13f
    lsrs    r1, r1, #8              @ the factor
    lsrs    r3, r0, #16
    bne     14f
    .irp    step, 8, 4, 2, 1
    lsrs    r3, r0, #(16 - \step)
    bne     15f
    lsls    r0, r0, #\step
    subs    r2, r2, #\step
15:
    .endr
    lsrs    r3, r1, #12
    lsls    r1, r1, #20
    lsrs    r1, r1, #20
    muls    r3, r0, r3
    muls    r1, r0, r1
    lsrs    r4, r1, #12
    adds    r3, r3, r4
    lsls    r1, r1, #20
16: beq     17f
    movs    r4, #1
    orrs    r3, r3, r4
17: actq_up r3, 27, r4
    actq_round r3, 4, r4
    lsrs    r3, r3, #4
    lsls    r3, r3, #6
    mov     r0, lr
    asrs    r0, r0, #31
    eors    r3, r3, r0
    subs    r3, r3, r0
    ldr     r4, [sp]
    adds    r2, r2, r4
    mov     r0, r9
    ldr     r0, [r0, r7]
    lsls    r1, r0, #1
    beq     30f
    lsrs    r1, r1, #24
    movs    r4, r1
    subs    r4, r4, #30
    cmp     r4, #221
    bhs     13f
    lsls    r5, r0, #9
    lsrs    r5, r5, #3
    movs    r4, #1
    lsls    r4, r4, #29
    orrs    r5, r5, r4
    asrs    r0, r0, #31
    eors    r5, r5, r0
    subs    r5, r5, r0
    subs    r4, r2, r1
    bmi     20f
    actq_sum r3, r5
    b       30f
13: b       90f
@ A sum of 17 to 24 bits.
14: lsrs    r3, r0, #24
    bne     90f
    adds    r2, r2, #8
    b       19f
18: lsls    r0, r0, #1
    subs    r2, r2, #1
19: lsls    r3, r0, #8
    bpl     18b
    lsrs    r3, r1, #12
    lsls    r1, r1, #20
    lsrs    r1, r1, #20
    lsrs    r4, r0, #12
    lsls    r0, r0, #20
    lsrs    r0, r0, #20
    movs    r5, r0
    muls    r5, r1, r5
    muls    r0, r3, r0
    muls    r1, r4, r1
    muls    r3, r4, r3
    adds    r0, r0, r1
    lsrs    r1, r5, #12
    adds    r0, r0, r1
    lsls    r3, r3, #4
    lsrs    r1, r0, #8
    adds    r3, r3, r1
    lsls    r0, r0, #24
    lsls    r5, r5, #20
    orrs    r0, r0, r5
    b       16b
20: movs    r2, r1
    rsbs    r4, r4, #0
    actq_sum r5, r3
30: asrs    r0, r3, #31
    eors    r3, r3, r0
    subs    r3, r3, r0
    beq     90f
    b       32f
31: lsls    r3, r3, #1
    subs    r2, r2, #1
32: lsls    r1, r3, #1
    bpl     31b
    actq_round r3, 7, r4
    lsrs    r3, r3, #7
    lsls    r2, r2, #23
    adds    r3, r3, r2
    lsls    r0, r0, #31
    orrs    r3, r3, r0
    mov     r0, r12
    str     r3, [r0, r7]
    adds    r7, r7, #4
    ldr     r0, [sp, #4]
    cmp     r7, r0
    beq     90f
    b       10b
90: mov     r0, r12
    adds    r0, r0, r7
    add     sp, sp, #8
    pop     {r4-r7}
    mov     r8, r4
    mov     r9, r5
    mov     r10, r6
    mov     r11, r7
    pop     {r4-r7, pc}
    .size   actq_scale, . - actq_scale
