/* SPDX-License-Identifier: MIT
 * Read-only parameters: each is computed when it is read, from the interpreter's state and what the machine
 * left in struct params. */
#include "gcode/readings.h"

#include <string.h>

#define MM_PER_INCH 25.4

/* Rows of nine axes X Y Z A B C U V W; ours end at C, the others read as 0 as on a machine without them. */
enum { ROW_AXES = 9, ROW_STEP = 20 };

/* Numbers of the first axis of a row, or of a single value: LinuxCNC's (docs/gcode-programs.md). */
enum {
    NUMBER_ABSOLUTE = 5021,
    NUMBER_PROBE = 5061,
    NUMBER_PROBE_OK = 5070,
    NUMBER_TOOL_APPLIED = 5081,
    NUMBER_G28 = 5161,
    NUMBER_G30 = 5181,
    NUMBER_G92_ON = 5210,
    NUMBER_G92 = 5211,
    NUMBER_WCS = 5220,
    NUMBER_G54 = 5221,
    NUMBER_INPUT = 5399,
    NUMBER_TOOL = 5400,
    NUMBER_TOOL_TABLE = 5401,
    NUMBER_WORK = 5420,
};

/* Angles have no inches. */
static double unit_of(const struct param_context *context, unsigned axis) {
    return context->gcode->modal.inches && axis < AXIS_A ? MM_PER_INCH : 1.0;
}

static double absolute_position(const struct param_context *context, unsigned axis) {
    return context->gcode->position_mm[axis] / unit_of(context, axis);
}

static double work_position(const struct param_context *context, unsigned axis) {
    double offset_mm[AXIS_COUNT];

    gcode_work_offset_mm(context->gcode, offset_mm);
    return (context->gcode->position_mm[axis] - offset_mm[axis]) / unit_of(context, axis);
}

/* #<_motion_mode>: ten times the G code, so that G38.2 is a whole number. */
static double motion_x10(const struct gcode_modal *modal) {
    static const double cycles[] = {
        [CYCLE_CHIP] = 730, [CYCLE_DRILL] = 810,     [CYCLE_DWELL] = 820,      [CYCLE_PECK] = 830,
        [CYCLE_BORE] = 850, [CYCLE_BORE_STOP] = 860, [CYCLE_BORE_DWELL] = 890,
    };
    static const double threads[] = {[THREAD_LINE] = 330, [THREAD_TAP] = 331, [THREAD_CYCLE] = 760};

    switch (modal->motion) {
    case MOTION_PROBE:
        return 380.0 + modal->probe;
    case MOTION_NONE:
        return 800.0;
    case MOTION_CYCLE:
        return cycles[modal->cycle];
    case MOTION_THREAD:
        return threads[modal->cycle];
    case MOTION_CUBIC:
        return 50.0;
    case MOTION_QUADRATIC:
        return 51.0;
    default:
        return 10.0 * (double)modal->motion;
    }
}

/* F as it was written. */
static double feed_word(const struct gcode_modal *modal, double unit_mm) {
    float feed = modal->feed_mm_s;

    if (modal->feed_mode != FEED_PER_REV)
        feed *= 60.0f;
    return (double)(feed / (float)unit_mm);
}

static enum status get_named(const struct param_context *context, const struct param_ref *ref,
                             double *value) {
    const struct gcode_modal *m = &context->gcode->modal;
    const double unit_mm = unit_of(context, AXIS_X);

#define work(axis)     work_position(context, axis)
#define absolute(axis) absolute_position(context, axis)
#define READING(known, reading, needs)                                                                       \
    if (ref->length == sizeof known - 1 && memcmp(ref->name, known, sizeof known - 1) == 0) {                \
        *value = (double)(reading);                                                                          \
        return (context->unknown & (needs)) != 0 ? STATUS_MACHINE_ONLY : STATUS_OK;                          \
    }
#include "gcode/readings.def"
#undef READING
#undef work
#undef absolute
    return params_get(context->params, ref, value);
}

/* Value of one row: a stored row is in mm whatever the unit of the program, as in LinuxCNC. */
static bool in_row(unsigned number, unsigned first, const double row[AXIS_COUNT], double *value) {
    const unsigned axis = number - first;

    if (number < first || axis >= ROW_AXES)
        return false;
    *value = axis < AXIS_COUNT ? row[axis] : 0.0;
    return true;
}

static bool in_offsets(const struct gcode_offsets *offsets, unsigned number, double *value) {
    for (unsigned wcs = 0; wcs < WCS_COUNT; wcs++) {
        const unsigned first = NUMBER_G54 + wcs * ROW_STEP;

        if (in_row(number, first, offsets->wcs_mm[wcs], value))
            return true;
        if (number == first + ROW_AXES) { /* R: no rotation */
            *value = 0.0;
            return true;
        }
    }
    return in_row(number, NUMBER_G28, offsets->g28_mm, value) ||
           in_row(number, NUMBER_G30, offsets->g30_mm, value) ||
           in_row(number, NUMBER_G92, offsets->g92_mm, value);
}

