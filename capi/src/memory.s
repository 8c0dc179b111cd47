@ The memory functions that compiled code calls (Arm's run-time ABI, IHI 0043, 4.3.4), for few bytes of code: a tenth of
@ compiler_builtins'. They are weak: another library's take their place. Thumb as on every Cortex-M.

    .syntax unified
    .thumb

    .macro function name
    .section .text.\name, "ax", %progbits
    .weak \name
    .type \name, %function
    .thumb_func
    .balign 2
\name:
    .endm

@ Zeroes r1 bytes at r0, a multiple of 4.
function __aeabi_memclr4
    push {r4, r5, lr}
    movs r2, #0
    movs r3, #0
    movs r4, #0
    movs r5, #0
    subs r1, #16
    blo 2f
1:
    stmia r0!, {r2-r5}
    subs r1, #16
    bhs 1b
2:
    adds r1, #12
    bmi 4f
3:
    stmia r0!, {r2}
    subs r1, #4
    bpl 3b
4:
    adds r1, #4
    beq 6f
5:
    strb r2, [r0]
    adds r0, #1
    subs r1, #1
    bne 5b
6:
    pop {r4, r5, pc}
    .size __aeabi_memclr4, . - __aeabi_memclr4

@ Copies r2 bytes from r1 to r0, both multiples of 4.
function __aeabi_memcpy4
    push {r4-r6, lr}
    subs r2, #16
    blo 2f
1:
    ldmia r1!, {r3-r6}
    stmia r0!, {r3-r6}
    subs r2, #16
    bhs 1b
2:
    adds r2, #12
    bmi 4f
3:
    ldmia r1!, {r3}
    stmia r0!, {r3}
    subs r2, #4
    bpl 3b
4:
    adds r2, #4
    beq 6f
5:
    subs r2, #1
    ldrb r3, [r1, r2]
    strb r3, [r0, r2]
    bne 5b
6:
    pop {r4-r6, pc}
    .size __aeabi_memcpy4, . - __aeabi_memcpy4
