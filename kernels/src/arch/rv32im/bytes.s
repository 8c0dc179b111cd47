# 8 bits on RV32IM: a product is those of two rows (layout/w8_scalar.rs, arch/portable/bytes.rs).
#
# The products of the words themselves are those of rows 0 and 1 plus 2^8 times those of rows 2 and 3, modulo 2^32: so
# only the latter need a mask. Two strips share the loads of a tile.

    .option push
    .option arch, +m, +c

# Two columns of a strip: the words at \words + \at. t4-t6: the activations and the start value.
    .macro  actq_columns words, at, a, a_high, b, b_high
    lw      t0, (\at)(\words)
    lw      t1, (\at + 4)(\words)
    mul     t2, t0, t4
    mul     t3, t1, t5
    srli    t0, t0, 8
    srli    t1, t1, 8
    and     t0, t0, a7
    and     t1, t1, a7
    mul     t0, t0, t4
    mul     t1, t1, t5
    add     t2, t2, t3
    add     t0, t0, t1
    slli    t1, t0, 8
    sub     t2, t2, t1
    add     t0, t0, t6
    add     t2, t2, t6
    add     \b, \b, t0
    add     \a, \a, t2
    srai    t0, t0, 16
    srai    t2, t2, 16
    add     \b_high, \b_high, t0
    add     \a_high, \a_high, t2
    .endm

# Loads or stores the sums of a strip at a2 + \at.
    .macro  actq_sums instruction, at, a, b, c, d
    \instruction \a, (\at)(a2)
    \instruction \b, (\at + 4)(a2)
    \instruction \c, (\at + 8)(a2)
    \instruction \d, (\at + 12)(a2)
    .endm

# Adds the columns of the tile, four pairs a pass, to the sums of one or two strips.
    .macro  actq_tile strips
    mv      a1, s8
2:  .set    actq_at, 0
    .rept   4
    lw      t4, (2 * actq_at)(a1)
    lw      t5, (2 * actq_at + 4)(a1)
    lw      t6, (2 * actq_at + 8)(a1)
    actq_columns a0, actq_at, s0, s1, s2, s3
    .if     \strips > 1
    actq_columns a6, actq_at, s4, s5, s6, s7
    .endif
    .set    actq_at, actq_at + 8
    .endr
    addi    a0, a0, 32
    .if     \strips > 1
    addi    a6, a6, 32
    .endif
    addi    a1, a1, 64
    bne     a1, a5, 2b
    .endm

# void(weights, tile, acc, acc_end, skip, pairs): adds `pairs` pairs of columns to the sums of each strip of four rows.
# s0-s3, s4-s7: the sums and sums of high halves of two rows; a7: the mask; s8, a5: begin and end of the tile; s9: the
# bytes between strips.
    .section .text.actq_bytes_w8, "ax", @progbits
    .balign 4
    .global actq_bytes_w8
    .type   actq_bytes_w8, @function
actq_bytes_w8:
    addi    sp, sp, -48
    .set    actq_at, 0
    .irp    s, s0, s1, s2, s3, s4, s5, s6, s7, s8, s9
    sw      \s, actq_at(sp)
    .set    actq_at, actq_at + 4
    .endr
    mv      s8, a1
    slli    s9, a5, 3
    add     s9, s9, a4
    slli    a5, a5, 4
    add     a5, a5, a1
    li      a7, 0x00ff00ff
1:  addi    t0, a2, 16
    beq     t0, a3, 3f
    add     a6, a0, s9
    actq_sums lw, 0, s0, s1, s2, s3
    actq_sums lw, 16, s4, s5, s6, s7
    actq_tile 2
    actq_sums sw, 0, s0, s1, s2, s3
    actq_sums sw, 16, s4, s5, s6, s7
    addi    a2, a2, 32
    add     a0, a6, a4
    bne     a2, a3, 1b
    j       4f
3:  actq_sums lw, 0, s0, s1, s2, s3
    actq_tile 1
    actq_sums sw, 0, s0, s1, s2, s3
4:  .set    actq_at, 0
    .irp    s, s0, s1, s2, s3, s4, s5, s6, s7, s8, s9
    lw      \s, actq_at(sp)
    .set    actq_at, actq_at + 4
    .endr
    addi    sp, sp, 48
    ret
    .size   actq_bytes_w8, . - actq_bytes_w8

    .option pop
