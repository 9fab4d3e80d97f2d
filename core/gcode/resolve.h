/* SPDX-License-Identifier: MIT
 * Block + state -> command, in Grbl 1.1h's order of checks. For core/gcode and readers of programs. [task]
 * Pure.
 *
 *   resolve.c        the order; modal groups, F S T N, dwell, path, program end
 *   resolve_straight.c  the short way of most lines
 *   resolve_store.c  G10 G28.1 G30.1 G92 G43 G49: new rows for the offsets
 *   resolve_machine.c M6 M48 .. M53, spindle, coolant
 *   resolve_port.c   M62 .. M68
 *   resolve_move.c   G0 G1 G2 G3 G38 G28 G30 G53: targets, feed
 *   resolve_cycle.c  G73 G81 .. G89: levels, holes, sticky words
 *   resolve_thread.c G33 G33.1 G76: ways and depths
 *   resolve_spline.c G5 G5.1: control points
 *   resolve_arc.c    the centre of an arc from I J K or R */
#ifndef WIFICNC_GCODE_RESOLVE_H
#define WIFICNC_GCODE_RESOLVE_H

#include "config.h"
#include "gcode/block.h"
#include "gcode/gcode.h"

#define MM_PER_INCH     25.4
#define S_PER_MIN       60.0
#define LINE_NUMBER_MAX 10000000.0

/** Give block its meaning in state. @return STATUS_OK and *command filled, or the error and *command
 * undefined */
enum status gcode_resolve(const struct gcode_state *state, const struct gcode_block *block,
                          struct gcode_command *command);

/** What the parts of gcode_resolve() share. */
struct resolver {
    const struct gcode_state *state;
    const struct gcode_block *block;
    struct gcode_command *out; /* out->next holds the modes of this line before any of the parts runs */
    uint32_t unused;           /* words that no one took so far; what is left at the end is error:36 */
    axis_mask_t axis_words;
    enum block_nonmodal nonmodal;
    enum block_axes axes;  /* as in the block, but AXES_MOTION when the modal motion takes the axis words */
    double unit_mm;        /* mm per programmed unit of length */
    const double *wcs_mm;  /* row of the coordinate system of this line */
    double tool_length_mm; /* in force for the motion of this line */
};

/** What a line does that says nothing of it. */
static inline void resolve_nothing(struct gcode_command *command) {
    command->tool_change = command->sync = command->port_sync = false;
    command->port = -1;
    command->coolant_passed = 0;
    command->dwell_s = -1.0f;
    command->store = STORE_NOTHING;
    command->store_tool_length = command->tool_table_used = false;
    command->flow = FLOW_RUN;
    command->modes = MODES_KEEP;
    command->line_number = 0;
    command->move.motion = MOTION_NONE;
    command->move.via = false;
    command->move.feed_mm_s = command->move.inverse_time_s = 0.0f;
    command->move.probe = 0;
}

/** Motion of the line: its own code, or the modal one. */
static inline enum gcode_motion resolve_motion(const struct gcode_state *state,
                                               const struct gcode_block *block) {
    return block_has_group(block, GROUP_MOTION) ? BLOCK_MOTION(block->value[GROUP_MOTION])
                                                : state->modal.motion;
}

/** Most lines of most jobs: G0 or G1, F, N and axis words, in the modes that are. */
static inline bool resolve_is_straight(const struct gcode_state *state, const struct gcode_block *block) {
    const uint32_t words = WORDS_AXES | WORD_BIT('F') | WORD_BIT('N');

    return (block->groups & ~(1u << GROUP_MOTION)) == 0 && (block->words & ~words) == 0 &&
           resolve_motion(state, block) <= MOTION_LINEAR && !state->modal.diameter &&
           state->modal.feed_mode == FEED_PER_MIN;
}

/** gcode_resolve() for these. Its own path, because it is what a job's speed comes from. */
enum status resolve_straight(const struct gcode_state *state, const struct gcode_block *block,
                             struct gcode_command *command);

enum status resolve_stores(struct resolver *r);
enum status resolve_move(struct resolver *r);

/** Where the axis words lead, in machine coordinates; other axes stay. */
enum status resolve_target(const struct resolver *r, double target_mm[AXIS_COUNT]);

/** Inputs and outputs, M62 .. M68. */
enum status resolve_port(struct resolver *r);
/** M6, M61, M48 .. M53. */
enum status resolve_switches(struct resolver *r);
/** Spindle and coolant for this line; and whether motion must finish first. */
void resolve_outputs(struct resolver *r);

/** A canned cycle into out->move. */
enum status resolve_cycle(struct resolver *r);

/** G33, G33.1 or G76 into out->move. */
enum status resolve_thread(struct resolver *r);

/** Control points of G5 and G5.1 into out->move.control_mm; the target is known. */
enum status resolve_spline(struct resolver *r);

/** Centre of the arc from the state's position to out->move.target_mm into out->move.center_mm. */
enum status resolve_arc(struct resolver *r);

/** F as a speed, mm/s; in G95 at the speed that S asks for. */
static inline float resolve_feed_mm_s(const struct gcode_modal *modal) {
    if (modal->feed_mode != FEED_PER_REV)
        return modal->feed_mm_s;
    return modal->feed_mm_s * (modal->spindle_rpm * (float)(1.0 / S_PER_MIN));
}

/** Take a word. @return false and *number unchanged if it is not there or was taken before */
static inline bool resolve_take(struct resolver *r, char letter, double *number) {
    const uint32_t bit = WORD_BIT(letter);

    if (!(r->unused & bit))
        return false;
    r->unused &= ~bit;
    *number = r->block->number[WORD(letter)];
    return true;
}

/** An axis word, mm or degrees: inches are lengths only. X may be a diameter (G7), I and R never. */
static inline double resolve_axis_word(const struct resolver *r, unsigned axis) {
    double number = r->block->number[block_axis_word(axis)];
    if (axis == AXIS_X && r->out->next.diameter)
        number *= 0.5;
    return axis < AXIS_A ? number * r->unit_mm : number;
}

/** Work offset of one axis in the coordinate system of this line. */
static inline double resolve_offset_mm(const struct resolver *r, unsigned axis) {
    const struct gcode_offsets *offsets = &r->state->offsets;
    const double offset = r->wcs_mm[axis] + offsets->g92_mm[axis];
    return axis == AXIS_Z ? offset + r->tool_length_mm : offset;
}

#endif
