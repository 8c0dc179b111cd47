#include "actq_link.h"

#include <string.h>

static void put32(uint8_t *to, uint32_t value) {
    for (int i = 0; i < 4; i++) {
        to[i] = (uint8_t)(value >> (8 * i));
    }
}

static uint32_t get32(const uint8_t *from) {
    return (uint32_t)from[0] | (uint32_t)from[1] << 8 | (uint32_t)from[2] << 16 | (uint32_t)from[3] << 24;
}

/* CRC-32 (ISO-HDLC), as zlib's. */
static uint32_t crc32(const uint8_t *bytes, size_t length) {
    uint32_t crc = 0xffffffffu;
    for (size_t i = 0; i < length; i++) {
        crc ^= bytes[i];
        for (int bit = 0; bit < 8; bit++) {
            crc = (crc & 1u) != 0 ? crc >> 1 ^ 0xedb88320u : crc >> 1;
        }
    }
    return ~crc;
}

/* COBS (Cheshire and Baker, 1999) between two zeros: the first ends what another host has left on the line. */
static size_t stuff(const uint8_t *frame, size_t length, uint8_t *wire) {
    size_t at = 1, code = at++;
    uint8_t run = 1;
    wire[0] = 0;
    for (size_t i = 0; i < length; i++) {
        if (frame[i] != 0) {
            wire[at++] = frame[i];
            run++;
        }
        if (frame[i] == 0 || (run == 0xff && i + 1 < length)) {
            wire[code] = run;
            code = at++;
            run = 1;
        }
    }
    wire[code] = run;
    wire[at++] = 0;
    return at;
}

static size_t send(actq_link *link, uint8_t kind, uint32_t micros, const uint8_t *payload, size_t length, uint8_t *wire) {
    uint8_t frame[ACTQ_LINK_FRAME];
    if (length > ACTQ_LINK_PAYLOAD) {
        return 0;
    }
    frame[0] = 1;
    frame[1] = kind;
    put32(frame + 2, link->sequence++);
    put32(frame + 6, micros);
    if (length > 0) {
        memcpy(frame + 10, payload, length);
    }
    put32(frame + 10 + length, crc32(frame, 10 + length));
    return stuff(frame, 14 + length, wire);
}

void actq_link_init(actq_link *link, uint32_t sequence) {
    memset(link, 0, sizeof *link);
    link->sequence = sequence;
}

size_t actq_link_observation(actq_link *link, uint32_t micros, const float *values, size_t count, uint8_t *wire,
                             uint32_t *number) {
    uint8_t payload[ACTQ_LINK_PAYLOAD];
    if (count > ACTQ_LINK_PAYLOAD / 4) {
        return 0;
    }
    for (size_t i = 0; i < count; i++) {
        uint32_t bits;
        memcpy(&bits, &values[i], 4);
        put32(payload + 4 * i, bits);
    }
    if (number != NULL) {
        *number = link->sequence;
    }
    return send(link, ACTQ_LINK_OBSERVATION, micros, payload, 4 * count, wire);
}

size_t actq_link_arm(actq_link *link, uint32_t micros, uint32_t token, uint8_t *wire) {
    uint8_t payload[4];
    put32(payload, token);
    return send(link, ACTQ_LINK_ARM, micros, payload, sizeof payload, wire);
}

size_t actq_link_disarm(actq_link *link, uint32_t micros, uint8_t *wire) {
    return send(link, ACTQ_LINK_DISARM, micros, NULL, 0, wire);
}

size_t actq_link_ask_status(actq_link *link, uint32_t micros, uint8_t *wire) {
    const uint8_t status = 1;
    return send(link, ACTQ_LINK_ASK, micros, &status, 1, wire);
}

size_t actq_link_begin_prefix(actq_link *link, uint32_t micros, uint32_t token, const actq_link_prefix *prefix, uint8_t *wire) {
    const uint32_t fields[5] = {token, prefix->image, prefix->length, crc32(prefix->bytes, prefix->length), prefix->lifetime};
    uint8_t payload[20];
    for (int i = 0; i < 5; i++) {
        put32(payload + 4 * i, fields[i]);
    }
    return send(link, ACTQ_LINK_BEGIN_PREFIX, micros, payload, sizeof payload, wire);
}

