/* SPDX-License-Identifier: MIT
 * $J=: one move with units, distance mode and feed of its own. No mode of the program is touched. */
#include "gcode/resolve.h"

#include <string.h> // memcpy

#define JOG_GROUPS (1u << GROUP_NONMODAL | 1u << GROUP_DISTANCE | 1u << GROUP_UNITS)
#define JOG_WORDS  (WORDS_AXES | WORD_BIT('F') | WORD_BIT('N'))

enum status gcode_jog(const struct gcode_state *state, const char *line, struct gcode_command *command) {
    struct gcode_block block;
    struct gcode_state jog;
    enum status status = gcode_parse(line, &block);
    if (status != STATUS_OK)
        return status;
    if ((block_axis_words(&block) & ~state->axes) != 0)
        return STATUS_UNSUPPORTED;
    uint8_t nonmodal = block.value[GROUP_NONMODAL];
    if ((block.groups & ~JOG_GROUPS) != 0 || (block.words & ~JOG_WORDS) != 0 ||
        (nonmodal != NONMODAL_NONE && nonmodal != NONMODAL_MACHINE_COORDS))
        return STATUS_JOG_WORD;
    if ((block.words & WORD_BIT('F')) == 0)
        return STATUS_NO_FEED;
    if (block_axis_words(&block) == 0)
        return STATUS_NO_AXIS_WORDS;
    /* A copy, so that the program's modes stay as they are. */
    memcpy(&jog, state, sizeof jog);
    jog.modal.motion = MOTION_LINEAR;
    jog.modal.feed_mode = FEED_PER_MIN;
    status = gcode_resolve(&jog, &block, command);
    command->next = state->modal;
    command->sync = false;
    return status;
}
