@ GEMV for 8-bit codes in paired lanes (kernels/src/layout/w8_paired.rs): strips of four rows.
@
@ Arguments: r0 weights, r1 prepared x, r2 acc, r3 strips (>= 1), [sp] x_end, [sp+4] bytes of the first chunk
@ in x, [sp+8] steps of 8 columns that the first pass through the row kernel's loop skips.
@
@ In the loops: r0 weights, r1 x, r2-r5 activation pairs, r6 and r8 the sums of rows 0 and 2, r7 and r9 those of rows 0 and 2
@ plus 2^8 times those of rows 1 and 3, r10-r12 and lr weight words.
@
@ Frame of the row kernel: 0 x after its first start word, 4-19 that word four times, 20 end of the first chunk, 24 acc, 28 end of
@ acc, or, if a row has several chunks or its first pass skips steps, acc after this strip, 32 end of this chunk,
@ 36 x_end, 40 end of acc, 44 skipped steps; of the group kernel: 0-15 sums over groups, 16 x, 28 x_end, 32 acc, 36 strips.

    .syntax unified
    .thumb

@ two columns of two rows
.macro r8_word word, pair, even, both
    smlad \both, \word, \pair, \both
    uxtb16 \word, \word
    smlad \even, \word, \pair, \even
.endm

.macro r8_cols4 pair0, pair1
    ldmia.w r0!, {r10-r12, lr}
    r8_word r10, \pair0, r6, r7
    r8_word r11, \pair0, r8, r9
    r8_word r12, \pair1, r6, r7
    r8_word lr, \pair1, r8, r9
.endm

.macro r8_cols8
    ldmia.w r1!, {r2-r5}
    r8_cols4 r2, r3
    r8_cols4 r4, r5
.endm

.macro r8_start
    ldr r6, [r1], #4
    mov r7, r6
    mov r8, r6
    mov r9, r6
.endm

@ the four rows' sums as r6-r9
.macro r8_sums
    sub r7, r7, r6
    asr r7, r7, #8
    sub r9, r9, r8
    asr r9, r9, #8
.endm

    .section .text.actq_w8_paired_row, "ax", %progbits
    .global actq_w8_paired_row
    .type actq_w8_paired_row, %function
    .thumb_func
    .balign 4
actq_w8_paired_row:
    push {r4-r11, lr}
    sub sp, sp, #52
    ldrd r4, r5, [sp, #88]
    ldr r10, [sp, #96]
    add r5, r5, r1
    r8_start
    stmia.w sp, {r1, r6-r9}
    add r11, r2, r3, lsl #4
    strd r5, r2, [sp, #20]
    strd r5, r4, [sp, #32]
    strd r11, r10, [sp, #40]
    cmp r5, r4
    it eq
    cmpeq r10, #0
    it ne
    addne r11, r2, #16
    str r11, [sp, #28]
    .if COMPACT
    b.n 1f
    .else
    beq.n 1f
9:
    ldmia.w sp, {r1, r6-r9}
    tbh [pc, r10, lsl #1]
7:
    .irp step, 10f, 11f, 12f, 13f, 14f, 15f, 16f, 17f
    .hword (\step - 7b) / 2
    .endr
    .endif
3:
    r8_start
    b.n 2f
    .balign 4
1:
    ldmia.w sp, {r1, r6-r9}
2:
    .if COMPACT
    r8_cols8
    .else
    .irp step, 10, 11, 12, 13, 14, 15, 16, 17
\step:
    r8_cols8
    .endr
    .endif
    ldr r2, [sp, #32]
    cmp r1, r2
    bne.w 2b
    ldrd r2, r10, [sp, #20]
    r8_sums
    cmp r1, r2
    bne.n 4f
    stmia.w r10!, {r6-r9}
    ldr r11, [sp, #28]
    str r10, [sp, #24]
    cmp r10, r11
    bne.w 1b
    ldr r4, [sp, #36]
    cmp r1, r4
    bne.n 5f
7:
    ldr r5, [sp, #40]
    cmp r10, r5
    beq.n 8f
    add r11, r10, #16
    strd r10, r11, [sp, #24]
    str r2, [sp, #32]
    .if COMPACT
    b.n 1b
    .else
    ldr r10, [sp, #44]
    b.w 9b
    .endif
8:
    add sp, sp, #52
    pop {r4-r11, pc}
4:
    @ A later chunk: its sums are added to the earlier ones.
    ldrd r4, r5, [r10]
    add r6, r6, r4
    add r7, r7, r5
    ldrd r4, r5, [r10, #8]
    add r8, r8, r4
    add r9, r9, r5
    ldr r4, [sp, #36]
    stmia.w r10!, {r6-r9}
    cmp r1, r4
    beq.n 7b
5:
    @ All chunks except the first are full: 512 columns and a start word.
    sub r10, r10, #16
    str r10, [sp, #24]
    add r2, r1, #1028
    str r2, [sp, #32]
    b.w 3b
    .size actq_w8_paired_row, . - actq_w8_paired_row

    .section .text.actq_w8_paired_group, "ax", %progbits
    .global actq_w8_paired_group
    .type actq_w8_paired_group, %function
    .thumb_func
    .balign 4
actq_w8_paired_group:
    push {r4-r11, lr}
    sub sp, sp, #44
    ldr r4, [sp, #80]
    str r1, [sp, #16]
    str r4, [sp, #28]
    strd r2, r3, [sp, #32]
1:
    ldr r1, [sp, #16]
    movs r4, #0
    strd r4, r4, [sp, #0]
    strd r4, r4, [sp, #8]
    .balign 4
2:
    r8_start
    .rept 4
    r8_cols8
    .endr
    r8_sums
    ldr r10, [r0], #4
    ldmia.w sp, {r2-r5}
    uxtb.w r11, r10
    mla r2, r6, r11, r2
    uxtb.w r11, r10, ror #8
    mla r3, r7, r11, r3
    uxtb.w r11, r10, ror #16
    mla r4, r8, r11, r4
    lsr r11, r10, #24
    mla r5, r9, r11, r5
    stmia.w sp, {r2-r5}
    ldr lr, [sp, #28]
    cmp r1, lr
    bne.w 2b
    ldrd r10, r11, [sp, #32]
    stmia.w r10!, {r2-r5}
    subs r11, r11, #1
    strd r10, r11, [sp, #32]
    bne.w 1b
    add sp, sp, #44
    pop {r4-r11, pc}
    .size actq_w8_paired_group, . - actq_w8_paired_group
    .text
