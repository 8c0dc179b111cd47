@ The products of attention for Armv7E-M: the twin of kernels/src/arch/portable/attention.rs. A lane of 16 bits holds two
@ columns, even + 256 odd; SMLAD of both lanes as they are, and of the even columns alone, takes four MACs with three
@ instructions.
@
@ The first segment of a sum starts it. A loop over the others is unrolled to several segments of equal length, and the
@ first pass enters it at the segment from which on whole passes remain: at its end, if none remains.

    .syntax unified
    .thumb

    .if COMPACT
    .equ KEY_LOG, 1
    .equ VALUE_LOG, 0
    .else
    .equ KEY_LOG, 3
    .equ VALUE_LOG, 2
    .endif

@ Eight columns of a key at \key, times the query in r4-r7, are added to \sum, or start it.
.macro eight_columns key, sum, starts=0
    ldrd r8, r9, [\key], #8
    .if \starts
    smuad \sum, r8, r4
    .else
    smlad \sum, r8, r4, \sum
    .endif
    sxtb16 r8, r8
    smlad \sum, r8, r5, \sum
    smlad \sum, r9, r6, \sum
    sxtb16 r9, r9
    smlad \sum, r9, r7, \sum
.endm

@ Computes the products of a query with keys, two at a time.
@
@ Arguments: r0 keys, r1 query, r2 sums, r3 keys (even, > 0), [sp] bytes of a key (a multiple of 8, > 0), [sp+4] bytes from
@ the first key of two to the second.
@
@ In the loop: r0 and r12 keys, r1 query, lr its end, r4-r7 query words, r8 and r9 key words, r10 and r11 sums.
@ Frame: 0 bytes of a key, 4 address at which the first pass enters.
    .section .text.actq_query_keys, "ax", %progbits
    .global actq_query_keys
    .type actq_query_keys, %function
    .thumb_func
    .balign 4
actq_query_keys:
    push {r4-r11, lr}
    ldrd r4, r5, [sp, #36]
    add r12, r0, r5
    add lr, r1, r4, lsl #1
    @ The segments that the first pass skips.
    rsb r5, r4, #8
    ubfx r5, r5, #3, #KEY_LOG
    cmp r4, #8
    it eq
    moveq r5, #(1 << KEY_LOG)
    adr r7, 2f
    adr r6, 3f
    subs r6, r6, r7
    mla r5, r5, r6, r7
    adds r5, r5, #1
    push {r4, r5}
1:
    ldmia.w r1!, {r4-r7}
    eight_columns r0, r10, 1
    eight_columns r12, r11, 1
    ldr pc, [sp, #4]
    .balign 4
2:
    ldmia.w r1!, {r4-r7}
    eight_columns r0, r10
    eight_columns r12, r11
3:
    .rept (1 << KEY_LOG) - 1
    ldmia.w r1!, {r4-r7}
    eight_columns r0, r10
    eight_columns r12, r11
    .endr
    cmp r1, lr
    bne.w 2b
    asr r10, r10, #8
    asr r11, r11, #8
    strd r10, r11, [r2], #8
    ldr r4, [sp]
    mov r0, r12
    add r12, r12, r4
    sub r1, r1, r4, lsl #1
    subs r3, r3, #2
    bne.w 1b
    pop {r4, r5}
    pop {r4-r11, pc}
    .size actq_query_keys, . - actq_query_keys

@ Two columns of two tokens each, in \value, times the weights \weight, are added to the sums, or start them.
.macro two_columns value, weight, both, low, starts=0
    .if \starts
    smuad \both, \value, \weight
    sxtb16 \value, \value
    smuad \low, \value, \weight
    .else
    smlad \both, \value, \weight, \both
    sxtb16 \value, \value
    smlad \low, \value, \weight, \low
    .endif
.endm

@ The same of eight tokens at \row, times the weights in r4-r7.
.macro eight_tokens row, both, low, starts=0
    ldrd r8, r9, [\row], #8
    two_columns r8, r4, \both, \low, \starts
    two_columns r9, r5, \both, \low
    ldrd r8, r9, [\row], #8
    two_columns r8, r6, \both, \low
    two_columns r9, r7, \both, \low
.endm

@ Computes the sums of values times weights, four columns at a time.
@
@ Arguments: r0 values, r1 weights, r2 sums, r3 fours of columns (> 0), [sp] bytes of a row, [sp+4] bytes of the weights (a
@ multiple of 16, > 0, at most those of a row).
@
@ In the loop: r0 and r12 rows, r1 weights, r4-r7 weights, r8 and r9 values, r10 and r11, r3 and lr sums: of both columns
@ as they are, and of the even ones.
@ Frame: 0 bytes of a row beyond the weights, 4 bytes of a row, 8 weights, 12 remaining fours, 16 end of the weights,
@ 20 address at which the first pass enters.
    .section .text.actq_weigh_values, "ax", %progbits
    .global actq_weigh_values
    .type actq_weigh_values, %function
    .thumb_func
    .balign 4
actq_weigh_values:
    push {r4-r11, lr}
    ldrd r5, r8, [sp, #36]
    add r12, r0, r5
    sub r4, r5, r8
    mov r6, r1
    mov r7, r3
    @ The segments that the first pass skips.
    rsb r9, r8, #16
    .if VALUE_LOG
    ubfx r9, r9, #4, #VALUE_LOG
    .else
    mov r9, #0
    .endif
    cmp r8, #16
    it eq
    moveq r9, #(1 << VALUE_LOG)
    adr r11, 2f
    adr r10, 3f
    sub r10, r10, r11
    mla r9, r9, r10, r11
    add r9, r9, #1
    add r8, r8, r1
    push {r4-r9}
1:
    ldmia.w r1!, {r4-r7}
    eight_tokens r0, r10, r11, 1
    eight_tokens r12, r3, lr, 1
    ldr pc, [sp, #20]
    .balign 4
2:
    ldmia.w r1!, {r4-r7}
    eight_tokens r0, r10, r11
    eight_tokens r12, r3, lr
3:
    .rept (1 << VALUE_LOG) - 1
    ldmia.w r1!, {r4-r7}
    eight_tokens r0, r10, r11
    eight_tokens r12, r3, lr
    .endr
    ldr r4, [sp, #16]
    cmp r1, r4
    bne.w 2b
    sub r10, r10, r11
    asr r10, r10, #8
    strd r11, r10, [r2], #8
    sub r3, r3, lr
    asr r3, r3, #8
    strd lr, r3, [r2], #8
    ldm sp, {r4-r7}
    add r0, r12, r4
    add r12, r0, r5
    mov r1, r6
    subs r7, r7, #1
    str r7, [sp, #12]
    bne.w 1b
    add sp, sp, #24
    pop {r4-r11, pc}
    .size actq_weigh_values, . - actq_weigh_values

    .text
