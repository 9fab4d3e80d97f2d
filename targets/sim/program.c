/* SPDX-License-Identifier: MIT
 * What is open (loops, ifs, calls) lies on two small stacks. What is not taken is skipped by reading on to
 * the O line with the same label, so that no table of jumps is needed, however long the file. */
#include "program.h"

#include "gcode/block.h"
#include "oword.h"
#include "program_text.h"

#include <string.h>

#define KIND_BIT(kind) (1u << (kind))

/* A step of the program needs all of these. */
struct step {
    struct program *program;
    struct params *params;
    const struct param_context *context;
    const struct oword *oword;
};

/* ---- subroutines ---- */

static struct program_sub *find_sub(struct program *program, const struct program_label *label) {
    for (unsigned i = 0; i < program->sub_count; i++) {
        if (oword_same(&program->subs[i].label, label))
            return &program->subs[i];
    }
    return NULL;
}

static enum status note_sub(struct program *program, const struct oword *oword, struct program_sub **open) {
    if (oword->kind == OWORD_ENDSUB) {
        if (*open == NULL || !oword_same(&(*open)->label, &oword->label))
            return STATUS_O_WORD_UNMATCHED;
        (*open)->after = program->next;
        *open = NULL;
        return STATUS_OK;
    }
    if (*open != NULL)
        return STATUS_O_WORD_UNMATCHED;
    if (find_sub(program, &oword->label) != NULL)
        return STATUS_SUB_REPEATED;
    if (program->sub_count == PROGRAM_SUBS_MAX)
        return STATUS_SUB_ROOM;
    *open = &program->subs[program->sub_count++];
    **open = (struct program_sub){.label = oword->label, .body = program->next};
    return STATUS_OK;
}

/* Once over the whole file, because a subroutine may be called before it is defined. Labels that are
 * computed are read with no context: only calls may have them, and a call is not noted. */
static enum status note_subs(struct program *program) {
    struct program_sub *open = NULL;
    bool more = true, has_code = false;

    for (;;) {
        struct oword oword;
        enum status status = program_read_line(program, &more);

        if (status == STATUS_OK && !more)
            break;
        if (has_code && program_end_is_percent(program->text)) {
            program->end = program->at.offset;
            break;
        }
        has_code |= program->text[0] != '\0' && !gcode_is_program_mark(program->text);
        if (status == STATUS_OK)
            status = oword_read(NULL, program->text, &oword);
        if (status == STATUS_OK && (oword.kind == OWORD_SUB || oword.kind == OWORD_ENDSUB))
            status = note_sub(program, &oword, &open);
        if (status != STATUS_OK)
            return status;
    }
    if (open == NULL)
        return STATUS_OK;
    /* The error is reported at the SUB line that has no end. */
    program->line = open->body.line - 1;
    return STATUS_O_WORD_UNMATCHED;
}

enum status program_begin(struct program *program, const struct program_source *source, uint32_t lines_max) {
    program->source = *source;
    program->next = (struct program_at){.offset = 0, .line = 1};
    program->line = 0;
    program->end = UINT32_MAX;
    program->lines_left = lines_max;
    program->chunk_offset = program->chunk_count = 0;
    program->sub_count = program->block_count = program->call_count = 0;
    program->saves = 0;
    program->restores = false;
    program->status = note_subs(program);
    program->next = (struct program_at){.offset = 0, .line = 1};
    return program->status;
}

/* ---- what is open ---- */

/* Blocks of the present subroutine begin here. */
static unsigned first_block(const struct program *program) {
    return program->call_count > 0 ? program->calls[program->call_count - 1].blocks : 0;
}

/* The innermost one, if it is of these kinds and has this label. */
static struct program_block *innermost(struct program *program, const struct program_label *label,
                                       unsigned kinds) {
    struct program_block *block;

    if (program->block_count <= first_block(program))
        return NULL;
    block = &program->blocks[program->block_count - 1];
    return (kinds & KIND_BIT(block->kind)) != 0 && oword_same(&block->label, label) ? block : NULL;
}

static enum status open_block(const struct step *step, struct program_at from, uint32_t left) {
    struct program *program = step->program;

    if (program->block_count == PROGRAM_BLOCKS_MAX)
        return STATUS_PROGRAM_DEPTH;
    program->blocks[program->block_count++] = (struct program_block){
        .label = step->oword->label,
        .kind = (uint8_t)step->oword->kind,
        .left = left,
        .from = from,
        .line = program->line,
    };
    return STATUS_OK;
}

