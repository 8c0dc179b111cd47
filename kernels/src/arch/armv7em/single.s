@ GEMV loop nest for Armv7E-M, stamped over the layouts of single lanes in kernels/src/layout: strips of four rows.
@
@ Arguments: r0 weights, r1 prepared x, r2 acc, r3 strips (>= 1), [sp] x_end, [sp+4] bytes of a group in x, or 0 with row
@ scales, [sp+8] units that the loop skips in a short pass: with row scales it is the first pass, with group scales the last
@ group's first.
@
@ In the loops: r0 weights, r1 x, r2 mask, r3 and r4 activation pairs, r5-r8 the four rows' sums t, r9-r12 weight words,
@ lr the extracted pair of codes.
@
@ Frame: 0-15 sums over groups, 16 x, 20 acc, 24 strips, 28 x_end, 32 group bytes, 36 end of this group, 40 skipped units.

    .syntax unified
    .thumb

@ t[r] += (codes of row r, pair at bit `rot`) * pair, for four rows
.macro mac4 rot, pair
    and lr, r2, r9, ror #\rot
    smlad r5, lr, \pair, r5
    and lr, r2, r10, ror #\rot
    smlad r6, lr, \pair, r6
    and lr, r2, r11, ror #\rot
    smlad r7, lr, \pair, r7
    and lr, r2, r12, ror #\rot
    smlad r8, lr, \pair, r8
.endm

@ the same at rotation 0, which has no encoding as ROR
.macro mac4_first pair
    and lr, r2, r9
    smlad r5, lr, \pair, r5
    and lr, r2, r10
    smlad r6, lr, \pair, r6
    and lr, r2, r11
    smlad r7, lr, \pair, r7
    and lr, r2, r12
    smlad r8, lr, \pair, r8
.endm

@ the bit of pair 15 in word k of the 3-bit layout
.macro mac4_spare mask, pair
    and lr, r9, #\mask
    smlad r5, lr, \pair, r5
    and lr, r10, #\mask
    smlad r6, lr, \pair, r6
    and lr, r11, #\mask
    smlad r7, lr, \pair, r7
    and lr, r12, #\mask
    smlad r8, lr, \pair, r8
.endm

@ signed bytes 0 and 2 (or, rotated by 8, 1 and 3) of four rows
.macro mac4_bytes pair, rot:vararg
    sxtb16 lr, r9 \rot
    smlad r5, lr, \pair, r5
    sxtb16 lr, r10 \rot
    smlad r6, lr, \pair, r6
    sxtb16 lr, r11 \rot
    smlad r7, lr, \pair, r7
    sxtb16 lr, r12 \rot
    smlad r8, lr, \pair, r8
.endm

.macro weights
    ldmia.w r0!, {r9-r12}
.endm

.macro pairs
    ldmia.w r1!, {r3, r4}
.endm

@ One unit of each layout. Prepared x of the unit starts at r1, which moves to its end.
.macro unit_w2
    weights
    pairs
    mac4_first r3
    mac4 2, r4
    pairs
    mac4 4, r3
    mac4 6, r4
    pairs
    mac4 8, r3
    mac4 10, r4
    pairs
    mac4 12, r3
    mac4 14, r4
.endm

.macro unit_w4
    weights
    pairs
    mac4_first r3
    mac4 4, r4
    pairs
    mac4 8, r3
    mac4 12, r4
.endm

.macro unit_w8
    weights
    pairs
    mac4_bytes r3
    mac4_bytes r4, , ror #8
.endm

