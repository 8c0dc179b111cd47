@ GEMV for 4-bit codes in paired lanes (kernels/src/format/w4_paired.rs): strips of eight rows, or four.
@
@ Arguments: r0 weights, r1 prepared x, r2 acc, r3 strips (>= 1), [sp] x_end, [sp+4] bytes of the first chunk
@ in x, [sp+8] steps of 8 columns that the first pass through the row kernel's loop leaves out.
@
@ In the loops: r0 weights, r1 x, r2 mask, r11 and r12 activation pairs, r6, r7, r5 the sums p, q, k of the first four rows,
@ r8, r3, r4 those of the others (or of all in a strip of four; two are low registers, because a chunk's start values come with
@ its first pairs), r9 and r10 weight words, lr the extracted codes.
@
@ Frame of the row kernel: 0 x_end where there is but one chunk, or 0, 4 x_end, 8 acc, 12 strips, 16 end of this chunk, 20 x,
@ 24 mask, 28 steps left out, 32 end of the first chunk; of the group kernel: 0-31 sums over groups, in the order of the
@ registers that take them, 32 mask, 36 x_end, 40 acc, 44 strips, 48 x.

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

@ Four columns of a strip. The first four of a chunk come with the start values and start all sums from them.
.macro c4_cols4 rows, first=0
    .if \first
    ldmia.w r1!, {r3, r4, r11, r12}
    .else
    ldmia.w r1!, {r11, r12}
    .endif
    ldrd r9, r10, [r0], #8
    .if \rows == 8
    .if \first
    c4_word r9, r11, r6, r7, r5, r3, r3, r4
    c4_word r10, r11, r8, r3, r4, r3, r3, r4
    .else
    c4_first r9, r11
    c4_last r10, r11
    .endif
    ldrd r9, r10, [r0], #8
    c4_first r9, r12
    c4_last r10, r12
    .else
    .if \first
    c4_word r9, r11, r8, r3, r4, r3, r3, r4
    .else
    c4_last r9, r11
    .endif
    c4_last r10, r12
    .endif
.endm

