/* SPDX-License-Identifier: MIT
 * gcode_line() and gcode_jog() from any valid state: a refused line changes nothing, an accepted one gives
 * finite numbers within the limits that gcode.h states.
 *
 * STATE_BYTES of the input make the state; the rest is lines, carried out one after the other. A line that
 * begins with '$' is a jog. */
#include "fuzz.h"
#include "status_text.h"

#include "gcode/arc.h"
#include "gcode/cycle.h"
#include "gcode/gcode.h"
#include "gcode/spline.h"
#include "gcode/thread.h"

#include <math.h>
#include <string.h>

enum { STATE_BYTES = 40, ARC_POINTS = 2000, CYCLE_ACTIONS = 2000 };

/* Mostly round and small, now and then at the limits. */
static double coordinate(struct input *input) {
    uint8_t byte = input_byte(input);
    if (byte >= 0xfe)
        return byte == 0xff ? GCODE_COORDINATE_MAX : -GCODE_COORDINATE_MAX;
    return byte < 0x80 ? (double)byte * 0.5 : -(double)(byte - 0x80) * 13.37;
}

/* Axes that the machine has not stay at 0. */
static void row(struct input *input, axis_mask_t axes, double mm[AXIS_COUNT]) {
    for (unsigned ax = 0; ax < AXIS_A; ax++)
        mm[ax] = mm[ax + AXIS_A] = coordinate(input);
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++)
        mm[ax] = (axes >> ax & 1) != 0 ? mm[ax] : 0.0;
}

static void modal(struct input *input, struct gcode_modal *modal) {
    uint8_t flags = input_byte(input), modes = input_byte(input);
    gcode_modal_init(modal);
    modal->motion = (enum gcode_motion)(modes % 6);
    modal->plane = (enum gcode_plane)(modes / 6 % 3);
    modal->path = (enum gcode_path)(modes / 18 % 3);
    modal->spindle = (enum gcode_spindle)(modes / 54 % 3);
    modal->inches = (flags & 1) != 0;
    modal->incremental = (flags & 2) != 0;
    modal->arc_absolute = (flags & 4) != 0;
    modal->feed_mode = (flags & 8) != 0 ? FEED_INVERSE_TIME : FEED_PER_MIN;
    modal->coolant = flags >> 4 & (COOLANT_MIST | COOLANT_FLOOD);
    modal->probe = modal->motion == MOTION_PROBE ? (uint8_t)(2 + (flags >> 6)) : 0;
    modal->wcs = input_byte(input) % WCS_COUNT;
    modal->tool = input_byte(input);
    modal->feed_mm_s = modal->feed_mode == FEED_PER_MIN ? (float)input_byte(input) : 0.0f;
    modal->spindle_rpm = (float)input_byte(input) * 100.0f;
}

static void state_from(struct input *input, struct gcode_state *state) {
    state->axes = (axis_mask_t)((1u << (1 + input_byte(input) % AXIS_COUNT)) - 1);
    state->ports = GCODE_PORTS_ALL;
    modal(input, &state->modal);
    row(input, state->axes, state->position_mm);
    for (unsigned n = 0; n < WCS_COUNT; n++)
        row(input, state->axes, state->offsets.wcs_mm[n]);
    row(input, state->axes, state->offsets.g28_mm);
    row(input, state->axes, state->offsets.g30_mm);
    row(input, state->axes, state->offsets.g92_mm);
    state->offsets.tool_length_mm = coordinate(input);
}

static void check_row(const double mm[AXIS_COUNT], const char *what) {
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++)
        CLAIM(gcode_in_range(ax, mm[ax]), "%s of axis %u is %g", what, ax, mm[ax]);
}

