/* Arms a controller at a Unix socket, sends it observations until it has applied some actions, and disarms it.
 *
 * It arms once, and only from the disarmed state: a controller that stopped has had a reason, which somebody must see.
 * Usage: link-client SOCKET ACTIONS [PREFIX TICKS]. PREFIX is a file with the keys and values that the image reads, which
 * the head may use for that many control ticks. A serial port differs only in how it is opened. */
#define _POSIX_C_SOURCE 200809L

#include "actq_link.h"

#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <time.h>
#include <unistd.h>

static uint64_t micros_of(clockid_t clock) {
    struct timespec now;
    clock_gettime(clock, &now);
    return (uint64_t)now.tv_sec * 1000000u + (uint64_t)now.tv_nsec / 1000u;
}

/* The time of day, so that a later run repeats no time of this one, also after the machine's start. */
static uint32_t micros(void) {
    return (uint32_t)micros_of(CLOCK_REALTIME);
}

static void put(int line, const uint8_t *wire, size_t length) {
    for (ssize_t written; length > 0; wire += written, length -= (size_t)written) {
        written = write(line, wire, length);
        if (written <= 0) {
            perror("the line");
            exit(1);
        }
    }
}

/* A prefix on its way. */
typedef struct {
    actq_link_prefix prefix;
    enum { BEGIN, WRITE, COMMIT, DONE } stage;
    uint32_t written, request;
} transfer;

static void read_prefix(transfer *to, const char *path, const char *ticks) {
    static uint8_t bytes[1u << 18];
    FILE *file = fopen(path, "rb");
    if (file == NULL) {
        perror(path);
        exit(1);
    }
    to->prefix.bytes = bytes;
    to->prefix.length = (uint32_t)fread(bytes, 1, sizeof bytes, file);
    to->prefix.lifetime = (uint32_t)strtoul(ticks, NULL, 10);
    to->stage = BEGIN;
    fclose(file);
}

/* Sends the next request, or again one that was not answered. */
static void send_prefix(transfer *of, int line, actq_link *link, const actq_link_status *status) {
    static uint8_t wire[ACTQ_LINK_WIRE];
    of->request = link->sequence;
    of->prefix.image = status->image;
    if (of->stage == BEGIN) {
        put(line, wire, actq_link_begin_prefix(link, micros(), status->token, &of->prefix, wire));
    } else if (of->stage == WRITE) {
        put(line, wire, actq_link_prefix_chunk(link, micros(), &of->prefix, of->written, status->payload, wire));
    } else if (of->stage == COMMIT) {
        put(line, wire, actq_link_commit_prefix(link, micros(), wire));
    }
}

/* Takes the answer to the last request; returns 1 if the next one can follow at once. */
static int answer_prefix(transfer *of, uint8_t refusal, uint32_t written) {
    if (refusal == ACTQ_LINK_BUSY || refusal == ACTQ_LINK_TOKEN) {
        return 0;
    }
    if (refusal != 0 && !(refusal == ACTQ_LINK_OFFSET && of->stage == WRITE)) {
        fprintf(stderr, "the controller refuses the prefix: refusal %u\n", (unsigned)refusal);
        exit(1);
    }
    of->written = written;
    if (of->stage == COMMIT) {
        of->stage = DONE;
    } else {
        of->stage = written < of->prefix.length ? WRITE : COMMIT;
    }
    return of->stage != DONE;
}

