/* SPDX-License-Identifier: MIT */
#include "expand.h"

#include "config.h"
#include "gcode/formula.h"
#include "input/line_reader.h"
#include "knowledge.h"
#include "machine/comment.h"
#include "program.h"

#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

/* On a PC there is room. */
enum { NUMBERED_ROOM = PARAMS_USER_MAX, NAMED_ROOM = 4096 };

/* Of a computed value; fewer where the line would become too long. 1e-4 mm is less than a step. */
enum { DECIMALS_MAX = 6, DECIMALS_MIN = 4 };

struct bytes {
    char *items;
    size_t size, room;
};

struct expand {
    struct bytes text, comments;
    uint32_t *numbers;
    size_t count, count_room;
    enum status status;
    uint32_t line;
    struct program_end end;
    bool short_of_memory;
};

/** One way through the program. */
struct run {
    struct program program;
    struct gcode_state gcode;
    struct params params;
    struct param_numbered numbered[NUMBERED_ROOM];
    struct param_named named[NAMED_ROOM];
    uint32_t unknown; /* NEEDS_ bits */
    struct expand *out;
};

struct text {
    const char *bytes;
    size_t size;
};

static int32_t read_text(const void *ctx, uint32_t offset, char *bytes, uint32_t size) {
    const struct text *text = ctx;
    size_t left = offset < text->size ? text->size - offset : 0;
    size_t count = left < size ? left : size;
    memcpy(bytes, text->bytes + offset, count);
    return (int32_t)count;
}

/* ---- what comes out ---- */

/* By doubling, so that a long program costs a constant time for each line. */
static void *grown(void *items, size_t wanted, size_t *room, size_t item_size) {
    while (*room < wanted)
        *room = *room == 0 ? 1024 : 2 * *room;
    return realloc(items, *room * item_size);
}

static bool add_bytes(struct bytes *to, const char *bytes, size_t count) {
    if (to->size + count > to->room || to->items == NULL) {
        char *items = grown(to->items, to->size + count, &to->room, 1);
        if (items == NULL)
            return false;
        to->items = items;
    }
    memcpy(to->items + to->size, bytes, count);
    to->size += count;
    return true;
}

static bool add_line(struct expand *out, const char *line, uint32_t number) {
    uint32_t *numbers = out->numbers;
    if (out->count + 1 > out->count_room)
        numbers = grown(numbers, out->count + 1, &out->count_room, sizeof *numbers);
    if (numbers == NULL)
        return false;
    out->numbers = numbers;
    numbers[out->count++] = number;
    return add_bytes(&out->text, line, strlen(line)) && add_bytes(&out->text, "\n", 1);
}

/* The comments of the line that was read last, in their brackets or behind their semicolon. */
static bool add_comments(struct bytes *to, const struct text *text, size_t at) {
    while (at < text->size && text->bytes[at] != '\n' && text->bytes[at] != '\r') {
        size_t end = at + 1;
        const char opens = text->bytes[at];
        while (opens != '(' ? opens == ';' : text->bytes[end - 1] != ')') {
            if (end == text->size || text->bytes[end] == '\n' || text->bytes[end] == '\r')
                break;
            end++;
        }
        if ((opens == '(' || opens == ';') && !add_bytes(to, text->bytes + at, end - at))
            return false;
        at = end;
    }
    return true;
}

static void write_comments(void *ctx, const char *bytes, size_t count) {
    struct expand *out = ctx;
    out->short_of_memory |= !add_bytes(&out->comments, bytes, count);
}

/* Before what the line does, as the controller shows them. */
static void take_comments(struct run *run) {
    struct expand *out = run->out;
    const struct text *text = run->program.source.ctx;
    const struct text_out writer = {.write = write_comments, .ctx = out};
    const struct param_context context = {
        .gcode = &run->gcode, .params = &run->params, .line = run->program.line, .unknown = run->unknown};
    struct bytes raw = {0};
    if (!run->program.has_values)
        out->short_of_memory |= !add_comments(&out->comments, text, run->program.at.offset);
    else if (add_comments(&raw, text, run->program.at.offset) && add_bytes(&raw, "", 1))
        comment_print(&writer, &context, raw.items);
    else
        out->short_of_memory = true;
    free(raw.items);
    write_comments(out, "\n", 1);
}

/* ---- one run ---- */

/* What the machine does with a command, less the motion. @return the program ends */
static bool follow(struct run *run, const char *line, const struct gcode_command *command) {
    program_note(&run->program, command->modes);
    run->unknown = knowledge_after(run->unknown, line, command);
    gcode_offsets_apply(&run->gcode.offsets, command);
    gcode_modal_apply(&run->gcode, command);
    if (command->move.motion != MOTION_NONE)
        memcpy(run->gcode.position_mm, command->move.target_mm, sizeof run->gcode.position_mm);
    return command->flow == FLOW_END;
}

/* A $ line does who knows what. A line with an error does nothing; but where not all is known, the machine
 * may see none in it (an arc that begins elsewhere). */
