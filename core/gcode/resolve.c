/* SPDX-License-Identifier: MIT */
#include "gcode/resolve.h"

/* A typical line of a job: most of what follows is not about it. */
static inline bool only_motion(const struct gcode_block *block) {
    return (block->groups & ~(1u << GROUP_MOTION)) == 0;
}

/* F means something else on the other side of G95. */
static void switch_feed_mode(struct gcode_modal *next, enum gcode_feed_mode mode) {
    if ((next->feed_mode == FEED_PER_REV) != (mode == FEED_PER_REV))
        next->feed_mm_s = 0.0f;
    next->feed_mode = mode;
}

/* The codes of the line become its modes, before anything is checked against them. */
static void apply_modes(const struct gcode_state *state, const struct gcode_block *block,
                        struct gcode_modal *next) {
    const uint8_t *value = block->value;

    if (block_has_group(block, GROUP_MOTION)) {
        next->motion = BLOCK_MOTION(value[GROUP_MOTION]);
        next->probe = next->motion == MOTION_PROBE ? BLOCK_KIND(value[GROUP_MOTION]) : 0;
        next->cycle = next->motion == MOTION_CYCLE || next->motion == MOTION_THREAD
                          ? BLOCK_KIND(value[GROUP_MOTION])
                          : 0;
    }
    if (only_motion(block))
        return;
    if (block_has_group(block, GROUP_PLANE))
        next->plane = (enum gcode_plane)value[GROUP_PLANE];
    if (block_has_group(block, GROUP_DISTANCE))
        next->incremental = value[GROUP_DISTANCE];
    if (block_has_group(block, GROUP_ARC_DISTANCE))
        next->arc_absolute = value[GROUP_ARC_DISTANCE];
    if (block_has_group(block, GROUP_FEED_MODE))
        switch_feed_mode(next, (enum gcode_feed_mode)value[GROUP_FEED_MODE]);
    if (block_has_group(block, GROUP_UNITS))
        next->inches = value[GROUP_UNITS];
    if (block_has_group(block, GROUP_WCS))
        next->wcs = value[GROUP_WCS];
    if (block_has_group(block, GROUP_PATH))
        next->path = (enum gcode_path)value[GROUP_PATH];
    if (block_has_group(block, GROUP_LATHE))
        next->diameter = value[GROUP_LATHE];
    if (block_has_group(block, GROUP_RETRACT))
        next->retract_to_r = value[GROUP_RETRACT];
    /* M6 stops the spindle and the coolant for the tool change; M3 in the same line starts it again after
     * that. */
    if (block_has_group(block, GROUP_TOOL) && value[GROUP_TOOL] == TOOL_CHANGES &&
        !state->ports.no_tool_change) {
        next->spindle = SPINDLE_OFF;
        next->coolant = 0;
    }
    if (block_has_group(block, GROUP_SPINDLE))
        next->spindle = (enum gcode_spindle)value[GROUP_SPINDLE];
    if (block_has_group(block, GROUP_COOLANT)) /* M7 and M8 add up, M9 clears both */
        next->coolant = value[GROUP_COOLANT] ? next->coolant | value[GROUP_COOLANT] : 0;
}

/* M70 .. M73, before the other codes of the line. M72 leaves alone what has moved on since: the motion mode,
 * so that axis words do not mean something else, and the tools. */
static enum status resolve_modes(struct resolver *r) {
    const struct gcode_state *state = r->state;
    struct gcode_modal *next = &r->out->next;

    if (!block_has_group(r->block, GROUP_MODES))
        return STATUS_OK;
    r->out->modes = (enum gcode_modes)r->block->value[GROUP_MODES];
    if (r->out->modes != MODES_RESTORE)
        return STATUS_OK;
    if (!state->is_saved)
        return STATUS_NOTHING_SAVED;
    *next = state->saved;
    next->motion = state->modal.motion;
    next->probe = state->modal.probe;
    next->cycle = state->modal.cycle;
    next->tool = state->modal.tool;
    next->tool_in_spindle = state->modal.tool_in_spindle;
    r->out->store_tool_length = true;
    r->out->tool_length_mm = state->saved_tool_length_mm;
    return STATUS_OK;
}