size_t actq_link_prefix_chunk(actq_link *link, uint32_t micros, const actq_link_prefix *prefix, uint32_t offset,
                              size_t payload, uint8_t *wire) {
    uint8_t chunk[ACTQ_LINK_PAYLOAD];
    size_t room = payload < sizeof chunk ? payload : sizeof chunk;
    if (room <= 4 || offset >= prefix->length) {
        return 0;
    }
    room = room - 4 < prefix->length - offset ? room - 4 : prefix->length - offset;
    put32(chunk, offset);
    memcpy(chunk + 4, prefix->bytes + offset, room);
    return send(link, ACTQ_LINK_PREFIX_CHUNK, micros, chunk, 4 + room, wire);
}

size_t actq_link_commit_prefix(actq_link *link, uint32_t micros, uint8_t *wire) {
    return send(link, ACTQ_LINK_COMMIT_PREFIX, micros, NULL, 0, wire);
}

static void append(actq_link *link, uint8_t byte) {
    if (link->length < sizeof link->received) {
        link->received[link->length++] = byte;
    } else {
        link->broken = 1;
    }
}

int actq_link_push(actq_link *link, uint8_t byte, actq_link_message *message) {
    if (byte != 0) {
        if (link->left > 0) {
            append(link, byte);
        } else {
            /* A run of fewer than 254 bytes stood for a zero after it. */
            if (link->code != 0 && link->code != 0xff) {
                append(link, 0);
            }
            link->code = byte;
            link->left = byte;
        }
        link->left--;
        return 0;
    }
    const size_t length = link->length;
    const int is_empty = link->code == 0, is_whole = link->left == 0 && !link->broken && length >= 14;
    link->length = 0;
    link->left = link->code = link->broken = 0;
    if (is_empty) {
        return 0;
    }
    const uint8_t *frame = link->received;
    if (!is_whole || get32(frame + length - 4) != crc32(frame, length - 4) || frame[0] != 1) {
        link->damaged++;
        return 0;
    }
    message->kind = frame[1];
    message->sequence = get32(frame + 2);
    message->micros = get32(frame + 6);
    message->payload = frame + 10;
    message->length = length - 14;
    return 1;
}

int actq_link_read_status(const actq_link_message *message, actq_link_status *status) {
    const uint8_t *p = message->payload;
    if (message->kind != ACTQ_LINK_STATUS || message->length != 46) {
        return 0;
    }
    *status = (actq_link_status){p[0], p[1], p[2], p[3], get32(p + 4), get32(p + 8), get32(p + 12), p[16], p[17],
                                 (uint16_t)(p[18] | p[19] << 8), (uint16_t)(p[20] | p[21] << 8), get32(p + 22),
                                 get32(p + 26), get32(p + 30), get32(p + 34), get32(p + 38), get32(p + 42)};
    return 1;
}

int actq_link_read_acknowledgement(const actq_link_message *message, uint32_t *of, uint8_t *refusal) {
    if (message->kind != ACTQ_LINK_ACKNOWLEDGEMENT || message->length != 9) {
        return 0;
    }
    *of = get32(message->payload);
    *refusal = message->payload[4];
    return 1;
}

uint32_t actq_link_written(const actq_link_message *acknowledgement) {
    return acknowledgement->length == 9 ? get32(acknowledgement->payload + 5) : 0;
}

int actq_link_read_action(const actq_link_message *message, uint32_t *of, int *applied, float *values, size_t room,
                          size_t *count) {
    if (message->kind != ACTQ_LINK_ACTION || message->length < 5 || (message->length - 5) % 4 != 0) {
        return 0;
    }
    *of = get32(message->payload);
    *applied = message->payload[4] != 0;
    *count = (message->length - 5) / 4;
    for (size_t i = 0; i < *count && i < room; i++) {
        const uint32_t bits = get32(message->payload + 5 + 4 * i);
        memcpy(&values[i], &bits, 4);
    }
    return 1;
}