int main(int count, char **arguments) {
    struct sockaddr_un address = {.sun_family = AF_UNIX};
    if ((count != 3 && count != 5) || strlen(arguments[1]) >= sizeof address.sun_path) {
        fprintf(stderr, "usage: link-client SOCKET ACTIONS [PREFIX TICKS]\n");
        return 2;
    }
    static transfer prefix = {.stage = DONE};
    if (count == 5) {
        read_prefix(&prefix, arguments[3], arguments[4]);
    }
    strcpy(address.sun_path, arguments[1]);
    const long wanted = strtol(arguments[2], NULL, 10);
    const int line = socket(AF_UNIX, SOCK_STREAM, 0);
    if (line < 0 || connect(line, (const struct sockaddr *)&address, sizeof address) != 0) {
        perror(arguments[1]);
        return 1;
    }
    static actq_link link;
    static uint8_t wire[ACTQ_LINK_WIRE];
    static float observation[ACTQ_LINK_PAYLOAD / 4];
    actq_link_status status = {0};
    long applied = 0;
    /* The request to arm; the rounds without its answer. */
    uint32_t request = 0;
    int is_requested = 0, is_armed = 0, unanswered = 0;
    /* Whole milliseconds before the cut to 32 bits: ahead of every number of an earlier run, for 49 days. */
    actq_link_init(&link, (uint32_t)(micros_of(CLOCK_REALTIME) / 1000u));
    /* Until the controller says that it is disarmed: what is sent last may be lost when a socket closes. */
    while (applied < wanted || status.state != ACTQ_LINK_DISARMED) {
        if (applied >= wanted) {
            put(line, wire, actq_link_disarm(&link, micros(), wire));
        }
        put(line, wire, actq_link_ask_status(&link, micros(), wire));
        put(line, wire, actq_link_observation(&link, micros(), observation, status.observation, wire, NULL));
        if (prefix.stage != DONE && status.observation > 0) {
            send_prefix(&prefix, line, &link, &status);
        }
        if (is_requested && !is_armed && ++unanswered > 500) {
            fprintf(stderr, "no answer to the request to arm\n");
            return 1;
        }
        /* 20 ms for answers. */
        struct pollfd ready = {.fd = line, .events = POLLIN};
        for (const uint64_t begun = micros_of(CLOCK_MONOTONIC); micros_of(CLOCK_MONOTONIC) - begun < 20000u;) {
            uint8_t bytes[256];
            const ssize_t length = poll(&ready, 1, 20) > 0 ? read(line, bytes, sizeof bytes) : 0;
            for (ssize_t i = 0; i < length; i++) {
                actq_link_message message;
                if (!actq_link_push(&link, bytes[i], &message)) {
                    continue;
                }
                uint32_t of;
                uint8_t refusal;
                int is_applied;
                float action[32];
                size_t values;
                if (actq_link_read_action(&message, &of, &is_applied, action, 32, &values)) {
                    applied += is_applied;
                } else if (actq_link_read_acknowledgement(&message, &of, &refusal)) {
                    if (is_requested && of == request) {
                        if (refusal != 0) {
                            fprintf(stderr, "the controller refuses to arm: refusal %u\n", (unsigned)refusal);
                            return 1;
                        }
                        is_armed = 1;
                    } else if (prefix.stage != DONE && of == prefix.request &&
                               answer_prefix(&prefix, refusal, actq_link_written(&message))) {
                        send_prefix(&prefix, line, &link, &status);
                    }
                } else if (actq_link_read_status(&message, &status) && applied < wanted) {
                    if (status.state == ACTQ_LINK_ARMED) {
                        is_armed = 1;
                    } else if (is_armed || status.state == ACTQ_LINK_LATCHED) {
                        fprintf(stderr, "the controller is not armed: state %u, fault %u\n", (unsigned)status.state,
                                (unsigned)status.fault);
                        return 1;
                    } else if (!is_requested && status.refusal == 0 && prefix.stage == DONE) {
                        request = link.sequence;
                        is_requested = 1;
                        put(line, wire, actq_link_arm(&link, micros(), status.token, wire));
                    }
                }
            }
        }
    }
    printf("image %08x, %u values, %u axes: %ld actions applied; damaged frames: %u here, %u at the controller\n",
           (unsigned)status.image, (unsigned)status.observation, (unsigned)status.axes, applied, (unsigned)link.damaged,
           (unsigned)status.damaged);
    close(line);
    return 0;
}
