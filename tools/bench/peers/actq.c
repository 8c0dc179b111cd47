/* An image by the C interface. */
#include "actq.h"
#include "f32.h"

BLOB(uint8_t, image, IMAGE)

static actq_image opened;
static actq_head head;
static uint32_t scratch[SCRATCH];
static float output[OUTPUTS];
static actq_status status;

void peer_init(void) {
    status = actq_image_open(&opened, image, IMAGE_BYTES);
    status = status == ACTQ_OK ? actq_head_init(&head, &opened, scratch, SCRATCH) : status;
}

void peer_step(unsigned step) {
    if (status == ACTQ_OK) {
        status = actq_step(&head, &input[step * INPUTS], INPUTS, output, OUTPUTS);
    }
}

/* NaN after an error. */
uint32_t peer_output(unsigned index) { return status == ACTQ_OK ? bits_of(output[index]) : 0x7fc00000 | status; }