/* Rows in the unit of the program. */
static bool in_positions(const struct param_context *context, unsigned number, double *value) {
    const struct gcode_modal *modal = &context->gcode->modal;
    const struct gcode_offsets *offsets = &context->gcode->offsets;
    const bool has_table = modal->tool_in_spindle >= 1 && modal->tool_in_spindle <= TOOL_COUNT;
    double rows[5][AXIS_COUNT] = {{0.0}};

    for (unsigned axis = 0; axis < AXIS_COUNT; axis++) {
        const double unit = unit_of(context, axis);

        rows[0][axis] = absolute_position(context, axis);
        rows[1][axis] = context->params->probe_mm[axis] / unit;
        rows[4][axis] = work_position(context, axis);
    }
    rows[2][AXIS_Z] = offsets->tool_length_mm / unit_of(context, AXIS_Z);
    if (has_table)
        rows[3][AXIS_Z] = (double)offsets->tool_mm[modal->tool_in_spindle - 1] / unit_of(context, AXIS_Z);
    return in_row(number, NUMBER_ABSOLUTE, rows[0], value) || in_row(number, NUMBER_PROBE, rows[1], value) ||
           in_row(number, NUMBER_TOOL_APPLIED, rows[2], value) ||
           in_row(number, NUMBER_TOOL_TABLE, rows[3], value) || in_row(number, NUMBER_WORK, rows[4], value);
}

static bool is_offset(const struct gcode_offsets *offsets) {
    for (unsigned axis = 0; axis < AXIS_COUNT; axis++) {
        if (offsets->g92_mm[axis] != 0.0)
            return true;
    }
    return false;
}

/* What must be known to compute the value of this number: NEEDS_ bits. Off the machine, when a program is
 * expanded on a PC, some of it is not (param_context.unknown). */
static uint32_t needs_of(unsigned number) {
    if (number >= NUMBER_WORK)
        return number < NUMBER_WORK + AXIS_COUNT ? NEEDS_WORK(number - NUMBER_WORK) : NEEDS_NOTHING;
    if (number == NUMBER_TOOL)
        return NEEDS_TOOL_IN_SPINDLE;
    if (number > NUMBER_TOOL)
        return NEEDS_OFFSETS | NEEDS_TOOL_IN_SPINDLE;
    if (number == NUMBER_WCS)
        return NEEDS_WCS;
    if (number == NUMBER_INPUT)
        return NEEDS_PROBE;
    return number >= NUMBER_PROBE && number <= NUMBER_PROBE_OK ? NEEDS_PROBE : NEEDS_OFFSETS;
}

static bool is_single(const struct param_context *context, unsigned number, double *value) {
    switch (number) {
    case NUMBER_PROBE_OK:
        *value = context->params->probe_ok;
        return true;
    case NUMBER_G92_ON:
        *value = is_offset(&context->gcode->offsets);
        return true;
    case NUMBER_WCS:
        *value = 1.0 + context->gcode->modal.wcs;
        return true;
    case NUMBER_INPUT:
        *value = context->params->input;
        return true;
    case NUMBER_TOOL:
        *value = context->gcode->modal.tool_in_spindle;
        return true;
    default:
        return false;
    }
}

static enum status get_numbered(const struct param_context *context, unsigned number, double *value) {
    if (!is_single(context, number, value) && !in_offsets(&context->gcode->offsets, number, value) &&
        !in_positions(context, number, value))
        return STATUS_PARAMETER_NUMBER;
    return (context->unknown & needs_of(number)) != 0 ? STATUS_MACHINE_ONLY : STATUS_OK;
}

enum status readings_get(const struct param_context *context, const struct param_ref *ref, double *value) {
    if (ref->name != NULL)
        return ref->name[0] == '_' ? get_named(context, ref, value) : params_get(context->params, ref, value);
    if (ref->number == 0)
        return STATUS_PARAMETER_NUMBER;
    if (ref->number > PARAMS_USER_MAX)
        return get_numbered(context, ref->number, value);
    return params_get(context->params, ref, value);
}

enum status readings_check_set(const struct param_ref *ref) {
    static const char *const reserved[] = {
#define READING(known, reading, needs) known,
#include "gcode/readings.def"
#undef READING
    };

    if (ref->name == NULL) {
        if (ref->number == 0)
            return STATUS_PARAMETER_NUMBER;
        return ref->number > PARAMS_USER_MAX ? STATUS_PARAMETER_READ_ONLY : STATUS_OK;
    }
    for (size_t i = 0; i < sizeof reserved / sizeof reserved[0]; i++) {
        if (strlen(reserved[i]) == ref->length && memcmp(ref->name, reserved[i], ref->length) == 0)
            return STATUS_PARAMETER_READ_ONLY;
    }
    return STATUS_OK;
}
