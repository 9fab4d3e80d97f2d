/* SPDX-License-Identifier: MIT
 * Block + state -> command, in Grbl 1.1h's order of checks. Private to core/gcode and its tests. [task] Pure.
 *
 *   resolve.c        the order; modal groups, F S T N, dwell, path, program end
 *   resolve_store.c  G10 G28.1 G30.1 G92 G43 G49: new rows for the offsets
 *   resolve_machine.c M6 M48 .. M53 M62 .. M65, spindle, coolant
 *   resolve_move.c   G0 G1 G2 G3 G38 G28 G30 G53: targets, feed
 *   resolve_cycle.c  G73 G81 .. G89: levels, holes, sticky words
 *   resolve_arc.c    the centre of an arc from I J K or R */
#ifndef WIFICNC_GCODE_RESOLVE_H
#define WIFICNC_GCODE_RESOLVE_H

#include "gcode/block.h"
#include "gcode/gcode.h"

#include <math.h> // fabs

/** Give block its meaning in state. @return STATUS_OK and *command filled, or the error and *command
 * undefined */
enum status gcode_resolve(const struct gcode_state *state, const struct gcode_block *block,
                          struct gcode_command *command);

/** What the parts of gcode_resolve() share. */
struct resolver {
    const struct gcode_state *state;
    const struct gcode_block *block;
    struct gcode_command *out; /* out->next holds the modes of this line before any of the parts runs */
    uint32_t unused;           /* words that nobody took so far; what is left at the end is error:36 */
    axis_mask_t axis_words;
    enum block_nonmodal nonmodal;
    enum block_axes axes;  /* as in the block, but AXES_MOTION when the modal motion takes the axis words */
    double unit_mm;        /* mm per programmed unit of length */
    const double *wcs_mm;  /* row of the coordinate system of this line */
    double tool_length_mm; /* in force for the motion of this line */
};

enum status resolve_stores(struct resolver *r);
enum status resolve_move(struct resolver *r);

/** M6, M48 .. M53, M62 .. M65. */
enum status resolve_switches(struct resolver *r);
/** Spindle and coolant for this line; and whether motion must finish first. */
void resolve_outputs(struct resolver *r);

/** A canned cycle into out->move. */
enum status resolve_cycle(struct resolver *r);

/** Centre of the arc from the state's position to out->move.target_mm into out->move.center_mm. */
enum status resolve_arc(struct resolver *r);

/** Take a word. @return false and *number unchanged if it is not there or was taken before */
static inline bool resolve_take(struct resolver *r, char letter, double *number) {
    const uint32_t bit = WORD_BIT(letter);

    if (!(r->unused & bit))
        return false;
    r->unused &= ~bit;
    *number = r->block->number[WORD(letter)];
    return true;
}

/** An axis word, mm or degrees: inches are lengths only. */
static inline double resolve_axis_word(const struct resolver *r, unsigned axis) {
    const double number = r->block->number[block_axis_word(axis)];
    return axis < AXIS_A ? number * r->unit_mm : number;
}

/** Work offset of one axis in the coordinate system of this line. */
static inline double resolve_offset_mm(const struct resolver *r, unsigned axis) {
    const struct gcode_offsets *offsets = &r->state->offsets;
    const double offset = r->wcs_mm[axis] + offsets->g92_mm[axis];
    return axis == AXIS_Z ? offset + r->tool_length_mm : offset;
}

static inline bool resolve_in_range(double coordinate) {
    return fabs(coordinate) <= GCODE_COORDINATE_MAX;
}

#endif
