/* SPDX-License-Identifier: MIT
 * Runs one G-code file through the host controller with nothing else around it, for callgrind and for the
 * clock.
 *
 * Usage: drive [-t TRACE] [-s SEED] AXES FILE [SETTING...]    prints the work counters as JSON; TRACE gets
 * every step event of the file as a struct trace_event; with SEED each side of the firmware stalls at random
 * times */
#include "host.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* A 10 MHz step timer that allows 500 k steps/s. */
static struct host_board board = {
    .timer_hz = 10000000,
    .step_pulse_ns = 1000,
    .dir_setup_ns = 1000,
    .max_step_rate_hz = 500000,
};

static void *checked(void *pointer, const char *what) {
    if (pointer == NULL) {
        perror(what);
        exit(1);
    }
    return pointer;
}

static char *read_file(const char *path, size_t *size) {
    FILE *file = checked(fopen(path, "rb"), path);
    size_t room = 1 << 24;
    char *text = checked(malloc(room), "memory");
    *size = fread(text, 1, room, file);
    fclose(file);
    return text;
}

/* Read all answers. @return errors among them. */
static unsigned drain(struct host *host) {
    char text[4096];
    unsigned errors = 0;
    size_t count;
    while ((count = host_read(host, text, sizeof text - 1)) > 0) {
        text[count] = 0;
        for (const char *at = text; (at = strstr(at, "error:")) != NULL; at++)
            errors++;
    }
    return errors;
}

static void write_events(void *ctx, const struct trace_event *events, size_t count) {
    if (fwrite(events, sizeof *events, count, ctx) != count) {
        perror("trace");
        exit(1);
    }
}

static unsigned feed(struct host *host, const char *text, size_t size) {
    unsigned errors = 0, stuck = 0;
    size_t done = 0;
    while (done < size && stuck < 1000) {
        size_t taken = host_write(host, text + done, size - done);
        done += taken;
        enum host_wait wait = host_run(host, 1u << 20);
        if (taken == 0 && wait == HOST_IDLE)
            (void)host_write(host, "~", 1), stuck++; /* a program pause: continue */
        else
            stuck = 0;
        errors += drain(host);
    }
    return errors;
}

/* Lets the file's last move end. @return errors */
static unsigned finish(struct host *host) {
    unsigned errors = 0;
    host_input_follows(host, 0);
    while (host_run(host, 1u << 20) != HOST_IDLE)
        errors += drain(host);
    trace_flush(host_trace(host));
    return errors;
}

/* The value of an option that comes next, or NULL; *at moves behind it. */
static const char *option(char **argv, int *at, const char *name) {
    if (argv[*at] == NULL || argv[*at + 1] == NULL || strcmp(argv[*at], name) != 0)
        return NULL;
    *at += 2;
    return argv[*at - 1];
}

static void stall(struct host *host, const char *seed) {
    struct host_random_stalls stalls = {
        .seed = strtoull(seed, NULL, 10), .sides = (1u << HOST_SIDES) - 1u, .gap_ms = 100, .longest_ms = 200};
    host_stall_randomly(host, &stalls);
}

int main(int argc, char **argv) {
    int first = 1;
    const char *trace_name = option(argv, &first, "-t"), *seed = option(argv, &first, "-s");
    if (argc <= ++first)
        return 2;
    size_t size;
    char *text = read_file(argv[first], &size);
    board.axis_count = (uint8_t)strtoul(argv[first - 1], NULL, 10);
    struct host *host = checked(host_create(&board), "host_create");
    unsigned errors = 0;
    for (int n = first + 1; n < argc; n++) {
        errors += feed(host, argv[n], strlen(argv[n]));
        errors += feed(host, "\n", 1);
    }
    FILE *trace = trace_name != NULL ? checked(fopen(trace_name, "wb"), trace_name) : NULL;
    if (trace != NULL)
        (void)trace_add(host_trace(host), write_events, trace);
    if (seed != NULL)
        stall(host, seed);
    uint64_t begin_ticks = host_time_ticks(host);
    errors += feed(host, text, size);
    errors += finish(host);
    if (trace != NULL && fclose(trace) != 0)
        perror(trace_name), errors++;
    struct host_counters counters;
    host_counters(host, &counters);
    printf("{\"errors\": %u, \"lines\": %llu, \"blocks\": %llu, \"segments\": %llu, \"spans\": %llu, "
           "\"step_events\": %llu, \"timer_events\": %llu, \"underruns\": %llu, \"starved\": %llu, "
           "\"unmet\": %llu, \"ticks\": %llu}\n",
           errors, (unsigned long long)counters.lines, (unsigned long long)counters.blocks,
           (unsigned long long)counters.segments, (unsigned long long)counters.spans,
           (unsigned long long)counters.step_events, (unsigned long long)counters.timer_events,
           (unsigned long long)counters.underruns, (unsigned long long)counters.lookahead_starved,
           (unsigned long long)counters.plan_unmet,
           (unsigned long long)(host_time_ticks(host) - begin_ticks));
    host_destroy(host);
    free(text);
    return errors != 0;
}
