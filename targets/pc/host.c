/* SPDX-License-Identifier: MIT */
#include "host_inner.h"
#include "host_store.h"

#include <stdlib.h>
#include <string.h>

static uint64_t earlier(uint64_t a, uint64_t b) {
    return a < b ? a : b;
}

static void append_out(void *ctx, const char *bytes, size_t count) {
    struct host *host = ctx;
    if (host->observer.said != NULL)
        host->observer.said(host->observer.ctx, bytes, count);
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
           board->digital_outputs <= OUTPUT_COUNT && board->tasks <= HOST_TASKS_PIC32MZ &&
           (board->look_ahead == 0 ||
            (board->look_ahead >= HOST_LOOK_AHEAD_MIN && board->look_ahead <= PLAN_SIZE)) &&
           board->laser_marks <= POWER_MARKS && board->restart <= HAL_RESTART_UNKNOWN;
}

static void run_events(struct host *host, uint64_t *budget, uint64_t until_ticks, bool refills);

/* What the task side wants done between two looks of the motion side: it waits until that one looks. */
static void call_motion(const void *ctx, void (*work)(void *arg), void *arg) {
    struct host *host = (struct host *)(uintptr_t)ctx;
    struct hal_step *hal = &host->hal.step;
    uint64_t end, budget = UINT64_MAX;
    while ((end = tasks_stalled_until(&host->tasks, HOST_MOTION, hal->now_ticks)) > hal->now_ticks) {
        end = earlier(end, host_next_edge_ticks(host));
        if (host->machine.drive.step.active)
            run_events(host, &budget, end, false);
        else
            hal->now_ticks = end;
        (void)host_follow_edges(host);
    }
    work(arg);
}

static const struct hal_motion_side motion_side = {.call = call_motion};

/* Without a motion side of its own machine_poll() does its work, and both are late together. */
static void own_motion_side(struct host *host) {
    host->tasks.own_motion = true;
    host->machine.board.motion_side = &motion_side;
    host->machine.board.motion_side_ctx = host;
}

struct host *host_create(const struct host_board *board) {
    return host_open(board, NULL);
}

static struct hal_ganged host_ganged(const struct host_board *board) {
    const unsigned later_axes = ((1u << board->axis_count) - 1) & ~1u;
    return (struct hal_ganged){.axes = board->ganged,
                               .fixed = board->ganged,
                               .switched = (axis_mask_t)(board->ganged & ~(board->switchless >> AXIS_COUNT)),
                               .spare = (axis_mask_t)(later_axes & ~(unsigned)board->ganged),
                               .take = virtual_take_motor,
                               .hold = virtual_hold_motors};
}

static struct device_board host_device(const struct host_board *board) {
    struct device_board device = {.wiring = {.estop_high = 0}};
    memset(device.wiring.pin, DEVICE_NO_PIN, sizeof device.wiring.pin);
    return board->device != NULL ? *board->device : device;
}

struct host *host_open(const struct host_board *board, const char *store_path) {
    char *path = store_path != NULL ? strdup(store_path) : NULL;
    if (store_path != NULL && path == NULL)
        return NULL;
    struct host *host = host_open_stored(board, path != NULL ? &host_store : NULL, path);
    if (host == NULL)
        free(path);
    else
        host->store_path = path;
    return host;
}

static bool has_drivers(const struct host_board *board) {
    bool any = false;
    for (unsigned motor = 0; motor < MOTOR_COUNT * AXIS_COUNT; motor++)
        any |= board->driver[motor] != 0;
    return any;
}

