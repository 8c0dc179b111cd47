/* Vector table and reset of a Cortex-M3 or later, as CMSIS startup files have them, without CMSIS. */
#include "semihosting.h"

extern uint32_t stack_top, data_load, data_start, data_end, bss_start, bss_end;

int main(void);
void reset(void);
static void fault(void);
/* SysTick's handler, for a program that has one. */
__attribute__((weak)) void tick(void);

typedef void (*handler)(void);

__attribute__((section(".vectors"), used)) static const struct {
    uint32_t *stack;
    handler handlers[15];
} vectors = {&stack_top, {reset, fault, fault, fault, fault, fault, 0, 0, 0, 0, fault, fault, 0, fault, tick}};

void reset(void) {
#ifdef __ARM_FP
    /* CPACR: full access to the FPU (Armv7-M ARM, B3.2.20). */
    *(volatile uint32_t *)0xe000ed88 |= 0xfu << 20;
    __asm__ volatile("dsb\n isb" ::: "memory");
#endif
    /* Volatile: otherwise the compiler makes calls of memcpy and memset of these loops. */
    const uint32_t *from = &data_load;
    for (volatile uint32_t *to = &data_start; to < &data_end;) {
        *to++ = *from++;
    }
    for (volatile uint32_t *to = &bss_start; to < &bss_end;) {
        *to++ = 0;
    }
    end(main());
}

void tick(void) {}

static void fault(void) {
    print("an exception stopped the program\n");
    end(2);
}
