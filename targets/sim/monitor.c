/* SPDX-License-Identifier: MIT */
#include "monitor.h"

#include "host_inner.h"

#include "input/line_reader.h"
#include "input/text_byte.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { SAID_SIZE = 160, FOUND_SIZE = 240, AHEAD_MAX = 1 << 12 };

#define WINDOWS_A_S   100u /* of 10 ms */
#define SLOWEST_S     120u /* from step to step, or to an answer */
#define RESET_SLOWEST 2u   /* s: the quiet time of an alarm, and what is reported then */
#define ANSWER_S      0.1
#define ACCEL_FACTOR  1.2
#define RATE_FACTOR   1.01
#define GRAIN_STEPS                                                                                          \
    4.0 /* of a second difference of rounded positions, of an axis that steps with another                   \
         */

enum answer { ANSWER_ANY, ANSWER_OK, ANSWER_TOO_LONG };

/* Whether a hold may end. */
struct leave {
    bool granted;          /* a resume has come behind the newest stop */
    bool resumed, stopped; /* by a byte, since the controller looked; the newest of them counts */
    uint8_t stops;         /* that the controller had counted */
    uint32_t banners;      /* ... and said */
    uint8_t pressed;       /* ... and seen of buttons, enum press bits */
    bool remote;           /* ... whether motion was a remote host's */
};

/* Positions of an axis at the ends of the last windows. */
struct windows {
    uint64_t number; /* of the present one */
    uint32_t valid;  /* ends of windows known */
    int32_t at[3][AXIS_COUNT];
};

struct monitor {
    struct host *host;
    uint32_t checks;
    char found[FOUND_SIZE];
    int32_t pulses[AXIS_COUNT], offset[AXIS_COUNT];
    uint64_t steps, looked_steps; /* events seen; at the last look */
    /* lines */
    struct line_reader model;
    uint8_t text_left; /* as that of struct rx */
    uint8_t expected[AHEAD_MAX];
    uint32_t sent, answered, banners, reports;
    bool lossy;
    char said[SAID_SIZE];
    size_t said_count;
    /* at the last look */
    const struct trace_event *write;
    enum machine_state state;
    bool critical, estop;
    struct leave leave;
    /* limits */
    struct windows windows;
    float steps_per_mm[AXIS_COUNT], accel_mm_s2[AXIS_COUNT], rate_mm_min[AXIS_COUNT];
    /* liveness */
    uint64_t further_ticks, seen_steps;
    uint32_t seen_answered;
};

static void found(struct monitor *monitor, const char *format, ...) {
    char text[FOUND_SIZE / 2];
    va_list arguments;
    /* Only the first: what follows is often its consequence. */
    if (monitor->found[0] != '\0')
        return;
    va_start(arguments, format);
    vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    double t_s = (double)monitor->host->hal.step.now_ticks / monitor->host->hal.timer_hz;
    snprintf(monitor->found, sizeof monitor->found, "at %.6f s in %s: %s", t_s, host_state(monitor->host),
             text);
}

/* ---- limits ---- */

static void forget_windows(struct monitor *monitor) {
    monitor->windows.valid = 0;
}

/* Alarms cut motion off, threads follow the spindle, a network host plans by itself, motors are not axes. */
static bool is_exempt(const struct monitor *monitor) {
    const struct machine *machine = &monitor->host->machine;
    return machine->life.critical || machine->life.restart || machine->life.state == MACHINE_ALARM ||
           machine->host.owns || machine->task.stage == TASK_THREAD ||
           machine->settings.kinematics != KINEMATICS_CARTESIAN;
}

/* First and second differences of the position at the ends of three windows: speed and acceleration, in
 * steps per window and per window squared. */
static void check_axis(struct monitor *monitor, unsigned ax) {
    const struct windows *w = &monitor->windows;
    const double window_s = 1.0 / WINDOWS_A_S, per_mm = (double)monitor->steps_per_mm[ax];
    double way = w->at[2][ax] - w->at[1][ax], before = w->at[1][ax] - w->at[0][ax];
    double most_way = (double)monitor->rate_mm_min[ax] / 60.0 * per_mm * window_s;
    double most_change = (double)monitor->accel_mm_s2[ax] * per_mm * window_s * window_s;
    if (fabs(way) > most_way * RATE_FACTOR + GRAIN_STEPS)
        found(monitor, "axis %u makes %.0f steps in 10 ms, its rate allows %.1f", ax, fabs(way), most_way);
    if (fabs(way - before) > most_change * ACCEL_FACTOR + GRAIN_STEPS)
        found(monitor,
              "axis %u changes its speed by %.0f steps per 10 ms in 10 ms, its acceleration allows %.1f", ax,
              fabs(way - before), most_change);
}

