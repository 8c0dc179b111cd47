@ 8 bits on ARMv7-M: a product is those of two rows (layout/w8_scalar.rs, arch/portable/bytes.rs).
@
@ The products of the words themselves are those of rows 0 and 1 plus 2^8 times those of rows 2 and 3, modulo 2^32: so
@ only the latter need a mask.

    .syntax unified
    .thumb

@ void(weights, tile, acc, acc_end, skip, pairs): adds `pairs` pairs of columns to the sums of each strip of four rows.
@ r8, r9: the sum and the sum of the high halves of rows 0 and 1; r10, r11: of rows 2 and 3; r12: the mask.
    .section .text.actq_bytes_w8, "ax", %progbits
    .balign 4
    .global actq_bytes_w8
    .type   actq_bytes_w8, %function
    .thumb_func
actq_bytes_w8:
    push    {r2-r11, lr}
    ldr     r2, [sp, #48]
    add     r2, r1, r2, lsl #4
    push    {r1, r2}                @ begin and end of the tile
    mov     r12, #0x00ff00ff
1:  ldr     r2, [sp, #8]
    ldmia   r2, {r8-r11}
    .balign 4
2:  .rept   4
    ldmia   r1!, {r2, r3, r4, lr}
    ldmia   r0!, {r5, r6}
    mla     r7, r5, r2, lr
    and     r5, r12, r5, lsr #8
    mla     r7, r6, r3, r7
    and     r6, r12, r6, lsr #8
    mla     r5, r5, r2, r4
    mla     r5, r6, r3, r5
    sub     r7, r7, r5, lsl #8
    add     r8, r8, r7
    add     r9, r9, r7, asr #16
    add     r10, r10, r5
    add     r11, r11, r5, asr #16
    .endr
    ldr     r2, [sp, #4]
    cmp     r1, r2
    bne.w   2b
    ldr     r2, [sp, #8]
    stmia   r2!, {r8-r11}
    str     r2, [sp, #8]
    ldr     r1, [sp, #52]
    add     r0, r0, r1
    ldr     r1, [sp]
    ldr     r3, [sp, #12]
    cmp     r2, r3
    bne.w   1b
    add     sp, sp, #8
    pop     {r2-r11, pc}
    .size   actq_bytes_w8, . - actq_bytes_w8
