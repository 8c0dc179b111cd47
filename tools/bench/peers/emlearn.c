/* emlearn's layers in f32, called as the code that it writes with method "inline" does. */
#include <stdbool.h>
#include <stddef.h>

#include "eml_net.h"
#include "f32.h"

static float values[2][WIDEST];

void peer_init(void) {}

/* RELU: of hidden layers. */
#define LAYER(i, in, rows, cols, function) \
    eml_net_forward(in, cols, transposed_##i, bias_##i, function, values[i % 2], rows)

void peer_step(unsigned step) {
    const float *in = &input[step * INPUTS];
#if LAYERS == 1
    LAYER(0, in, 256, 256, EmlNetActivationIdentity);
#else
    LAYER(0, in, 512, 48, EmlNetActivationRelu);
    LAYER(1, values[0], 256, 512, EmlNetActivationRelu);
    LAYER(2, values[1], 128, 256, EmlNetActivationRelu);
    LAYER(3, values[0], 12, 128, EmlNetActivationIdentity);
#endif
}

uint32_t peer_output(unsigned index) { return bits_of(values[(LAYERS - 1) % 2][index]); }