/* Read on to the O line with this label and one of these keywords, which *found becomes; it is not carried
 * out, and reading continues after it. The text of the line is program->text. */
static enum status skip_to(struct program *program, const struct program_label *label, unsigned kinds,
                           struct oword *found) {
    const struct program_label wanted = *label;
    const uint32_t from_line = program->line;

    for (;;) {
        bool more;
        enum status status = program_read_line(program, &more);

        if (status == STATUS_OK && more)
            status = oword_read(NULL, program->text, found);
        if (status != STATUS_OK)
            return status;
        /* A loop or an if does not reach into or out of a subroutine. */
        if (!more || found->kind == OWORD_SUB || found->kind == OWORD_ENDSUB)
            break;
        if ((kinds & KIND_BIT(found->kind)) != 0 && oword_same(&found->label, &wanted))
            return STATUS_OK;
    }
    program->line = from_line;
    return STATUS_O_WORD_UNMATCHED;
}

static enum status condition(const struct param_context *context, const struct oword *oword, double *value) {
    bool given;
    const enum status status = oword_value(context, oword, &given, value);

    return status == STATUS_OK && !given ? STATUS_O_WORD_SYNTAX : status;
}

/* ---- if ---- */

/* From an IF or ELSEIF that is false to the branch that is taken. */
static enum status find_branch(const struct step *step) {
    struct program *program = step->program;
    struct param_context context = *step->context;
    struct oword found = *step->oword;
    const struct program_label label = found.label;
    const unsigned kinds = KIND_BIT(OWORD_ELSEIF) | KIND_BIT(OWORD_ELSE) | KIND_BIT(OWORD_ENDIF);
    double value = 0.0;

    while (value == 0.0) {
        const enum status status = skip_to(program, &label, kinds, &found);

        if (status != STATUS_OK || found.kind == OWORD_ENDIF)
            return status;
        if (found.kind == OWORD_ELSE)
            break;
        /* Of the ELSEIF, for what a condition may read (#<_line>). */
        context.line = program->line;
        const enum status computed = condition(&context, &found, &value);
        if (computed != STATUS_OK)
            return computed;
    }
    return open_block(step, program->next, 0);
}

static enum status take_if(const struct step *step) {
    double value;
    const enum status status = condition(step->context, step->oword, &value);

    if (status != STATUS_OK)
        return status;
    return value != 0.0 ? open_block(step, step->program->next, 0) : find_branch(step);
}

/* ELSEIF and ELSE end the branch that was taken. */
static enum status end_branch(const struct step *step) {
    struct oword found;

    if (innermost(step->program, &step->oword->label, KIND_BIT(OWORD_IF)) == NULL)
        return STATUS_O_WORD_UNMATCHED;
    step->program->block_count--;
    if (step->oword->kind == OWORD_ENDIF)
        return STATUS_OK;
    return skip_to(step->program, &step->oword->label, KIND_BIT(OWORD_ENDIF), &found);
}

/* ---- loops ---- */

static enum status take_while(const struct step *step) {
    struct program *program = step->program;
    const struct program_block *end_of = innermost(program, &step->oword->label, KIND_BIT(OWORD_DO));
    struct oword found;
    double value;
    const enum status status = condition(step->context, step->oword, &value);

    if (status != STATUS_OK)
        return status;
    if (end_of != NULL) {
        if (value != 0.0)
            program->next = end_of->from;
        else
            program->block_count--;
        return STATUS_OK;
    }
    if (value == 0.0)
        return skip_to(program, &step->oword->label, KIND_BIT(OWORD_ENDWHILE), &found);
    /* From the WHILE line itself, so that its condition is computed again in each round. */
    return open_block(step, program->at, 0);
}

static enum status end_while(const struct step *step) {
    const struct program_block *block = innermost(step->program, &step->oword->label, KIND_BIT(OWORD_WHILE));

    if (block == NULL)
        return STATUS_O_WORD_UNMATCHED;
    step->program->next = block->from;
    step->program->block_count--;
    return STATUS_OK;
}

static enum status take_repeat(const struct step *step) {
    struct oword found;
    double count;
    const enum status status = condition(step->context, step->oword, &count);

