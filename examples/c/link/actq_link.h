/* A host's end of the link to a controller (docs/LINK.md), in C99: frames out of messages, and messages out of bytes.
 *
 * It has no port and no clock: the caller sends the bytes and gives the time. SPDX-License-Identifier: MIT OR Apache-2.0 */
#ifndef ACTQ_LINK_H
#define ACTQ_LINK_H

#include <stddef.h>
#include <stdint.h>

/* Longest payload: 128 values of an observation. Longest frame: header, payload, checksum. On the wire: one byte more
 * for each 254, and a zero at both ends. */
#define ACTQ_LINK_PAYLOAD 512u
#define ACTQ_LINK_FRAME (10u + ACTQ_LINK_PAYLOAD + 4u)
#define ACTQ_LINK_WIRE (ACTQ_LINK_FRAME + ACTQ_LINK_FRAME / 254u + 3u)

enum actq_link_kind {
    ACTQ_LINK_OBSERVATION = 1,
    ACTQ_LINK_ARM = 2,
    ACTQ_LINK_DISARM = 3,
    ACTQ_LINK_ASK = 6,
    ACTQ_LINK_BEGIN_PREFIX = 11,
    ACTQ_LINK_PREFIX_CHUNK = 12,
    ACTQ_LINK_COMMIT_PREFIX = 13,
    ACTQ_LINK_ACTION = 128,
    ACTQ_LINK_STATUS = 129,
    ACTQ_LINK_ACKNOWLEDGEMENT = 133
};

/* Refusals that a host answers by itself: with the token of another status, from the written bytes on, or again. */
enum actq_link_refusal { ACTQ_LINK_TOKEN = 1, ACTQ_LINK_OFFSET = 10, ACTQ_LINK_BUSY = 13 };

enum actq_link_state { ACTQ_LINK_DISARMED = 0, ACTQ_LINK_ARMED = 1, ACTQ_LINK_LATCHED = 2 };

/* One end of a line. */
typedef struct {
    uint32_t sequence;                       /* of the next frame to send: any number to begin with, but none of an earlier run */
    uint8_t received[ACTQ_LINK_FRAME + 1];   /* the frame in progress, unstuffed */
    size_t length;                           /* bytes in it */
    uint8_t left;                            /* bytes until the next code byte; 0: a code byte is next */
    uint8_t code;                            /* the last code byte */
    uint8_t broken;                          /* the frame in progress is too long */
    uint32_t damaged;                        /* frames with wrong stuffing, checksum or version */
} actq_link;

/* A message of a controller. `payload` is valid until the next byte is pushed. */
typedef struct {
    uint8_t kind;
    uint32_t sequence, micros;
    const uint8_t *payload;
    size_t length;
} actq_link_message;

typedef struct {
    uint8_t state, fault, refusal, reset;
    uint32_t token, ticks, image;
    uint8_t slot, axes;
    uint16_t observation, payload;
    uint32_t refused;
    uint32_t good, damaged, malformed, repeated, lost;
} actq_link_status;

void actq_link_init(actq_link *link, uint32_t sequence);

/* Each writes a frame to `wire`, of ACTQ_LINK_WIRE bytes, and returns its bytes; 0 if the message is too long. `number`,
 * if it is not null, gets the frame's sequence number, which an action or an acknowledgement repeats. */
size_t actq_link_observation(actq_link *link, uint32_t micros, const float *values, size_t count, uint8_t *wire,
                             uint32_t *number);
size_t actq_link_arm(actq_link *link, uint32_t micros, uint32_t token, uint8_t *wire);
size_t actq_link_disarm(actq_link *link, uint32_t micros, uint8_t *wire);
size_t actq_link_ask_status(actq_link *link, uint32_t micros, uint8_t *wire);

/* A prefix, of the bytes that `actq_set_prefix` takes: for how many control ticks the head may use it, and the image that
 * reads it, from the status. */
typedef struct {
    const uint8_t *bytes;
    uint32_t length, lifetime, image;
} actq_link_prefix;

/* The requests of a prefix, one after the acknowledgement of the other: begin, then chunks until all bytes are written, then
 * commit until its refusal is not ACTQ_LINK_BUSY. A chunk begins at `offset`, and its payload has at most `payload` bytes
 * (that of the status) and ACTQ_LINK_PAYLOAD. */
size_t actq_link_begin_prefix(actq_link *link, uint32_t micros, uint32_t token, const actq_link_prefix *prefix, uint8_t *wire);
size_t actq_link_prefix_chunk(actq_link *link, uint32_t micros, const actq_link_prefix *prefix, uint32_t offset,
                              size_t payload, uint8_t *wire);
size_t actq_link_commit_prefix(actq_link *link, uint32_t micros, uint8_t *wire);

/* Takes a byte; returns 1 if it ends a frame that holds a message. */
int actq_link_push(actq_link *link, uint8_t byte, actq_link_message *message);

/* Each returns 1 if the message is of its kind. An acknowledgement's `refusal` is 0 if the request `of` was done. Up to
 * `room` values of the action are written; `count` gets their number. */
int actq_link_read_status(const actq_link_message *message, actq_link_status *status);
int actq_link_read_acknowledgement(const actq_link_message *message, uint32_t *of, uint8_t *refusal);
/* The bytes that the controller has written of the prefix, of an acknowledgement of one of its requests. */
uint32_t actq_link_written(const actq_link_message *acknowledgement);
int actq_link_read_action(const actq_link_message *message, uint32_t *of, int *applied, float *values, size_t room,
                          size_t *count);

#endif