struct host *host_open_stored(const struct host_board *board, const struct hal_store *store,
                              const void *store_ctx) {
    struct host *host = board_is_possible(board) ? calloc(1, sizeof *host) : NULL;
    if (host == NULL)
        return NULL;
    host->device = host_device(board);
    const struct machine_board wired = {
        .timer_hz = board->timer_hz,
        .step_pulse_ns = board->step_pulse_ns,
        .default_pulse_us = board->default_pulse_us,
        .dir_setup_ns = board->dir_setup_ns,
        .step_spread_ns = board->step_spread_ns,
        .step_grid_ns = board->step_grid_ns,
        .max_step_rate_hz = board->max_step_rate_hz,
        .look_ahead = board->look_ahead,
        .laser_marks = board->laser_marks,
        .axis_count = board->axis_count,
        .home_axes = board->home_axes,
        .motors_wake_us = board->motors_wake_us,
        .outputs = (uint8_t)(BOARD_OUTPUTS_ALL & ~board->missing_outputs),
        .toolsetter = board->toolsetter != 0,
        .digital_inputs = board->digital_inputs,
        .digital_outputs = board->digital_outputs,
        .encoder = board->encoder != 0 ? &host_encoder : NULL,
        .pump = board->pump_hz > 0 ? &host->hal.pump : NULL,
        .servo = (board->missing_outputs & BOARD_OUTPUT_SERVO) == 0 ? &host_servo : NULL,
        .bus = board->spindle_bus != 0 ? &host_bus : NULL,
        .vfd = board->spindle_bus != 0 ? &host->vfd : NULL,
        .drivers = has_drivers(board) ? &host->drivers : NULL,
        .dial = board->dial != 0 ? &host->hal.dial : NULL,
        .dial_state = board->dial != 0 ? &host->dial : NULL,
        .analog = board->analog != 0 ? &host_analog : NULL,
        .ganged = &host->hal.ganged,
        .restart = host_restart(host, board),
        .store = store,
        .store_ctx = store_ctx,
    };
    const struct text_out out = {.write = append_out, .ctx = host};
    host_drivers_init(host, board->driver);
    host->input_follows = 1;
    host->hal.ganged = host_ganged(board);
    host->hal.dial = host_dial(board->dial);
    host->hal.pump = host_pump(board);
    host->hal.switchless = board->switchless;
    host->hal.virtual_machine.ganged = board->ganged;
    host->hal.settings = &host->machine.settings;
    host->hal.step.write = host->trace.events;
    host->seen = host->trace.events;
    host->hal.timer_hz = board->timer_hz;
    host->hal.switch_ticks = UINT64_MAX;
    /* Before machine_init(), which reads the time: hal_time_us() divides by it. */
    host->hal.timer_mhz_q8 = (uint32_t)(((uint64_t)board->timer_hz << 8) / 1000000);
    machine_init(&host->machine, &wired, &host->hal, &host->hal.step, &out);
    tasks_init(&host->tasks, board->tasks, board->timer_hz);
    if (host->tasks.own_motion)
        own_motion_side(host);
    return host;
}

void host_destroy(struct host *host) {
    if (host != NULL) {
        output_log_free(&host->hal.output_log);
        free(host->planned);
        free(host->out);
        free(host->store_path);
    }
    free(host);
}

/* ---- bytes in ---- */

/* The reader is what takes bytes out of the port: a receive interrupt, or a task of the firmware. */
static bool reader_stalls(struct host *host) {
    uint64_t now = host->hal.step.now_ticks;
    return tasks_stalled_until(&host->tasks, HOST_READER, now) > now;
}

/* @return false: no room, the byte must come again */
static bool put_byte(struct host *host, uint8_t byte, bool lossy) {
    if (lossy)
        rx_put_or_lose(&host->machine.lines.rx, byte);
    else if (!rx_put(&host->machine.lines.rx, byte))
        return false;
    if (host->observer.put != NULL)
        host->observer.put(host->observer.ctx, byte, lossy);
    return true;
}

/* What arrived while the reader was stalled. */
static void read_waiting(struct host *host) {
    if (host->waiting_count == 0 || reader_stalls(host))
        return;
    for (size_t n = 0; n < host->waiting_count; n++)
        (void)put_byte(host, (uint8_t)host->waiting[n], rx_free(&host->machine.lines.rx) == 0);
    host->waiting_count = 0;
    tasks_wake(&host->tasks, host->hal.step.now_ticks);
}

/* @param room  for this and what waits already */
static size_t keep_waiting(struct host *host, const char *bytes, size_t count, size_t room) {
    room = room > host->waiting_count ? room - host->waiting_count : 0;
    count = count < room ? count : room;
    memcpy(host->waiting + host->waiting_count, bytes, count);
    host->waiting_count += count;
    return count;
}

size_t host_write(struct host *host, const char *bytes, size_t count) {
    size_t taken = 0;
    read_waiting(host);
    tasks_wake(&host->tasks, host->hal.step.now_ticks);
    if (reader_stalls(host))
        return keep_waiting(host, bytes, count, rx_free(&host->machine.lines.rx));
    while (taken < count && put_byte(host, (uint8_t)bytes[taken], false))
        taken++;
    return taken;
}

void host_write_or_lose(struct host *host, const char *bytes, size_t count) {
    read_waiting(host);
    tasks_wake(&host->tasks, host->hal.step.now_ticks);
    if (reader_stalls(host))
        (void)keep_waiting(host, bytes, count, WAITING_SIZE);
    else
        while (count-- > 0)
            (void)put_byte(host, (uint8_t)*bytes++, true);
}

