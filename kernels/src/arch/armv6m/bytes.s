@ 8 bits on ARMv6-M: a product for each weight (layout/w8_scalar.rs, arch/portable/bytes.rs).
@
@ Without AND and shift in one instruction, the product of two rows saves nothing. Codes are bytes with an offset of 128.

    .syntax unified
    .thumb

@ void(weights, tile, acc, acc_end, skip, pairs): adds `pairs` pairs of columns to the sums of each strip of four rows.
@ r8-r11: sums; r7: the end of the tile. On the stack: tile, acc, acc_end; at 48: skip.
    .section .text.actq_bytes_w8, "ax", %progbits
    .balign 4
    .global actq_bytes_w8
    .type   actq_bytes_w8, %function
    .thumb_func
actq_bytes_w8:
    push    {r4-r7, lr}
    mov     r4, r8
    mov     r5, r9
    mov     r6, r10
    mov     r7, r11
    push    {r4-r7}
    ldr     r7, [sp, #40]
    lsls    r7, r7, #3
    adds    r7, r7, r1
    push    {r1-r3}
1:  ldr     r1, [sp]
    ldr     r4, [sp, #4]
    ldmia   r4!, {r2, r3, r5, r6}
    mov     r8, r2
    mov     r9, r3
    mov     r10, r5
    mov     r11, r6
2:  .set    actq_at, 0
    .rept   4
    ldmia   r1!, {r5, r6}
    .irp    x, r5, r6
    .irp    acc, r8, r10, r9, r11
    ldrb    r2, [r0, #actq_at]
    muls    r2, \x, r2
    add     \acc, \acc, r2
    .set    actq_at, actq_at + 1
    .endr
    .endr
    .endr
    adds    r0, r0, #32
    cmp     r1, r7
    bne     2b
    ldr     r4, [sp, #4]
    mov     r2, r8
    mov     r3, r9
    mov     r5, r10
    mov     r6, r11
    stmia   r4!, {r2, r3, r5, r6}
    str     r4, [sp, #4]
    ldr     r3, [sp, #48]
    adds    r0, r0, r3
    ldr     r3, [sp, #8]
    cmp     r4, r3
    bne     1b
    add     sp, sp, #12
    pop     {r4-r7}
    mov     r8, r4
    mov     r9, r5
    mov     r10, r6
    mov     r11, r7
    pop     {r4-r7, pc}
    .size   actq_bytes_w8, . - actq_bytes_w8
