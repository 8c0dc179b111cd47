@ GEMV for 4-bit codes in paired lanes (kernels/src/layout/w4_paired.rs): strips of eight rows, or four.
@
@ Arguments: r0 weights, r1 prepared x, r2 acc, r3 strips (>= 1; of four rows there is one), [sp] x_end, [sp+4] bytes of the first chunk
@ in x, [sp+8] steps of 8 columns that the first pass through the row kernel's loop skips.
@
@ In the loops: r0 weights, r1 x, r2 mask, r6, r7, r5 the sums p, q, k of the first four rows, r8, r3, r4 those of the others (or of
@ all in a strip of four; two are low registers, because a chunk's start values are loaded with its first pairs), r9-r12 activation pairs
@ and weight words, lr the extracted codes.
@
@ Frame of the row kernel: 0 x after its first start words, 4-27 r3-r8 as these set them, 28 end of the first chunk, 32 acc,
@ 36 end of acc, or, if a row has several chunks or its first pass skips steps, acc after this strip, 40 end of this
@ chunk, 44 x_end, 48 end of acc, 52 skipped steps; of the group kernel: 0-31 sums over groups, in the order of the registers
@ that take them, 32 mask, 36 x_end, 40 acc, 44 end of acc, 48 x.

    .syntax unified
    .thumb

@ two columns of four rows
.macro c4_word word, pair, p, q, k, p0, q0, k0
    and lr, r2, \word
    smlad \p, lr, \pair, \p0
    and lr, r2, \word, ror #8
    smlad \q, lr, \pair, \q0
    and \word, \word, #0x0f0f0f0f
    smlad \k, \word, \pair, \k0
.endm

.macro c4_first word, pair
    c4_word \word, \pair, r6, r7, r5, r6, r7, r5
.endm

.macro c4_last word, pair
    c4_word \word, \pair, r8, r3, r4, r8, r3, r4
.endm

@ Four columns of a strip of four. The first four of a chunk are loaded with the start values and start all sums from them.
.macro c4_cols4 first=0
    .if \first
    ldmia.w r1!, {r3, r4, r11, r12}
    .else
    ldmia.w r1!, {r11, r12}
    .endif
    ldrd r9, r10, [r0], #8
    .if \first
    c4_word r9, r11, r8, r3, r4, r3, r3, r4
    .else
    c4_last r9, r11
    .endif
    c4_last r10, r12
.endm

@ Eight columns of a strip of eight, whose first pair is in r10. Loads also take later words if there is room, so that there are
@ five loads and not six. After it r10 holds the next pair, after a last one nothing, or the scales of the
@ first four rows: two successive single loads take less time.
.macro c4_cols8 first=0, last=0, scales=0
    ldmia.w r0!, {r9, r11, r12}
    .if \first
    c4_word r9, r10, r6, r7, r5, r3, r3, r4
    c4_word r11, r10, r8, r3, r4, r3, r3, r4
    .else
    c4_first r9, r10
    c4_last r11, r10
    .endif
    ldmia.w r1!, {r9, r10}
    c4_first r12, r9
    ldrd r11, r12, [r0], #8
    c4_last r11, r9
    c4_first r12, r10
    ldmia.w r0!, {r9, r11, r12}
    c4_last r9, r10
    .if \last
    ldr r9, [r1], #4
    .if \scales
    ldr r10, [r0], #4
    .endif
    .else
    ldmia.w r1!, {r9, r10}
    .endif
    c4_first r11, r9
    c4_last r12, r9
.endm

.macro c4_prologue frame
    push {r4-r11, lr}
    .if \frame
    sub sp, sp, #\frame
    .endif
    movw r12, #0xf00f
    movt r12, #0xf00f
.endm

@ The four rows' sums as `a` to `d`: A from the low 20 bits of k - 2^8*q, then the others. `b` may be p, `c` may be q.
.macro c4_sums p, q, k, a, b, c, d
    sub \a, \k, \q, lsl #8
    sbfx \a, \a, #0, #20
    sub \p, \p, \a
    sub \k, \k, \a
    sub \q, \q, \k, asr #8
    asr \b, \p, #12
    asr \d, \q, #12
    asr \c, \k, #8
.endm

@ Adds four sums to those at r12.
.macro c4_add a, b, c, d, old0, old1
    ldrd \old0, \old1, [r12]
    add \a, \a, \old0
    add \b, \b, \old1
    ldrd \old0, \old1, [r12, #8]
    add \c, \c, \old0
    add \d, \d, \old1
    stmia.w r12!, {\a, \b, \c, \d}
.endm

.macro c4_start
    ldmia.w r1!, {r3, r4}
    mov r5, r4
    mov r6, r3
    mov r7, r3
    mov r8, r3
.endm

    .section .text.actq_w4_paired_row, "ax", %progbits
    .global actq_w4_paired_row
    .type actq_w4_paired_row, %function
    .thumb_func
    .balign 4
actq_w4_paired_row:
    c4_prologue 60
    ldrd r9, r10, [sp, #96]
    ldr r11, [sp, #104]
    add r10, r10, r1
    add lr, r2, r3, lsl #5
    c4_start
    stmia.w sp, {r1, r3-r8}
    strd r10, r2, [sp, #28]
    strd r10, r9, [sp, #40]
    strd lr, r11, [sp, #48]
    cmp r10, r9
    it eq
    cmpeq r11, #0
    it ne
    addne lr, r2, #32
    str lr, [sp, #36]
    mov r2, r12
    .if COMPACT
    b.n 1f
    .else
    beq.n 1f
9:
    ldmia.w sp, {r1, r3-r8}
    ldr r10, [r1], #4
    tbh [pc, r11, lsl #1]
7:
    .irp step, 10f, 11f, 12f, 13f
    .hword (\step - 7b) / 2
    .endr
    .endif
3:
    c4_start
    b.n 2f
    .balign 4
1:
    ldmia.w sp, {r1, r3-r8}
2:
    ldr r10, [r1], #4
    .if !COMPACT
    .irp step, 10, 11, 12
\step:
    c4_cols8
    .endr
13:
    .endif
    c4_cols8 0, 1
    ldr lr, [sp, #40]
    cmp r1, lr
    bne.w 2b
    ldrd r9, r12, [sp, #28]
    cmp r1, r9
    bne.n 4f
    c4_sums r6, r7, r5, r9, r10, r11, lr
    stmia.w r12!, {r9-r11, lr}
    c4_sums r8, r3, r4, r5, r6, r7, r9
    stmia.w r12!, {r5-r7, r9}
    ldr r11, [sp, #36]
    str r12, [sp, #32]
    cmp r12, r11
    bne.w 1b
    ldr r9, [sp, #44]
    cmp r1, r9
    bne.n 5f
7:
    ldr r10, [sp, #48]
    cmp r12, r10
    beq.n 8f
    add r11, r12, #32
    ldr r9, [sp, #28]
    strd r12, r11, [sp, #32]
    str r9, [sp, #40]
    .if COMPACT
    b.n 1b
    .else
    ldr r11, [sp, #52]
    b.w 9b
    .endif
8:
    add sp, sp, #60
    pop {r4-r11, pc}
4:
    @ A later chunk: its sums are added to the earlier ones.
    c4_sums r6, r7, r5, r9, r10, r11, lr
    c4_add r9, r10, r11, lr, r5, r6
    c4_sums r8, r3, r4, r5, r6, r7, r9
    c4_add r5, r6, r7, r9, r10, r11
    ldr r9, [sp, #44]
    cmp r1, r9
    beq.n 7b
5:
    @ All chunks except the first are full: 256 columns and two start words.
    sub r12, r12, #32
    str r12, [sp, #32]
    add r3, r1, #520
    str r3, [sp, #40]
    b.w 3b
    .size actq_w4_paired_row, . - actq_w4_paired_row

@ The last strip of a block, so its loop is short: eight columns, of which no pass skips any. r5: x_end, r6: end of this chunk,
@ r7: acc.
    .section .text.actq_w4_paired_row4, "ax", %progbits
    .global actq_w4_paired_row4
    .type actq_w4_paired_row4, %function
    .thumb_func
    .balign 4
actq_w4_paired_row4:
    c4_prologue 0
    mov r7, r2
    mov r2, r12
    ldrd r5, r6, [sp, #36]
    add r6, r6, r1
    movs r9, #0
    strd r9, r9, [r7]
    strd r9, r9, [r7, #8]
1:
    ldmia.w r1!, {r3, r4}
    mov r8, r3
2:
    c4_cols4
    c4_cols4
    cmp r1, r6
    bne.n 2b
    c4_sums r8, r3, r4, r9, r10, r11, lr
    mov r12, r7
    c4_add r9, r10, r11, lr, r3, r4
    @ All chunks except the first are full: 256 columns and two start words.
    add r6, r1, #520
    cmp r1, r5
    bne.n 1b
    pop {r4-r11, pc}
    .size actq_w4_paired_row4, . - actq_w4_paired_row4

@ lr, p, k and q become 2^12 * (A, B, C, D), of at most 17 + 12 bits; r10 and r9 2^4 * the scales of rows 0 and 2, 1 and 3: SMLAW
@ divides the product by 2^16. r2 is the mask inverted.
.macro c4_rows p, q, k
    sub lr, \k, \q, lsl #8
    lsl lr, lr, #12
    sub \p, \p, lr, asr #12
    sub \k, \k, lr, asr #12
    lsl \k, \k, #4
    sub \q, \q, \k, asr #12
    and r9, r2, r10, lsr #4
    and r10, r2, r10, lsl #4
.endm

@ The sums over groups: r6, r11, r7, r12 of the first four rows, r8, r2, r9, r5 of the others.
.macro c4_group_kernel name, rows
    .section .text.\name, "ax", %progbits
    .global \name
    .type \name, %function
    .thumb_func
    .balign 4
\name:
    c4_prologue 52
    ldr r4, [sp, #88]
    add r3, r2, r3, lsl #((\rows + 12) / 4)
    strd r12, r4, [sp, #32]
    strd r2, r3, [sp, #40]
    str r1, [sp, #48]
    mov r2, r12
1:
    movs r3, #0
    strd r3, r3, [sp, #0]
    strd r3, r3, [sp, #8]
    .if \rows == 8
    strd r3, r3, [sp, #16]
    strd r3, r3, [sp, #24]
    .endif
    ldr r1, [sp, #48]
    .balign 4
2:
    .if \rows == 8
    ldmia.w r1!, {r3, r4, r10}
    c4_cols8 1
    c4_cols8
    c4_cols8
    c4_cols8 0, 1, 1
    .else
    c4_cols4 1
    add r5, r1, #56
    c4_cols4
3:
    c4_cols4
    c4_cols4
    cmp r1, r5
    bne.n 3b
    .endif
    mvn r2, r2
    .if \rows == 8
    c4_rows r6, r7, r5
    ldrd r11, r12, [sp, #24]
    smlawb r11, r6, r9, r11
    smlawt r12, r7, r9, r12
    ldrd r6, r7, [sp, #8]
    smlawb r6, lr, r10, r6
    smlawt r7, r5, r10, r7
    .endif
    ldr r10, [r0], #4
    c4_rows r8, r3, r4
    ldrd r2, r5, [sp, #0]
    smlawb r2, r8, r9, r2
    smlawt r5, r3, r9, r5
    .if \rows == 8
    ldrd r8, r9, [sp, #16]
    .else
    ldrd r8, r9, [sp, #8]
    .endif
    smlawb r8, lr, r10, r8
    smlawt r9, r4, r10, r9
    .if \rows == 8
    stmia.w sp, {r2, r5-r9, r11, r12}
    .else
    stmia.w sp, {r2, r5, r8, r9}
    .endif
    ldrd r2, lr, [sp, #32]
    cmp r1, lr
    bne.w 2b
    ldr r3, [sp, #0]
    ldrd r10, lr, [sp, #40]
    .if \rows == 8
    strd r6, r11, [r10], #8
    strd r7, r12, [r10], #8
    .endif
    strd r8, r3, [r10], #8
    strd r9, r5, [r10], #8
    str r10, [sp, #40]
    cmp r10, lr
    bne.w 1b
    add sp, sp, #52
    pop {r4-r11, pc}
    .size \name, . - \name
.endm

    c4_group_kernel actq_w4_paired_group, 8
    c4_group_kernel actq_w4_paired_group4, 4
    .text
