/* The int8 network, for peers in Rust. */
#include "int8.h"

const struct layer *const peer_layers = layers;
const int8_t *const peer_input = input;
