/* SPDX-License-Identifier: MIT */
#include "host_inner.h"
#include "host_store.h"

#include <stdlib.h>
#include <string.h>

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
           board->max_step_rate_hz >= 1 && board->digital_inputs <= DIGITAL_INPUT_COUNT &&
           board->digital_outputs <= OUTPUT_COUNT;
}

struct host *host_create(const struct host_board *board) {
    return host_open(board, NULL);
}

struct host *host_open(const struct host_board *board, const char *store_path) {
    if (!board_is_possible(board))
        return NULL;
    struct host *host = calloc(1, sizeof *host);
    if (host == NULL)
        return NULL;
    if (store_path != NULL && (host->store_path = strdup(store_path)) == NULL) {
        free(host);
        return NULL;
    }
    const struct machine_board machine_board = {
        .timer_hz = board->timer_hz,
        .step_pulse_ns = board->step_pulse_ns,
        .dir_setup_ns = board->dir_setup_ns,
        .max_step_rate_hz = board->max_step_rate_hz,
        .axis_count = board->axis_count,
        .home_axes = board->home_axes,
        .motors_wake_us = board->motors_wake_us,
        .relay_spindle = board->relay_spindle != 0,
        .digital_inputs = board->digital_inputs,
        .digital_outputs = board->digital_outputs,
        .encoder = board->encoder != 0 ? &host_encoder : NULL,
        .servo = &host_servo,
        .analog = board->analog != 0 ? &host_analog : NULL,
        .ganged = board->ganged != 0 ? &host->hal.ganged : NULL,
        .store = store_path != NULL ? &host_store : NULL,
        .store_ctx = host->store_path,
    };
    const struct text_out out = {.write = append_out, .ctx = host};
    host->input_follows = 1;
    host->hal.ganged = (struct hal_ganged){.axes = board->ganged, .hold = virtual_hold_motors};
    host->hal.virtual_machine.ganged = board->ganged;
    host->hal.settings = &host->machine.settings;
    host->hal.step.write = host->trace.events;
    host->seen = host->trace.events;
    host->hal.timer_hz = board->timer_hz;
    host->hal.switch_ticks = UINT64_MAX;
    host->hal.timer_mhz_q8 = (uint32_t)(((uint64_t)board->timer_hz << 8) / 1000000);
    machine_init(&host->machine, &machine_board, &host->hal, &host->hal.step, &out);
    return host;
}

void host_destroy(struct host *host) {
    if (host != NULL) {
        free(host->out);
        free(host->store_path);
    }
    free(host);
}

size_t host_write(struct host *host, const char *bytes, size_t count) {
    size_t taken = 0;
    while (taken < count && rx_put(&host->machine.rx, (uint8_t)bytes[taken]))
        taken++;
    return taken;
}

void host_write_or_lose(struct host *host, const char *bytes, size_t count) {
    while (count-- > 0)
        rx_put_or_lose(&host->machine.rx, (uint8_t)*bytes++);
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
    host->seen = host->trace.events;
}

/* Step events until half of the spans are used up, so that prep refills in batches; a time is reached; or an
 * input changes. */
static void run_events(struct host *host, uint64_t *budget, uint64_t until_ticks) {
    struct step *step = &host->machine.step;
    struct hal_step *hal = &host->hal.step;
    const bool follows = host->hal.virtual_machine.follows;
    uint32_t held = ring_held(&step->ring.index);
    uint32_t enough = held > 2 ? held / 2 : held - 1; /* more may come behind the last span but one */
    do {
        if (hal->alarm_ticks > until_ticks) {
            hal->now_ticks = until_ticks;
            return;
        }
        hal->now_ticks = hal->alarm_ticks;
        step_isr(step);
        bool changed = follows && host_follow_edges(host);
        if (hal->write == &host->trace.events[TRACE_CHUNK])
            flush_trace(host);
        host->timer_events++;
        if (changed) {
            --*budget;
            return;
        }
    } while (--*budget != 0 && step->active && ring_held(&step->ring.index) > enough);
}

/* Where the planner's newest segment ends. A fraction of 1/2 is exactly on a step. */
static void planned_steps(const struct emit *emit, double steps[AXIS_COUNT]) {
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++)
        steps[ax] = emit->steps[ax] + emit->fraction[ax] / 256.0 - 0.5;
}

static double way_steps(const struct segment *segment, unsigned ax) {
    double phases = (segment->phase_end[ax] - segment->phase[ax]) / 256.0;
    return segment->steps[ax] < 0 ? segment->steps[ax] - phases : segment->steps[ax] + phases;
}

