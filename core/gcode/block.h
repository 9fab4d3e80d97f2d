/* SPDX-License-Identifier: MIT
 * A parsed line: which words with which numbers, which codes in which modal groups. No meaning, no units, no
 * state. For core/gcode, and for what reads programs in targets/sim. [task] Pure. */
#ifndef WIFICNC_GCODE_BLOCK_H
#define WIFICNC_GCODE_BLOCK_H

#include "base/axis.h"
#include "gcode/gcode.h"
#include "gcode/nonmodal_gen.h"

#include <stdbool.h>
#include <stdint.h>

/** Inlined into the ways that most lines go, and kept out of them: what few lines need shall not take
 * registers from all the others. */
#define HOT  inline __attribute__((always_inline))
#define COLD __attribute__((noinline, cold))

/** Modal groups; group n is bit n of gcode_block.groups. */
enum block_group {
    GROUP_NONMODAL,
    GROUP_MOTION,
    GROUP_PLANE,
    GROUP_DISTANCE,
    GROUP_ARC_DISTANCE,
    GROUP_FEED_MODE,
    GROUP_UNITS,
    GROUP_CUTTER,
    GROUP_TOOL_LENGTH,
    GROUP_WCS,
    GROUP_PATH,
    GROUP_FLOW,
    GROUP_SPINDLE,
    GROUP_COOLANT,
    GROUP_RETRACT,
    GROUP_TOOL,
    GROUP_OVERRIDE,
    GROUP_PORT,
    GROUP_LATHE,
    GROUP_MODES,
    GROUP_SPEED_MODE,
    GROUP_SCALING,
    GROUP_ROTATION,
    GROUP_POLAR,
    GROUP_COUNT
};

/** Values of GROUP_TOOL: M6, M61. */
enum block_tool { TOOL_CHANGES, TOOL_NAMED };

/** Values of GROUP_TOOL_LENGTH. Those of GROUP_NONMODAL are generated; the other groups use the enums of
 * gcode/gcode.h. */
enum block_tool_length { TOOL_LENGTH_DYNAMIC, TOOL_LENGTH_CANCEL, TOOL_LENGTH_TABLE, TOOL_LENGTH_ADD };

/** Value of GROUP_OVERRIDE: OVERRIDE_ bits in the low half and what to do with them in the high half. */
enum block_override { OVERRIDES_ON = 0, OVERRIDES_OFF = 16, OVERRIDES_BY_P = 32 };

/** Value of GROUP_PORT: bits. */
enum block_port { OUTPUT_OFF = 0, OUTPUT_ON = 1, OUTPUT_SYNC = 2, OUTPUT_ANALOG = 4, INPUT_WAIT = 8 };

/** Value of GROUP_MOTION: the motion in the low half; n of G38.n, the canned cycle or the kind of thread in
 * the high half. */
#define BLOCK_PROBE(n)      (MOTION_PROBE | (n) << 4)
#define BLOCK_CYCLE(cycle)  (MOTION_CYCLE | (cycle) << 4)
#define BLOCK_THREAD(kind)  (MOTION_THREAD | (kind) << 4)
#define BLOCK_MOTION(value) ((enum gcode_motion)((value) & 15))
#define BLOCK_KIND(value)   ((uint8_t)((value) >> 4))

/** Who takes the axis words of the line. */
enum block_axes {
    AXES_FREE,   /* no code did: they belong to the modal motion */
    AXES_MOTION, /* G0 .. G3, G38.n, canned cycles */
    AXES_STORE,  /* G10, G92 */
    AXES_HOME,   /* G28, G30 */
    AXES_TOOL_LENGTH,
};

/** Words are bits and indices by letter: A = 0 .. Z = 25. */
#define WORD(letter)     ((letter) - 'A')
#define WORD_BIT(letter) ((uint32_t)1 << WORD(letter))
#define WORDS_AXES                                                                                           \
    (WORD_BIT('X') | WORD_BIT('Y') | WORD_BIT('Z') | WORD_BIT('A') | WORD_BIT('B') | WORD_BIT('C'))
#define WORDS_CENTER (WORD_BIT('I') | WORD_BIT('J') | WORD_BIT('K'))

struct gcode_block {
    uint32_t words;  /* which numbers stand in the line; G and M never do */
    uint32_t groups; /* which groups have a value */
    uint8_t axes;    /* enum block_axes */
    uint8_t value[GROUP_COUNT];
    double number[26]; /* as written; valid where words has the bit */
};

/** Axis words of the block. */
static inline axis_mask_t block_axis_words(const struct gcode_block *block) {
    return (axis_mask_t)((block->words >> WORD('X') & 7u) | (block->words & 7u) << AXIS_A);
}

/** Index of an axis' word in gcode_block.number. */
static inline unsigned block_axis_word(unsigned axis) {
    return axis < AXIS_A ? (unsigned)WORD('X') + axis : axis - AXIS_A;
}

static inline bool block_has_group(const struct gcode_block *block, enum block_group group) {
    return (block->groups >> group & 1u) != 0;
}

/** A lone `%`, `O1000` or `:1000`, with or without an N word: the ends of a tape and the number of a program,
 * which CAM programs write around the G-code. They ask for nothing.
 *  @param line  filtered, upper case, NUL-terminated */
bool gcode_is_program_mark(const char *line);

/** Parse one filtered, NUL-terminated line of any length. Errors 1, 2, 4, 20, 21, 23, 24, 25, 38: the first
 * from the left. */
enum status gcode_parse(const char *line, struct gcode_block *block);

/** The same for a line as it came, which ends at LF or CR; spaces may follow its words.
 *  @return the end; NULL and *block undefined: the line needs the filter (anything but capitals, numbers and
 *          spaces), or has an error */
const char *gcode_parse_plain(const char *line, struct gcode_block *block);

#endif
