/* What the harness, the peers and prepare.py share. The command line has the numbers STEPS, INPUTS, OUTPUTS, LAYERS, WIDEST. */
#ifndef PEER_H
#define PEER_H

#include <stdint.h>

/* A product of int8 values, with a scale a tensor, as TensorFlow Lite defines it; also in embedded_nn.rs. */
struct layer {
    int32_t rows, cols;
    const int8_t *weights;
    const int32_t *bias;
    int32_t multiplier, shift, zero_in, zero_out, least;
};

#ifdef __cplusplus
extern "C" {
#endif
void peer_init(void);
/* Evaluates the network on an input: what is counted. */
void peer_step(unsigned step);
/* An output of the last step: an int8 value, or the bits of an f32. */
uint32_t peer_output(unsigned index);
#ifdef __cplusplus
}
#endif

/* An array that is a file. */
#ifdef __cplusplus
#define EXTERN extern "C"
#else
#define EXTERN extern
#endif
#define BLOB(type, name, file)                                                                                                   \
    __asm__(".section .rodata." #name ",\"a\"\n.balign 16\n.global " #name "\n" #name ": .incbin \"" file "\"\n.previous");         \
    EXTERN const type name[];

static inline uint32_t bits_of(float value) {
    union {
        float value;
        uint32_t bits;
    } either = {value};
    return either.bits;
}

#endif
