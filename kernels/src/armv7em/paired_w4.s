@ GEMV for 4-bit codes in paired lanes (kernels/src/format/w4_paired.rs): strips of eight rows, or four.
@
@ Arguments: r0 weights, r1 prepared x, r2 acc, r3 strips (>= 1), [sp] x_end, [sp+4] bytes of the first chunk
@ in x, [sp+8] steps of 8 columns that the first pass through the row kernel's loop leaves out.
@
@ In the loops: r0 weights, r1 x, r2 mask, r9 and r10 activation pairs, r5-r7 the sums p, q, k of the first four rows, r8, r3
@ and r4 those of the others (or of all in a strip of four; two are low registers, because a chunk's start values come with its
@ first pairs), r11 and r12 weight words, lr the extracted codes.
@
@ Frame: 0-31 sums over groups, those of the last four rows first (group kernel), 0 end of this chunk (row kernel), 32 x, 36 mask,
@ 40 end of the first chunk (row kernel) or mask (group kernel), 44 x_end, 48 acc, 52 strips, 56 steps left out.

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
    c4_word \word, \pair, r5, r6, r7, r5, r6, r7
.endm

.macro c4_last word, pair
    c4_word \word, \pair, r8, r3, r4, r8, r3, r4
.endm

@ Four columns of a strip. The first four of a chunk come with the start values and start all sums from them.
.macro c4_cols4 rows, first=0
    .if \first
    ldmia.w r1!, {r3, r4, r9, r10}
    .else
    ldmia.w r1!, {r9, r10}
    .endif
    ldrd r11, r12, [r0], #8
    .if \rows == 8
    .if \first
    c4_word r11, r9, r5, r6, r7, r3, r3, r4
    c4_word r12, r9, r8, r3, r4, r3, r3, r4
    .else
    c4_first r11, r9
    c4_last r12, r9
    .endif
    ldrd r11, r12, [r0], #8
    c4_first r11, r10
    c4_last r12, r10
    .else
    .if \first
    c4_word r11, r9, r8, r3, r4, r3, r3, r4
    .else
    c4_last r11, r9
    .endif
    c4_last r12, r10
    .endif
.endm

