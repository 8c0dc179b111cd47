@ 4 bits on ARMv6-M: a product is those of two rows (layout/w4_scalar.rs, arch/portable/pairs.rs).

    .syntax unified
    .thumb

@ Two columns of four rows: \word times r5 and r6, added to \first and \second.
    .macro  actq_quad word, first, second
    movs    r2, r7
    ands    r2, r2, \word
    muls    r2, r5, r2
    add     \first, \first, r2
    lsrs    r2, \word, #4
    ands    r2, r2, r7
    muls    r2, r5, r2
    add     \second, \second, r2
    lsrs    r2, \word, #8
    ands    r2, r2, r7
    muls    r2, r6, r2
    add     \first, \first, r2
    lsrs    \word, \word, #12
    ands    \word, \word, r7
    muls    \word, r6, \word
    add     \second, \second, \word
    .endm

@ Adds the sums \a and \b of two rows each to the words at r4.
    .macro  actq_add a, b
    ldmia   r4!, {r2, r3, r5, r6}
    subs    r4, r4, #16
    add     r2, r2, \a
    add     r5, r5, \b
    stmia   r4!, {r2}
    mov     r2, \a
    asrs    r2, r2, #16
    adds    r3, r3, r2
    stmia   r4!, {r3, r5}
    mov     r2, \b
    asrs    r2, r2, #16
    adds    r6, r6, r2
    stmia   r4!, {r6}
    .endm

@ void(weights, chunk, acc, acc_end, skip, eights): adds a chunk of `eights` times eight columns to the sums of each
@ strip. r8-r11: sums of two rows; r7: the mask; r12: the end of the chunk. On the stack: chunk, acc, acc_end; at 48:
@ skip.
    .section .text.actq_pairs_w4, "ax", %progbits
    .balign 4
    .global actq_pairs_w4
    .type   actq_pairs_w4, %function
    .thumb_func
actq_pairs_w4:
    push    {r4-r7, lr}
    mov     r4, r8
    mov     r5, r9
    mov     r6, r10
    mov     r7, r11
    push    {r4-r7}
    ldr     r4, [sp, #40]
    lsls    r4, r4, #4
    adds    r4, r4, #8
    adds    r4, r4, r1
    mov     r12, r4
    push    {r1-r3}
    movs    r7, #15
    lsls    r4, r7, #16
    orrs    r7, r7, r4
1:  ldr     r1, [sp]
    ldr     r4, [r1]
    adds    r1, r1, #8
    mov     r8, r4
    mov     r9, r4
    mov     r10, r4
    mov     r11, r4
2:  .rept   2
    ldmia   r1!, {r6}
    ldmia   r0!, {r3, r4}
    sxth    r5, r6
    asrs    r6, r6, #16
    actq_quad r3, r8, r9
    actq_quad r4, r10, r11
    .endr
    cmp     r1, r12
    bne     2b
    ldr     r4, [sp, #4]
    actq_add r8, r9
    actq_add r10, r11
    str     r4, [sp, #4]
    ldr     r3, [sp, #48]
    adds    r0, r0, r3
    ldr     r3, [sp, #8]
    cmp     r4, r3
    beq     3f
    b       1b
3:  add     sp, sp, #12
    pop     {r4-r7}
    mov     r8, r4
    mov     r9, r5
    mov     r10, r6
    mov     r11, r7
    pop     {r4-r7, pc}
    .size   actq_pairs_w4, . - actq_pairs_w4