/* N F S T. The number of F in G93 is left to resolve_move(). */
static enum status resolve_values(struct resolver *r) {
    struct gcode_modal *next = &r->out->next;
    double number;

    if (resolve_take(r, 'N', &number)) {
        /* A fraction is cut off, as in Grbl. */
        if (number >= LINE_NUMBER_MAX + 1.0)
            return STATUS_LINE_NUMBER;
        r->out->line_number = (uint32_t)number;
    }
    if (next->feed_mode == FEED_INVERSE_TIME) {
        const bool moves_at_feed =
            next->motion != MOTION_RAPID && next->motion != MOTION_NONE && next->motion != MOTION_THREAD;

        /* F of G93 is not modal: each line needs its own, and an F of before does not come back. */
        next->feed_mm_s = 0.0f;
        if (r->axes == AXES_MOTION && moves_at_feed && !(r->unused & WORD_BIT('F')))
            return STATUS_NO_FEED;
        r->unused &= ~WORD_BIT('F');
    } else if (resolve_take(r, 'F', &number)) {
        next->feed_mm_s = (float)(number * r->unit_mm / (next->feed_mode == FEED_PER_REV ? 1.0 : S_PER_MIN));
    }
    if (resolve_take(r, 'S', &number))
        next->spindle_rpm = (float)number;
    if (resolve_take(r, 'T', &number))
        next->tool = (int32_t)number;
    return STATUS_OK;
}

/* G65 P5 Q0 or Q1, as grblHAL has it; no other P is known. */
static enum status resolve_probe_input(struct resolver *r) {
    double p, q;

    if (!resolve_take(r, 'P', &p) || !resolve_take(r, 'Q', &q))
        return STATUS_VALUE_MISSING;
    if (p != 5.0 || (q != 0.0 && q != 1.0))
        return STATUS_UNSUPPORTED;
    if (q == 1.0 && !r->state->ports.toolsetter)
        return STATUS_NO_TOOLSETTER;
    r->out->next.toolsetter = q == 1.0;
    return STATUS_OK;
}

/* G4, G65. */
static enum status resolve_once(struct resolver *r) {
    double seconds;

    if (r->nonmodal == NONMODAL_PROBE_INPUT)
        return resolve_probe_input(r);
    if (r->nonmodal != NONMODAL_DWELL)
        return STATUS_OK;
    if (!resolve_take(r, 'P', &seconds))
        return STATUS_VALUE_MISSING;
    r->out->dwell_s = (float)seconds;
    return STATUS_OK;
}

/* G64 takes the P that neither G4 nor G10 wanted; G64 without P is back to $11 alone. Q, LinuxCNC's tolerance
 * for points that are left out, is taken and not needed: P and $11 hold for these, too. */
static void resolve_path(struct resolver *r) {
    double tolerance = 0.0;

    if (!block_has_group(r->block, GROUP_PATH) || r->out->next.path != PATH_BLEND)
        return;
    resolve_take(r, 'P', &tolerance);
    r->unused &= ~WORD_BIT('Q');
    r->out->next.path_tolerance_mm = (float)(tolerance * r->unit_mm);
}

static void resolve_flow(struct resolver *r) {
    struct gcode_modal *next = &r->out->next;

    if (!block_has_group(r->block, GROUP_FLOW))
        return;
    r->out->flow = (enum gcode_flow)r->block->value[GROUP_FLOW];
    if (r->out->flow == FLOW_END) { /* what Grbl's M2 and M30 set back: not units, S, F, T */
        next->motion = MOTION_LINEAR;
        next->plane = PLANE_XY;
        next->incremental = false;
        switch_feed_mode(next, FEED_PER_MIN);
        next->overrides = OVERRIDE_ALL;
        next->wcs = 0;
        next->spindle = SPINDLE_OFF;
        next->coolant = 0;
    }
}

