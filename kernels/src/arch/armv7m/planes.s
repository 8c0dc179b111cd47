@ Bit planes on ARMv7-M: tables of sums, and lookups in them (arch/portable/planes.rs).
@
@ A lookup is LDRB of the index, LDRH of the entry with a scaled index, and an addition, which also shifts an entry by
@ its plane.

    .syntax unified
    .thumb

@ Adds the entries of the unit at r0 + \at to r4-r11, from the table at r1.
    .macro  actq_unit planes, at
    .set    actq_row, 0
    .irp    acc, r4, r5, r6, r7, r8, r9, r10, r11
    ldrb    r2, [r0, #\at + actq_row]
    ldrb    r3, [r0, #\at + 8 + actq_row]
    ldrh    r2, [r1, r2, lsl #1]
    ldrh    r3, [r1, r3, lsl #1]
    add     \acc, \acc, r2
    add     \acc, \acc, r3, lsl #1
    .if     \planes > 2
    ldrb    r2, [r0, #\at + 16 + actq_row]
    ldrh    r2, [r1, r2, lsl #1]
    add     \acc, \acc, r2, lsl #2
    .endif
    .set    actq_row, actq_row + 1
    .endr
    add     r1, r1, #512
    .endm

@ void(weights, tables, acc, acc_end, skip, count): adds `count` units to the sums of each strip of eight rows.
@ r12: the end of the tables that are taken four at a time; lr: acc.
    .macro  actq_planes name, planes
    .section .text.\name, "ax", %progbits
    .balign 4
    .global \name
    .type   \name, %function
    .thumb_func
\name:
    push    {r3-r11, lr}
    mov     lr, r2
    ldr     r12, [sp, #44]
    bic     r12, r12, #3
    add     r12, r1, r12, lsl #9
1:  ldmia   lr, {r4-r11}
    cmp     r1, r12
    beq     3f
    .balign 4
2:  actq_unit \planes, 0
    actq_unit \planes, (8 * \planes)
    actq_unit \planes, (16 * \planes)
    actq_unit \planes, (24 * \planes)
    adds    r0, r0, #(32 * \planes)
    cmp     r1, r12
    bne.w   2b
3:  ldr     r3, [sp, #44]
    ands    r2, r3, #3
    beq     5f
    add     r2, r1, r2, lsl #9
    push    {r2}
4:  actq_unit \planes, 0
    adds    r0, r0, #(8 * \planes)
    ldr     r2, [sp]
    cmp     r1, r2
    bne.w   4b
    pop     {r2}
    ldr     r3, [sp, #44]
5:  stmia   lr!, {r4-r11}
    sub     r1, r1, r3, lsl #9
    ldr     r2, [sp, #40]
    add     r0, r0, r2
    ldr     r3, [sp]
    cmp     lr, r3
    bne.w   1b
    pop     {r3-r11, pc}
    .size   \name, . - \name
    .endm

    actq_planes actq_planes_w2, 2
    actq_planes actq_planes_w3, 3

@ void(x, tables, count): builds the tables of `count` times eight columns. A word holds two entries, which differ in
@ column 0. Eight words in registers are a block. From a block to the next, bit t of its number rises and all bits
@ below it fall: one addition a word, of the steps r2, r12, lr and r3 for t = 0 to 3.
    .section .text.actq_planes_build, "ax", %progbits
    .balign 4
    .global actq_planes_build
    .type   actq_planes_build, %function
    .thumb_func
actq_planes_build:
    push    {r2, r4-r11, lr}
1:  ldrsh   r4, [r0]
    ldrsh   r5, [r0, #2]
    ldrsh   r6, [r0, #4]
    ldrsh   r7, [r0, #6]
    ldrsh   r8, [r0, #8]
    ldrsh   r9, [r0, #10]
    ldrsh   r10, [r0, #12]
    ldrsh   r11, [r0, #14]
    adds    r0, r0, #16
    add     r2, r4, r5
    add     r2, r2, r6
    add     r2, r2, r7
    add     r2, r2, r8
    add     r2, r2, r9
    add     r2, r2, r10
    add     r2, r2, r11
    rsb     r2, r2, #1024           @ the first entry: no bit is set
    mov     r3, #0x00020002
    .irp    x, r5, r6, r7, r8, r9, r10, r11
    mul     \x, \x, r3              @ what a column's bit adds to two entries
    .endr
    add     r2, r2, r2, lsl #16
    add     r4, r2, r4, lsl #17
    mov     r2, r8
    sub     r12, r9, r8
    sub     lr, r10, r9
    sub     lr, lr, r8
    sub     r3, r11, r10
    sub     r3, r3, r9
    sub     r3, r3, r8
    add     r8, r4, r7
    add     r9, r8, r5
    add     r10, r8, r6
    add     r11, r10, r5
    add     r6, r4, r6
    add     r7, r6, r5
    add     r5, r4, r5
    stmia   r1!, {r4-r11}
    .irp    step, r2, r12, r2, lr, r2, r12, r2, r3, r2, r12, r2, lr, r2, r12, r2
    .irp    word, r4, r5, r6, r7, r8, r9, r10, r11
    add     \word, \word, \step
    .endr
    stmia   r1!, {r4-r11}
    .endr
    ldr     r2, [sp]
    subs    r2, r2, #1
    str     r2, [sp]
    bne.w   1b
    pop     {r2, r4-r11, pc}
    .size   actq_planes_build, . - actq_planes_build
