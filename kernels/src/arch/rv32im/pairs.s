# 4 bits on RV32IM: a product is those of two rows (layout/w4_scalar.rs, arch/portable/pairs.rs).

    .option push
    .option arch, +m, +c

# Two columns of four rows: \word times t4 and t5, added to \first and \second.
    .macro  actq_quad word, first, second
    srli    t0, \word, 4
    srli    t1, \word, 8
    srli    t2, \word, 12
    and     t3, \word, a7
    and     t0, t0, a7
    and     t1, t1, a7
    and     t2, t2, a7
    mul     t3, t3, t4
    mul     t0, t0, t4
    mul     t1, t1, t5
    mul     t2, t2, t5
    add     \first, \first, t3
    add     \second, \second, t0
    add     \first, \first, t1
    add     \second, \second, t2
    .endm

# Eight columns of a strip.
    .macro  actq_eight at
    .set    actq_at, \at
    .rept   4
    lh      t4, (actq_at)(a1)
    lh      t5, (actq_at + 2)(a1)
    lw      t6, (2 * actq_at)(a0)
    actq_quad t6, s0, s1
    lw      t6, (2 * actq_at + 4)(a0)
    actq_quad t6, s2, s3
    .set    actq_at, actq_at + 4
    .endr
    .endm

# void(weights, chunk, acc, acc_end, skip, eights): adds a chunk of `eights` times eight columns to the sums of each strip. A
# pass has 16 columns, of which an odd count skips the first eight. s0-s3: sums of two rows; s4: 1 for an odd count; a7: the
# mask; a5: the end of the chunk; a6: its begin.
    .section .text.actq_pairs_w4, "ax", @progbits
    .balign 4
    .global actq_pairs_w4
    .type   actq_pairs_w4, @function
actq_pairs_w4:
    addi    sp, sp, -32
    sw      s4, 16(sp)
    sw      s0, 0(sp)
    sw      s1, 4(sp)
    sw      s2, 8(sp)
    sw      s3, 12(sp)
    mv      a6, a1
    addi    a1, a1, 8
    andi    s4, a5, 1
    slli    a5, a5, 4
    add     a5, a5, a1
    li      a7, 0x000f000f
1:  lw      s0, 0(a6)
    mv      s1, s0
    mv      s2, s0
    mv      s3, s0
    beqz    s4, 2f
    addi    a0, a0, -32
    addi    a1, a1, -16
    j       3f
2:  actq_eight 0
3:  actq_eight 16
    addi    a0, a0, 64
    addi    a1, a1, 32
    bne     a1, a5, 2b
    .set    actq_at, 0
    .irp    s, s0, s1, s2, s3
    lw      t0, (actq_at)(a2)
    lw      t1, (actq_at + 4)(a2)
    add     t0, t0, \s
    srai    t2, \s, 16
    add     t1, t1, t2
    sw      t0, (actq_at)(a2)
    sw      t1, (actq_at + 4)(a2)
    .set    actq_at, actq_at + 8
    .endr
    addi    a2, a2, 32
    add     a0, a0, a4
    addi    a1, a6, 8
    bne     a2, a3, 1b
    lw      s0, 0(sp)
    lw      s1, 4(sp)
    lw      s2, 8(sp)
    lw      s3, 12(sp)
    lw      s4, 16(sp)
    addi    sp, sp, 32
    ret
    .size   actq_pairs_w4, . - actq_pairs_w4

    .option pop
