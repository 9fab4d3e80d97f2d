/* SPDX-License-Identifier: MIT */
#include "gcode/resolve.h"

#define TOOL_NUMBER_MAX 255.0 /* as of T */

/* M6: the tool that T chose. Spindle and coolant go off (resolve.c), unless the line switches them on again.
 */
static void change_tool(struct resolver *r) {
    r->out->tool_change = !r->state->ports.no_tool_change;
    r->out->next.tool_in_spindle = r->out->next.tool;
}

/* M48 M49; M50 M51 M53 with P0 off, any other P or none on. */
static void switch_overrides(struct resolver *r) {
    const unsigned value = r->block->value[GROUP_OVERRIDE];
    const unsigned bits = value & OVERRIDE_ALL;
    uint8_t *overrides = &r->out->next.overrides;
    bool on = (value & ~(unsigned)OVERRIDE_ALL) != OVERRIDES_OFF;
    double p;

    if ((value & OVERRIDES_BY_P) != 0 && resolve_take(r, 'P', &p))
        on = p != 0.0;
    *overrides = (uint8_t)(on ? *overrides | bits : *overrides & ~bits);
}

/* M61 Q: this tool is in the spindle already. */
static enum status name_tool(struct resolver *r) {
    double number;

    if (!resolve_take(r, 'Q', &number))
        return STATUS_VALUE_MISSING;
    if (number < 0.0)
        return STATUS_NEGATIVE;
    if (number > TOOL_NUMBER_MAX)
        return STATUS_TOOL_NUMBER;
    r->out->next.tool = r->out->next.tool_in_spindle = (int32_t)number;
    return number == r->out->next.tool ? STATUS_OK : STATUS_NOT_INTEGER;
}

enum status resolve_switches(struct resolver *r) {
    enum status status = STATUS_OK;

    if (block_has_group(r->block, GROUP_TOOL) && r->block->value[GROUP_TOOL] == TOOL_CHANGES)
        change_tool(r);
    else if (block_has_group(r->block, GROUP_TOOL))
        status = name_tool(r);
    if (block_has_group(r->block, GROUP_OVERRIDE))
        switch_overrides(r);
    return status;
}

void resolve_outputs(struct resolver *r) {
    const struct gcode_modal *before = &r->state->modal;
    struct gcode_command *out = r->out;
    const enum gcode_spindle spindle = out->tool_change ? SPINDLE_OFF : before->spindle;
    const uint8_t coolant = out->tool_change ? 0 : before->coolant;

    out->spindle = out->next.spindle;
    out->coolant = out->next.coolant;
    /* What waits for the moves before it: an output or mode that must change between two moves. */
    out->sync = out->spindle != spindle || out->coolant != coolant ||
                (out->spindle != SPINDLE_OFF && out->next.spindle_rpm != before->spindle_rpm) ||
                out->next.overrides != before->overrides || out->port_sync ||
                (out->next.feed_mode == FEED_PER_REV) != (before->feed_mode == FEED_PER_REV);
}
