/* SPDX-License-Identifier: MIT
 * program.h and gcode/formula.h: whatever text comes, it ends; a line that can be computed is plain,
 * its assignments are kept, and a line that cannot changes nothing.
 *
 * The first byte says how many bytes a read gives and what is unknown; the rest is the text. */
#include "fuzz.h"

#include "config.h"
#include "gcode/formula.h"
#include "knowledge.h"
#include "program.h"

#include <math.h>
#include <string.h>

enum { LINES_MAX = 2000 };

struct text {
    const uint8_t *bytes;
    uint32_t size, most;
};

struct interpreter {
    struct program program;
    struct gcode_state gcode;
    struct params params;
    struct param_numbered numbered[PARAMS_NUMBERED];
    struct param_named named[PARAMS_NAMED];
    uint32_t unknown;
};

static int32_t read_text(const void *ctx, uint32_t offset, char *bytes, uint32_t size) {
    const struct text *text = ctx;
    uint32_t left = offset < text->size ? text->size - offset : 0;
    uint32_t count = left < size ? left : size;
    count = count < text->most ? count : text->most;
    memcpy(bytes, text->bytes + offset, count);
    return (int32_t)count;
}

static void check_plain(const char *text) {
    CLAIM(strlen(text) < FORMULA_TEXT_SIZE, "%zu characters", strlen(text));
    CLAIM(strpbrk(text, "#[]<>=/") == NULL, "not plain: %s", text);
}

static void check_params(const struct params *params) {
    CLAIM(params->numbered_count <= PARAMS_NUMBERED && params->named_count <= PARAMS_NAMED, "%d %d",
          params->numbered_count, params->named_count);
    for (unsigned n = 0; n < PARAMS_LOCAL; n++)
        CLAIM(isfinite(params->local[n]), "#%u is %g", n + 1, params->local[n]);
    for (unsigned n = 0; n < params->numbered_count; n++)
        CLAIM(params->numbered[n].number > PARAMS_LOCAL && params->numbered[n].number <= PARAMS_USER_MAX &&
                  isfinite(params->numbered[n].value),
              "#%d is %g", params->numbered[n].number, params->numbered[n].value);
    for (unsigned n = 0; n < params->named_count; n++)
        CLAIM(params->named[n].name[0] != '\0' && strlen(params->named[n].name) < PARAMS_NAME_SIZE &&
                  isfinite(params->named[n].value),
              "%s is %g", params->named[n].name, params->named[n].value);
}

/* What the host does with a line. @return false: it was refused */
static bool carry_out(struct interpreter *it) {
    const struct param_context context = {
        .gcode = &it->gcode, .params = &it->params, .line = it->program.line, .unknown = it->unknown};
    struct gcode_command command;
    struct formula formula;
    if (formula_compute(&context, it->program.text, FORMULA_DECIMALS, &formula) != STATUS_OK)
        return false;
    check_plain(formula.text);
    if (params_set(&it->params, formula.sets, formula.set_count) != STATUS_OK)
        return false;
    if (gcode_line(&it->gcode, formula.text, &command) != STATUS_OK)
        return true;
    program_note(&it->program, command.modes);
    it->unknown = knowledge_after(it->unknown, formula.text, &command);
    CLAIM(it->unknown <= NEEDS_ALL, "unknown %x", (unsigned)it->unknown);
    gcode_offsets_apply(&it->gcode.offsets, &command);
    gcode_modal_apply(&it->gcode, &command);
    if (command.move.motion != MOTION_NONE)
        memcpy(it->gcode.position_mm, command.move.target_mm, sizeof it->gcode.position_mm);
    return true;
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    static struct interpreter it;
    struct input input = {data, data + size};
    uint8_t options = input_byte(&input);
    const struct text text = {input.at, (uint32_t)input_left(&input), 1u + options / 2};
    const struct program_source source = {&text, read_text};
    unsigned lines = 0;
    memset(&it, 0, sizeof it);
    it.unknown = (options & 1) != 0 ? NEEDS_ALL : NEEDS_NOTHING;
    it.gcode.axes = (axis_mask_t)((1u << AXIS_COUNT) - 1);
    it.params.numbered = it.numbered;
    it.params.numbered_room = PARAMS_NUMBERED;
    it.params.named = it.named;
    it.params.named_room = PARAMS_NAMED;
    gcode_modal_init(&it.gcode.modal);
    if (program_begin(&it.program, &source, LINES_MAX) != STATUS_OK)
        return 0;
    while (program_next(&it.program, &it.params, &it.gcode, it.unknown) == PROGRAM_LINE && carry_out(&it)) {
        CLAIM(++lines <= LINES_MAX, "%u lines", lines);
        check_params(&it.params);
    }
    CLAIM(it.program.line <= text.size + 1, "line %lu", (unsigned long)it.program.line);
    return 0;
}
