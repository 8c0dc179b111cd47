@ Bit planes on ARMv6-M: tables of sums, and lookups in them (arch/portable/planes.rs).
@
@ A lookup is LDRB of the index, a shift, LDRH of the entry, and an addition. There is no shift within an addition, so
@ planes are taken one after the other, the highest first, and the sums are doubled in between. Six of eight sums are in
@ high registers, which an addition reaches.

    .syntax unified
    .thumb

@ Adds the entries of the plane at r0 + \at to the sums, from the table at r1, and moves r1 to the next table.
    .macro  actq_unit at
    .set    actq_row, 0
    .irp    acc, r6, r7, r8, r9, r10, r11, r12, lr
    ldrb    r2, [r0, #\at + actq_row]
    lsls    r2, r2, #1
    ldrh    r3, [r1, r2]
    add     \acc, \acc, r3
    .set    actq_row, actq_row + 1
    .endr
    adds    r1, r1, r4
    .endm

@ Adds the entries of all units' plane \plane to the sums. A pass has two units, of which an odd count skips the first.
@ \step: the bytes of a unit, if r0 moves with each; otherwise it moves with the pass.
    .macro  actq_plane plane, bytes
    ldr     r2, [sp, #56]
    lsrs    r2, r2, #1
    .if     \bytes > 16
    bcs     3f
2:  actq_unit (8 * \plane)
    adds    r0, r0, #\bytes
3:  actq_unit (8 * \plane)
    adds    r0, r0, #\bytes
    .else
    bcc     2f
    subs    r0, r0, #\bytes
    b       3f
2:  actq_unit (8 * \plane)
3:  actq_unit (\bytes + 8 * \plane)
    adds    r0, r0, #(2 * \bytes)
    .endif
    cmp     r1, r5
    bne     2b
    ldr     r1, [sp]
    .if     \plane > 0
    ldr     r2, [sp, #12]
    subs    r0, r0, r2
    .irp    acc, r6, r7, r8, r9, r10, r11, r12, lr
    add     \acc, \acc, \acc
    .endr
    .endif
    .endm

@ void(weights, tables, acc, acc_end, skip, count): adds `count` units to the sums of each strip of eight rows.
@ On the stack: tables, acc, acc_end, the bytes of a strip's units; at 52: skip, count. r4: the bytes of a table; r5: the
@ end of the tables.
    .macro  actq_planes name, planes
    .section .text.\name, "ax", %progbits
    .balign 4
    .global \name
    .type   \name, %function
    .thumb_func
\name:
    push    {r4-r7, lr}
    mov     r4, r8
    mov     r5, r9
    mov     r6, r10
    mov     r7, r11
    push    {r4-r7}
    ldr     r4, [sp, #40]
    lsls    r5, r4, #9
    adds    r5, r5, r1
    movs    r6, #(8 * \planes)
    muls    r4, r6, r4
    push    {r1-r4}
    movs    r4, #1
    lsls    r4, r4, #9
1:  movs    r6, #0
    movs    r7, #0
    mov     r8, r6
    mov     r9, r6
    mov     r10, r6
    mov     r11, r6
    mov     r12, r6
    mov     lr, r6
    .if     \planes > 2
    actq_plane 2, (8 * \planes)
    .endif
    actq_plane 1, (8 * \planes)
    actq_plane 0, (8 * \planes)
    ldr     r2, [sp, #4]
    .set    actq_row, 0
    .irp    acc, r6, r7, r8, r9, r10, r11, r12, lr
    ldr     r3, [r2, #(4 * actq_row)]
    add     r3, r3, \acc
    str     r3, [r2, #(4 * actq_row)]
    .set    actq_row, actq_row + 1
    .endr
    adds    r2, r2, #32
    str     r2, [sp, #4]
    ldr     r3, [sp, #52]
    adds    r0, r0, r3
    ldr     r3, [sp, #8]
    cmp     r2, r3
    beq     4f
    b       1b
4:  add     sp, sp, #16
    pop     {r4-r7}
    mov     r8, r4
    mov     r9, r5
    mov     r10, r6
    mov     r11, r7
    pop     {r4-r7, pc}
    .size   \name, . - \name
    .endm

    actq_planes actq_planes_w2, 2
    actq_planes actq_planes_w3, 3

@ void(x, tables, count): builds the tables of `count` times eight columns. A word holds two entries, which differ in
@ column 0. Four words in registers are a block. From a block to the next, bit t of its number rises and all bits below
@ it fall: one addition a word, of the steps r8 to r12 for t = 0 to 4.
    .section .text.actq_planes_build, "ax", %progbits
    .balign 4
    .global actq_planes_build
    .type   actq_planes_build, %function
    .thumb_func
actq_planes_build:
    push    {r4-r7, lr}
    mov     r4, r8
    mov     r5, r9
    mov     r6, r10
    mov     r7, r11
    push    {r4-r7}
    mov     lr, r2
    mov     r3, r1
1:  movs    r1, #0
    ldrsh   r1, [r0, r1]
    movs    r2, #2
    lsls    r4, r2, #16
    adds    r2, r2, r4              @ what a column's bit adds to two entries
    movs    r7, r1                  @ the sum of columns
    movs    r6, #0                  @ the sum of steps
    .set    actq_at, 6
    .irp    step, r8, r9, r10, r11, r12
    movs    r4, #actq_at
    ldrsh   r4, [r0, r4]
    adds    r7, r7, r4
    muls    r4, r2, r4
    subs    r5, r4, r6
    mov     \step, r5
    adds    r6, r6, r4
    .set    actq_at, actq_at + 2
    .endr
    movs    r5, #2
    ldrsh   r5, [r0, r5]
    movs    r6, #4
    ldrsh   r6, [r0, r6]
    adds    r7, r7, r5
    adds    r7, r7, r6
    muls    r5, r2, r5
    muls    r6, r2, r6
    movs    r4, #128
    lsls    r4, r4, #3
    subs    r4, r4, r7              @ the first entry: no bit is set
    lsls    r7, r4, #16
    orrs    r4, r4, r7
    lsls    r1, r1, #17
    adds    r4, r4, r1
    adds    r7, r5, r6
    adds    r7, r7, r4
    adds    r6, r6, r4
    adds    r5, r5, r4
    stmia   r3!, {r4-r7}
    .irp    step, r8, r9, r8, r10, r8, r9, r8, r11, r8, r9, r8, r10, r8, r9, r8, r12, r8, r9, r8, r10, r8, r9, r8, r11, r8, r9, r8, r10, r8, r9, r8
    .irp    word, r4, r5, r6, r7
    add     \word, \word, \step
    .endr
    stmia   r3!, {r4-r7}
    .endr
    adds    r0, r0, #16
    mov     r2, lr
    subs    r2, r2, #1
    mov     lr, r2
    beq     2f
    b       1b
2:  pop     {r4-r7}
    mov     r8, r4
    mov     r9, r5
    mov     r10, r6
    mov     r11, r7
    pop     {r4-r7, pc}
    .size   actq_planes_build, . - actq_planes_build
