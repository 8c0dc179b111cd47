/* Runs a peer's steps, the last one between the marks of the counter, and prints each output and the stack of the first step. */
#include "peer.h"

extern uint32_t stack_top;
int main(void);

#ifdef __riscv
/* Start and semihosting of a core on QEMU's virt; Arm's are in examples/c. picolibc's errno is at tp. The word is `csrw mtvec, t0`,
 * which gcc's rv32imac lacks. */
static uint32_t thread[16];
__attribute__((naked, section(".text.start"))) void reset(void) {
    __asm__ volatile(".option push\n.option norelax\nla gp, __global_pointer$\n.option pop\nla sp, stack_top\nla tp, %0\nla t0, fault\n.word 0x30529073\ncall run" ::"i"(thread));
}

static void call_host(intptr_t operation, const void *argument) {
    register intptr_t a0 __asm__("a0") = operation;
    register const void *a1 __asm__("a1") = argument;
    __asm__ volatile(".balign 16\n.option push\n.option norvc\nslli x0, x0, 0x1f\nebreak\nsrai x0, x0, 7\n.option pop" : "+r"(a0) : "r"(a1) : "memory");
}

static void print(const char *text) { call_host(0x04, text); }

void run(void) {
    const uint32_t arguments[2] = {0x20026, (uint32_t)main()};
    call_host(0x20, arguments);
}

__attribute__((aligned(4))) void fault(void) {
    const uint32_t arguments[2] = {0x20026, 2};
    call_host(0x20, arguments);
}
#else
#include "semihosting.h"
#endif

/* Different, because equal functions may become one. */
__attribute__((noinline)) void actq_count_begin(void) { __asm__ volatile("nop"); }
__attribute__((noinline)) void actq_count_end(void) { __asm__ volatile("nop\n nop"); }

static void print_word(char kind, uint32_t word) {
    char text[] = "x 00000000\n";
    text[0] = kind;
    for (int i = 0; i < 8; i++) {
        text[9 - i] = "0123456789abcdef"[word >> 4 * i & 15];
    }
    print(text);
}

#define PAINT 0x5ac3a53cu
#define PAINTED (1u << 17) /* words below the stack pointer */

#ifdef __riscv
#define STACK_POINTER "mv %0, sp"
#else
#define STACK_POINTER "mov %0, sp"
#endif

int main(void) {
    volatile uint32_t *top;
    __asm__ volatile(STACK_POINTER : "=r"(top));
    peer_init();
    for (volatile uint32_t *word = top - PAINTED; word < top; word++) {
        *word = PAINT;
    }
    for (unsigned step = 0; step < STEPS; step++) {
        if (step + 1 < STEPS) {
            peer_step(step);
        } else {
            actq_count_begin();
            peer_step(step);
            actq_count_end();
        }
        volatile uint32_t *used = top - PAINTED;
        while (step == 0 && used < top && *used == PAINT) {
            used++;
        }
        if (step == 0) {
            print_word('s', 4 * (uint32_t)(top - used));
        }
        for (unsigned i = 0; i < OUTPUTS; i++) {
            print_word('v', peer_output(i));
        }
    }
    return 0;
}
