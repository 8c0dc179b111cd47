/* The least that runs an image: its size is that of the library with every operation. */
#include "actq.h"
#include "policy.h"

/* Or actq_image_open_checksummed, for smaller code: `actq export-c` has checked the image. */
#ifndef OPEN
#define OPEN actq_image_open
#endif

static actq_image image;
static actq_head head;
static uint32_t scratch[POLICY_SCRATCH_WORDS];
static float observation[POLICY_OBSERVATION_LEN];
static float action[POLICY_ACTION_LEN];

int main(void) {
    actq_status status = OPEN(&image, (const uint8_t *)policy_image, POLICY_IMAGE_BYTES);
    if (status == ACTQ_OK) {
        status = actq_head_init(&head, &image, scratch, POLICY_SCRATCH_WORDS);
    }
    if (status == ACTQ_OK) {
        status = actq_step(&head, observation, POLICY_OBSERVATION_LEN, action, POLICY_ACTION_LEN);
    }
    return status;
}