size_t host_read(struct host *host, char *bytes, size_t size) {
    size_t count = host->out_count < size ? host->out_count : size;
    memcpy(bytes, host->out, count);
    memmove(host->out, host->out + count, host->out_count - count);
    host->out_count -= count;
    return count;
}

#define POLL_US 1000 /* while the step ISR works, the sides are polled as often */

static uint64_t ticks_of_us(const struct host *host, uint64_t us) {
    return us * host->hal.timer_mhz_q8 >> 8;
}

/* Hand the events on that the ISR has written since. */
static void flush_trace(struct host *host) {
    host->trace.count = (size_t)(host->hal.step.write - host->trace.events);
    trace_flush(&host->trace);
    host->hal.step.write = host->trace.events;
    host->seen = host->trace.events;
}

/* A laser's output follows the step interrupt. The edges before have been followed. */
static void follow_beam(struct host *host) {
    if (!outputs_beam_differs(&host->hal))
        return;
    flush_trace(host);
    outputs_follow_beam(&host->hal);
    trace_set_duty(&host->trace, host->hal.step.now_ticks, host->hal.step.duty);
}

/* Step events until a time is reached, or an input changes. @param polls  what feeds the step interrupt may
 * look all the time: then for the time between two polls at most */
static void run_events(struct host *host, uint64_t *budget, uint64_t until_ticks, bool polls) {
    struct step *step = &host->machine.drive.step;
    struct hal_step *hal = &host->hal.step;
    const bool follows = host->hal.virtual_machine.follows;
    if (polls)
        until_ticks = earlier(until_ticks, hal->now_ticks + ticks_of_us(host, POLL_US));
    do {
        if (hal->alarm_ticks > until_ticks) {
            hal->now_ticks = until_ticks;
            return;
        }
        hal->now_ticks = hal->alarm_ticks;
        step_isr(step);
        bool changed = follows && host_follow_edges(host);
        follow_beam(host);
        if (hal->write == &host->trace.events[TRACE_CHUNK])
            flush_trace(host);
        host->timer_events++;
        if (changed) {
            --*budget;
            return;
        }
    } while (--*budget != 0 && step->active);
}

/* When the controller wants to be polled although nothing happens, or UINT64_MAX. @param waits  also looks
 * at a spindle's drive */
static uint64_t wake_ticks(const struct host *host, bool waits) {
    uint64_t us = waits ? machine_wait_us(&host->machine) : machine_event_us(&host->machine);
    /* Where a look is due there is nothing to wake for: time would go tick by tick. */
    if (us == UINT32_MAX || tasks_await_ticks(&host->tasks))
        return UINT64_MAX;
    return host->hal.step.now_ticks + ticks_of_us(host, us) + 1;
}

/* Whoever asked can put more input: nothing of what it has put waits, and there is room for motion. */
static bool wants_input(const struct host *host) {
    const struct machine *machine = &host->machine;
    return !host->paced && host->waiting_count == 0 && rx_free(&machine->lines.rx) == RX_SIZE &&
           machine->task.stage == TASK_NONE;
}

/* A poll has been done: was there an alarm? It begins a quiet time. */
static void note_alarm(struct host *host) {
    bool quiet = host->machine.clock.quiet.on;
    if (quiet && !host->alarm_seen)
        host->alarm_ticks = host->hal.step.now_ticks;
    host->alarm_seen = quiet;
}

/* A batch of motion is made and cut in portions, so that a chip looks at other things in between. Where
 * everything looks all the time that takes no time at all. */
static void finish_portions(struct machine *machine, bool own_motion) {
    struct motion *motion = &machine->drive.motion;
    while (motion->works && motion_poll(motion, hal_time_us(machine->hal)))
        ;
    while (motion->ahead.owner == AHEAD_HOST && ahead_is_making(&motion->ahead) &&
           hosted_poll(&machine->host.hosted))
        ;
    while (!own_motion && machine_poll_motion(machine))
        ;
}

/* The tasks that are due look. @return the controller was one of them; *any: something was done */
static bool look(struct host *host, bool *any) {
    struct tasks *tasks = &host->tasks;
    struct machine *machine = &host->machine;
    const struct hal_step *hal =
        &host->hal.step; /* its time continues when the controller waits for motion */
    bool looks = tasks_is_due(tasks, HOST_CONTROLLER, hal->now_ticks);
    if (looks && machine_poll(machine)) {
        *any = true;
        if (!tasks_sleep(tasks))
            finish_portions(machine, tasks->own_motion);
        tasks_looked(tasks, HOST_CONTROLLER, true, hal->now_ticks);
    }
    if (tasks->own_motion && tasks_is_due(tasks, HOST_MOTION, hal->now_ticks)) {
        bool done = machine_poll_motion(machine);
        while (done && !tasks_sleep(tasks) && machine_poll_motion(machine))
            ;
        tasks_looked(tasks, HOST_MOTION, done, hal->now_ticks);
        *any |= done;
    }
    follow_beam(host);
    note_alarm(host);
    host_show_segments(host);
    if (host->observer.looked != NULL)
        host->observer.looked(host->observer.ctx, looks);
    return looks;
}

