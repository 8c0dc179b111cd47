/* The C that BakeNN writes for the network. */
#include "bknn_net.h"
#include "bakenn_input.h"
#include "peer.h"

static uint8_t arena[BKNN_NET_ARENA_SIZE + 16] __attribute__((aligned(16)));
static int8_t output[OUTPUTS];

void peer_init(void) {}

void peer_step(unsigned step) { bknn_net_infer(BKNN_NET_ARENA_SIZE ? arena : 0, &input[step * INPUTS], output); }

uint32_t peer_output(unsigned index) { return (uint32_t)(int32_t)output[index]; }