static void end_window(struct monitor *monitor) {
    struct windows *w = &monitor->windows;
    memmove(w->at[0], w->at[1], sizeof w->at[0] * 2);
    memcpy(w->at[2], monitor->pulses, sizeof w->at[2]);
    w->valid += w->valid < 3;
    if (w->valid == 3 && (monitor->checks & MONITOR_LIMITS) != 0)
        for (unsigned ax = 0; ax < AXIS_COUNT; ax++)
            check_axis(monitor, ax);
    w->number++;
}

/* All windows that end before this time. */
static void pass_windows(struct monitor *monitor, uint64_t t_ticks) {
    struct windows *w = &monitor->windows;
    uint64_t number = t_ticks * WINDOWS_A_S / monitor->host->hal.timer_hz;
    for (unsigned n = 0; n < 3 && w->number < number; n++)
        end_window(monitor);
    w->number = number;
}

/* A window in which the limits changed would be judged by the wrong ones. */
static bool limits_changed(struct monitor *monitor) {
    const struct settings *now = &monitor->host->machine.settings;
    bool same = memcmp(monitor->steps_per_mm, now->steps_per_mm, sizeof monitor->steps_per_mm) == 0 &&
                memcmp(monitor->accel_mm_s2, now->acceleration_mm_s2, sizeof monitor->accel_mm_s2) == 0 &&
                memcmp(monitor->rate_mm_min, now->max_rate_mm_min, sizeof monitor->rate_mm_min) == 0;
    memcpy(monitor->steps_per_mm, now->steps_per_mm, sizeof monitor->steps_per_mm);
    memcpy(monitor->accel_mm_s2, now->acceleration_mm_s2, sizeof monitor->accel_mm_s2);
    memcpy(monitor->rate_mm_min, now->max_rate_mm_min, sizeof monitor->rate_mm_min);
    return !same;
}

/* ---- pulses ---- */

/* Everything the ISR has written since the last time. */
static void take_events(struct monitor *monitor) {
    const struct trace_event *end = monitor->host->hal.step.write;
    for (; monitor->write != end; monitor->write++) {
        pass_windows(monitor, monitor->write->t_ticks);
        monitor->steps++;
        for (unsigned ax = 0; ax < AXIS_COUNT; ax++)
            if ((monitor->write->step_mask >> ax & 1) != 0)
                monitor->pulses[ax] += (monitor->write->dir_mask >> ax & 1) != 0 ? -1 : 1;
    }
}

/* The chunk is handed on and begins again. */
static void take_chunk(void *ctx, const struct trace_event *events, size_t count) {
    struct monitor *monitor = ctx;
    (void)count;
    take_events(monitor);
    monitor->write = events;
}

static void check_counter(struct monitor *monitor) {
    int32_t steps[AXIS_COUNT];
    host_position_steps(monitor->host, steps);
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++) {
        int32_t want =
            monitor->pulses[ax] + monitor->host->machine.trust.shift_steps[ax] + monitor->offset[ax];
        if (steps[ax] != want)
            found(monitor, "axis %u counts %ld, its pulses make %ld", ax, (long)steps[ax], (long)want);
    }
}

/* ---- a look of the controller ---- */

static bool is_off(const struct virtual_outputs *outputs) {
    return outputs->spindle_direction == 0 && outputs->spindle_duty == 0 && outputs->coolant == 0;
}

static void check_state(struct monitor *monitor, bool stepped) {
    const struct machine *machine = &monitor->host->machine;
    bool dead =
        monitor->state == MACHINE_ALARM || monitor->state == MACHINE_SLEEP || monitor->state == MACHINE_CHECK;
    if (stepped && (dead || monitor->critical || monitor->estop))
        found(monitor, "a step%s", monitor->estop ? " with the e-stop pressed" : " where nothing may move");
    bool off = machine->life.critical || machine->life.state == MACHINE_SLEEP;
    if (off && !machine->life.restart && !is_off(&monitor->host->hal.outputs_set))
        found(monitor, "spindle or coolant is on");
}

