# Bit planes on RV32IM: tables of sums, and lookups in them (arch/portable/planes.rs).
#
# A lookup is LBU of the index, a shift and an addition to the table's address (SH1ADD with Zba), LHU of the entry, and an
# addition. Planes are taken one after the other, the highest first, and the sums are doubled in between.

    .option push
    .option arch, +m, +c
    .if     ZBA
    .option arch, +zba
    .endif

    .macro  actq_save
    addi    sp, sp, -32
    .set    actq_at, 0
    .irp    s, s0, s1, s2, s3, s4, s5, s6, s7
    sw      \s, actq_at(sp)
    .set    actq_at, actq_at + 4
    .endr
    .endm

    .macro  actq_restore
    .set    actq_at, 0
    .irp    s, s0, s1, s2, s3, s4, s5, s6, s7
    lw      \s, actq_at(sp)
    .set    actq_at, actq_at + 4
    .endr
    addi    sp, sp, 32
    ret
    .endm

# Adds the entries of four rows' bytes at a0 + \at to four sums, from the table at a1 + \table; \first: they are the sums.
    .macro  actq_rows at, table, first, a, b, c, d
    lbu     t0, (\at)(a0)
    lbu     t1, (\at + 1)(a0)
    lbu     t2, (\at + 2)(a0)
    lbu     t3, (\at + 3)(a0)
    .if     ZBA
    .irp    t, t0, t1, t2, t3
    sh1add  \t, \t, a1
    .endr
    .else
    .irp    t, t0, t1, t2, t3
    slli    \t, \t, 1
    .endr
    .irp    t, t0, t1, t2, t3
    add     \t, \t, a1
    .endr
    .endif
    .if     \first
    lhu     \a, (\table)(t0)
    lhu     \b, (\table)(t1)
    lhu     \c, (\table)(t2)
    lhu     \d, (\table)(t3)
    .else
    lhu     t0, (\table)(t0)
    lhu     t1, (\table)(t1)
    lhu     t2, (\table)(t2)
    lhu     t3, (\table)(t3)
    add     \a, \a, t0
    add     \b, \b, t1
    add     \c, \c, t2
    add     \d, \d, t3
    .endif
    .endm

    .macro  actq_unit at, table, first=0
    actq_rows (\at), (\table), \first, s0, s1, s2, s3
    actq_rows (\at + 4), (\table), \first, s4, s5, s6, s7
    .endm

# Four units.
    .macro  actq_units plane, bytes, first=0
    actq_unit (8 * \plane), 0, \first
    actq_unit (\bytes + 8 * \plane), 512
    actq_unit (2 * \bytes + 8 * \plane), 1024
    actq_unit (3 * \bytes + 8 * \plane), 1536
    addi    a0, a0, 4 * \bytes
    add     a1, a1, t6
    .endm

# Adds the entries of all units' plane \plane to the sums, which begin with those of the plane that is \first: four units a
# pass, then one.
    .macro  actq_plane plane, bytes, first=0
    .if     \first
    bne     a1, a6, 1f
    .irp    s, s0, s1, s2, s3, s4, s5, s6, s7
    li      \s, 0
    .endr
    j       4f
1:  actq_units \plane, \bytes, 1
    .endif
    beq     a1, a6, 3f
2:  actq_units \plane, \bytes
    bne     a1, a6, 2b
3:  beq     a1, t4, 5f
4:  actq_unit (8 * \plane), 0
    addi    a0, a0, \bytes
    addi    a1, a1, 512
    bne     a1, t4, 4b
5:  mv      a1, t5
    .if     \plane > 0
    sub     a0, a0, a7
    .irp    s, s0, s1, s2, s3, s4, s5, s6, s7
    slli    \s, \s, 1
    .endr
    .endif
    .endm

# void(weights, tables, acc, acc_end, skip, count): adds `count` units to the sums of each strip of eight rows. t4, a6: the
# end of the tables, and of those that are taken four at a time; t5: their begin; a7: the bytes of a strip's units.
    .macro  actq_planes name, planes
    .section .text.\name, "ax", @progbits
    .balign 4
    .global \name
    .type   \name, @function
\name:
    actq_save
    mv      t5, a1
    andi    a6, a5, -4
    slli    a6, a6, 9
    add     a6, a6, a1
    slli    t4, a5, 9
    add     t4, t4, a1
    slli    a7, a5, 4
    .if     \planes > 2
    slli    t0, a5, 3
    add     a7, a7, t0
    .endif
    li      t6, 2048
10:
    .if     \planes > 2
    actq_plane 2, (8 * \planes), 1
    actq_plane 1, (8 * \planes)
    .else
    actq_plane 1, (8 * \planes), 1
    .endif
    actq_plane 0, (8 * \planes)
    .set    actq_at, 0
    .irp    s, s0, s1, s2, s3, s4, s5, s6, s7
    lw      t0, actq_at(a2)
    add     t0, t0, \s
    sw      t0, actq_at(a2)
    .set    actq_at, actq_at + 4
    .endr
    addi    a2, a2, 32
    add     a0, a0, a4
    bne     a2, a3, 10b
    actq_restore
    .size   \name, . - \name
    .endm

    actq_planes actq_planes_w2, 2
    actq_planes actq_planes_w3, 3

# void(x, tables, count): builds the tables of `count` times eight columns. A word holds two entries, which differ in
# column 0. Eight words in registers are a block. From a block to the next, bit t of its number rises and all bits below
# it fall: one addition a word, of the steps t4, t5, t6 and a3 for t = 0 to 3.
    .section .text.actq_planes_build, "ax", @progbits
    .balign 4
    .global actq_planes_build
    .type   actq_planes_build, @function
actq_planes_build:
    actq_save
    li      a7, 0x20002
1:  lh      t0, 0(a0)
    lh      t1, 2(a0)
    lh      t2, 4(a0)
    lh      t3, 6(a0)
    lh      t4, 8(a0)
    lh      t5, 10(a0)
    lh      t6, 12(a0)
    lh      a3, 14(a0)
    li      a5, 1024
    .irp    x, t0, t1, t2, t3, t4, t5, t6, a3
    sub     a5, a5, \x              # at last the first entry: no bit is set
    .endr
    .irp    x, t1, t2, t3, t4, t5, t6, a3
    mul     \x, \x, a7              # what a column's bit adds to two entries
    .endr
    slli    a4, a5, 16
    add     a5, a5, a4
    slli    t0, t0, 17
    add     s0, a5, t0
    add     s1, s0, t1
    add     s2, s0, t2
    add     s3, s1, t2
    add     s4, s0, t3
    add     s5, s1, t3
    add     s6, s2, t3
    add     s7, s3, t3
    sub     a3, a3, t6
    sub     a3, a3, t5
    sub     a3, a3, t4
    sub     t6, t6, t5
    sub     t6, t6, t4
    sub     t5, t5, t4
    .set    actq_block, 0
    .irp    step, zero, t4, t5, t4, t6, t4, t5, t4, a3, t4, t5, t4, t6, t4, t5, t4
    .set    actq_at, actq_block
    .irp    s, s0, s1, s2, s3, s4, s5, s6, s7
    .if     actq_block
    add     \s, \s, \step
    .endif
    sw      \s, actq_at(a1)
    .set    actq_at, actq_at + 4
    .endr
    .set    actq_block, actq_block + 32
    .endr
    addi    a0, a0, 16
    addi    a1, a1, 512
    addi    a2, a2, -1
    bnez    a2, 1b
    actq_restore
    .size   actq_planes_build, . - actq_planes_build

    .option pop
