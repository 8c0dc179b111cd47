@ GEMV for 3-bit codes in paired lanes (kernels/src/layout/w3_paired.rs): strips of four rows.
@
@ Arguments: r0 weights, r1 prepared x, r2 acc, r3 strips (>= 1), [sp] x_end, [sp+4] minus the biases of all chunks,
@ [sp+8] steps of 8 columns that the first pass through the row kernel's loop skips.
@ x_end is the end of the last chunk; with row scales, the sum of x is there.
@
@ In the loops: r0 weights, r1 x, r2 mask, r3-r5 weight words, r6 the sums t of rows 2 and 3 (it is loaded first, with the chunk's
@ start value), r7 and r8 activation pairs, r9 t of rows 0 and 1, r10 and r11 sums of the two t over chunks, r12 sums of their
@ high halves side by side, lr the extracted codes, or the sum of x.
@
@ The high halves of 64 columns stay within `4 * 127 * 64 = 32512`.
@
@ Frame of the row kernel: 0 x, 4 and 8 minus the biases, 12 0, 16-23 sums of the high halves, 24 acc, 28 end of acc, or, if the
@ first pass skips steps, acc after this strip, 32 x_end, 36 sum of x, 40 end of acc, 44 skipped steps; of the group kernel:
@ 0-15 sums over groups, 16 x, 20 acc, 24 end of acc, 28 x_end.

    .syntax unified
    .thumb

@ t += (codes at bit `rot` of both rows and lanes) * pair; `codes` takes the extracted codes.
.macro d3_set codes, word, rot, pair, t, from
    .if \rot
    and \codes, r2, \word, ror #\rot
    .else
    and \codes, r2, \word
    .endif
    smlad \t, \codes, \pair, \from
.endm

@ A chunk of eight columns; afterwards r9 and r6 hold its sums t. With `sum`, the sum of x after the chunk, in both halves of a
@ word, goes to lr, which the second half does not change.
.macro d3_chunk sum=0, t0=r9, t1=r6
    ldmia.w r1!, {r6-r8}
    ldmia.w r0!, {r3-r5}
    d3_set lr, r3, 0, r7, \t0, r6
    d3_set lr, r3, 6, r7, \t1, r6
    d3_set lr, r4, 0, r8, \t0, \t0
    d3_set lr, r4, 6, r8, \t1, \t1
    .if \sum
    ldmia.w r1!, {r7, r8, lr}
    .else
    ldmia.w r1!, {r7, r8}
    .endif
    eor r3, r3, r4, ror #2
    eor r4, r5, r4, ror #4
    d3_set r3, r3, 10, r8, \t0, \t0
    d3_set r3, r5, 0, r7, \t0, \t0
    d3_set r5, r5, 6, r7, \t1, \t1
    d3_set r4, r4, 10, r8, \t1, \t1
.endm

@ the same, then its sums are added to those of the earlier chunks
.macro d3_next_chunk sum=0
    d3_chunk \sum
    add r10, r10, r9
    add r11, r11, r6
    pkhtb r3, r6, r9, asr #16
    sadd16 r12, r12, r3
.endm

    .section .text.actq_w3_paired_row, "ax", %progbits
    .global actq_w3_paired_row
    .type actq_w3_paired_row, %function
    .thumb_func
    .balign 4