/* The segments that the last poll has put into the ring; what was stepped meanwhile is still in its slot. */
static void show_segments(struct host *host) {
    const struct segment_ring *ring = &host->machine.motion.ring;
    struct host_segment moved;
    if (host->watch == NULL || host->watched == ring->index.head)
        return;
    planned_steps(&host->machine.motion.emit, moved.from_steps);
    for (uint32_t i = host->watched; i != ring->index.head; i++)
        for (unsigned ax = 0; ax < AXIS_COUNT; ax++)
            moved.from_steps[ax] -= way_steps(&ring->slots[i & (SEGMENT_RING_SIZE - 1)], ax);
    for (; host->watched != ring->index.head; host->watched++) {
        moved.segment = &ring->slots[host->watched & (SEGMENT_RING_SIZE - 1)];
        for (unsigned ax = 0; ax < AXIS_COUNT; ax++)
            moved.to_steps[ax] = moved.from_steps[ax] + way_steps(moved.segment, ax);
        host->watch(host->watch_ctx, &moved);
        memcpy(moved.from_steps, moved.to_steps, sizeof moved.from_steps);
    }
}

/* When the controller wants to be polled although nothing happens, or UINT64_MAX. */
static uint64_t wake_ticks(const struct host *host) {
    uint64_t us = machine_wait_us(&host->machine);
    if (us == UINT32_MAX)
        return UINT64_MAX;
    return host->hal.step.now_ticks + (us * host->hal.timer_mhz_q8 >> 8) + 1;
}

static uint64_t earlier(uint64_t a, uint64_t b) {
    return a < b ? a : b;
}

/* @param waits  also with nothing to do, time goes on to its end */
static enum host_wait run(struct host *host, uint64_t max_events, uint64_t until_ticks, bool waits) {
    struct machine *machine = &host->machine;
    struct hal_step *hal = &host->hal.step;
    uint64_t budget = max_events;
    while (budget != 0) {
        bool any = host_follow_edges(host);
        any |= machine_poll(machine);
        show_segments(host);
        bool all_read = !host->paced && rx_free(&machine->rx) == RX_SIZE && machine->stage == TASK_NONE;
        if (all_read && !host->input_follows)
            machine_input_pause(machine);
        if (all_read && host->input_follows && motion_has_room(&machine->motion))
            return machine->step.active ? HOST_ROOM : HOST_IDLE;
        if (hal->now_ticks >= until_ticks)
            return HOST_TIME;
        uint64_t next = host_next_edge_ticks(host);
        if (machine->step.active) {
            run_events(host, &budget, earlier(next, until_ticks));
            continue;
        }
        if (any)
            continue;
        next = earlier(next, wake_ticks(host));
        if (next == UINT64_MAX && !waits)
            return HOST_IDLE;
        hal->now_ticks = earlier(next, until_ticks);
    }
    return HOST_BUDGET;
}

enum host_wait host_run(struct host *host, uint64_t max_events) {
    return host_run_before(host, max_events, UINT64_MAX);
}

enum host_wait host_run_before(struct host *host, uint64_t max_events, uint64_t t_ticks) {
    enum host_wait wait = run(host, max_events, t_ticks, false);
    flush_trace(host);
    return wait;
}

enum host_wait host_run_until(struct host *host, uint64_t t_ticks) {
    enum host_wait wait = run(host, UINT64_MAX, t_ticks, true);
    flush_trace(host);
    return wait;
}

enum host_wait host_run_paced(struct host *host, uint64_t t_ticks, uint64_t max_events) {
    host->paced = true;
    enum host_wait wait = run(host, max_events, t_ticks, true);
    host->paced = false;
    flush_trace(host);
    return wait;
}

uint64_t host_next_ticks(const struct host *host) {
    if (host->machine.step.active)
        return host->hal.step.now_ticks;
    return earlier(wake_ticks(host), host_next_edge_ticks(host));
}

uint64_t host_time_ticks(const struct host *host) {
    return host->hal.step.now_ticks;
}

const char *host_state(const struct host *host) {
    return machine_state_text(&host->machine);
}

bool host_is_paused(const struct host *host) {
    return host->machine.stage == TASK_PAUSED;
}

void host_position_steps(const struct host *host, int32_t steps[AXIS_COUNT]) {
    machine_position(&host->machine, steps);
}

void host_shift_steps(const struct host *host, int32_t steps[AXIS_COUNT]) {
    memcpy(steps, host->machine.shift_steps, sizeof host->machine.shift_steps);
}

void host_watch_segments(struct host *host, host_segment_watcher *watch, void *ctx) {
    host->watch = watch;
    host->watch_ctx = ctx;
    host->watched = host->machine.motion.ring.index.head;
}

const struct machine *host_machine(const struct host *host) {
    return &host->machine;
}

bool host_take_move(struct host *host, struct gcode_move *out) {
    struct gcode_move *move = &host->machine.command.move;
    *out = *move;
    move->motion = MOTION_NONE;
    return out->motion != MOTION_NONE;
}

void host_input_follows(struct host *host, int follows) {
    host->input_follows = follows;
}

struct trace *host_trace(struct host *host) {
    return &host->trace;
}

void host_counters(const struct host *host, struct host_counters *out) {
    const struct machine *machine = &host->machine;
    *out = (struct host_counters){
        .step_events = host->trace.total + host->trace.count,
        .timer_events = host->timer_events,
        .segments = machine->prep.segments,
        .spans = machine->step.spans_done,
        .blocks = machine->motion.plan.moves_total,
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

void host_lock(struct host *host) {
    machine_lock(&host->machine);
}

size_t host_core_ram_bytes(void) {
    return sizeof(struct machine);
}