/* When the controller has looked: the rule of docs/laser.md. */
static void check_beam(struct monitor *monitor) {
    const struct machine *machine = &monitor->host->machine;
    const unsigned cut = SEGMENT_CUT, kinds = cut | SEGMENT_DWELL;
    const struct virtual_outputs *set = &monitor->host->hal.outputs_set;
    if (!machine->settings.laser_mode || set->spindle_duty == 0)
        return;
    unsigned aim_pct = machine->settings.aim_power_pct;
    if (machine->life.state == MACHINE_IDLE && aim_pct > 0 &&
        duty_power(&machine->drive.prep.timing.curve, set->spindle_duty) <= DUTY_FULL * aim_pct / 100 + 1)
        return;
    if (machine->life.state != MACHINE_RUN && machine->life.state != MACHINE_HOLD)
        found(monitor, "the beam is on");
    else if (!machine->drive.step.active || (monitor->host->hal.step.tag >> 16 & kinds) != cut)
        found(monitor, "the beam is on and nothing is cut");
}

/* What waits for something with a name: a person, a time, an input. */
static bool waits_by_name(const struct machine *machine) {
    return machine->life.critical || machine->life.state == MACHINE_HOLD ||
           machine->life.state == MACHINE_DOOR || machine->life.state == MACHINE_ALARM ||
           machine->life.state == MACHINE_SLEEP || machine->task.stage == TASK_PAUSED ||
           machine->task.stage == TASK_TOOL_WAIT || machine->task.stage == TASK_DWELLING ||
           machine->task.stage == TASK_DWELL || machine->task.stage == TASK_THREAD ||
           machine->clock.timer.on || machine->host.owns;
}

static void check_liveness(struct monitor *monitor) {
    const struct machine *machine = &monitor->host->machine;
    uint64_t now = monitor->host->hal.step.now_ticks;
    bool owes = monitor->answered != monitor->sent || machine->drive.step.active;
    bool further = monitor->steps != monitor->seen_steps || monitor->answered != monitor->seen_answered;
    if (further || !owes || waits_by_name(machine))
        monitor->further_ticks = now;
    monitor->seen_steps = monitor->steps;
    monitor->seen_answered = monitor->answered;
    if (now - monitor->further_ticks > (uint64_t)SLOWEST_S * monitor->host->hal.timer_hz)
        found(monitor, "nothing has happened for %u s, and %lu lines wait", SLOWEST_S,
              (unsigned long)(monitor->sent - monitor->answered));
}

enum press { PRESS_START = 1, PRESS_STOP = 2 };

static uint8_t pressed(const struct monitor *monitor) {
    static const uint64_t stops =
        1ull << VIRTUAL_DOOR | 1ull << VIRTUAL_ESTOP | 1ull << VIRTUAL_HOLD | 1ull << VIRTUAL_RESET;
    const uint64_t levels = monitor->host->hal.virtual_machine.levels;
    return (uint8_t)(((levels >> VIRTUAL_START & 1) != 0 ? PRESS_START : 0) |
                     ((levels & stops) != 0 ? PRESS_STOP : 0));
}

static bool is_held(enum machine_state state) {
    return state == MACHINE_HOLD || state == MACHINE_DOOR;
}

/* A remote host lets a job continue that it has interrupted before it moves itself. */
static bool is_remote(const struct machine *machine) {
    return machine->host.owns || machine->host.job.step == HOST_JOB_BRAKES;
}

/* Which of a button and a byte came first is not known: a stop counts. What else the controller counts, a
 * lost sender, it has done before it looked at the button. */
static void see_stops(struct monitor *monitor) {
    struct leave *leave = &monitor->leave;
    const struct machine *machine = &monitor->host->machine;
    const uint8_t now = pressed(monitor), fresh = now & (uint8_t)~leave->pressed;
    if ((fresh & PRESS_STOP) != 0 || (leave->stops != machine->suspend.stops && !leave->resumed))
        leave->granted = false;
    if ((fresh & (PRESS_START | PRESS_STOP)) == PRESS_START && !leave->stopped)
        leave->granted = true;
    leave->pressed = now;
    leave->stops = machine->suspend.stops;
}

