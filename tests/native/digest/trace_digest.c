/* SPDX-License-Identifier: MIT
 * Programs through the whole controller in virtual time, as a digest of every step edge: time, axes,
 * directions, flags, source line. On any processor the same one, or the processors do not step alike.
 *
 * Reads them from stdin, each ended by a NUL; says a line for each. */
#include "host.h"

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { TEXT_MAX = 1 << 20, EVENTS_A_RUN = 1 << 20 };

static const struct host_board board = {.timer_hz = 20000000,
                                        .step_pulse_ns = 2000,
                                        .dir_setup_ns = 2000,
                                        .max_step_rate_hz = 250000,
                                        .axis_count = 6};

/* Two lanes of FNV-1a over words: cheap where 64-bit products are not. */
struct digest {
    uint32_t first, second;
};

struct seen {
    struct digest digest;
    uint64_t events;
};

static void add(struct digest *digest, uint32_t word) {
    digest->first = (digest->first ^ word) * 16777619u;
    digest->second = (digest->second ^ (word << 16 | word >> 16)) * 2654435761u;
}

static void consume(void *ctx, const struct trace_event *events, size_t count) {
    struct seen *seen = ctx;
    for (size_t i = 0; i < count; i++) {
        add(&seen->digest, (uint32_t)events[i].t_ticks);
        add(&seen->digest, (uint32_t)(events[i].t_ticks >> 32));
        add(&seen->digest,
            (uint32_t)events[i].step_mask << 16 | (uint32_t)events[i].dir_mask << 8 | events[i].flags);
        add(&seen->digest, events[i].line);
    }
    seen->events += count;
}

/* What the controller says belongs to what must be alike, too. */
static void drain(struct host *host, struct digest *said) {
    char text[1024];
    size_t count;
    while ((count = host_read(host, text, sizeof text)) > 0)
        for (size_t i = 0; i < count; i++)
            add(said, (uint8_t)text[i]);
}

static void feed(struct host *host, const char *text, size_t size, struct digest *said) {
    size_t done = 0;
    while (done < size) {
        size_t taken = host_write(host, text + done, size - done);
        enum host_wait wait = host_run(host, EVENTS_A_RUN);
        done += taken;
        drain(host, said);
        if (taken == 0 && wait == HOST_IDLE)
            (void)host_write(host, "~", 1); /* a program pause */
    }
    host_input_follows(host, 0);
    while (host_run(host, EVENTS_A_RUN) != HOST_IDLE)
        drain(host, said);
    drain(host, said);
}

static int run(const char *text, size_t size) {
    struct seen seen = {.events = 0};
    struct digest said = {0, 0};
    int32_t steps[AXIS_COUNT];
    struct host *host = host_create(&board);
    if (host == NULL)
        return 1;
    (void)trace_add(host_trace(host), consume, &seen);
    feed(host, text, size, &said);
    trace_flush(host_trace(host));
    host_position_steps(host, steps);
    printf("%lu events %08" PRIx32 "%08" PRIx32 " said %08" PRIx32 "%08" PRIx32 " at",
           (unsigned long)seen.events, seen.digest.first, seen.digest.second, said.first, said.second);
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++)
        printf(" %ld", (long)steps[ax]);
    printf("\n");
    host_destroy(host);
    return 0;
}

int main(void) {
    static char text[TEXT_MAX];
    size_t size = 0, begin = 0;
    size_t count;
    while (size < TEXT_MAX && (count = fread(text + size, 1, TEXT_MAX - size, stdin)) > 0)
        size += count;
    for (size_t at = 0; at < size; at++)
        if (text[at] == '\0') {
            if (run(text + begin, at - begin) != 0)
                return 1;
            begin = at + 1;
        }
    return 0;
}
