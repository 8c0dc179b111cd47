@ Products of the layouts for Helium (kernels/src/layout/w*_helium.rs): VMLADAVA multiplies 16 bytes and adds the products to a
@ register, which must be even.
@
@ Every kernel: r0 weights, r1 prepared vector, r2 sums, r3 their end (one strip or more), [sp] the steps of a row, [sp+4], with group
@ scales, those of a group. A step is 16 columns, at 3 bits 32.
@
@ In a kernel: r1 weights, r3 activations, r7 sums, r9 the sum of the activations, r11 a multiple of it; on the stack at FRAME words.

    .syntax unified
    .thumb
    .arch armv8.1-m.main
    .arch_extension mve.fp
    .arch_extension lob

@ Two rows of four sums at 2 bits: the three low fields, then all of the byte.
.macro quad2 w, next, s0, s1, s2, s3
    vand q3, \w, q5
    vmladava.s8 \s3, q0, \w
    vand q4, \w, q6
    vmladava.s8 \s0, q0, q3
    vand q3, \w, q7
    vmladava.s8 \s1, q0, q4
    .ifnc \next, none
    vldrb.u8 \next, [r1], #16
    .endif
    vmladava.s8 \s2, q0, q3
.endm

.macro step2
    vldrb.u8 q0, [r3], #16
    vldrb.u8 q1, [r1], #16
    quad2 q1, q2, r0, r2, r4, r6
    quad2 q2, none, r8, r10, r12, lr
.endm

.macro step2_4
    vldrb.u8 q0, [r3], #16
    vldrb.u8 q1, [r1], #16
    quad2 q1, none, r0, r2, r4, r6
.endm

.macro level2 s0, s1, s2, s3
    sub \s3, \s3, \s0
    sub \s3, \s3, \s1
    sub \s3, \s3, \s2
    add \s0, r11, \s0, lsl #1
    add \s1, r11, \s1, asr #1
    add \s2, r11, \s2, asr #3
    add \s3, r9, \s3, asr #5
.endm

.macro levels2_4
    level2 r0, r2, r4, r6
.endm

.macro levels2
    level2 r0, r2, r4, r6
    level2 r8, r10, r12, lr
.endm

.macro constants2
    vmov.i8 q5, #0x03
    vmov.i8 q6, #0x0c
    vmov.i8 q7, #0x30
.endm

@ r11 = -3 r9
.macro multiple2
    add r11, r9, r9, lsl #1
    rsb r11, r11, #0
.endm

@ 4 bits: the even row is the low field.
.macro pair4 w, next, even, odd
    vand q3, \w, q7
    vmladava.s8 \odd, q0, \w
    .ifnc \next, none
    vldrb.u8 \next, [r1], #16
    .endif
    vmladava.s8 \even, q0, q3
.endm

.macro step4
    vldrb.u8 q0, [r3], #16
    vldrb.u8 q1, [r1], #16
    pair4 q1, q2, r0, r2
    pair4 q2, q1, r4, r6
    pair4 q1, q2, r8, r10
    pair4 q2, none, r12, lr
.endm

.macro step4_4
    vldrb.u8 q0, [r3], #16
    vldrb.u8 q1, [r1], #16
    pair4 q1, q2, r0, r2
    pair4 q2, none, r4, r6
.endm

.macro level4 even, odd
    sub \odd, \odd, \even
    add \even, r11, \even, lsl #1
    add \odd, r9, \odd, asr #3
.endm

.macro levels4_4
    level4 r0, r2
    level4 r4, r6
.endm

.macro levels4
    levels4_4
    level4 r8, r10
    level4 r12, lr
.endm

.macro constants4
    vmov.i8 q7, #0x0f
.endm

@ r11 = -15 r9
.macro multiple4
    rsb r11, r9, r9, lsl #4
    rsb r11, r11, #0
.endm

@ 8 bits: the bytes as they are.
.macro step8_4
    vldrb.u8 q0, [r3], #16
    vldrb.u8 q1, [r1], #16
    vldrb.u8 q2, [r1], #16
    vmladava.s8 r0, q0, q1
    vldrb.u8 q1, [r1], #16
    vmladava.s8 r2, q0, q2
    vldrb.u8 q2, [r1], #16
    vmladava.s8 r4, q0, q1
    vmladava.s8 r6, q0, q2
.endm