static void check_stops(struct monitor *monitor) {
    struct leave *leave = &monitor->leave;
    const struct machine *machine = &monitor->host->machine;
    const enum machine_state now = machine->life.state;
    const bool left = is_held(monitor->state) && (now == MACHINE_IDLE || now == MACHINE_RUN);
    const bool remote = is_remote(machine),
               reset = machine->life.restart || leave->banners != monitor->banners;
    see_stops(monitor);
    if (left && !leave->granted && !reset && !remote && !leave->remote)
        found(monitor, "a hold has ended, and no resume came behind the last stop");
    if (is_held(now) && !is_held(monitor->state)) /* a ~ from before it was none */
        leave->granted = leave->resumed;
    leave->resumed = leave->stopped = false;
    leave->banners = monitor->banners;
    leave->remote = remote;
}

/* In the ESP32's periods. */
static void check_rests(struct monitor *monitor) {
    const uint32_t rounds = tasks_rounds_over(&monitor->host->tasks);
    if (rounds > 0)
        found(monitor, "a task has worked %u rounds without a rest", (unsigned)rounds);
}

static void looked(void *ctx, bool controller) {
    struct monitor *monitor = ctx;
    const struct machine *machine = &monitor->host->machine;
    take_events(monitor);
    if ((monitor->checks & MONITOR_STATE) != 0)
        check_state(monitor, monitor->steps != monitor->looked_steps);
    monitor->looked_steps = monitor->steps;
    if ((monitor->checks & MONITOR_COUNTER) != 0)
        check_counter(monitor);
    if (controller && (monitor->checks & MONITOR_BEAM) != 0)
        check_beam(monitor);
    if (controller && (monitor->checks & MONITOR_STOPS) != 0)
        check_stops(monitor);
    if ((monitor->checks & MONITOR_LIVENESS) != 0)
        check_liveness(monitor);
    check_rests(monitor);
    if (limits_changed(monitor) || is_exempt(monitor))
        forget_windows(monitor);
    monitor->state = machine->life.state;
    monitor->critical = machine->life.critical;
    struct hal_inputs inputs;
    hal_inputs_read(&monitor->host->hal, &inputs);
    monitor->estop = inputs.estop;
}

/* ---- lines ---- */

/* A packet may be a resume: what it is, its own tests look at. */
static void asked(void *ctx) {
    struct monitor *monitor = ctx;
    monitor->leave.granted = monitor->leave.resumed = true;
}

static void put_realtime(struct monitor *monitor, uint8_t byte) {
    struct leave *leave = &monitor->leave;
    const bool stops = byte == '!' || byte == 0x84 || byte == 0x85 || byte == 0x18;
    if (!stops && byte != '~')
        return;
    leave->granted = leave->resumed = !stops;
    leave->stopped |= stops;
}

static void put(void *ctx, uint8_t byte, bool lossy) {
    struct monitor *monitor = ctx;
    if (!text_byte(&monitor->text_left, &byte))
        return;
    put_realtime(monitor, byte);
    if (byte == 0xA3) { /* the operator's lines are answered before those that wait */
        monitor->lossy = true;
        memset(monitor->expected, ANSWER_ANY, sizeof monitor->expected);
    }
    if (byte >= 0x80 || byte == 0x18 || byte == '?' || byte == '!' || byte == '~')
        return; /* taken out before the lines */
    /* Once bytes may be lost it is not known any more which line an answer belongs to: then only their
     * number counts. */
    monitor->lossy |= lossy;
    enum line_result result = line_reader_put(&monitor->model, byte);
    if (result == LINE_NONE)
        return;
    bool empty = result == LINE_READY && monitor->model.text[0] == '\0';
    uint8_t answer = result == LINE_OVERFLOW ? ANSWER_TOO_LONG : empty ? ANSWER_OK : ANSWER_ANY;
    monitor->expected[monitor->sent++ % AHEAD_MAX] = monitor->lossy ? ANSWER_ANY : answer;
}

static void take_answer(struct monitor *monitor, const char *line) {
    if (monitor->answered == monitor->sent) {
        found(monitor, "an answer without a line: %s", line);
        return;
    }
    uint8_t expected = monitor->expected[monitor->answered++ % AHEAD_MAX];
    if ((expected == ANSWER_OK && strcmp(line, "ok") != 0) ||
        (expected == ANSWER_TOO_LONG && strcmp(line, "error:11") != 0))
        found(monitor, "an answer out of order: %s", line);
}