static void lose_track(struct run *run, const char *line) {
    if (line[0] == '$' || run->unknown != NEEDS_PROBE)
        run->unknown = NEEDS_ALL;
}

/* The line as it goes over the wire; with fewer decimals where any controller can take it then. */
static enum status compute(struct run *run, struct formula *formula) {
    const struct param_context context = {
        .gcode = &run->gcode, .params = &run->params, .line = run->program.line, .unknown = run->unknown};
    const char *line = run->program.text;
    for (unsigned decimals = DECIMALS_MAX; decimals >= DECIMALS_MIN; decimals--) {
        enum status status = formula_compute(&context, line, decimals, formula);
        if (status != STATUS_OK)
            return status;
        if (strlen(formula->text) < (decimals > DECIMALS_MIN ? GRBL_LINE_SIZE : LINE_SIZE))
            return params_set(&run->params, formula->sets, formula->set_count);
    }
    return STATUS_LINE_TOO_LONG;
}

/* What the line says and does. $ lines and what is not G-code go through unchanged. */
static enum status take_line(struct run *run, bool *ends) {
    struct gcode_command command;
    struct formula formula;
    struct expand *out = run->out;
    const size_t comments_before = out->comments.size;
    const char *line = run->program.text;
    take_comments(run);
    if (line[0] != '$' && formula_is(line)) {
        enum status status = compute(run, &formula);
        if (status != STATUS_OK)
            return status;
        line = formula.text;
    }
    if (line[0] == '\0' && !run->program.has_message) {
        out->comments.size = comments_before;
        return STATUS_OK;
    }
    if (strlen(line) >= LINE_SIZE)
        return STATUS_LINE_TOO_LONG;
    out->short_of_memory |= !add_line(out, line, run->program.line);
    if (out->short_of_memory)
        *ends = true;
    /* The line goes out in any case; followed is only what the machine will execute. */
    else if (line[0] != '$' && gcode_line(&run->gcode, line, &command) == STATUS_OK)
        *ends = follow(run, line, &command);
    else
        lose_track(run, line);
    return STATUS_OK;
}

static void go(struct run *run, const struct text *text, uint32_t lines_max) {
    const struct program_source source = {text, read_text};
    struct program *program = &run->program;
    enum status status = program_begin(program, &source, lines_max);
    bool ends = false;
    while (status == STATUS_OK && !ends &&
           program_next(program, &run->params, &run->gcode, run->unknown) == PROGRAM_LINE)
        status = take_line(run, &ends);
    run->out->status = status != STATUS_OK ? status : program->status;
    run->out->line = program->line;
    program_note_end(program, ends, &run->out->end);
}

struct expand *expand_create(const char *text, size_t size, enum expand_start start, uint32_t lines_max) {
    const struct text whole = {text, size};
    struct run *run = calloc(1, sizeof *run);
    struct expand *out = calloc(1, sizeof *out);
    bool made = run != NULL && out != NULL;
    if (made) {
        run->out = out;
        run->unknown = start == EXPAND_ANYWHERE ? NEEDS_ALL : NEEDS_PROBE;
        run->gcode.axes = (axis_mask_t)((1u << AXIS_COUNT) - 1);
        run->gcode.ports = GCODE_PORTS_ALL;
        run->params.numbered = run->numbered;
        run->params.numbered_room = NUMBERED_ROOM;
        run->params.named = run->named;
        run->params.named_room = NAMED_ROOM;
        gcode_modal_init(&run->gcode.modal);
        go(run, &whole, lines_max);
        made = !out->short_of_memory;
    }
    free(run);
    if (made)
        return out;
    expand_destroy(out);
    return NULL;
}

void expand_destroy(struct expand *expand) {
    if (expand == NULL)
        return;
    free(expand->text.items);
    free(expand->comments.items);
    free(expand->numbers);
    free(expand);
}

int expand_error(const struct expand *expand) {
    return (int)expand->status;
}

uint32_t expand_error_line(const struct expand *expand) {
    return expand->line;
}

const char *expand_text(const struct expand *expand, size_t *size) {
    *size = expand->text.size;
    return expand->text.items;
}

const char *expand_comments(const struct expand *expand, size_t *size) {
    *size = expand->comments.size;
    return expand->comments.items;
}

size_t expand_lines(const struct expand *expand, const uint32_t **numbers) {
    *numbers = expand->numbers;
    return expand->count;
}

const struct program_end *expand_end(const struct expand *expand) {
    return &expand->end;
}

int expand_is_needed(const char *text, size_t size) {
    struct line_reader reader;
    enum line_result result = LINE_NONE;
    line_reader_reset(&reader);
    for (size_t taken = 0; taken < size;) {
        taken += line_reader_take(&reader, (const uint8_t *)text + taken, size - taken, &result);
        if (result == LINE_READY && program_is_jump(reader.text))
            return 1;
    }
    line_reader_put(&reader, '\n');
    return program_is_jump(reader.text);
}
