/* No network: the harness itself. */
#include "peer.h"

void peer_init(void) {}
void peer_step(unsigned step) { (void)step; }
uint32_t peer_output(unsigned index) { return index; }