/* When something happens by itself at rest, or UINT64_MAX. @param waits  as of wake_ticks() */
static uint64_t next_cause_ticks(struct host *host, bool waits) {
    uint64_t next = earlier(host_next_edge_ticks(host), wake_ticks(host, waits));
    next = earlier(next, outputs_next_ticks(&host->hal, false));
    next = earlier(next, host_bus_next_ticks(&host->hal));
    next = earlier(next, host_drivers_next_ticks(&host->hal));
    if (host->waiting_count > 0)
        next = earlier(next, tasks_stalled_until(&host->tasks, HOST_READER, host->hal.step.now_ticks));
    return next;
}

/* At rest time goes to the next thing that happens, or to a task's next look. @return false: nothing does */
static bool skip_rest(struct host *host, uint64_t until_ticks, bool waits) {
    struct hal_step *hal = &host->hal.step;
    uint64_t cause = next_cause_ticks(host, waits);
    uint64_t next = earlier(cause, tasks_next_ticks(&host->tasks, false, hal->now_ticks));
    if (next == UINT64_MAX && !waits)
        return false;
    hal->now_ticks = earlier(next, until_ticks);
    if (hal->now_ticks == cause)
        tasks_wake(&host->tasks, cause);
    return true;
}

/* @param waits  also with nothing to do, time continues until it ends */
static enum host_wait run(struct host *host, uint64_t max_events, uint64_t until_ticks, bool waits) {
    struct machine *machine = &host->machine;
    struct tasks *tasks = &host->tasks;
    const struct hal_step *hal = &host->hal.step;
    /* Counts step events, so that a caller gets the program back from a job without an end. */
    uint64_t budget = max_events;
    while (budget != 0) {
        /* What happens at this instant in the order of a chip: interrupts of inputs, bytes, tasks, then
         * the outputs that they have set. */
        bool any = host_follow_edges(host);
        read_waiting(host);
        bool worked = false, looked = look(host, &worked);
        outputs_follow(&host->hal);
        if (looked && wants_input(host)) {
            /* No more is coming: what waits for a successor in the look-ahead is planned to its end now. */
            if (!host->input_follows)
                machine_input_pause(machine);
            else if (motion_has_room(&machine->drive.motion))
                return machine->drive.step.active ? HOST_ROOM : HOST_IDLE;
        }
        if (looked && !worked)
            tasks_looked(tasks, HOST_CONTROLLER, false, hal->now_ticks);
        if (hal->now_ticks >= until_ticks)
            return HOST_TIME;
        if (worked && tasks_sleep(tasks))
            continue; /* all there is to do, at this instant: then they sleep */
        if (machine->drive.step.active) {
            uint64_t next = earlier(until_ticks, host_next_edge_ticks(host));
            next = earlier(next, tasks_next_ticks(tasks, true, hal->now_ticks));
            next = earlier(next, outputs_next_ticks(&host->hal, true));
            run_events(host, &budget, next, tasks_refill(tasks, hal->now_ticks));
            tasks_stepped(tasks, hal->now_ticks);
        } else if (!any && !worked && !skip_rest(host, until_ticks, waits)) {
            return HOST_IDLE;
        }
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
    tasks_wake(&host->tasks, host->hal.step.now_ticks);
    enum host_wait wait = run(host, UINT64_MAX, t_ticks, true);
    flush_trace(host);
    return wait;
}

enum host_wait host_run_paced(struct host *host, uint64_t t_ticks, uint64_t max_events) {
    tasks_wake(&host->tasks, host->hal.step.now_ticks); /* a network host may have asked for something */
    host->paced = true;
    enum host_wait wait = run(host, max_events, t_ticks, true);
    host->paced = false;
    flush_trace(host);
    return wait;
}

void host_act(struct host *host) {
    uint64_t now = host->hal.step.now_ticks;
    read_waiting(host);
    bool looks = tasks_stalled_until(&host->tasks, HOST_CONTROLLER, now) == now;
    if (looks)
        tasks_looked(&host->tasks, HOST_CONTROLLER, machine_poll(&host->machine), now);
    follow_beam(host);
    note_alarm(host);
    host_show_segments(host);
    if (host->observer.looked != NULL)
        host->observer.looked(host->observer.ctx, looks);
}

bool host_stall(struct host *host, enum host_side side, uint64_t from_ticks, uint64_t ticks) {
    const struct task_stall stall = {from_ticks, from_ticks + ticks, (uint8_t)side};
    if ((unsigned)side >= HOST_SIDES)
        return false;
    if (side == HOST_MOTION && !host->tasks.one_loop)
        own_motion_side(host);
    return tasks_stall(&host->tasks, &stall, host->hal.step.now_ticks);
}

void host_stall_randomly(struct host *host, const struct host_random_stalls *stalls) {
    if ((stalls->sides >> HOST_MOTION & 1) != 0 && !host->tasks.one_loop)
        own_motion_side(host);
    tasks_stall_randomly(&host->tasks, stalls, host->hal.step.now_ticks);
}

void host_look_each(struct host *host, uint32_t period_us) {
    tasks_look_each(&host->tasks, period_us);
}

uint64_t host_next_ticks(struct host *host) {
    struct tasks *tasks = &host->tasks;
    uint64_t now = host->hal.step.now_ticks;
    if (host->machine.drive.step.active)
        return now;
    return earlier(next_cause_ticks(host, true), tasks_next_ticks(tasks, false, now));
}

uint64_t host_time_ticks(const struct host *host) {
    return host->hal.step.now_ticks;
}

const char *host_state(const struct host *host) {
    return machine_state_text(&host->machine);
}

bool host_is_paused(const struct host *host) {
    return host->machine.task.stage == TASK_PAUSED || host->machine.task.stage == TASK_TOOL_WAIT;
}

bool host_awaits_tool(const struct host *host, int32_t *tool) {
    *tool = host->machine.task.command.next.tool;
    return host->machine.task.stage == TASK_TOOL_WAIT;
}

uint64_t host_alarm_ticks(const struct host *host) {
    return host->alarm_ticks;
}

uint8_t host_dwells(const struct host *host) {
    return (uint8_t)(host->hal.step.tag >> 24);
}

uint32_t host_line_now(const struct host *host) {
    return emit_line(&host->machine.drive.motion.emit);
}

void host_position_steps(const struct host *host, int32_t steps[AXIS_COUNT]) {
    machine_position(&host->machine, steps);
}

void host_shift_steps(const struct host *host, int32_t steps[AXIS_COUNT]) {
    memcpy(steps, host->machine.trust.shift_steps, sizeof host->machine.trust.shift_steps);
}

void host_watch_segments(struct host *host, host_segment_watcher *watch, void *ctx) {
    host->watch = watch;
    host->watch_ctx = ctx;
    host->watched = host->machine.drive.motion.queue.published;
}

void host_sender_lost(struct host *host, bool lines_wait) {
    machine_sender_lost(&host->machine, lines_wait);
}

bool host_notice(const struct host *host, unsigned number, char *text, size_t size) {
    return machine_notice(&host->machine, number, text, size);
}

bool host_is_busy(const struct host *host) {
    return host->machine.task.stage != TASK_NONE || !machine_is_at_rest(&host->machine);
}

enum machine_reads host_reads(const struct host *host) {
    return machine_reads(&host->machine);
}

void host_pendant_lost(struct host *host) {
    machine_pendant_lost(&host->machine);
    tasks_wake(&host->tasks, host->hal.step.now_ticks);
}

uint32_t host_drop_unread(struct host *host) {
    const uint32_t dropped = machine_drop_unread(&host->machine);
    if (host->observer.dropped != NULL)
        host->observer.dropped(host->observer.ctx, dropped);
    return dropped;
}

void host_stopped_by_other(struct host *host) {
    machine_stopped_by_other(&host->machine);
}

void host_set_start(struct host *host, uint32_t start_id) {
    host->machine.board.start_id = start_id;
}

void host_set_mpg(struct host *host, bool on) {
    machine_set_mpg(&host->machine, on);
}

const struct machine *host_machine(const struct host *host) {
    return &host->machine;
}

bool host_take_move(struct host *host, struct gcode_move *out) {
    struct gcode_move *move = &host->machine.task.command.move;
    *out = *move;
    move->motion = MOTION_NONE;
    return out->motion != MOTION_NONE;
}

void host_input_follows(struct host *host, int follows) {
    if (host->input_follows != follows)
        tasks_wake(&host->tasks, host->hal.step.now_ticks);
    host->input_follows = follows;
}

struct trace *host_trace(struct host *host) {
    return &host->trace;
}