static void take_said(struct monitor *monitor, const char *line) {
    if (strcmp(line, "ok") == 0 || strncmp(line, "error:", 6) == 0) {
        take_answer(monitor, line);
    } else if (strncmp(line, "Grbl ", 5) == 0) {
        monitor->banners++;
        /* With the banner all lines on their way are over; none of them is answered any more. */
        monitor->answered = monitor->sent;
        line_reader_reset(&monitor->model);
    } else if (line[0] == '<') {
        monitor->reports++;
        if (strstr(line, "nan") != NULL || strstr(line, "inf") != NULL)
            found(monitor, "a report without numbers: %s", line);
    }
}

static void said(void *ctx, const char *bytes, size_t count) {
    struct monitor *monitor = ctx;
    for (size_t n = 0; n < count; n++) {
        if (bytes[n] == '\n') {
            monitor->said[monitor->said_count] = '\0';
            monitor->said_count = 0;
            if ((monitor->checks & MONITOR_ANSWERS) != 0)
                take_said(monitor, monitor->said);
        } else if (bytes[n] != '\r' && monitor->said_count < SAID_SIZE - 1) {
            monitor->said[monitor->said_count++] = bytes[n];
        }
    }
}

static void dropped(void *ctx, uint32_t lines) {
    struct monitor *monitor = ctx;
    monitor->sent -= lines;
}

/* ---- the monitor ---- */

struct monitor *monitor_create(struct host *host, uint32_t checks) {
    struct monitor *monitor = calloc(1, sizeof *monitor);
    if (monitor == NULL)
        return NULL;
    if (!trace_add(&host->trace, take_chunk, monitor)) {
        free(monitor);
        return NULL;
    }
    monitor->host = host;
    monitor->checks = checks;
    monitor->write = host->hal.step.write;
    monitor->state = host->machine.life.state;
    monitor->further_ticks = host->hal.step.now_ticks;
    line_reader_reset(&monitor->model);
    host_position_steps(host, monitor->offset);
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++)
        monitor->offset[ax] -= host->machine.trust.shift_steps[ax];
    host->observer = (struct host_observer){
        .ctx = monitor, .looked = looked, .put = put, .asked = asked, .said = said, .dropped = dropped};
    return monitor;
}

void monitor_destroy(struct monitor *monitor) {
    if (monitor != NULL)
        monitor->host->observer = (struct host_observer){0};
    free(monitor);
}

const char *monitor_found(struct monitor *monitor) {
    take_events(monitor);
    return monitor->found[0] != '\0' ? monitor->found : NULL;
}

static void release_all(struct monitor *monitor) {
    struct host *host = monitor->host;
    const struct host_random_stalls none = {.longest_ms = 1};
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++)
        virtual_no_travel(host, ax);
    virtual_no_surface(host);
    for (int input = 0; input < VIRTUAL_INPUT_COUNT; input++)
        virtual_set(host, input, false);
    virtual_set(host, VIRTUAL_ESTOP, host->machine.settings.estop_normally_open); /* its contact rests */
    host_stall_randomly(host, &none);
}

static bool pass_until(struct monitor *monitor, const uint32_t *count, uint32_t want, double seconds) {
    struct host *host = monitor->host;
    uint64_t slice = host->hal.timer_hz / 1000,
             end = host_time_ticks(host) + (uint64_t)(seconds * host->hal.timer_hz);
    while (*count < want && host_time_ticks(host) < end)
        (void)host_run_until(host, host_time_ticks(host) + slice);
    return *count >= want;
}

const char *monitor_end(struct monitor *monitor) {
    struct host *host = monitor->host;
    release_all(monitor);
    uint64_t stalled = tasks_stalls_end(&host->tasks);
    /* No more lines come: what waits in the look-ahead may run. */
    host_input_follows(host, 0);
    (void)host_run_until(host, stalled);
    (void)host_write(host, "\x18", 1);
    if (!pass_until(monitor, &monitor->banners, monitor->banners + 1, RESET_SLOWEST))
        found(monitor, "a reset without a banner");
    (void)host_write(host, "?", 1);
    if (!pass_until(monitor, &monitor->reports, monitor->reports + 1, ANSWER_S))
        found(monitor, "no report after a reset");
    return monitor_found(monitor);
}
