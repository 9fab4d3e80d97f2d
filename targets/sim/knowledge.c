/* SPDX-License-Identifier: MIT */
#include "knowledge.h"

#include "gcode/block.h"

/* Modes that the codes and words of the line have set. */
static uint32_t made_known(const struct gcode_block *block) {
    static const struct {
        uint8_t group;
        uint32_t needs;
    } groups[] = {
        {GROUP_UNITS, NEEDS_UNITS},         {GROUP_DISTANCE, NEEDS_DISTANCE},
        {GROUP_PLANE, NEEDS_PLANE},         {GROUP_ARC_DISTANCE, NEEDS_ARC_DISTANCE},
        {GROUP_FEED_MODE, NEEDS_FEED_MODE}, {GROUP_WCS, NEEDS_WCS},
        {GROUP_MOTION, NEEDS_MOTION},       {GROUP_SPINDLE, NEEDS_SPINDLE},
        {GROUP_RETRACT, NEEDS_RETRACT},
    };
    uint32_t known = 0;

    for (unsigned i = 0; i < sizeof groups / sizeof groups[0]; i++) {
        if (block_has_group(block, (enum block_group)groups[i].group))
            known |= groups[i].needs;
    }
    if (block_has_group(block, GROUP_COOLANT) && block->value[GROUP_COOLANT] == 0)
        known |= NEEDS_COOLANT; /* M9; M7 and M8 leave the other as it was */
    if (block->words & WORD_BIT('S'))
        known |= NEEDS_RPM;
    if (block->words & WORD_BIT('T'))
        known |= NEEDS_TOOL;
    return known;
}

/* How long was what was counted in the unit before? */
static bool loses_lengths(uint32_t unknown, const struct gcode_block *block) {
    return block_has_group(block, GROUP_UNITS) && (unknown & NEEDS_UNITS) != 0;
}

/* M72 brings back modes of which it is not known any more whether they were set or found. */
static uint32_t after_restore(uint32_t unknown, const struct gcode_command *command) {
    return command->modes == MODES_RESTORE && (unknown & ~NEEDS_PROBE) != 0 ? unknown | NEEDS_ALL : unknown;
}

/* Work coordinates are other ones after the line, or it goes where only the machine knows. */
static bool loses_position(uint32_t unknown, const struct gcode_block *block,
                           const struct gcode_command *command) {
    const uint8_t nonmodal = block->value[GROUP_NONMODAL];

    if (command->move.motion == MOTION_PROBE || command->move.motion == MOTION_CYCLE ||
        command->move.motion == MOTION_THREAD)
        return true;
    return (unknown & NEEDS_OFFSETS) != 0 &&
           (block_has_group(block, GROUP_WCS) || block_has_group(block, GROUP_TOOL_LENGTH) ||
            (nonmodal != NONMODAL_NONE && nonmodal != NONMODAL_DWELL));
}

static uint32_t after_move(uint32_t unknown, const struct gcode_block *block,
                           const struct gcode_command *command) {
    const bool absolute = (unknown & NEEDS_DISTANCE) == 0 && !command->next.incremental;

    if (command->move.motion > MOTION_ARC_CCW)
        return unknown;
    for (unsigned axis = 0; axis < AXIS_COUNT; axis++) {
        if (!(block_axis_words(block) >> axis & 1))
            continue;
        if (absolute)
            unknown &= ~NEEDS_WORK(axis);
        else if (unknown & NEEDS_DISTANCE)
            unknown |= NEEDS_WORK(axis);
    }
    return unknown;
}

uint32_t knowledge_after(uint32_t unknown, const char *line, const struct gcode_command *command) {
    struct gcode_block block;
    const bool stands_somewhere = (unknown & NEEDS_WORK_ALL) != 0;

    if (gcode_parse(line, &block) != STATUS_OK)
        return unknown;
    if (command->store != STORE_NOTHING && stands_somewhere)
        unknown |= NEEDS_OFFSETS; /* G92 and G10 L20 count from there */
    if (loses_lengths(unknown, &block))
        unknown |= NEEDS_WORK_ALL | NEEDS_FEED;
    if (loses_position(unknown, &block, command))
        unknown |= NEEDS_WORK_ALL;
    unknown &= ~made_known(&block);
    if (block.value[GROUP_NONMODAL] == NONMODAL_NONE)
        unknown = after_move(unknown, &block, command);
    if ((block.words & WORD_BIT('F')) && !(unknown & NEEDS_FEED_MODE))
        unknown &= ~NEEDS_FEED;
    unknown = after_restore(unknown, command);
    if (command->tool_change && !(unknown & NEEDS_TOOL))
        unknown &= ~NEEDS_TOOL_IN_SPINDLE;
    return unknown;
}
