/* Text to the debugger or QEMU, and the end of the program (Arm semihosting 2.0, DUI 0471). */
#ifndef SEMIHOSTING_H
#define SEMIHOSTING_H

#include <stdint.h>

static inline intptr_t semihosting(int operation, const void *argument) {
    register intptr_t r0 __asm__("r0") = operation;
    register const void *r1 __asm__("r1") = argument;
    __asm__ volatile("bkpt 0xab" : "+r"(r0) : "r"(r1) : "memory");
    return r0;
}

/* SYS_WRITE0 */
static inline void print(const char *text) { semihosting(0x04, text); }

/* Prints why a program fails, and returns its status. */
static inline int fail(const char *why) {
    print(why);
    print("\n");
    return 1;
}

static inline void print_number(unsigned number) {
    char text[11];
    char *digit = text + sizeof text - 1;
    *digit = 0;
    do {
        *--digit = (char)('0' + number % 10);
        number /= 10;
    } while (number != 0);
    print(digit);
}

/* SYS_EXIT_EXTENDED with ADP_Stopped_ApplicationExit and a status */
static inline void end(int status) {
    const uint32_t arguments[2] = {0x20026, (uint32_t)status};
    semihosting(0x20, arguments);
    for (;;) {
    }
}

#endif