static void check_modal(const struct gcode_modal *modal) {
    CLAIM(modal->motion <= MOTION_THREAD && modal->plane <= PLANE_YZ && modal->path <= PATH_EXACT_STOP,
          "no such mode");
    CLAIM(modal->feed_mode <= FEED_PER_REV && modal->spindle <= SPINDLE_CCW && modal->coolant <= 3,
          "no such mode");
    CLAIM(modal->wcs < WCS_COUNT && modal->tool >= 0 && modal->tool <= 255, "wcs %d, tool %ld", modal->wcs,
          (long)modal->tool);
    CLAIM(modal->cycle <= CYCLE_BORE_DWELL && modal->overrides <= OVERRIDE_ALL, "cycle %d, overrides %d",
          modal->cycle, modal->overrides);
    CLAIM(modal->tool_in_spindle >= 0 && modal->tool_in_spindle <= 255, "tool in spindle %ld",
          (long)modal->tool_in_spindle);
    CLAIM(modal->motion != MOTION_PROBE || (modal->probe >= 2 && modal->probe <= 5), "probe %d",
          modal->probe);
    CLAIM(isfinite(modal->feed_mm_s) && modal->feed_mm_s >= 0, "feed %g", (double)modal->feed_mm_s);
    CLAIM(isfinite(modal->spindle_rpm) && modal->spindle_rpm >= 0, "S %g", (double)modal->spindle_rpm);
    CLAIM(isfinite(modal->path_tolerance_mm) && modal->path_tolerance_mm >= 0, "P %g",
          (double)modal->path_tolerance_mm);
}

static void check_arc(const struct gcode_state *state, const struct gcode_move *move) {
    double point_mm[AXIS_COUNT] = {0};
    struct arc arc;
    CLAIM(move->plane <= PLANE_YZ, "plane %d", move->plane);
    CLAIM(isfinite(move->center_mm[0]) && isfinite(move->center_mm[1]), "centre %g %g", move->center_mm[0],
          move->center_mm[1]);
    arc_begin(&arc, state->position_mm, move, 0.002);
    CLAIM(arc.chords > 0, "an arc without chords");
    CLAIM(arc.radius_mm <= GCODE_RADIUS_MAX_MM * 1.001, "radius %g", arc.radius_mm);
    double length_mm = arc_length_mm(&arc);
    CLAIM(isfinite(length_mm) && length_mm >= 0, "length %g", length_mm);
    for (unsigned n = 0; n < ARC_POINTS && arc_next(&arc, point_mm); n++)
        for (unsigned ax = 0; ax < AXIS_COUNT; ax++)
            CLAIM((state->axes >> ax & 1) != 0 ? isfinite(point_mm[ax]) : point_mm[ax] == 0.0,
                  "point %u of an arc: %g on axis %u", n, point_mm[ax], ax);
    if (arc.done == arc.chords)
        CLAIM(memcmp(point_mm, move->target_mm, sizeof point_mm) == 0, "an arc ends elsewhere");
}

static void check_action(const struct gcode_state *state, const struct gcode_drill *drill,
                         const struct cycle_action *action, unsigned normal) {
    check_row(action->target_mm, "action");
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++)
        CLAIM((state->axes >> ax & 1) != 0 || action->target_mm[ax] == 0.0, "axis %u is not there and moves",
              ax);
    CLAIM(action->kind <= CYCLE_ACTION_SPINDLE_START, "action %d", action->kind);
    CLAIM(action->kind != CYCLE_ACTION_DWELL || (isfinite(action->dwell_s) && action->dwell_s >= 0),
          "dwell %g", (double)action->dwell_s);
    CLAIM(action->kind != CYCLE_ACTION_FEED ||
              (action->target_mm[normal] >= drill->bottom_mm && action->target_mm[normal] <= drill->r_mm),
          "a feed to %g, hole from %g to %g", action->target_mm[normal], drill->r_mm, drill->bottom_mm);
}

static void check_cycle(const struct gcode_state *state, const struct gcode_move *move) {
    const struct gcode_drill *drill = &move->drill;
    struct cycle_action action;
    struct cycle cycle;
    unsigned n = 0;
    CLAIM(drill->cycle <= CYCLE_BORE_DWELL, "cycle %d", drill->cycle);
    CLAIM(drill->bottom_mm <= drill->r_mm && drill->r_mm <= drill->clear_mm, "levels %g %g %g",
          drill->bottom_mm, drill->r_mm, drill->clear_mm);
    CLAIM(drill->repeats >= 1 && drill->repeats <= DRILL_REPEATS_MAX, "%lu holes",
          (unsigned long)drill->repeats);
    CLAIM(drill->pecks >= 1 && drill->pecks <= DRILL_PECKS_MAX, "%lu pecks", (unsigned long)drill->pecks);
    check_row(move->via_mm, "bottom of the last hole");
    cycle_begin(&cycle, state->position_mm, move);
    while (n < CYCLE_ACTIONS && cycle_next(&cycle, &action)) {
        check_action(state, drill, &action, cycle.normal);
        n++;
    }
    for (unsigned ax = 0; ax < AXIS_COUNT && n < CYCLE_ACTIONS; ax++)
        CLAIM(cycle.at_mm[ax] == move->target_mm[ax], "axis %u of a cycle ends at %g, not at %g", ax,
              cycle.at_mm[ax], move->target_mm[ax]);
}