    if (status != STATUS_OK)
        return status;
    if (count >= (double)UINT32_MAX)
        return STATUS_EXPRESSION_RESULT;
    if (count < 0.5)
        return skip_to(step->program, &step->oword->label, KIND_BIT(OWORD_ENDREPEAT), &found);
    return open_block(step, step->program->next, (uint32_t)(count + 0.5) - 1);
}

static enum status end_repeat(const struct step *step) {
    struct program_block *block = innermost(step->program, &step->oword->label, KIND_BIT(OWORD_REPEAT));

    if (block == NULL)
        return STATUS_O_WORD_UNMATCHED;
    if (block->left > 0) {
        block->left--;
        step->program->next = block->from;
    } else {
        step->program->block_count--;
    }
    return STATUS_OK;
}

/* BREAK, CONTINUE: leave what is open inside of the loop, then go to its end, or behind it. */
static enum status leave_loop(const struct step *step) {
    static const uint8_t ends[OWORD_COUNT] = {
        [OWORD_WHILE] = OWORD_ENDWHILE, [OWORD_DO] = OWORD_WHILE, [OWORD_REPEAT] = OWORD_ENDREPEAT};
    const unsigned loops = KIND_BIT(OWORD_WHILE) | KIND_BIT(OWORD_DO) | KIND_BIT(OWORD_REPEAT);
    struct program *program = step->program;
    const struct program_block *block;
    struct oword found;
    enum status status;

    while ((block = innermost(program, &step->oword->label, loops)) == NULL) {
        if (program->block_count <= first_block(program))
            return STATUS_O_WORD_UNMATCHED;
        program->block_count--;
    }
    status = skip_to(program, &step->oword->label, KIND_BIT(ends[block->kind]), &found);
    if (status != STATUS_OK)
        return status;
    if (step->oword->kind == OWORD_BREAK)
        program->block_count--;
    else
        program->next = program->at;
    return STATUS_OK;
}

/* ---- calls ---- */

static enum status take_call(const struct step *step) {
    struct program *program = step->program;
    const struct program_sub *sub = find_sub(program, &step->oword->label);
    double arguments[PARAMS_LOCAL];
    struct program_call *call;
    enum status status;

    if (sub == NULL)
        return STATUS_SUB_UNKNOWN;
    if (program->call_count == PROGRAM_CALLS_MAX)
        return STATUS_PROGRAM_DEPTH;
    status = oword_arguments(step->context, step->oword, arguments);
    if (status != STATUS_OK)
        return status;
    call = &program->calls[program->call_count++];
    call->sub = sub;
    call->back = program->next;
    call->blocks = program->block_count;
    call->saved = 0;
    memcpy(call->local, step->params->local, sizeof call->local);
    memcpy(step->params->local, arguments, sizeof arguments);
    step->params->value = 0.0;
    step->params->value_returned = false;
    params_enter(step->params);
    program->next = sub->body;
    return STATUS_OK;
}

void program_note(struct program *program, enum gcode_modes modes) {
    if (modes == MODES_KEEP || modes == MODES_RESTORE)
        return;
    program->saves++;
    if (modes == MODES_SAVE_FOR_SUB && program->call_count > 0)
        program->calls[program->call_count - 1].saved = program->saves;
}

/* RETURN, ENDSUB. */
static enum status end_call(const struct step *step) {
    struct program *program = step->program;
    const struct program_call *call;
    double value;
    bool given;
    enum status status;

    if (program->call_count == 0)
        return STATUS_O_WORD_UNMATCHED;
    call = &program->calls[program->call_count - 1];
    /* The label of RETURN is that of what surrounds it, an if perhaps; LinuxCNC does not compare it. */
    if (step->oword->kind == OWORD_ENDSUB && !oword_same(&call->sub->label, &step->oword->label))
        return STATUS_O_WORD_UNMATCHED;
    if (step->oword->kind == OWORD_ENDSUB && program->block_count > call->blocks) {
        program->line = program->blocks[program->block_count - 1].line;
        return STATUS_O_WORD_UNMATCHED;
    }
    status = oword_value(step->context, step->oword, &given, &value);
    if (status != STATUS_OK)
        return status;
    step->params->value = value;
    step->params->value_returned = given;
    params_leave(step->params);
    memcpy(step->params->local, call->local, sizeof call->local);
    program->block_count = call->blocks;
    program->next = call->back;
    program->call_count--;
    /* M73: the caller gets its modes back by a line M72 of our own. A later M70 to M73 has overwritten
     * what that would restore, which is an error. */
    program->restores = call->saved != 0;
    return call->saved == 0 || call->saved == program->saves ? STATUS_OK : STATUS_SAVED_OVER;
}

