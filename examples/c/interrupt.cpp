// A head in slices below a control interrupt of 1 kHz: the interrupt keeps its deadlines however long the head takes.
//
// The interrupt is SysTick's. It takes the newest action; the main loop computes the next one, 20,000 modelled
// instructions at a time. docs/C.md builds and runs this.
#include "actq.hpp"
#include "policy.h"

#include "semihosting.h"

namespace {

constexpr uint32_t slice = 20000;
// SysTick's registers (Armv7-M ARM, B3.3).
volatile uint32_t &csr = *reinterpret_cast<volatile uint32_t *>(0xe000e010);
volatile uint32_t &rvr = *reinterpret_cast<volatile uint32_t *>(0xe000e014);
volatile uint32_t &cvr = *reinterpret_cast<volatile uint32_t *>(0xe000e018);
#ifndef CORE_HZ
#error "give the core's clock: -DCORE_HZ=25000000 for mps2-an386, -DCORE_HZ=168000000 for netduinoplus2"
#endif
// Cycles of a period: 1 kHz.
constexpr uint32_t period = CORE_HZ / 1000;

uint32_t scratch[POLICY_SCRATCH_WORDS];
actq::Head head;
// Written by the main loop while `ready` is false, read by the interrupt while it is true. `volatile` does not order
// `action`: the fences do, as std::atomic_signal_fence would, which needs libstdc++.
float action[POLICY_ACTION_LEN];
volatile bool ready;
volatile unsigned ticks;
volatile unsigned applied;
volatile unsigned missed;

}  // namespace

extern "C" void tick() {
    // Cycles since the interrupt was raised: SysTick counts down from `period`.
    if (period - cvr > period / 10) {
        missed = missed + 1;
    }
    ticks = ticks + 1;
    if (ready) {
        // Reads of the action belong between both fences.
        __atomic_signal_fence(__ATOMIC_ACQUIRE);
        applied = applied + 1;
        __atomic_signal_fence(__ATOMIC_RELEASE);
        ready = false;
    }
}

int main() {
    if (const actq::Status status = head.open({policy_image, POLICY_IMAGE_BYTES / 4}, scratch); !status) {
        return fail(status.text());
    }
    uint32_t least = 0;
    if (!head.least_budget(least) || least > slice) {
        return fail("the slices are too short");
    }
    rvr = period - 1;
    cvr = 0;
    csr = 7;
    unsigned slices = 0, wrong = 0;
    for (unsigned step = 0; step < POLICY_GOLDEN_STEPS; step++) {
        const float *observation = &policy_golden_observations[step * POLICY_OBSERVATION_LEN];
        actq::Status status = head.begin({observation, POLICY_OBSERVATION_LEN});
        if (status) {
            do {
                status = head.poll(slice, action);
                slices++;
            } while (status.pending());
        }
        if (!status) {
            return fail(status.text());
        }
        for (unsigned i = 0; i < POLICY_ACTION_LEN; i++) {
            union {
                float value;
                uint32_t bits;
            } given;
            given.value = action[i];
            wrong += given.bits != policy_golden_actions[step * POLICY_ACTION_LEN + i];
        }
        __atomic_signal_fence(__ATOMIC_RELEASE);
        ready = true;
        while (ready) {
            __asm__ volatile("wfi");
        }
        __atomic_signal_fence(__ATOMIC_ACQUIRE);
    }
    csr = 0;
    print_number(applied);
    print(" actions applied in ");
    print_number(ticks);
    print(" ticks; late ticks: ");
    print_number(missed);
    print("; values that differ in bits from the host's: ");
    print_number(wrong);
    print("\n");
    return missed != 0 || wrong != 0 || slices <= POLICY_GOLDEN_STEPS;
}
