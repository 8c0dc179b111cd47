/* ESP-NN's fully connected layers in C, which is what it has for a core without Espressif's vector instructions. */
#include "esp_nn_ansi_headers.h"
#include "int8.h"

static int8_t values[2][WIDEST];

void peer_init(void) {}

void peer_step(unsigned step) {
    const int8_t *in = &input[step * INPUTS];
    for (int i = 0; i < LAYERS; i++) {
        const struct layer *layer = &layers[i];
        esp_nn_fully_connected_s8_ansi(in, -layer->zero_in, (uint16_t)layer->cols, layer->weights, 0, layer->bias, values[i % 2],
                                       (uint16_t)layer->rows, layer->zero_out, layer->shift, layer->multiplier, layer->least, 127);
        in = values[i % 2];
    }
}

uint32_t peer_output(unsigned index) { return (uint32_t)(int32_t)values[(LAYERS - 1) % 2][index]; }
