/* SPDX-License-Identifier: MIT */
#include "rebuild.h"

#include "gcode/gcode.h"
#include "input/line_reader.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define S_PER_MIN 60.0

struct rebuild {
    struct gcode_state gcode;
    struct line_reader reader;
    double top_z_mm;
    axis_mask_t moved;
    uint8_t stored;
};

struct rebuild *rebuild_create(uint8_t axis_count) {
    if (axis_count < 1 || axis_count > AXIS_COUNT)
        return NULL;
    struct rebuild *rebuild = calloc(1, sizeof *rebuild);
    if (rebuild == NULL)
        return NULL;
    /* fmax() of NaN and a number is the number: the first move of Z sets it. */
    rebuild->top_z_mm = NAN;
    rebuild->gcode.axes = (axis_mask_t)((1u << axis_count) - 1);
    /* The board's outputs are not known here. None is missing, so that no line is refused that the machine
     * has executed. */
    rebuild->gcode.ports = GCODE_PORTS_ALL;
    gcode_modal_init(&rebuild->gcode.modal);
    line_reader_reset(&rebuild->reader);
    return rebuild;
}

void rebuild_destroy(struct rebuild *rebuild) {
    free(rebuild);
}

void rebuild_set_position(struct rebuild *rebuild, const double machine_mm[AXIS_COUNT]) {
    memcpy(rebuild->gcode.position_mm, machine_mm, sizeof rebuild->gcode.position_mm);
}

int rebuild_set_offset(struct rebuild *rebuild, int row, const double mm[AXIS_COUNT]) {
    struct gcode_offsets *offsets = &rebuild->gcode.offsets;
    double *to = row == -28                    ? offsets->g28_mm
                 : row == -30                  ? offsets->g30_mm
                 : row == -92                  ? offsets->g92_mm
                 : row >= 0 && row < WCS_COUNT ? offsets->wcs_mm[row]
                                               : NULL;
    if (row == -43) {
        offsets->tool_length_mm = mm[AXIS_Z];
        return 0;
    }
    if (to == NULL)
        return -1;
    memcpy(to, mm, sizeof offsets->g28_mm);
    return 0;
}

static void take_move(struct rebuild *rebuild, const double target_mm[AXIS_COUNT]) {
    double *position_mm = rebuild->gcode.position_mm;
    if (target_mm[AXIS_Z] != position_mm[AXIS_Z])
        rebuild->top_z_mm = fmax(rebuild->top_z_mm, target_mm[AXIS_Z]);
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++) {
        if (target_mm[ax] != position_mm[ax])
            rebuild->moved |= (axis_mask_t)(1u << ax);
        position_mm[ax] = target_mm[ax];
    }
}

/* What the machine does with a command, less the motion: machine/task.c. */
static void take(struct rebuild *rebuild, const struct gcode_command *command) {
    const struct gcode_move *move = &command->move;
    if (command->tool_table_used || (command->store != STORE_NOTHING && command->store != STORE_G92))
        /* The job has changed what the machine stores: it is not what it was before the first line. */
        rebuild->stored = 1;
    gcode_offsets_apply(&rebuild->gcode.offsets, command);
    if (move->motion != MOTION_NONE && move->via)
        take_move(rebuild, move->via_mm);
    if (move->motion != MOTION_NONE)
        take_move(rebuild, move->target_mm);
    gcode_modal_apply(&rebuild->gcode, command);
}

int rebuild_line(struct rebuild *rebuild, const char *line, size_t size) {
    enum line_result result = LINE_NONE;
    struct gcode_command command;

    for (size_t i = 0; i < size; i++)
        line_reader_put(&rebuild->reader, (uint8_t)line[i]);
    result = line_reader_put(&rebuild->reader, '\n');
    if (result == LINE_OVERFLOW || result == LINE_BROKEN)
        return STATUS_LINE_TOO_LONG;
    if (rebuild->reader.text[0] == '\0' || rebuild->reader.text[0] == '$')
        return STATUS_OK;
    enum status status = gcode_line(&rebuild->gcode, rebuild->reader.text, &command);
    if (status == STATUS_OK)
        take(rebuild, &command);
    return (int)status;
}

static int16_t motion_g10(const struct gcode_modal *modal) {
    static const int16_t cycle_g10[] = {[CYCLE_CHIP] = 730,      [CYCLE_DRILL] = 810, [CYCLE_DWELL] = 820,
                                        [CYCLE_PECK] = 830,      [CYCLE_BORE] = 850,  [CYCLE_BORE_STOP] = 860,
                                        [CYCLE_BORE_DWELL] = 890};
    static const int16_t thread_g10[] = {[THREAD_LINE] = 330, [THREAD_TAP] = 331, [THREAD_CYCLE] = 760};
    switch (modal->motion) {
    case MOTION_THREAD:
        return thread_g10[modal->cycle];
    case MOTION_RAPID:
        return 0;
    case MOTION_LINEAR:
        return 10;
    case MOTION_ARC_CW:
        return 20;
    case MOTION_ARC_CCW:
        return 30;
    case MOTION_PROBE:
        return (int16_t)(380 + modal->probe);
    case MOTION_CYCLE:
        return cycle_g10[modal->cycle];
    case MOTION_CUBIC:
        return 50;
    case MOTION_QUADRATIC:
        return 51;
    case MOTION_NONE:
    default:
        return 800;
    }
}

void rebuild_state(const struct rebuild *rebuild, struct rebuild_state *out) {
    static const int16_t path_g10[] = {[PATH_BLEND] = 640, [PATH_EXACT] = 610, [PATH_EXACT_STOP] = 611};
    static const uint8_t feed_mode_g[] = {[FEED_PER_MIN] = 94, [FEED_INVERSE_TIME] = 93, [FEED_PER_REV] = 95};
    static const uint8_t spindle_m[] = {[SPINDLE_OFF] = 5, [SPINDLE_CW] = 3, [SPINDLE_CCW] = 4};
    const struct gcode_modal *modal = &rebuild->gcode.modal;
    const struct gcode_offsets *offsets = &rebuild->gcode.offsets;
    double work_offset_mm[AXIS_COUNT];

    *out = (struct rebuild_state){
        .top_z_mm = rebuild->top_z_mm,
        .moved = rebuild->moved,
        .stored = rebuild->stored,
        .tool_length_mm = offsets->tool_length_mm,
        .feed_mm_min = (double)modal->feed_mm_s * (modal->feed_mode == FEED_PER_REV ? 1.0 : S_PER_MIN),
        .spindle_rpm = (double)modal->spindle_rpm,
        .path_tolerance_mm = (double)modal->path_tolerance_mm,
        .tool = modal->tool,
        .motion_g10 = motion_g10(modal),
        .path_g10 = path_g10[modal->path],
        .wcs_g10 = (int16_t)(modal->wcs < 6 ? 540 + 10 * modal->wcs : 585 + modal->wcs),
        .plane_g = (uint8_t)(17 + modal->plane),
        .units_g = modal->inches ? 20 : 21,
        .distance_g = modal->incremental ? 91 : 90,
        .feed_mode_g = feed_mode_g[modal->feed_mode],
        .spindle_m = spindle_m[modal->spindle],
        .coolant = modal->coolant,
        .arc_absolute = modal->arc_absolute,
    };
    gcode_work_offset_mm(&rebuild->gcode, work_offset_mm);
    memcpy(out->machine_mm, rebuild->gcode.position_mm, sizeof out->machine_mm);
    memcpy(out->g92_mm, offsets->g92_mm, sizeof out->g92_mm);
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++)
        out->work_mm[ax] = out->machine_mm[ax] - work_offset_mm[ax];
}
