/* SPDX-License-Identifier: MIT
 * Runs a program from stdin through the host controller and looks at the planner's pieces while it does.
 *
 * Usage: plan_law TRACE PART SETTING... < PROGRAM
 *
 * Every proven y is checked in double precision against the limits that docs/motion.md states. PART < 1: what
 * the backward pass found ahead is lowered to a random part of it, at least PART, behind the planner's back,
 * so that the forward pass meets a plan that it cannot follow. TRACE gets every step event. Prints JSON. */
#include "host.h"
#include "machine/parts.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define SLACK 1.0005 /* float32 against double */

static struct host_board board = {.timer_hz = 20000000,
                                  .step_pulse_ns = 500,
                                  .dir_setup_ns = 500,
                                  .max_step_rate_hz = 900000,
                                  .axis_count = 3};
static unsigned checked, wrong, lowered;
static uint32_t lowered_to; /* pieces below it had their turn */
static double least_part;

static double random_part(void) {
    static uint64_t state = 88172645463325252u;
    state ^= state << 13;
    state ^= state >> 7;
    state ^= state << 17;
    return least_part + (1.0 - least_part) * (double)(state >> 40) / (double)(1u << 24);
}

/* Can ya become some yb in 0 .. most within half a blend? q is the gain of (yb - ya) at both ends. */
static bool is_possible(const struct piece *piece, const struct piece *next, const vec *accel, double ya,
                        double most, const double q[2][2]) {
    double least = 0.0, greatest = most;
    for (unsigned ax = 0; ax < 3; ax++)
        for (int end = 0; end < 2; end++) {
            double u0 = (double)piece->unit[ax], du = (double)next->unit[ax] - u0;
            double bound = 4.0 * (double)piece->tangent_mm * (double)(*accel)[ax] * SLACK;
            double bend = 2.0 * du * ya, gain = q[end][0] * u0 + q[end][1] * du,
                   rounding = 1e-6 * ya * fabs(gain);
            bound += rounding;
            if (gain == 0.0) {
                greatest = fabs(bend) > bound ? -1.0 : greatest;
                continue;
            }
            double a = (-bound - bend) / gain + ya, b = (bound - bend) / gain + ya;
            least = fmax(least, fmin(a, b));
            greatest = fmin(greatest, fmax(a, b));
        }
    return least <= greatest * SLACK;
}

/* With s = 2 (yb - ya): the direction at the start of a half, and that at its end plus what y gained. */
static const double FIRST[2][2] = {{2.0, 0.0}, {2.0, 3.0}}, SECOND[2][2] = {{2.0, 1.0}, {2.0, 4.0}};

static void check(bool good, const char *what, uint32_t piece) {
    checked++;
    if (!good && ++wrong <= 5)
        fprintf(stderr, "piece %u: %s\n", (unsigned)piece, what);
}

static void check_plan(struct path *path, const struct timing *timing) {
    for (uint32_t i = path->tail; i + 1 < path->head && i + 1 < timing->known; i++) {
        const struct piece *piece = path_piece(path, i), *next = path_piece(path, i + 1);
        double before_mm = (double)path_piece(path, i - 1)->tangent_mm;
        double line_mm = fmax((double)piece->length_mm - (double)piece->tangent_mm - before_mm, 0.0);
        double reach = (double)piece->blend_y + 2.0 * (double)piece->accel_mm_s2 * line_mm;
        check((double)piece->enter_y <= reach * SLACK, "starts faster than it can slow down", i);
        if (piece->tangent_mm == 0.0f) {
            check(piece->blend_y == 0.0f, "passes a stop", i);
            continue;
        }
        double blend_y = (double)piece->blend_y, middle_y = (double)piece->middle_y;
        check(is_possible(piece, next, &path->accel, blend_y, middle_y, FIRST), "first half", i);
        check(is_possible(piece, next, &path->accel, middle_y, (double)next->enter_y, SECOND), "second half",
              i);
    }
}

/* Not the piece under way nor the next one: of these the forward pass has used what was there. */
static void lower_plan(struct path *path, const struct timing *timing) {
    if ((int32_t)(lowered_to - path->tail) < 2)
        lowered_to = path->tail + 2;
    for (; (int32_t)(timing->known - lowered_to) > 1; lowered_to++) {
        struct piece *piece = path_piece(path, lowered_to);
        float part = (float)random_part();
        piece->enter_y *= part;
        piece->blend_y *= part;
        piece->middle_y *= part;
        lowered++;
    }
}

static void look(struct host *host) {
    struct machine *machine = (struct machine *)(uintptr_t)host_machine(host);
    struct plan *plan = &machine->drive.motion.plan;
    if (least_part < 1.0)
        lower_plan(&plan->path, &plan->timing);
    else
        check_plan(&plan->path, &plan->timing);
}

static void write_events(void *ctx, const struct trace_event *events, size_t count) {
    if (fwrite(events, sizeof *events, count, ctx) != count)
        exit(1);
}

static void run(struct host *host, const char *text, size_t size) {
    char answers[4096];
    for (size_t done = 0;;) {
        done += host_write(host, text + done, size - done);
        host_input_follows(host, done < size);
        enum host_wait wait = host_run(host, 20);
        look(host);
        while (host_read(host, answers, sizeof answers) > 0)
            ;
        if (wait == HOST_IDLE && done == size)
            return;
    }
}

int main(int argc, char **argv) {
    static char text[1 << 20];
    struct host *host = host_create(&board);
    FILE *trace = argc > 2 ? fopen(argv[1], "wb") : NULL;
    if (host == NULL || trace == NULL)
        return 2;
    least_part = 1.0;
    for (int n = 3; n < argc; n++) {
        run(host, argv[n], strlen(argv[n]));
        run(host, "\n", 1);
    }
    least_part = strtod(argv[2], NULL);
    (void)trace_add(host_trace(host), write_events, trace);
    run(host, text, fread(text, 1, sizeof text, stdin));
    trace_flush(host_trace(host));
    struct host_counters counters;
    int32_t position[AXIS_COUNT];
    host_counters(host, &counters);
    host_position_steps(host, position);
    printf("{\"checked\": %u, \"wrong\": %u, \"lowered\": %u, \"unmet\": %llu, \"position\": [%d, %d, %d]}\n",
           checked, wrong, lowered, (unsigned long long)counters.plan_unmet, (int)position[0],
           (int)position[1], (int)position[2]);
    host_destroy(host);
    return fclose(trace);
}
