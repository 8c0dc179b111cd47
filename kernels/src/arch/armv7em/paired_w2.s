@ GEMV for 2-bit codes in paired lanes (kernels/src/layout/w2_paired.rs): strips of eight rows, or four.
@
@ Arguments: r0 weights, r1 prepared x, r2 acc, r3 strips (>= 1; of four rows there is one), [sp] x_end, [sp+4] minus the biases of all chunks,
@ [sp+8] steps of 8 columns that the first pass through the row kernel's loop skips; with group scales, not 0 if the last
@ pair has one group only.
@ x_end is the end of the last chunk; with row scales, the sum of x is there.
@
@ In the loops: r0 weights, r1 x, r3-r6 activation pairs, r2 and r7-r9 the sums t of row pairs 0 to 3 (r7 and r2 in a strip
@ of four, and r8 the end of the chunk; r2 is started last, because a chunk's start value is loaded with its first pairs), r10 and
@ r11 weight words, r12 the mask, lr the extracted codes.
@
@ Frame: 0-31 sums over chunks, (sum of t, sum of its high half) of each row pair, or sums over groups; 32 mask, 36 x_end, 40 x, 44 minus the biases,
@ 48 acc, 52 strips, or end of acc, or, if the first pass skips steps, acc after this strip, 56 sum of x, 60 skipped
@ steps, 64 end of acc.

    .syntax unified
    .thumb

@ t += (codes at bit `rot` of both rows and lanes) * pair
.macro d2_set rot, word, pair, t, from
    .if \rot
    and lr, r12, \word, ror #\rot
    .else
    and lr, r12, \word
    .endif
    smlad \t, lr, \pair, \from
.endm

@ eight columns of a row pair
.macro d2_word word, t, from
    d2_set 0, \word, r3, \t, \from
    d2_set 4, \word, r4, \t, \t
    d2_set 8, \word, r5, \t, \t
    d2_set 12, \word, r6, \t, \t
.endm

@ Eight columns of a strip. The first eight of a chunk load the start value into r2 and start all sums from it.
.macro d2_cols8 rows, first
    .if \first
    ldmia.w r1!, {r2-r6}
    ldrd r10, r11, [r0, #8]
    d2_word r10, r8, r2
    d2_word r11, r9, r2
    ldrd r10, r11, [r0], #16
    d2_word r11, r7, r2
    d2_word r10, r2, r2
    .else
    ldmia.w r1!, {r3-r6}
    ldrd r10, r11, [r0], #8
    .if \rows == 4
    d2_word r10, r7, r7
    d2_word r11, r2, r2
    .else
    d2_word r10, r2, r2
    d2_word r11, r7, r7
    ldrd r10, r11, [r0], #8
    d2_word r10, r8, r8
    d2_word r11, r9, r9
    .endif
    .endif
.endm

.macro d2_prologue
    push {r4-r11, lr}
    sub sp, sp, #68
    movw r12, #0xc003
    movt r12, #0xc003
    ldrd r4, r5, [sp, #104]
    strd r12, r4, [sp, #32]
    strd r1, r5, [sp, #40]
    strd r2, r3, [sp, #48]
.endm

@ Writes the sums over chunks from `low`, `high`; sets x to its start.
.macro d2_begin low, high
    .irp at, 0, 8, 16, 24
    strd \low, \high, [sp, #\at]
    .endr
    ldr r12, [sp, #32]
    ldr r1, [sp, #40]
.endm

@ The rest of t without its high half is 4 * even = 2 * the even row's level sum; the odd row's is 2 * odd + sum(x).
.macro d2_rows even, odd
    sub \even, \even, \odd, lsl #16
    asr \even, \even, #1
    add \odd, r7, \odd, lsl #1
.endm

    .section .text.actq_w2_paired_row, "ax", %progbits
    .global actq_w2_paired_row
    .type actq_w2_paired_row, %function
    .thumb_func
    .balign 4
actq_w2_paired_row:
    d2_prologue
    ldr r6, [r4]
    ldr lr, [sp, #112]
    add r3, r2, r3, lsl #5
    str r6, [sp, #56]
    strd lr, r3, [sp, #60]
    cmp lr, #0
    it ne
    addne r3, r2, #32
    str r3, [sp, #52]
    beq.n 1f
9:
    @ A short first chunk: all sums start before the first step that is not skipped.
    ldr r4, [sp, #44]
    movs r5, #0
    d2_begin r4, r5
    ldr lr, [sp, #60]
    ldr r2, [r1], #4
    mov r7, r2
    mov r8, r2
    mov r9, r2
    tbh [pc, lr, lsl #1]
7:
    .irp step, 2f, 11f, 12f, 13f
    .hword (\step - 7b) / 2
    .endr
    .balign 4
1:
    ldr r4, [sp, #44]
    movs r5, #0
    d2_begin r4, r5
2:
    d2_cols8 8, 1
    .irp step, 11, 12, 13
\step:
    d2_cols8 8, 0
    .endr
    ldmia.w sp, {r3-r6, r10-r12, lr}
    add r3, r3, r2
    add r4, r4, r2, asr #16
    add r5, r5, r7
    add r6, r6, r7, asr #16
    add r10, r10, r8
    add r11, r11, r8, asr #16
    add r12, r12, r9
    add lr, lr, r9, asr #16
    stmia.w sp, {r3-r6, r10-r12, lr}
    ldrd r12, lr, [sp, #32]
    cmp r1, lr
    bne.w 2b
    ldr r7, [sp, #56]
    ldrd r8, r9, [sp, #48]
    d2_rows r3, r4
    d2_rows r5, r6
    ldrd r12, lr, [sp, #24]
    d2_rows r10, r11
    d2_rows r12, lr
    stmia.w r8!, {r3-r6, r10-r12, lr}
    str r8, [sp, #48]
    cmp r8, r9
    bne.w 1b
    ldr r9, [sp, #64]
    cmp r8, r9
    beq.n 8f
    add r8, r8, #32
    str r8, [sp, #52]
    b.w 9b
8:
    add sp, sp, #68
    pop {r4-r11, pc}
    .size actq_w2_paired_row, . - actq_w2_paired_row

@ The last strip of a block, so its loop is short: eight columns. r9: steps that this chunk skips.
    .section .text.actq_w2_paired_row4, "ax", %progbits
    .global actq_w2_paired_row4
    .type actq_w2_paired_row4, %function
    .thumb_func
    .balign 4
actq_w2_paired_row4:
    d2_prologue
    ldr r9, [sp, #112]
    movs r6, #0
    strd r5, r6, [sp, #0]
    strd r5, r6, [sp, #8]
2:
    ldr r2, [r1], #4
    mov r7, r2
    add r8, r1, #64
    sub r8, r8, r9, lsl #4
    movs r9, #0
3:
    d2_cols8 4, 0
    cmp r1, r8
    bne.n 3b
    ldmia.w sp, {r3-r6}
    add r3, r3, r7
    add r4, r4, r7, asr #16
    add r5, r5, r2
    add r6, r6, r2, asr #16
    stmia.w sp, {r3-r6}
    ldr r8, [sp, #36]
    cmp r1, r8
    bne.n 2b
    ldr r7, [r1]
    d2_rows r3, r4
    d2_rows r5, r6
    ldr r8, [sp, #48]
    stmia.w r8, {r3-r6}
    add sp, sp, #68
    pop {r4-r11, pc}
    .size actq_w2_paired_row4, . - actq_w2_paired_row4

@ Adds a group's sums t of two row pairs, times the odd rows' `scales`, to the sums of the odd rows, and then, times the scales
@ `evens`, to those of the even rows. r12 holds the sum of x. Even rows sum 4 * even * scale, odd rows
@ (2 * odd + sum(x)) * scale.
.macro d2_scale scales, evens, t0, t1, even0, odd0, even1, odd1
    uxtb16 \evens, \scales
    uxtb16 \scales, \scales, ror #8
    smlabb \odd0, r12, \scales, \odd0
    smlabt \odd1, r12, \scales, \odd1
    add \scales, \scales, \scales
    smlatb \odd0, \t0, \scales, \odd0
    smlatt \odd1, \t1, \scales, \odd1
    sub \t0, \t0, #0x8000
    sub \t1, \t1, #0x8000
    smlabb \even0, \t0, \evens, \even0
    smlabt \even1, \t1, \evens, \even1
.endm

@ Separates the sums t of a row pair in two groups: `low` becomes 4 * even of both, |4 * even| <= 24384, `second` odd of both.
@ `first` is free then.
.macro d2_apart first, second, low
    pkhbt \low, \first, \second, lsl #16
    pkhtb \second, \second, \first, asr #16
    eor \low, \low, #0x80008000
.endm

@ Adds the level sums to the sums of the pair's rows. `scales` holds a byte for the even and one for the odd row in the first
@ group, then two for the second group; lr the two sums of x, |sum(x)| <= 127 * 32 = 4064. |odd| <= 8128 and the doubled scales,
@ at most 510, are int16, too.
.macro d2_scale_two scales, low, high, even, odd, temp
    uxtb16 \temp, \scales
    smlad \even, \low, \temp, \even
    uxtb16 \scales, \scales, ror #8
    smlad \odd, lr, \scales, \odd
    add \scales, \scales, \scales
    smlad \odd, \high, \scales, \odd
.endm

.macro d2_zero
    mov.w r4, #0
    .irp at, 0, 8, 16, 24
    strd r4, r4, [sp, #\at]
    .endr
.endm

@ Groups are paired: after the first, Z is clear, and its sums t are on the stack until those of the second, after which Z
@ is set; no instruction between sets flags. Sums over groups: row pairs 2, 3, 0 and 1. Bit 31 of the remaining strips means that a last group
@ follows the pairs.
    .section .text.actq_w2_paired_group, "ax", %progbits
    .global actq_w2_paired_group
    .type actq_w2_paired_group, %function
    .thumb_func
    .balign 4
actq_w2_paired_group:
    d2_prologue
    d2_zero
    ldr r5, [sp, #112]
    cmp r5, #0
    bne.w 8f
    movs r4, #1
    b.n 2f
    .balign 4
3:
    stmdb sp!, {r2, r7-r9}
    cmp.w r0, r0
2:
    d2_cols8 8, 1
    d2_cols8 8, 0
    d2_cols8 8, 0
    d2_cols8 8, 0
    bne.w 3b
    ldr lr, [r1], #4
    ldrd r3, r4, [sp], #8
    d2_apart r3, r2, r5
    d2_apart r4, r7, r3
    ldrd r10, r11, [r0], #8
    ldrd r4, r6, [sp, #24]
    d2_scale_two r10, r5, r2, r4, r6, r12
    strd r4, r6, [sp, #24]
    ldrd r4, r6, [sp, #32]
    d2_scale_two r11, r3, r7, r4, r6, r12
    strd r4, r6, [sp, #32]
    ldmia.w sp!, {r2, r3, r6, r7, r10, r11}
    ldrd r4, r5, [r0], #8
    d2_apart r2, r8, r12
    d2_scale_two r4, r12, r8, r6, r7, r2
    d2_apart r3, r9, r12
    d2_scale_two r5, r12, r9, r10, r11, r2
    stmdb sp!, {r6, r7, r10, r11}
    ldrd r12, lr, [sp, #32]
    cmp r1, lr
    bne.w 2b
    ldrd r8, r9, [sp, #48]
    subs r9, r9, #1
    bmi.w 5f
    ldrd r2, r3, [sp, #16]
    ldrd r4, r5, [sp, #24]
    .irp even, r2, r4, r6, r10
    asr.w \even, \even, #1
    .endr
    stmia.w r8!, {r2-r7, r10, r11}
    strd r8, r9, [sp, #48]
    d2_zero
    ldr r1, [sp, #40]
    bne.w 2b
4:
    add sp, sp, #68
    pop {r4-r11, pc}
8:
    @ After the pairs, the vector has a last pair, whose second group x_end excludes.
    ldr r4, [sp, #36]
    sub r4, r4, #76
    str r4, [sp, #36]
    orr r9, r3, #0x80000000
    str r9, [sp, #52]
    cmp r1, r4
    bne.w 2b
9:
    sub r9, r9, #1
5:
    str r9, [sp, #52]
    ldr r2, [r1], #4
    mov r7, r2
    mov r8, r2
    mov r9, r2
    add r10, r1, #64
    str r10, [sp, #56]
6:
    d2_cols8 8, 0
    ldr lr, [sp, #56]
    cmp r1, lr
    bne.w 6b
    ldrsh r12, [r1, #68]
    ldrd r10, r11, [r0], #8
    ldrd r3, r4, [sp, #16]
    ldrd r5, r6, [sp, #24]
    d2_scale r10, lr, r2, r7, r3, r4, r5, r6
    ldr r7, [sp, #48]
    asr r3, r3, #1
    asr r5, r5, #1
    stmia.w r7!, {r3-r6}
    ldmia.w sp, {r3-r6}
    d2_scale r11, lr, r8, r9, r3, r4, r5, r6
    asr r3, r3, #1
    asr r5, r5, #1
    stmia.w r7!, {r3-r6}
    ldr r9, [sp, #52]
    lsls r10, r9, #1
    beq.w 4b
    strd r7, r9, [sp, #48]
    d2_zero
    ldrd r12, lr, [sp, #32]
    ldr r1, [sp, #40]
    cmp r1, lr
    bne.w 2b
    b.w 9b
    .size actq_w2_paired_group, . - actq_w2_paired_group

@ A strip of four has a word of scales after each group. r9: from a group's end in x to its sum, 68 bytes in the first of two.
    .section .text.actq_w2_paired_group4, "ax", %progbits
    .global actq_w2_paired_group4
    .type actq_w2_paired_group4, %function
    .thumb_func
    .balign 4
actq_w2_paired_group4:
    d2_prologue
    ldr r5, [sp, #112]
    cbz r5, 1f
    @ After the end of the last group are its partner's start word and the sums.
    sub r4, r4, #8
    str r4, [sp, #36]
1:
    movs r5, #0
    strd r5, r5, [sp, #0]
    strd r5, r5, [sp, #8]
    movs r4, #68
    mov r9, r4
2:
    ldr r2, [r1], #4
    mov r7, r2
    add r8, r1, #64
3:
    d2_cols8 4, 0
    d2_cols8 4, 0
    cmp r1, r8
    bne.n 3b
    ldrsh r12, [r1, r9]
    ldr r10, [r0], #4
    ldmia.w sp, {r3-r6}
    d2_scale r10, lr, r7, r2, r3, r4, r5, r6
    stmia.w sp, {r3-r6}
    rsb r9, r9, #70
    cmp r9, #68
    it eq
    addeq r1, r1, #4
    ldrd r12, lr, [sp, #32]
    cmp r1, lr
    bne.n 2b
    ldr r9, [sp, #48]
    asr r3, r3, #1
    asr r5, r5, #1
    stmia.w r9, {r3-r6}
    add sp, sp, #68
    pop {r4-r11, pc}
    .size actq_w2_paired_group4, . - actq_w2_paired_group4
    .text