.macro c4_prologue
    push {r4-r11, lr}
    sub sp, sp, #60
    movw r12, #0xf00f
    movt r12, #0xf00f
    ldrd r4, r5, [sp, #96]
    strd r1, r12, [sp, #32]
    str r4, [sp, #44]
    strd r2, r3, [sp, #48]
    ldr r6, [sp, #104]
    str r6, [sp, #56]
.endm

@ r11: where the sums of the next strip go, r12: strips left, this one included
.macro c4_next_strip
    subs r12, r12, #1
    strd r11, r12, [sp, #48]
    bne.w 1b
    add sp, sp, #60
    pop {r4-r11, pc}
.endm

@ The four rows' sums as `a`, `b`, `c` and `d`: A from the low 20 bits of k - 2^8*q, then the others.
.macro c4_sums p, q, k, a, b, c, d
    sub \a, \k, \q, lsl #8
    sbfx \a, \a, #0, #20
    sub \p, \p, \a
    sub \k, \k, \a
    sub \q, \q, \k, asr #8
    asr \b, \p, #12
    asr \c, \k, #8
    asr \d, \q, #12
.endm

@ Adds `a` to `d` to the sums at r11.
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
    mov r5, r3
    mov r6, r3
    mov r7, r4
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
    str r5, [sp, #40]
    str r5, [sp, #0]
1:
    ldrd r1, r2, [sp, #32]
    c4_start \rows
    ldr lr, [sp, #56]
    tbh [pc, lr, lsl #1]
7:
    .irp step, 10f, 11f, 12f, 13f
    .hword (\step - 7b) / 2
    .endr
3:
    c4_start \rows
    .balign 4
2:
    .irp step, 10, 11, 12, 13
\step:
    c4_cols4 \rows
    c4_cols4 \rows
    .endr
    ldr lr, [sp, #0]
    cmp r1, lr
    bne.w 2b
    ldrd r12, lr, [sp, #40]
    ldr r11, [sp, #48]
    cmp r1, r12
    bne.n 4f
    .if \rows == 8
    c4_sums r5, r6, r7, r2, r9, r10, r12
    stmia.w r11!, {r2, r9, r10, r12}
    .endif
    c4_sums r8, r3, r4, r2, r5, r6, r7
    stmia.w r11!, {r2, r5, r6, r7}
    cmp r1, lr
    bne.n 5f
6:
    ldr r12, [sp, #52]
    c4_next_strip
4:
    @ A later chunk's sums are added to those before.
    .if \rows == 8
    c4_sums r5, r6, r7, r2, r9, r10, r12
    c4_add r2, r9, r10, r12, r5, r6
    .endif
    c4_sums r8, r3, r4, r2, r5, r6, r7
    c4_add r2, r5, r6, r7, r9, r10
    cmp r1, lr
    bne.n 5f
    ldr r12, [sp, #40]
    str r12, [sp, #0]
    b.n 6b
5:
    @ All chunks but the first are full: 256 columns and two start words.
    add r3, r1, #520
    str r3, [sp, #0]
    ldr r2, [sp, #36]
    b.w 3b
    .size \name, . - \name
.endm

@ lr, p, k and q become 2^12 * (A, B, C, D), of at most 17 + 12 bits; r12 and r11 2^4 * the scales of rows 0 and 2, 1 and 3: SMLAW
@ takes 2^16 away from the product. r2 is the mask inverted.
.macro c4_rows p, q, k
    ldr r11, [r0], #4
    sub lr, \k, \q, lsl #8
    lsl lr, lr, #12
    sub \p, \p, lr, asr #12
    sub \k, \k, lr, asr #12
    lsl \k, \k, #4
    sub \q, \q, \k, asr #12
    and r12, r2, r11, lsl #4
    and r11, r2, r11, lsr #4
.endm

.macro c4_group_kernel name, rows
    .section .text.\name, "ax", %progbits
    .global \name
    .type \name, %function
    .thumb_func
    .balign 16
\name:
    c4_prologue
    str r12, [sp, #40]
1:
    movs r3, #0
    movs r4, #0
    strd r3, r4, [sp, #0]
    strd r3, r4, [sp, #8]
    .if \rows == 8
    strd r3, r4, [sp, #16]
    strd r3, r4, [sp, #24]
    .endif
    ldrd r1, r2, [sp, #32]
    .balign 4
2:
    c4_cols4 \rows, 1
    .rept 7
    c4_cols4 \rows
    .endr
    mvn r2, r2
    .if \rows == 8
    c4_rows r5, r6, r7
    ldrd r9, r10, [sp, #16]
    smlawb r9, lr, r12, r9
    smlawb r10, r5, r11, r10
    strd r9, r10, [sp, #16]
    ldrd r9, r10, [sp, #24]
    smlawt r9, r7, r12, r9
    smlawt r10, r6, r11, r10
    strd r9, r10, [sp, #24]
    .endif
    c4_rows r8, r3, r4
    ldmia.w sp, {r5-r7, r9}
    smlawb r5, lr, r12, r5
    smlawb r6, r8, r11, r6
    smlawt r7, r4, r12, r7
    smlawt r9, r3, r11, r9
    stmia.w sp, {r5-r7, r9}
    ldrd r2, lr, [sp, #40]
    cmp r1, lr
    bne.w 2b
    ldrd r11, r12, [sp, #48]
    .if \rows == 8
    ldrd r2, r3, [sp, #16]
    ldrd r4, r8, [sp, #24]
    stmia.w r11!, {r2-r4, r8}
    .endif
    stmia.w r11!, {r5-r7, r9}
    c4_next_strip
    .size \name, . - \name
.endm

    c4_row_kernel actq_w4_paired_row, 8
    c4_row_kernel actq_w4_paired_row4, 4
    c4_group_kernel actq_w4_paired_group, 8
    c4_group_kernel actq_w4_paired_group4, 4
    .text