static void check_spline(const struct gcode_state *state, const struct gcode_move *move) {
    struct spline spline;
    double point_mm[AXIS_COUNT] = {0};
    spline_begin(&spline, state->position_mm, move, 0.002);
    for (unsigned n = 0; n < ARC_POINTS && spline_next(&spline, point_mm); n++)
        check_row(point_mm, "point of a spline");
    if (spline.done == spline.chords)
        CLAIM(memcmp(point_mm, move->target_mm, sizeof point_mm) == 0, "a spline ends elsewhere");
}

static void check_thread(const struct gcode_state *state, const struct gcode_move *move) {
    const struct gcode_thread *spec = &move->thread;
    struct thread_action action = {.kind = THREAD_RAPID};
    struct thread thread;
    unsigned passes = 0;
    CLAIM(spec->kind <= THREAD_CYCLE, "thread %d", spec->kind);
    CLAIM(isfinite(spec->pitch_mm) && spec->pitch_mm > 0, "pitch %g", (double)spec->pitch_mm);
    check_row(move->via_mm, "end of a thread");
    if (spec->kind != THREAD_CYCLE)
        return;
    CLAIM(thread_pass_count(spec) <= THREAD_PASSES_MAX, "%lu passes", (unsigned long)thread_pass_count(spec));
    thread_begin(&thread, state->position_mm, move);
    while (thread_next(&thread, &action)) {
        CLAIM(fabs(action.depth_mm) <= (double)spec->depth_mm * 1.000001, "depth %g", action.depth_mm);
        passes += action.kind == THREAD_PASS;
    }
    CLAIM(passes == thread_pass_count(spec), "%u passes", passes);
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++)
        CLAIM(action.target_mm[ax] == move->target_mm[ax], "axis %u of a thread ends at %g, not at %g", ax,
              action.target_mm[ax], move->target_mm[ax]);
}

static void check_move(const struct gcode_state *state, const struct gcode_move *move) {
    CLAIM(move->motion <= MOTION_THREAD, "motion %d", move->motion);
    if (move->motion == MOTION_NONE)
        return;
    check_row(move->target_mm, "target");
    if (move->via)
        check_row(move->via_mm, "via");
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++)
        if ((state->axes >> ax & 1) == 0)
            CLAIM(move->target_mm[ax] == 0.0, "axis %u is not there and moves", ax);
    CLAIM(isfinite(move->feed_mm_s) && move->feed_mm_s >= 0, "feed %g", (double)move->feed_mm_s);
    CLAIM(isfinite(move->inverse_time_s) && move->inverse_time_s >= 0, "time %g",
          (double)move->inverse_time_s);
    CLAIM(move->motion == MOTION_RAPID || move->motion == MOTION_THREAD || move->feed_mm_s > 0 ||
              move->inverse_time_s > 0,
          "a move that never ends");
    CLAIM((move->motion == MOTION_PROBE) == (move->probe != 0), "probe %d", move->probe);
    if (move->motion == MOTION_ARC_CW || move->motion == MOTION_ARC_CCW)
        check_arc(state, move);
    if (move->motion == MOTION_CYCLE)
        check_cycle(state, move);
    if (move->motion == MOTION_CUBIC || move->motion == MOTION_QUADRATIC)
        check_spline(state, move);
    if (move->motion == MOTION_THREAD)
        check_thread(state, move);
}