@ r12: the mask, r4: x_end, r5: bytes of the first chunk, r6: steps left out
.macro c4_prologue
    push {r4-r11, lr}
    sub sp, sp, #52
    movw r12, #0xf00f
    movt r12, #0xf00f
    ldrd r4, r5, [sp, #88]
    ldr r6, [sp, #96]
.endm

@ `to`: where the sums of the next strip go, `left`: strips left, this one included; both are kept at `acc`.
.macro c4_next_strip acc, to=r11, left=r12
    subs \left, \left, #1
    strd \to, \left, [sp, #\acc]
    bne.w 1b
    add sp, sp, #52
    pop {r4-r11, pc}
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

@ Adds four sums to those at r11.
.macro c4_add a, b, c, d, old0, old1
    ldrd \old0, \old1, [r11]
    add \a, \a, \old0
    add \b, \b, \old1
    ldrd \old0, \old1, [r11, #8]
    add \c, \c, \old0
    add \d, \d, \old1
    stmia.w r11!, {\a, \b, \c, \d}
.endm

.macro c4_start rows
    ldmia.w r1!, {r3, r4}
    .if \rows == 8
    mov r6, r3
    mov r7, r3
    mov r5, r4
    .endif
    mov r8, r3
.endm

.macro c4_row_kernel name, rows
    .section .text.\name, "ax", %progbits
    .global \name
    .type \name, %function
    .thumb_func
    .balign 16
\name:
    c4_prologue
    add r5, r5, r1
    str r4, [sp, #4]
    strd r2, r3, [sp, #8]
    strd r5, r1, [sp, #16]
    strd r12, r6, [sp, #24]
    str r5, [sp, #32]
    cmp r5, r4
    it ne
    movne r4, #0
    str r4, [sp, #0]
1:
    ldrd r1, r2, [sp, #20]
    .if \rows == 8
    ldr lr, [sp, #28]
    c4_start 8
    tbh [pc, lr, lsl #1]
7:
    .irp step, 10f, 11f, 12f, 13f
    .hword (\step - 7b) / 2
    .endr
3:
    c4_start 8
    .balign 4
2:
    .irp step, 10, 11, 12, 13
\step:
    c4_cols4 8
    c4_cols4 8
    .endr
    .else
    @ Seldom more than a strip of a block, so its loop is short: eight columns, of which no pass leaves out any.
3:
    c4_start 4
2:
    c4_cols4 4
    c4_cols4 4
    .endif
    ldr lr, [sp, #16]
    cmp r1, lr
    bne.w 2b
    ldmia.w sp, {r9-r12}
    cmp r1, r9
    bne.n 4f
    .if \rows == 8
    c4_sums r6, r7, r5, r2, r6, r7, lr
    stmia.w r11!, {r2, r6, r7, lr}
    .endif
    c4_sums r8, r3, r4, r2, r5, r6, r7
    stmia.w r11!, {r2, r5, r6, r7}
6:
    c4_next_strip 8
4:
    @ One of several chunks: its sums are added to those before, which are 0 at the first.
    ldr lr, [sp, #32]
    cmp r1, lr
    bne.n 8f
    movs r9, #0
    .irp at, 0, 8
    strd r9, r9, [r11, #\at]
    .if \rows == 8
    strd r9, r9, [r11, #(16 + \at)]
    .endif
    .endr
8:
    .if \rows == 8
    c4_sums r6, r7, r5, r2, r6, r7, lr
    c4_add r2, r6, r7, lr, r5, r9
    .endif
    c4_sums r8, r3, r4, r2, r5, r6, r7
    c4_add r2, r5, r6, r7, r9, lr
    cmp r1, r10
    bne.n 5f
    ldr r9, [sp, #32]
    str r9, [sp, #16]
    b.n 6b
5:
    @ All chunks but the first are full: 256 columns and two start words.
    add r3, r1, #520
    str r3, [sp, #16]
    ldr r2, [sp, #24]
    b.w 3b
    .size \name, . - \name
.endm

@ lr, p, k and q become 2^12 * (A, B, C, D), of at most 17 + 12 bits; r10 and r9 2^4 * the scales of rows 0 and 2, 1 and 3: SMLAW
@ takes 2^16 away from the product. r2 is the mask inverted.
.macro c4_rows p, q, k
    ldr r9, [r0], #4
    sub lr, \k, \q, lsl #8
    lsl lr, lr, #12
    sub \p, \p, lr, asr #12
    sub \k, \k, lr, asr #12
    lsl \k, \k, #4
    sub \q, \q, \k, asr #12
    and r10, r2, r9, lsl #4
    and r9, r2, r9, lsr #4
.endm

@ The sums over groups: r6, r11, r7, r12 of the first four rows, r8, r2, r9, r5 of the others.
.macro c4_group_kernel name, rows
    .section .text.\name, "ax", %progbits
    .global \name
    .type \name, %function
    .thumb_func
    .balign 16
\name:
    c4_prologue
    strd r12, r4, [sp, #32]
    strd r2, r3, [sp, #40]
    str r1, [sp, #48]
1:
    movs r3, #0
    movs r4, #0
    strd r3, r4, [sp, #0]
    strd r3, r4, [sp, #8]
    .if \rows == 8
    strd r3, r4, [sp, #16]
    strd r3, r4, [sp, #24]
    .endif
    ldr r1, [sp, #48]
    ldr r2, [sp, #32]
    .balign 4
2:
    c4_cols4 \rows, 1
    .if \rows == 8
    .rept 7
    c4_cols4 8
    .endr
    .else
    add r5, r1, #56
    c4_cols4 4
3:
    c4_cols4 4
    c4_cols4 4
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
    ldr r2, [sp, #0]
    ldrd r10, lr, [sp, #40]
    .if \rows == 8
    strd r6, r11, [r10], #8
    strd r7, r12, [r10], #8
    .endif
    strd r8, r2, [r10], #8
    strd r9, r5, [r10], #8
    c4_next_strip 40, r10, lr
    .size \name, . - \name
.endm

    c4_row_kernel actq_w4_paired_row, 8
    c4_row_kernel actq_w4_paired_row4, 4
    c4_group_kernel actq_w4_paired_group, 8
    c4_group_kernel actq_w4_paired_group4, 4
    .text
