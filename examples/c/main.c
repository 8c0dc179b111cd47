/* Runs an image on a bare Cortex-M, and compares each action with the bits that the host computed.
 *
 * `actq export-c IMAGE --golden RECORDING` writes policy.h, policy.c and policy_golden.c. docs/C.md builds and runs this. */
#include "actq.h"
#include "policy.h"

#include "semihosting.h"

/* Instructions of a slice, by the cost model. */
#define SLICE 20000u

static actq_image image;
static actq_head head;
static uint32_t scratch[POLICY_SCRATCH_WORDS];

static int failed(const char *what, actq_status status) {
    print(what);
    print(": ");
    return fail(actq_status_text(status));
}

/* Counts the values with other bits than the host's. */
static unsigned differing(const float *action, const uint32_t *expected) {
    unsigned count = 0;
    for (unsigned i = 0; i < POLICY_ACTION_LEN; i++) {
        union {
            float value;
            uint32_t bits;
        } given;
        given.value = action[i];
        count += given.bits != expected[i];
    }
    return count;
}

/* A step in slices, as a control loop with other work runs it. */
static actq_status in_slices(const float *observation, uint32_t budget, float *action) {
    actq_status status = actq_begin(&head, observation, POLICY_OBSERVATION_LEN);
    if (status != ACTQ_OK) {
        return status;
    }
    do {
        status = actq_poll(&head, budget, action, POLICY_ACTION_LEN);
    } while (status == ACTQ_PENDING);
    return status;
}

int main(void) {
    if (actq_abi() != ACTQ_ABI) {
        print("the library and its header differ\n");
        return 1;
    }
    actq_status status = actq_image_open(&image, (const uint8_t *)policy_image, POLICY_IMAGE_BYTES);
    if (status != ACTQ_OK) {
        return failed("open", status);
    }
    actq_cost cost;
    status = actq_image_cost(&image, &cost);
    if (status != ACTQ_OK) {
        return failed("cost", status);
    }
    status = actq_head_init(&head, &image, scratch, POLICY_SCRATCH_WORDS);
    if (status != ACTQ_OK) {
        return failed("init", status);
    }
    status = actq_self_test(&head);
    if (status != ACTQ_OK) {
        return failed("self-test", status);
    }
    uint32_t budget = cost.least_budget > SLICE ? cost.least_budget : SLICE;
    unsigned wrong = 0;
    for (int sliced = 0; sliced < 2; sliced++) {
        actq_reset(&head);
        for (unsigned step = 0; step < POLICY_GOLDEN_STEPS; step++) {
            const float *observation = &policy_golden_observations[step * POLICY_OBSERVATION_LEN];
            float action[POLICY_ACTION_LEN];
            status = sliced ? in_slices(observation, budget, action)
                            : actq_step(&head, observation, POLICY_OBSERVATION_LEN, action, POLICY_ACTION_LEN);
            if (status != ACTQ_OK) {
                return failed("step", status);
            }
            wrong += differing(action, &policy_golden_actions[step * POLICY_ACTION_LEN]);
        }
    }
    print_number(2 * POLICY_GOLDEN_STEPS);
    print(" steps, half of them in slices; values that differ in bits from the host's: ");
    print_number(wrong);
    print("\n");
    return wrong != 0;
}
