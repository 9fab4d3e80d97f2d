/* SPDX-License-Identifier: MIT
 * One interpreter for the tests of expressions, parameters and programs: everything that a machine has for
 * them, and no machine. */
#include "config.h"
#include "gcode/expression.h"
#include "gcode/formula.h"
#include "program.h"

#include <stdlib.h>
#include <string.h>

struct bench {
    struct gcode_state gcode;
    struct params params;
    struct param_numbered numbered[PARAMS_NUMBERED];
    struct param_named named[PARAMS_NAMED];
    struct formula formula;
    struct program program;
    struct program_source source;
    const char *text; /* of the program */
    uint32_t text_size;
    int32_t fails_at; /* offset from which on nothing can be read, or -1 */
};

struct bench *bench_create(axis_mask_t axes) {
    struct bench *bench = calloc(1, sizeof *bench);
    bench->gcode.axes = axes;
    gcode_modal_init(&bench->gcode.modal);
    bench->params.numbered = bench->numbered;
    bench->params.numbered_room = PARAMS_NUMBERED;
    bench->params.named = bench->named;
    bench->params.named_room = PARAMS_NAMED;
    return bench;
}

void bench_destroy(struct bench *bench) {
    free(bench);
}

void bench_clear(struct bench *bench) {
    params_clear(&bench->params);
}

void bench_probe(struct bench *bench, const double probe_mm[AXIS_COUNT], bool ok) {
    memcpy(bench->params.probe_mm, probe_mm, sizeof bench->params.probe_mm);
    bench->params.probe_ok = ok;
}

static struct param_context context_of(const struct bench *bench, uint32_t line) {
    return (struct param_context){.gcode = &bench->gcode, .params = &bench->params, .line = line};
}

/* @return the status, or -1 when something follows the value */
int bench_value(const struct bench *bench, const char *text, double *value) {
    const struct param_context context = context_of(bench, 7);
    enum status status = expression_value(&context, &text, value);
    return status == STATUS_OK && *text != '\0' ? -1 : (int)status;
}

static int carry_out(struct bench *bench, const char *line, uint32_t number) {
    const struct param_context context = context_of(bench, number);
    struct gcode_command command;
    enum status status = formula_compute(&context, line, FORMULA_DECIMALS, &bench->formula);
    if (status == STATUS_OK)
        status = gcode_line(&bench->gcode, bench->formula.text, &command);
    if (status == STATUS_OK)
        status = params_set(&bench->params, bench->formula.sets, bench->formula.set_count);
    if (status != STATUS_OK)
        return (int)status;
    program_note(&bench->program, command.modes);
    gcode_offsets_apply(&bench->gcode.offsets, &command);
    gcode_modal_apply(&bench->gcode, &command);
    if (command.move.motion != MOTION_NONE)
        memcpy(bench->gcode.position_mm, command.move.target_mm, sizeof bench->gcode.position_mm);
    return STATUS_OK;
}

/* One filtered line, with its effects. */
int bench_line(struct bench *bench, const char *line) {
    return carry_out(bench, line, 7);
}

/* The plain text of the last line. */
const char *bench_plain(const struct bench *bench) {
    return bench->formula.text;
}

void bench_position(const struct bench *bench, double mm[AXIS_COUNT]) {
    memcpy(mm, bench->gcode.position_mm, sizeof bench->gcode.position_mm);
}

static int32_t read_text(const void *ctx, uint32_t offset, char *bytes, uint32_t size) {
    const struct bench *bench = ctx;
    uint32_t left = offset < bench->text_size ? bench->text_size - offset : 0;
    if (bench->fails_at >= 0 && offset + (left < size ? left : size) > (uint32_t)bench->fails_at)
        return -1;
    memcpy(bytes, bench->text + offset, left < size ? left : size);
    return (int32_t)(left < size ? left : size);
}

/* The text must live as long as the program runs. */
int bench_program(struct bench *bench, const char *text, uint32_t size, uint32_t lines_max,
                  int32_t fails_at) {
    bench->text = text;
    bench->text_size = size;
    bench->fails_at = fails_at;
    bench->source = (struct program_source){bench, read_text};
    return (int)program_begin(&bench->program, &bench->source, lines_max);
}

void bench_fail_at(struct bench *bench, int32_t offset) {
    bench->fails_at = offset;
}

/* Execute lines up to one that leaves plain text. @return an enum program_result */
int bench_step(struct bench *bench) {
    for (;;) {
        int result = (int)program_next(&bench->program, &bench->params, &bench->gcode, NEEDS_NOTHING);
        if (result != PROGRAM_LINE)
            return result;
        bench->program.status = (enum status)carry_out(bench, bench->program.text, bench->program.line);
        if (bench->program.status != STATUS_OK)
            return PROGRAM_FAILED;
        if (bench->formula.text[0] != '\0')
            return PROGRAM_LINE;
    }
}

int bench_status(const struct bench *bench) {
    return (int)bench->program.status;
}

uint32_t bench_line_number(const struct bench *bench) {
    return bench->program.line;
}