@ Pair 15 is in three words; r4 holds it throughout, so r3 loads the others one by one.
.macro unit_w3
    ldr.w r4, [r1, #60]
    weights
    ldr.w r3, [r1], #4
    mac4 1, r3
    ldr.w r3, [r1], #4
    mac4 4, r3
    ldr.w r3, [r1], #4
    mac4 7, r3
    ldr.w r3, [r1], #4
    mac4 10, r3
    ldr.w r3, [r1], #4
    mac4 13, r3
    mac4_spare 0x00020002, r4
    weights
    ldr.w r3, [r1], #4
    mac4 2, r3
    ldr.w r3, [r1], #4
    mac4 5, r3
    ldr.w r3, [r1], #4
    mac4 8, r3
    ldr.w r3, [r1], #4
    mac4 11, r3
    ldr.w r3, [r1], #4
    mac4 14, r3
    mac4_spare 0x00040004, r4
    weights
    ldr.w r3, [r1], #4
    mac4 3, r3
    ldr.w r3, [r1], #4
    mac4 6, r3
    ldr.w r3, [r1], #4
    mac4 9, r3
    ldr.w r3, [r1], #4
    mac4 12, r3
    ldr.w r3, [r1], #8
    mac4 15, r3
    mac4_spare 0x00080008, r4
.endm

@ All four rows' sums of a group start from the same value.
.macro start_sums
    ldr r8, [r1], #4
    mov r5, r8
    mov r6, r8
    mov r7, r8
.endm

@ Jumps to the first unit of a pass that is not skipped. `ahead` are the labels of the units except the first, which is at 2.
.macro enter_pass ahead
    .ifnb \ahead
    ldr lr, [sp, #40]
    tbh [pc, lr, lsl #1]
7:
    .hword (2f - 7b) / 2
    .irp step, \ahead
    .hword (\step - 7b) / 2
    .endr
    .endif
.endm

@ 32 columns; `more` are the labels of the units except the first.
.macro pass unit, more
    .balign 4
2:
    \unit
    .ifnb \more
    .irp step, \more
\step:
    \unit
    .endr
    .endif
.endm

@ A kernel for both kinds of scales. With a u8 scale per group, each group's sums are multiplied with its scales and added up on
@ the stack; groups are whole passes, except the last. Rows with one scale each are one group, whose sums are the result; its
@ end does not change from strip to strip.
.macro kernel name, mask, unit, ahead, more
    .section .text.\name, "ax", %progbits
    .global \name
    .type \name, %function
    .thumb_func
    .balign 4
\name:
    push {r4-r11, lr}
    sub sp, sp, #44
    ldrd r4, r5, [sp, #80]
    ldr r6, [sp, #88]
    strd r1, r2, [sp, #16]
    strd r3, r4, [sp, #24]
    strd r5, r4, [sp, #32]
    str r6, [sp, #40]
    .if \mask
    movw r2, #(\mask & 0xffff)
    movt r2, #(\mask >> 16)
    .endif
1:
    ldr r1, [sp, #16]
    ldrd r3, r4, [sp, #28]
    cbz r4, 4f
    movs r5, #0
    strd r5, r5, [sp, #0]
    strd r5, r5, [sp, #8]
3:
    add r4, r4, r1
    cmp r4, r3
    blo.n 8f
    @ The last group: its first pass may be short.
    str r3, [sp, #36]
4:
    start_sums
    .ifb \ahead
    b.w 2f
    .endif
    enter_pass "\ahead"
    @ With the wide instructions here, the loop's alignment needs no padding.
8:
    str.w r4, [sp, #36]
    start_sums
    pass \unit, "\more"
    ldrd r3, lr, [sp, #32]
    cmp r1, lr
    bne.w 2b
    cbz r3, 9f
    ldmia.w sp, {r9-r12}
    ldr r3, [r0], #4
    uxtb r4, r3
    mla r5, r5, r4, r9
    uxtb.w r4, r3, ror #8
    mla r6, r6, r4, r10
    uxtb.w r4, r3, ror #16
    mla r7, r7, r4, r11
    lsrs r4, r3, #24
    mla r8, r8, r4, r12
    stmia.w sp, {r5-r8}
    ldrd r3, r4, [sp, #28]
    cmp r1, r3
    bne.w 3b
9:
    ldrd lr, r3, [sp, #20]
    stmia.w lr!, {r5-r8}
    subs r3, r3, #1
    strd lr, r3, [sp, #20]
    bne.w 1b
    add sp, sp, #44
    pop {r4-r11, pc}
    .size \name, . - \name
.endm

    kernel actq_w2, 0x00060006, unit_w2, "11f", "11"
    kernel actq_w3, 0x000e000e, unit_w3
    kernel actq_w4, 0x001e001e, unit_w4, "11f, 12f, 13f", "11, 12, 13"
    kernel actq_w8, 0, unit_w8, "11f, 12f, 13f, 14f, 15f, 16f, 17f", "11, 12, 13, 14, 15, 16, 17"
    .text