.macro step8
    vldrb.u8 q0, [r3], #16
    vldrb.u8 q1, [r1], #16
    vldrb.u8 q2, [r1], #16
    vmladava.s8 r0, q0, q1
    vldrb.u8 q1, [r1], #16
    vmladava.s8 r2, q0, q2
    vldrb.u8 q2, [r1], #16
    vmladava.s8 r4, q0, q1
    vldrb.u8 q1, [r1], #16
    vmladava.s8 r6, q0, q2
    vldrb.u8 q2, [r1], #16
    vmladava.s8 r8, q0, q1
    vldrb.u8 q1, [r1], #16
    vmladava.s8 r10, q0, q2
    vldrb.u8 q2, [r1], #16
    vmladava.s8 r12, q0, q1
    vmladava.s8 lr, q0, q2
.endm

.macro levels8_4
.endm

.macro levels8
.endm

.macro constants8
.endm

.macro multiple8
.endm

@ 3 bits: columns a of x are q0, b are q1. Sums: r0 row 0, r2 8 times row 1, r4 all of words 0 and 1, r6 row 3 of a, r8 8 times that of b,
@ r10 64 times the low bits of row 2 of a, r12 minus those of b.
.macro half3 x
    vand q3, q2, q5
    vmladava.s8 r4, \x, q2
    vand q4, q2, q6
    vmladava.s8 r0, \x, q3
    vldrb.u8 q2, [r1], #16
    vmladava.s8 r2, \x, q4
.endm

.macro step3_4
    vld20.32 {q0, q1}, [r3]
    vld21.32 {q0, q1}, [r3]!
    vldrb.u8 q2, [r1], #16
    half3 q0
    half3 q1
    vand q3, q2, q5
    vand q4, q2, q6
    vmladava.s8 r6, q0, q3
    vand q3, q2, q7
    vmladava.s8 r8, q1, q4
    vshr.s8 q4, q2, #7
    vmladava.s8 r10, q0, q3
    vmladava.s8 r12, q1, q4
.endm

.macro levels3_4
    sub r4, r4, r0
    sub r4, r4, r2
    add r4, r9, r4, asr #4
    add r4, r4, r10, asr #5
    sub r4, r4, r12, lsl #1
    add r6, r6, r8, asr #3
    add r0, r11, r0, lsl #1
    add r2, r11, r2, asr #2
    add r6, r11, r6, lsl #1
.endm

.macro constants3
    vmov.i8 q5, #0x07
    vmov.i8 q6, #0x38
    vmov.i8 q7, #0x40
.endm

@ r11 = -7 r9
.macro multiple3
    rsb r11, r9, r9, lsl #3
    rsb r11, r11, #0
.endm

.macro begin name
    .section .text.\name, "ax", %progbits
    .global \name
    .type \name, %function
    .thumb_func
    .balign 4
