/* SPDX-License-Identifier: MIT */
#include "host.h"

#include "base/debug.h"
#include "hal/hal_step.h"
#include "machine/machine.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

struct hal {
    struct hal_step step;
    uint32_t timer_mhz_q8; /* ticks per us, 24.8 */
};

struct host {
    struct machine machine;
    struct hal hal;
    struct trace trace;
    uint64_t timer_events;
    int input_follows;
    char *out; /* what the controller said and nobody has read yet */
    size_t out_count, out_size;
};

uint32_t hal_time_us(const struct hal *hal) {
    return (uint32_t)((hal->step.now_ticks << 8) / hal->timer_mhz_q8);
}

void hal_spindle_set(struct hal *hal, int direction, float rpm) {
    (void)hal;
    (void)direction;
    (void)rpm;
}

void hal_coolant_set(struct hal *hal, uint8_t bits) {
    (void)hal;
    (void)bits;
}

void hal_inputs_read(const struct hal *hal, struct hal_inputs *inputs) {
    *inputs = (struct hal_inputs){.limit_min = 0x3F, .limit_max = 0x3F, .probe = !hal->step.probe};
}

void hal_debug(enum debug_channel channel, const char *what, int32_t first, int32_t second) {
    static const char *const names[] = {
        [DEBUG_MACHINE] = "machine", [DEBUG_MOTION] = "motion", [DEBUG_STEP] = "step"};
    fprintf(stderr, "%s: %s: %ld %ld\n", names[channel], what, (long)first, (long)second);
}

static void append_out(void *ctx, const char *bytes, size_t count) {
    struct host *host = ctx;
    if (host->out_count + count > host->out_size) {
        size_t size = 2 * (host->out_count + count);
        char *out = realloc(host->out, size);
        if (out == NULL)
            abort(); /* no memory for an answer: a line would go unanswered */
        host->out = out;
        host->out_size = size;
    }
    memcpy(host->out + host->out_count, bytes, count);
    host->out_count += count;
}

static int board_is_possible(const struct host_board *board) {
    return board->timer_hz >= 1000000 && board->timer_hz <= 100000000 && board->axis_count >= 1 &&
           board->axis_count <= AXIS_COUNT && board->step_pulse_ns >= 1 && board->step_pulse_ns <= 255000 &&
           board->max_step_rate_hz >= 1;
}

struct host *host_create(const struct host_board *board) {
    if (!board_is_possible(board))
        return NULL;
    struct host *host = calloc(1, sizeof *host);
    if (host == NULL)
        return NULL;
    const struct machine_board machine_board = {
        .timer_hz = board->timer_hz,
        .step_pulse_ns = board->step_pulse_ns,
        .dir_setup_ns = board->dir_setup_ns,
        .max_step_rate_hz = board->max_step_rate_hz,
        .axis_count = board->axis_count,
    };
    const struct text_out out = {.write = append_out, .ctx = host};
    host->input_follows = 1;
    host->hal.step.write = host->trace.events;
    host->hal.timer_mhz_q8 = (uint32_t)(((uint64_t)board->timer_hz << 8) / 1000000);
    machine_init(&host->machine, &machine_board, &host->hal, &host->hal.step, &out);
    return host;
}

void host_destroy(struct host *host) {
    if (host != NULL)
        free(host->out);
    free(host);
}

size_t host_write(struct host *host, const char *bytes, size_t count) {
    size_t taken = 0;
    while (taken < count && rx_put(&host->machine.rx, (uint8_t)bytes[taken]))
        taken++;
    return taken;
}

size_t host_read(struct host *host, char *bytes, size_t size) {
    size_t count = host->out_count < size ? host->out_count : size;
    memcpy(bytes, host->out, count);
    memmove(host->out, host->out + count, host->out_count - count);
    host->out_count -= count;
    return count;
}

/* Hand the events on that the ISR has written since. */
static void flush_trace(struct host *host) {
    host->trace.count = (size_t)(host->hal.step.write - host->trace.events);
    trace_flush(&host->trace);
    host->hal.step.write = host->trace.events;
}

/* Step events until half of the spans are used up, so that prep refills in batches. */
static void run_events(struct host *host, uint64_t *budget) {
    struct step *step = &host->machine.step;
    struct hal_step *hal = &host->hal.step;
    uint32_t held = ring_held(&step->ring.index);
    uint32_t enough = held > 2 ? held / 2 : held - 1; /* more may come behind the last span but one */
    do {
        hal->now_ticks = hal->alarm_ticks;
        step_isr(step);
        if (hal->write == &host->trace.events[TRACE_CHUNK])
            flush_trace(host);
        host->timer_events++;
    } while (--*budget != 0 && step->active && ring_held(&step->ring.index) > enough);
}

/* At rest, but moves wait for the start delay: jump there. */
static void jump_to_start(struct host *host) {
    uint64_t us = MOTION_START_DELAY_US;
    host->hal.step.now_ticks += (us * host->hal.timer_mhz_q8 >> 8) + 1;
}

static enum host_wait run(struct host *host, uint64_t max_events) {
    struct machine *machine = &host->machine;
    uint64_t budget = max_events;
    while (budget != 0) {
        bool any = machine_poll(machine);
        uint32_t room = rx_free(&machine->rx);
        if (host->input_follows && room == RX_SIZE && !plan_is_full(&machine->motion.plan))
            return machine->step.active ? HOST_ROOM : HOST_IDLE;
        if (machine->step.active)
            run_events(host, &budget);
        else if (machine->motion.waits)
            jump_to_start(host);
        else if (!any)
            return HOST_IDLE;
    }
    return HOST_BUDGET;
}

enum host_wait host_run(struct host *host, uint64_t max_events) {
    enum host_wait wait = run(host, max_events);
    flush_trace(host);
    return wait;
}

uint64_t host_time_ticks(const struct host *host) {
    return host->hal.step.now_ticks;
}

void host_position_steps(const struct host *host, int32_t steps[AXIS_COUNT]) {
    machine_position(&host->machine, steps);
}

void host_input_follows(struct host *host, int follows) {
    host->input_follows = follows;
    if (!follows)
        machine_input_pause(&host->machine);
}

struct trace *host_trace(struct host *host) {
    return &host->trace;
}

void host_counters(const struct host *host, struct host_counters *out) {
    const struct machine *machine = &host->machine;
    *out = (struct host_counters){
        .step_events = host->trace.total + host->trace.count,
        .timer_events = host->timer_events,
        .segments = machine->step.segments_done,
        .spans = machine->step.spans_done,
        .blocks = machine->motion.plan.blocks_total,
        .lines = machine->lines,
        .lookahead_starved = machine->motion.emit.starved,
        .underruns = machine->step.underruns,
    };
}

float host_feed_mm_s(const struct host *host) {
    return emit_speed_mm_s(&host->machine.motion.emit);
}

void host_steps_per_mm(const struct host *host, float out[AXIS_COUNT]) {
    memcpy(out, host->machine.settings.steps_per_mm, sizeof host->machine.settings.steps_per_mm);
}

size_t host_core_ram_bytes(void) {
    return sizeof(struct machine);
}