/* M3, M4, M7 and M8 need their outputs. */
static enum status resolve_wiring(struct resolver *r) {
    const struct gcode_ports *ports = &r->state->ports;
    const uint8_t *value = r->block->value;
    if (block_has_group(r->block, GROUP_SPINDLE) &&
        !gcode_can_turn(ports, (enum gcode_spindle)value[GROUP_SPINDLE]))
        return STATUS_NO_OUTPUT;
    if (!block_has_group(r->block, GROUP_COOLANT))
        return STATUS_OK;
    r->out->coolant_passed = value[GROUP_COOLANT] & ports->no_coolant;
    r->out->next.coolant &= (uint8_t)~ports->no_coolant;
    return gcode_lacks_coolant(ports, value[GROUP_COOLANT]) ? STATUS_NO_OUTPUT : STATUS_OK;
}

/* Words that this machine or this line cannot have. */
static enum status refuse_words(const struct resolver *r) {
    if ((r->axis_words & ~r->state->axes) != 0)
        return STATUS_UNSUPPORTED;
    if ((r->block->words & WORD_BIT('E')) != 0 && !block_has_group(r->block, GROUP_PORT) &&
        resolve_motion(r->state, r->block) != MOTION_THREAD)
        return STATUS_UNSUPPORTED; /* as a word that does not exist */
    if (block_has_group(r->block, GROUP_SCALING) &&
        (r->axis_words != 0 || (r->block->words & WORD_BIT('S')) != 0))
        return STATUS_UNSUPPORTED; /* on a lathe these would preset coordinates, or limit the speed */
    return STATUS_OK;
}

static enum status resolve_any(const struct gcode_state *state, const struct gcode_block *block,
                               struct gcode_command *command) {
    struct resolver r = {
        .state = state,
        .block = block,
        .out = command,
        .unused = block->words,
        .axis_words = block_axis_words(block),
        .nonmodal = (enum block_nonmodal)block->value[GROUP_NONMODAL],
        .axes = (enum block_axes)block->axes,
    };
    enum status status = refuse_words(&r);

    if (status != STATUS_OK)
        return status;
    if (r.axes == AXES_FREE && r.axis_words != 0)
        r.axes = AXES_MOTION;
    command->next = state->modal;
    resolve_nothing(command);
    status = resolve_modes(&r);
    if (status != STATUS_OK)
        return status;
    /* Before any word is read: G20, G54 or G93 of a line count for its own words. */
    apply_modes(state, block, &command->next);
    r.unit_mm = command->next.inches ? MM_PER_INCH : 1.0;
    r.wcs_mm = state->offsets.wcs_mm[command->next.wcs];
    r.tool_length_mm = command->store_tool_length ? command->tool_length_mm : state->offsets.tool_length_mm;

    if (command->next.feed_mode == FEED_PER_REV && !(WITH_ENCODER && state->ports.encoder))
        return STATUS_NO_ENCODER;
    status = resolve_values(&r);
    if (status == STATUS_OK && !only_motion(block))
        status = resolve_wiring(&r);
    if (status == STATUS_OK && !only_motion(block))
        status = resolve_switches(&r);
    if (status == STATUS_OK && block_has_group(block, GROUP_PORT))
        status = resolve_port(&r);
    if (status == STATUS_OK && !only_motion(block))
        status = resolve_once(&r);
    if (status == STATUS_OK && !only_motion(block))
        status = resolve_stores(&r);
    if (status == STATUS_OK)
        status = resolve_move(&r);
    if (status != STATUS_OK)
        return status;
    resolve_path(&r);
    if (r.axes != AXES_FREE)
        r.unused &= ~WORDS_AXES;
    if (r.unused != 0) /* Grbl does not know these three */
        return (r.unused & (WORD_BIT('E') | WORD_BIT('H') | WORD_BIT('Q'))) != 0 ? STATUS_UNSUPPORTED
                                                                                 : STATUS_WORDS_UNUSED;
    /* After all that may fail, and in this order: what the line switches is the difference to the modes
     * before, and M2 or M30 then set modes back that the line's motion has still used. */
    resolve_outputs(&r);
    resolve_flow(&r);
    return STATUS_OK;
}

enum status gcode_resolve(const struct gcode_state *state, const struct gcode_block *block,
                          struct gcode_command *command) {
    return resolve_is_straight(state, block) ? resolve_straight(state, block, command)
                                             : resolve_any(state, block, command);
}
