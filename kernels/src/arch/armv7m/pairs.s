@ 4 bits on ARMv7-M: a product is those of two rows (layout/w4_scalar.rs, arch/portable/pairs.rs).
@
@ AND with a shifted operand leaves a column of two rows; one MLA multiplies both.

    .syntax unified
    .thumb

@ Two columns of eight rows: the words \a and \b, and the pair of x at r1 + \at.
    .macro  actq_pair a, b, at
    ldrsh   r3, [r1, #\at]
    and     r2, r8, \a
    mla     r4, r2, r3, r4
    and     r2, r8, \a, lsr #4
    mla     r5, r2, r3, r5
    and     r2, r8, \b
    mla     r6, r2, r3, r6
    and     r2, r8, \b, lsr #4
    mla     r7, r2, r3, r7
    ldrsh   r3, [r1, #\at + 2]
    and     r2, r8, \a, lsr #8
    mla     r4, r2, r3, r4
    and     r2, r8, \a, lsr #12
    mla     r5, r2, r3, r5
    and     r2, r8, \b, lsr #8
    mla     r6, r2, r3, r6
    and     r2, r8, \b, lsr #12
    mla     r7, r2, r3, r7
    .endm

@ void(weights, chunk, acc, acc_end, skip, eights): adds a chunk of `eights` times eight columns to the sums of each
@ strip. A pass has 16 columns, of which an odd count skips the first eight. r4-r7: sums of two rows; r8: the mask; lr: the
@ end of the chunk.
    .section .text.actq_pairs_w4, "ax", %progbits
    .balign 4
    .global actq_pairs_w4
    .type   actq_pairs_w4, %function
    .thumb_func
actq_pairs_w4:
    push    {r1-r11, lr}
    ldr     r3, [sp, #52]
    add     lr, r1, #8
    add     lr, lr, r3, lsl #4
    mov     r8, #0x000f000f
1:  ldr     r4, [r1], #8
    lsls    r3, r3, #31
    mov     r5, r4
    mov     r6, r4
    mov     r7, r4
    bpl     2f
    subs    r1, r1, #16
    b       3f
    .balign 4
2:  ldmia   r0!, {r9-r12}
    actq_pair r9, r10, 0
    actq_pair r11, r12, 4
    ldmia   r0!, {r9-r12}
    actq_pair r9, r10, 8
    actq_pair r11, r12, 12
3:  ldmia   r0!, {r9-r12}
    actq_pair r9, r10, 16
    actq_pair r11, r12, 20
    ldmia   r0!, {r9-r12}
    actq_pair r9, r10, 24
    actq_pair r11, r12, 28
    adds    r1, r1, #32
    cmp     r1, lr
    bne.w   2b
    ldr     r2, [sp, #4]
    ldmia   r2, {r9-r12}
    add     r9, r9, r4
    add     r10, r10, r4, asr #16
    add     r11, r11, r5
    add     r12, r12, r5, asr #16
    stmia   r2!, {r9-r12}
    ldmia   r2, {r9-r12}
    add     r9, r9, r6
    add     r10, r10, r6, asr #16
    add     r11, r11, r7
    add     r12, r12, r7, asr #16
    stmia   r2!, {r9-r12}
    str     r2, [sp, #4]
    ldr     r3, [sp, #48]
    add     r0, r0, r3
    ldr     r1, [sp, #8]
    cmp     r2, r1
    ldr     r1, [sp]
    ldr     r3, [sp, #52]
    bne.w   1b
    pop     {r1-r11, pc}
    .size   actq_pairs_w4, . - actq_pairs_w4
