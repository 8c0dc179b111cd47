/* A cooperative loop, as of firmware without interrupts or an operating system: each turn runs a slice of the head and
 * the other work, and none takes longer than a millisecond.
 *
 * docs/C.md builds and runs this. */
#include "actq.h"
#include "policy.h"

#include "semihosting.h"

/* Instructions of a slice, by the cost model; and the longest turn, in cycles of the 25 MHz of mps2-an386. */
#define SLICE 20000u
#define LONGEST 25000u

/* SysTick's registers (Armv7-M ARM, B3.3). It counts down from its largest value, 24 bits. */
#define CSR (*(volatile uint32_t *)0xe000e010)
#define RVR (*(volatile uint32_t *)0xe000e014)
#define CVR (*(volatile uint32_t *)0xe000e018)

static actq_image image;
static actq_head head;
static uint32_t scratch[POLICY_SCRATCH_WORDS];

/* The policy's task: begins a step, or runs a slice of it. Returns 1 with an action. */
static int think(unsigned step, float *action, actq_status *status) {
    static int is_thinking;
    if (!is_thinking) {
        *status = actq_begin(&head, &policy_golden_observations[step * POLICY_OBSERVATION_LEN], POLICY_OBSERVATION_LEN);
        is_thinking = *status == ACTQ_OK;
        return 0;
    }
    *status = actq_poll(&head, SLICE, action, POLICY_ACTION_LEN);
    is_thinking = *status == ACTQ_PENDING;
    return *status == ACTQ_OK;
}

/* Other work: here, a filter of the last action. */
static void filter(const float *action, float *filtered) {
    for (unsigned i = 0; i < POLICY_ACTION_LEN; i++) {
        filtered[i] += 0.1f * (action[i] - filtered[i]);
    }
}

int main(void) {
    float action[POLICY_ACTION_LEN] = {0}, filtered[POLICY_ACTION_LEN] = {0};
    actq_status status = actq_image_open(&image, (const uint8_t *)policy_image, POLICY_IMAGE_BYTES);
    if (status == ACTQ_OK) {
        status = actq_head_init(&head, &image, scratch, POLICY_SCRATCH_WORDS);
    }
    /* Before the loop: the first call takes as long as a short step. */
    uint32_t least = 0;
    if (status == ACTQ_OK) {
        status = actq_least_budget(&head, &least);
    }
    if (status != ACTQ_OK || actq_abi() != ACTQ_ABI || least > SLICE) {
        return fail(status != ACTQ_OK ? actq_status_text(status) : "another library, or too short slices");
    }
    RVR = 0xffffff;
    CVR = 0;
    CSR = 5;
    uint32_t turns = 0, longest = 0;
    unsigned step = 0;
    while (step < POLICY_GOLDEN_STEPS && (status == ACTQ_OK || status == ACTQ_PENDING)) {
        const uint32_t begun = CVR;
        step += (unsigned)think(step, action, &status);
        filter(action, filtered);
        const uint32_t taken = (begun - CVR) & 0xffffff;
        longest = taken > longest ? taken : longest;
        turns++;
    }
    if (status != ACTQ_OK) {
        return fail(actq_status_text(status));
    }
    print_number(step);
    print(" actions in ");
    print_number(turns);
    print(longest <= LONGEST ? " turns, none longer than a millisecond\n" : " turns, one longer than a millisecond\n");
    return longest > LONGEST;
}