actq_w3_paired_row:
    push {r4-r11, lr}
    sub sp, sp, #52
    ldrd r4, r10, [sp, #88]
    ldr r9, [sp, #96]
    mov r11, r10
    movs r12, #0
    stmia.w sp, {r1, r10-r12}
    ldr r5, [r4]
    add r6, r2, r3, lsl #4
    strd r4, r5, [sp, #32]
    strd r6, r9, [sp, #40]
    cmp r9, #0
    it ne
    addne r6, r2, #16
    strd r2, r6, [sp, #24]
    movw r2, #0xe007
    movt r2, #0xe007
    beq.n 1f
9:
    ldmia.w sp, {r1, r10-r12}
    strd r12, r12, [sp, #16]
    tbh [pc, r9, lsl #1]
7:
    .irp step, 2f, 11f, 12f, 13f
    .hword (\step - 7b) / 2
    .endr
    .if !COMPACT
    .irp step, 14f, 15f, 16f, 17f
    .hword (\step - 7b) / 2
    .endr
    .endif
    .balign 4
1:
    ldmia.w sp, {r1, r10-r12}
    strd r12, r12, [sp, #16]
2:
    d3_chunk
    add r10, r10, r9
    add r11, r11, r6
    pkhtb r12, r6, r9, asr #16
    .irp step, 11, 12, 13
\step:
    d3_next_chunk
    .endr
    .if !COMPACT
    .irp step, 14, 15, 16, 17
\step:
    d3_next_chunk
    .endr
    .endif
    ldrd r7, r8, [sp, #16]
    ldr lr, [sp, #32]
    sxtah r7, r7, r12
    add r8, r8, r12, asr #16
    strd r7, r8, [sp, #16]
    cmp r1, lr
    bne.w 2b
    @ The rest of a sum of t without its high half is 8 * even = 4 * the even row's level sum; the odd row's is
    @ 2 * odd + sum(x).
    ldr lr, [sp, #36]
    sub r3, r10, r7, lsl #16
    asrs r3, r3, #2
    add r4, lr, r7, lsl #1
    sub r5, r11, r8, lsl #16
    asrs r5, r5, #2
    add r6, lr, r8, lsl #1
    ldrd r9, r10, [sp, #24]
    stmia.w r9!, {r3-r6}
    str r9, [sp, #24]
    cmp r9, r10
    bne.w 1b
    ldr r10, [sp, #40]
    cmp r9, r10
    beq.n 8f
    add r9, r9, #16
    str r9, [sp, #28]
    ldr r9, [sp, #44]
    b.w 9b
8:
    add sp, sp, #52
    pop {r4-r11, pc}
    .size actq_w3_paired_row, . - actq_w3_paired_row

    .section .text.actq_w3_paired_group, "ax", %progbits
    .global actq_w3_paired_group
    .type actq_w3_paired_group, %function
    .thumb_func
    .balign 4
actq_w3_paired_group:
    push {r4-r11, lr}
    sub sp, sp, #36
    ldr r4, [sp, #72]
    add r3, r2, r3, lsl #4
    strd r1, r2, [sp, #16]
    strd r3, r4, [sp, #24]
    movw r2, #0xe007
    movt r2, #0xe007
1:
    ldr r1, [sp, #16]
    movs r4, #0
    strd r4, r4, [sp, #0]
    strd r4, r4, [sp, #8]
    .balign 4
2:
    d3_chunk 0, r10, r11
    pkhtb r12, r11, r10, asr #16
    d3_next_chunk
    d3_next_chunk
    d3_next_chunk 1
    @ The four level sums, at most 7 * 127 * 32 = 28448: both halves of r10 of the even rows, of r12 of the odd ones. The four
    @ chunks' biases are 2^15 in both halves of r10.
    sub r10, r10, r12, lsl #16
    sub r11, r11, r12
    uxtah r11, r11, r12
    asr r10, r10, #2
    pkhbt r10, r10, r11, lsl #14
    eor r10, r10, #0x80008000
    sadd16 r12, r12, r12
    sadd16 r12, r12, lr
    ldr r9, [r0], #4
    ldr lr, [sp, #28]
    uxtb16 r8, r9
    uxtb16 r9, r9, ror #8
    ldmia.w sp, {r3-r6}
    smlabb r3, r10, r8, r3
    smlabb r4, r12, r9, r4
    smlatt r5, r10, r8, r5
    smlatt r6, r12, r9, r6
    stmia.w sp, {r3-r6}
    cmp r1, lr
    bne.w 2b
    ldrd r9, r10, [sp, #20]
    stmia.w r9!, {r3-r6}
    str r9, [sp, #20]
    cmp r9, r10
    bne.w 1b
    add sp, sp, #36
    pop {r4-r11, pc}
    .size actq_w3_paired_group, . - actq_w3_paired_group
    .text