static void check_port(const struct gcode_command *command) {
    static const int counts[] = {OUTPUT_COUNT, ANALOG_COUNT, DIGITAL_INPUT_COUNT, ANALOG_COUNT};
    if (command->port < 0)
        return;
    CLAIM(command->port_kind <= PORT_ANALOG_IN && command->port < counts[command->port_kind], "port %d of %d",
          command->port, command->port_kind);
    if (command->port_kind == PORT_ANALOG_OUT)
        CLAIM(command->port_pct >= 0 && command->port_pct <= 100, "%g percent", (double)command->port_pct);
    if (command->port_kind >= PORT_DIGITAL_IN)
        CLAIM(command->wait <= WAIT_LOW && isfinite(command->wait_s) &&
                  (command->wait == WAIT_NOT || command->wait_s > 0),
              "waits for %d, %g s", command->wait, (double)command->wait_s);
}

static void check_command(const struct gcode_state *state, const struct gcode_command *command) {
    check_modal(&command->next);
    CLAIM(isfinite(command->dwell_s), "dwell %g", (double)command->dwell_s);
    CLAIM(command->store <= STORE_TOOL, "store %d", command->store);
    CLAIM(command->store != STORE_WCS || command->store_wcs < WCS_COUNT, "row %d", command->store_wcs);
    if (command->store == STORE_TOOL)
        CLAIM(command->store_tool < TOOL_COUNT &&
                  fabs((double)command->store_tool_mm) <= GCODE_COORDINATE_MAX,
              "tool %d, length %g", command->store_tool, (double)command->store_tool_mm);
    else if (command->store != STORE_NOTHING)
        check_row(command->store_mm, "stored offset");
    if (command->store_tool_length)
        CLAIM(fabs(command->tool_length_mm) <= GCODE_COORDINATE_MAX, "tool length %g",
              command->tool_length_mm);
    check_port(command);
    CLAIM(command->flow <= FLOW_END, "flow %d", command->flow);
    check_move(state, &command->move);
}

/* The short way of a plain line: if it takes this line, it makes the same of it. */
static void check_plain(const struct gcode_state *state, const char *text, const struct gcode_command *same) {
    size_t length = strlen(text);
    struct gcode_command command;
    char *line = malloc(length + 2);
    if (line == NULL)
        abort();
    memcpy(line, text, length);
    memcpy(line + length, "\n", 2);
    memset(&command, 0xa5, sizeof command);
    const char *end = gcode_plain_line(state, line, &command);
    CLAIM(end == NULL || strchr(text, ' ') != NULL ||
              (end == line + length && memcmp(&command, same, sizeof command) == 0),
          "the short way of %s leads elsewhere", text);
    free(line);
}

static void carry_out(struct gcode_state *state, const struct gcode_command *command) {
    gcode_offsets_apply(&state->offsets, command);
    if (command->move.motion != MOTION_NONE)
        memcpy(state->position_mm, command->move.target_mm, sizeof state->position_mm);
    gcode_modal_apply(state, command);
}

static void line(struct gcode_state *state, const char *text) {
    const struct gcode_state before = *state;
    struct gcode_command command;
    bool jog = text[0] == '$';
    memset(&command, 0xa5, sizeof command);
    enum status status = jog ? gcode_jog(state, text + 1, &command) : gcode_line(state, text, &command);
    CLAIM(memcmp(state, &before, sizeof before) == 0, "resolving changes the state");
    CLAIM(status == STATUS_OK || strcmp(status_text(status), "unknown status") != 0, "status %d", status);
    if (status != STATUS_OK)
        return;
    check_command(state, &command);
    check_plain(state, text, &command);
    CLAIM(!jog || memcmp(&command.next, &before.modal, sizeof before.modal) == 0, "a jog changes modes");
    carry_out(state, &command);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    struct gcode_state state;
    size_t head = size < STATE_BYTES ? size : STATE_BYTES;
    struct input input = {data, data + head};
    memset(&state, 0, sizeof state);
    state_from(&input, &state);
    for (const uint8_t *at = data + head, *end = data + size; at < end;) {
        const uint8_t *stop = memchr(at, '\n', (size_t)(end - at));
        size_t length = (size_t)((stop != NULL ? stop : end) - at);
        char *text = calloc(length + 1, 1);
        if (text == NULL)
            abort();
        memcpy(text, at, length);
        line(&state, text);
        free(text);
        at += length + (stop != NULL);
    }
    return 0;
}
