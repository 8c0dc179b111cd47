# Scaling of sums to f32 on RV32IM without an FPU: the arithmetic of `math/soft.rs`, `scaled`, which takes what this
# leaves.
#
# Mantissas have their leading bit at bit 31 until the addition, where it is at bit 29, with the sign as two's complement.

    .option push
    .option arch, +m, +c

# Moves the leading bit of \m from bit 30 or 31 to bit 31, and the exponent t4 with it.
    .macro  actq_up m
    bltz    \m, 80f
    slli    \m, \m, 1
    addi    t4, t4, -1
80:
    .endm

# Rounds \m to nearest even, to 24 bits; 33 bits are left.
    .macro  actq_round m
    srli    t5, \m, 8
    andi    t5, t5, 1
    addi    t5, t5, 0x7f
    add     t5, t5, \m
    bltu    t5, \m, 90f
    andi    \m, t5, -256
    .endm

# Adds \small, t6 places down, to \large as t1. A bit that falls out sets the last one.
    .macro  actq_sum large, small
    bltu    s1, t6, 90f
    sra     t2, \small, t6
    sll     t6, t2, t6
    sub     t6, t6, \small
    snez    t6, t6
    or      t2, t2, t6
    add     t1, \large, t2
    .endm

# f32 *(sums, start, scales, x_scale, y, end): computes y up to the first value that it leaves, and returns its address.
# a0-a2, a4, a5: operands, y and its end; a3, a6: the mantissa and the exponent of x_scale; a7, s1-s4: bounds; s0: 2^29.
# t0: the sum; t1: the factor, the term, the result; t4: its exponent.
    .section .text.actq_scale, "ax", @progbits
    .balign 4
    .global actq_scale
    .type   actq_scale, @function
actq_scale:
    addi    sp, sp, -32
    sw      s0, 0(sp)
    sw      s1, 4(sp)
    sw      s2, 8(sp)
    sw      s3, 12(sp)
    sw      s4, 16(sp)
    srli    a6, a3, 23
    addi    a6, a6, -102
    li      s0, 0x800000
    slli    a3, a3, 9
    srli    a3, a3, 9
    or      a3, a3, s0
    li      s0, 0x20000000
    li      s1, 30
    li      s2, 221
    li      a7, 95
    li      s3, 0xffffff
    li      s4, 0x1000000
10: lw      t0, 0(a0)
    lhu     t1, 0(a2)
    srai    t2, t0, 31
    xor     t3, t0, t2
    sub     t3, t3, t2
    addi    t4, t3, -1
    bgeu    t4, s3, 90f             # not 0, and below 2^24
    srli    t4, t1, 7
    addi    t5, t4, -80
    bgeu    t5, a7, 90f             # positive, and of a usual exponent
    ori     t1, t1, 0x80
    andi    t1, t1, 0xff
    mul     t1, t1, a3
    actq_up t1
    actq_round t1
    add     t4, t4, a6
    slli    t3, t3, 8
    bgeu    t3, s4, 81f
    slli    t3, t3, 8
    addi    t4, t4, -8
    bgeu    t3, s4, 81f
    slli    t3, t3, 8
    addi    t4, t4, -8
81: .irp    step, 4, 2, 1
    srli    t5, t3, (32 - \step)
    bnez    t5, 11f
    slli    t3, t3, \step
    addi    t4, t4, -\step
11:
    .endr
    mul     t5, t1, t3
    mulhu   t1, t1, t3
    snez    t5, t5
    or      t1, t1, t5
    actq_up t1
    actq_round t1
    srli    t1, t1, 2
    xor     t1, t1, t2
    sub     t1, t1, t2
    lw      t2, 0(a1)
    slli    t5, t2, 1
    beqz    t5, 30f
    srli    t5, t5, 24
    addi    t6, t5, -30
    bgeu    t6, s2, 90f
    slli    t3, t2, 9
    srli    t3, t3, 3
    or      t3, t3, s0
    srai    t2, t2, 31
    xor     t3, t3, t2
    sub     t3, t3, t2
    sub     t6, t4, t5
    bltz    t6, 20f
    actq_sum t1, t3
30: srai    t2, t1, 31
    xor     t1, t1, t2
    sub     t1, t1, t2
    beqz    t1, 90f
    slli    t5, t1, 1
    bltz    t5, 32f
31: slli    t1, t1, 1
    slli    t5, t1, 1
    addi    t4, t4, -1
    bgez    t5, 31b
32: srli    t5, t1, 7
    andi    t5, t5, 1
    addi    t5, t5, 0x3f
    add     t1, t1, t5
    srli    t1, t1, 7
    slli    t4, t4, 23
    add     t1, t1, t4
    slli    t2, t2, 31
    or      t1, t1, t2
    sw      t1, 0(a4)
    addi    a0, a0, 4
    addi    a1, a1, 4
    addi    a2, a2, 2
    addi    a4, a4, 4
    bne     a4, a5, 10b
    j       90f
20: mv      t4, t5
    neg     t6, t6
    actq_sum t3, t1
    j       30b
90: mv      a0, a4
    lw      s0, 0(sp)
    lw      s1, 4(sp)
    lw      s2, 8(sp)
    lw      s3, 12(sp)
    lw      s4, 16(sp)
    addi    sp, sp, 32
    ret
    .size   actq_scale, . - actq_scale

    .option pop