/* A subroutine is passed over where it is. */
static enum status pass_sub(const struct step *step) {
    step->program->next = find_sub(step->program, &step->oword->label)->after;
    return step->program->block_count > 0 ? STATUS_O_WORD_UNMATCHED : STATUS_OK;
}

/* ---- the way through ---- */

static enum status take_oword(const struct step *step) {
    switch (step->oword->kind) {
    case OWORD_SUB:
        return pass_sub(step);
    case OWORD_CALL:
        return take_call(step);
    case OWORD_RETURN:
    case OWORD_ENDSUB:
        return end_call(step);
    case OWORD_IF:
        return take_if(step);
    case OWORD_ELSEIF:
    case OWORD_ELSE:
    case OWORD_ENDIF:
        return end_branch(step);
    case OWORD_WHILE:
        return take_while(step);
    case OWORD_ENDWHILE:
        return end_while(step);
    case OWORD_DO:
        return open_block(step, step->program->next, 0);
    case OWORD_REPEAT:
        return take_repeat(step);
    case OWORD_ENDREPEAT:
        return end_repeat(step);
    case OWORD_BREAK:
    case OWORD_CONTINUE:
        return leave_loop(step);
    case OWORD_NONE:
    case OWORD_COUNT:
        break;
    }
    return STATUS_OK;
}

/* The end of the text ends everything that is open, which should be nothing. */
static enum status end_text(struct program *program) {
    if (program->block_count == 0)
        return STATUS_OK;
    program->line = program->blocks[program->block_count - 1].line;
    return STATUS_O_WORD_UNMATCHED;
}

/* One line. @param more  false: there was none @param plain  it is for the caller */
static enum status take_line(struct program *program, struct params *params, struct param_context context,
                             bool *more, bool *plain) {
    static const char restore[] = "M72";
    struct oword oword;
    const struct step step = {.program = program, .params = params, .context = &context, .oword = &oword};
    enum status status;

    *plain = program->restores;
    if (program->restores) {
        memcpy(program->text, restore, sizeof restore);
        program->restores = program->has_message = false;
        return STATUS_OK;
    }
    status = program_read_line(program, more);
    if (status != STATUS_OK)
        return status;
    if (!*more)
        return end_text(program);
    if (program->lines_left == 0)
        return STATUS_PROGRAM_ENDLESS;
    program->lines_left--;
    context.line = program->line;
    status = oword_read(&context, program->text, &oword);
    if (status != STATUS_OK)
        return status;
    *plain = oword.kind == OWORD_NONE && (program->text[0] != '\0' || program->has_message) &&
             !gcode_is_program_mark(program->text);
    return take_oword(&step);
}

enum program_result program_next(struct program *program, struct params *params,
                                 const struct gcode_state *gcode, uint32_t unknown) {
    const struct param_context context = {.gcode = gcode, .params = params, .unknown = unknown};
    bool more = true, plain = false;

    while (program->status == STATUS_OK && more && !plain)
        program->status = take_line(program, params, context, &more, &plain);
    if (program->status != STATUS_OK)
        return PROGRAM_FAILED;
    return plain ? PROGRAM_LINE : PROGRAM_DONE;
}

/* Past the subroutine that begins here; @return false: this is none */
static bool pass_body(struct program *program) {
    struct oword oword;
    if (oword_read(NULL, program->text, &oword) != STATUS_OK || oword.kind != OWORD_SUB)
        return false;
    const struct program_sub *sub = find_sub(program, &oword.label);
    if (sub != NULL)
        program->next = sub->after;
    return sub != NULL;
}

void program_note_end(struct program *program, bool ends, struct program_end *out) {
    bool more = true;
    *out = (struct program_end){.has_code = true, .is_open = program->end != UINT32_MAX};
    if (program->status != STATUS_OK || (ends && (program->call_count > 0 || program->block_count > 0)))
        return;
    if (ends)
        out->line = program->line;
    program->end = UINT32_MAX;
    while (program_read_line(program, &more) != STATUS_PROGRAM_READ && more)
        if (out->line == 0 || !pass_body(program))
            (void)program_end_take(out, program->text, program->line);
}

bool program_is_jump(const char *line) {
    struct oword oword;

    return oword_read(NULL, line, &oword) == STATUS_OK && oword.kind != OWORD_NONE;
}
