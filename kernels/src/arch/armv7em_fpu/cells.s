@ The cells of kernels/src/ops/cells.rs on the FPU of the hard-float target: the same operations in the same order. Repeated parts
@ are calls, because exponentials take the most code.

    .syntax unified
    .thumb
    .fpu fpv4-sp-d16

@ Calls within this file change only the registers that they name. s8-s13 are `CELL` of mod.rs: the
@ factors of x in the exponents of e^x and e^2x, in quarters, the number that rounds such an exponent, and p1, p0 and q0.

@ s0, s1: numerator and denominator of 2^(4 s0). Changes s2, s3, r10, r12.
    .section .text.actq_cell_exp2, "ax", %progbits
    .type actq_cell_exp2, %function
    .thumb_func
    .balign 4
actq_cell_exp2:
    vadd.f32 s1, s0, s10
    vsub.f32 s1, s1, s10
    vsub.f32 s0, s0, s1
    vcvt.s32.f32 s1, s1, #28
    vmul.f32 s2, s0, s0
    vmul.f32 s3, s2, s11
    vmov r12, s1
    vadd.f32 s3, s3, s12
    vadd.f32 s2, s2, s13
    vmul.f32 s0, s3, s0
    vadd.f32 s3, s2, s0
    vsub.f32 s1, s2, s0
    vmov r10, s3
    add.w r10, r10, r12, asr #3
    vmov s0, r10
    bx lr
    .size actq_cell_exp2, . - actq_cell_exp2

@ s0: sigmoid(s0) * tanh(s4). Changes s1-s3, s5, s6, r9, r10, r12.
    .section .text.actq_cell_gated, "ax", %progbits
    .type actq_cell_gated, %function
    .thumb_func
    .balign 4
actq_cell_gated:
    mov r9, lr
    vmul.f32 s0, s0, s8
    bl actq_cell_exp2
    vmov.f32 s5, s0
    vadd.f32 s6, s0, s1
    vmul.f32 s0, s4, s9
    bl actq_cell_exp2
    vsub.f32 s2, s0, s1
    vadd.f32 s0, s0, s1
    vmul.f32 s2, s5, s2
    vmul.f32 s0, s6, s0
    vdiv.f32 s0, s2, s0
    bx r9
    .size actq_cell_gated, . - actq_cell_gated

@ Elements of an LSTM cell, [sp] (> 0) of them: r0 gates i, each further gate r1 bytes after the last; r2 cell states, r3
@ outputs. [sp+4] is the address of s8-s13.
    .section .text.actq_lstm, "ax", %progbits
    .global actq_lstm
    .type actq_lstm, %function
    .thumb_func
    .balign 4
actq_lstm:
    push {r4-r10, lr}
    ldrd r8, r12, [sp, #32]
    vldmia r12, {s8-s13}
1:
    adds r4, r0, r1
    adds r5, r4, r1
    adds r6, r5, r1
    vldr s0, [r4]
    vmul.f32 s0, s0, s8
    bl actq_cell_exp2
    vadd.f32 s1, s0, s1
    vdiv.f32 s0, s0, s1
    vldr s7, [r2]
    vmul.f32 s7, s0, s7
    vldmia r0!, {s0}
    vldr s4, [r5]
    bl actq_cell_gated
    vadd.f32 s4, s7, s0
    vstmia r2!, {s4}
    vldr s0, [r6]
    bl actq_cell_gated
    vstmia r3!, {s0}
    subs r8, r8, #1
    bne.n 1b
    pop {r4-r10, pc}
    .size actq_lstm, . - actq_lstm

@ Elements of a GRU cell, [sp] (> 0) of them: r0 and r1 gates r of either product, each further gate r2 bytes after the last;
@ r3 states. [sp+4] is the address of s8-s13.
    .section .text.actq_gru, "ax", %progbits
    .global actq_gru
    .type actq_gru, %function
    .thumb_func
    .balign 4
actq_gru:
    push {r4-r10, lr}
    ldrd r8, r12, [sp, #32]
    vldmia r12, {s8-s13}
1:
    adds r4, r0, r2
    adds r5, r1, r2
    vldmia r0!, {s0}
    vldmia r1!, {s1}
    vadd.f32 s0, s0, s1
    vmul.f32 s0, s0, s8
    bl actq_cell_exp2
    vadd.f32 s1, s0, s1
    vdiv.f32 s7, s0, s1
    vldr s0, [r4]
    vldr s1, [r5]
    vadd.f32 s0, s0, s1
    vmul.f32 s0, s0, s8
    bl actq_cell_exp2
    vmov.f32 s5, s0
    vmov.f32 s6, s1
    adds r4, r4, r2
    adds r5, r5, r2
    vldr s0, [r4]
    vldr s1, [r5]
    vmul.f32 s1, s7, s1
    vadd.f32 s0, s0, s1
    vmul.f32 s0, s0, s9
    bl actq_cell_exp2
    vsub.f32 s2, s0, s1
    vadd.f32 s0, s0, s1
    vldr s3, [r3]
    vmul.f32 s2, s6, s2
    vmul.f32 s3, s5, s3
    vadd.f32 s1, s5, s6
    vmul.f32 s3, s3, s0
    vmul.f32 s1, s1, s0
    vadd.f32 s2, s2, s3
    vdiv.f32 s0, s2, s1
    vstmia r3!, {s0}
    subs r8, r8, #1
    bne.n 1b
    pop {r4-r10, pc}
    .size actq_gru, . - actq_gru
    .text
