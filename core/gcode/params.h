/* SPDX-License-Identifier: MIT
 * What a program keeps in parameters: #1..#30, #31..#5000, #<local>, #<_global>. [task] Plain storage, given
 * by the owner at the beginning; nothing is allocated. Volatile: a reset clears all of it.
 *
 * Values are doubles, as every number from the text to the planner (number.h, gcode.h): an integer is exact
 * up to 2^53, and a target that went through a parameter is as good as one that was typed.
 *
 *   #1..#30       zero at the beginning; a subroutine has its own (program.h)
 *   #31..#5000    zero until set; `numbered_room` different ones may be set
 *   #<name>       lives until its subroutine returns, in the main program until the reset
 *   #<_name>      lives until the reset; a name that begins with _ is the same everywhere
 * and what is only read, from #5001 on and under reserved names, is computed in readings.h. */
#ifndef WIFICNC_GCODE_PARAMS_H
#define WIFICNC_GCODE_PARAMS_H

#include "base/axis.h"
#include "gcode/status.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum {
    PARAMS_LOCAL = 30,      /* #1 .. */
    PARAMS_USER_MAX = 5000, /* .. #5000 can be set */
    PARAMS_NAME_SIZE = 32,  /* characters of a name and its NUL */
};

struct param_numbered {
    double value;
    uint16_t number;
};

struct param_named {
    double value;
    uint8_t level; /* of the call that owns it; PARAMS_GLOBAL */
    char name[PARAMS_NAME_SIZE];
};
enum { PARAMS_GLOBAL = 255 };

struct params {
    double local[PARAMS_LOCAL];      /* #1 .. */
    struct param_numbered *numbered; /* the owner's, numbered_room of them */
    struct param_named *named;       /* the owner's, named_room of them */
    uint16_t numbered_room, numbered_count;
    uint16_t named_room, named_count;
    uint8_t level; /* calls now open */
    /* what others leave here for readings.c */
    double value; /* #<_value>: of the last return */
    bool value_returned;
    double input;                /* #5399: result of the last M66 */
    bool probe_ok;               /* #5070 */
    double probe_mm[AXIS_COUNT]; /* #5061..: work coordinates in which the probe moved, mm or degrees */
};

/** Which parameter. */
struct param_ref {
    const char *name; /* inside some text; NULL: numbered */
    uint8_t length;   /* of the name, 1 .. PARAMS_NAME_SIZE - 1 */
    uint16_t number;  /* 1 .. 65535, there may be no such parameter */
};

/** One assignment of a line. */
struct param_set {
    struct param_ref ref;
    double value;
};

/** Everything zero or gone; the room stays. */
void params_clear(struct params *params);

/** Value of #1 .. #5000 or of a name that a program has set.
 *  @return STATUS_PARAMETER_UNSET: no one set that name */
enum status params_get(const struct params *params, const struct param_ref *ref, double *value);

/** Do all assignments, in their order, or none. The refs must be assignable (readings_check_set()).
 *  @return STATUS_PARAMETER_ROOM: not all of them find room, and nothing was set */
enum status params_set(struct params *params, const struct param_set *sets, size_t count);

/** A subroutine begins: the names of its caller are out of sight. */
void params_enter(struct params *params);

/** It has returned: its names are gone. */
void params_leave(struct params *params);

#endif