\name:
    push {r4-r11, lr}
    vpush {d8-d15}
    ldr r4, [sp, #100]
    mov r7, r2
.endm

.macro end name
    vpop {d8-d15}
    pop {r4-r11, pc}
    .size \name, . - \name
.endm

@ Strips of eight rows with row scales. The first pass through the loop enters it at a step. On the stack: the activations, the end of
@ the sums, the entry.
.macro row_eight bits
    begin actq_helium_w\bits
    ldr r9, [r1], #4
    multiple\bits
    constants\bits
    add r5, r1, r4, lsl #4
    rsb r4, r4, #0
    and r4, r4, #7
    adr.w r8, 2f
    adds r8, r8, #1
    mov r10, #(3f - 2f)
    mla r8, r4, r10, r8
    sub sp, sp, #16
    strd r1, r3, [sp]
    str r8, [sp, #8]
    mov r1, r0
1:
    clrm {r0, r2, r4, r6, r8, r10, r12, lr}
    ldr r3, [sp]
    ldr pc, [sp, #8]
    .balign 4
2:
    step\bits
3:
    .rept 7
    step\bits
    .endr
    cmp r3, r5
    bne.w 2b
    levels\bits
    stmia.w r7!, {r0, r2, r4, r6, r8, r10, r12, lr}
    ldr r0, [sp, #4]
    cmp r7, r0
    bne.w 1b
    add sp, sp, #16
    end actq_helium_w\bits
.endm

@ Strips of four rows with row scales. On the stack: the activations, the end of the sums.
.macro row_four name, bits
    begin \name
    ldr r9, [r1], #4
    multiple\bits
    constants\bits
    mov r5, r4
    sub sp, sp, #8
    strd r1, r3, [sp]
    mov r1, r0
1:
    clrm {r0, r2, r4, r6, r8, r10, r12}
    ldr r3, [sp]
    dls lr, r5
2:
    step\bits\()_4
    le lr, 2b
    levels\bits\()_4
    stmia.w r7!, {r0, r2, r4, r6}
    ldr r0, [sp, #4]
    cmp r7, r0
    bne.w 1b
    add sp, sp, #8
    end \name
.endm

@ The next group: its sum, and r5, the end of its activations; r0 and r5 change.
.macro group bits, step_log
    ldrd r0, r5, [sp, #8]
    ldr r9, [r3], #4
    add r5, r3, r5, lsl #\step_log
    cmp r5, r0
    it hi
    movhi r5, r0
    multiple\bits
.endm

@ Strips with group scales. On the stack: the activations, the end of the sums, the end of the activations, the steps of a group, and
@ from 16 on the sums of a group. `end` of the activations: every group has a word before its columns.
.macro group_begin name, bits, step_log
    begin \name
    constants\bits
    ldr r5, [sp, #104]
    sub sp, sp, #48
    strd r1, r3, [sp]
    add r6, r4, r5
    subs r6, r6, #1
    udiv r6, r6, r5
    lsl r6, r6, #2
    add r6, r6, r4, lsl #\step_log
    add r6, r6, r1
    strd r6, r5, [sp, #8]
    mov r1, r0
.endm

.macro group_eight bits
    group_begin actq_helium_w\bits\()_group, \bits, 4
1:
    vmov.i32 q0, #0
    vstrw.32 q0, [r7]
    vstrw.32 q0, [r7, #16]
    ldr r3, [sp]
2:
    group \bits, 4
    clrm {r0, r2, r4, r6, r8, r10, r12, lr}
3:
    step\bits
    cmp r3, r5
    bne.w 3b
    levels\bits
    add r5, sp, #16
    stmia.w r5, {r0, r2, r4, r6, r8, r10, r12, lr}
    vldrw.u32 q0, [r5]
    vldrb.u32 q2, [r1], #4
    vldrw.u32 q1, [r5, #16]
    vmul.i32 q0, q0, q2
    vldrb.u32 q3, [r1], #4
    vldrw.u32 q2, [r7]
    vmul.i32 q1, q1, q3
    vadd.i32 q0, q0, q2
    vldrw.u32 q3, [r7, #16]
    vstrw.32 q0, [r7]
    vadd.i32 q1, q1, q3
    vstrw.32 q1, [r7, #16]
    ldr r0, [sp, #8]
    cmp r3, r0
    bne.w 2b
    adds r7, r7, #32
    ldr r0, [sp, #4]
    cmp r7, r0
    bne.w 1b
    add sp, sp, #48
    end actq_helium_w\bits\()_group
.endm

.macro group_four name, bits, step_log
    group_begin \name, \bits, \step_log
1:
    vmov.i32 q0, #0
    vstrw.32 q0, [r7]
    ldr r3, [sp]
2:
    group \bits, \step_log
    clrm {r0, r2, r4, r6, r8, r10, r12}
3:
    step\bits\()_4
    cmp r3, r5
    bne.w 3b
    levels\bits\()_4
    add r5, sp, #16
    stmia.w r5, {r0, r2, r4, r6}
    vldrw.u32 q0, [r5]
    vldrb.u32 q1, [r1], #4
    vldrw.u32 q2, [r7]
    vmul.i32 q0, q0, q1
    vadd.i32 q0, q0, q2
    vstrw.32 q0, [r7]
    ldr r0, [sp, #8]
    cmp r3, r0
    bne.w 2b
    adds r7, r7, #16
    ldr r0, [sp, #4]
    cmp r7, r0
    bne.w 1b
    add sp, sp, #48
    end \name
.endm

    row_eight 2
    row_eight 4
    row_eight 8
    row_four actq_helium_w2_four, 2
    row_four actq_helium_w4_four, 4
    row_four actq_helium_w8_four, 8
    row_four actq_helium_w3, 3
    group_eight 2
    group_eight 4
    group_eight 8
    group_four actq_helium_w2_group_four, 2, 4
    group_four actq_helium_w4_group_four, 4, 4
    group_four actq_helium_w8_group_four, 8, 4
    group_four actq_helium_w3_group, 3, 5

    .text
