/* SPDX-License-Identifier: MIT
 * S of a laser along the path: constant from one mark to the next, whatever the chords are. [task]
 *
 * An engraved picture changes S ten times in a millimetre. Were each of its points the end of a chord, the
 * look-ahead would be as short as the points are near to each other; so S is kept apart from the geometry, as
 * marks on the length of the path, and points of a straight row become long chords whatever their S is:
 *
 *     moves    |S100|S300|S0 |S0 |S900|         power_mark() at each change
 *     chord    |-----------------------|        one; with its corners cut it has about the same length
 *     marks    100  300  0       900            in units from the start of the job
 *     segments |---------|-------------|        power_segment(): marks as parts of a segment's way
 *
 * A place is counted in 1/POWER_UNITS mm, modulo 2^32. Within a piece it goes with the way made of it, so the
 * end of a chord, the middle of its corner, is exactly where it was counted. */
#ifndef WIFICNC_MOTION_POWER_H
#define WIFICNC_MOTION_POWER_H

#include "hal/core_sizes.h"
#include "motion/beam.h"
#include "segment/queue.h"

/** In a mm, or a degree. */
#define POWER_UNITS 4096.0f
/** Of one chord at most, so that places of all chords ahead can be compared: a longer one has coarser units.
 */
#define POWER_CHORD_MAX (1u << 22)
/** POWER_MARKS (hal/core_sizes.h): with 2048 of them, 0.05 mm from each to the next, they reach over the
 * stopping way of a fast machine. */
_Static_assert((POWER_MARKS & (POWER_MARKS - 1)) == 0, "ring index is masked");

struct power_mark {
    uint32_t at; /* place */
    float rpm;   /* S from there on; 0: dark */
};

struct power {
    uint32_t most;       /* marks that it may hold: POWER_MARKS or less */
    uint32_t head, kept; /* kept: from here on they may be needed again */
    uint32_t end;        /* place where the newest closed chord ends */
    struct power_mark marks[POWER_MARKS];
};

/** Where the laser is on the path. */
struct power_place {
    uint32_t at;
    uint32_t mark; /* in force there */
};

/** One segment of motion, as a laser needs it. */
struct power_way {
    uint32_t to;     /* place at its end */
    float v0, v1;    /* speed at its start and end, mm/s */
    float feed_mm_s; /* F along the same path */
    float time_s;
    bool coarse; /* one mean of all its S */
};

/** Dark, at place 0. */
void power_reset(struct power *power);

/** Room for what one more move can mark. */
static inline bool power_has_room(const struct power *power) {
    return power->head - power->kept < power->most;
}

/** S at the end of what is marked. */
static inline float power_rpm(const struct power *power) {
    return power->marks[(power->head - 1) & (POWER_MARKS - 1)].rpm;
}

/** S from this place on, or from the newest mark on if that is later. */
void power_mark(struct power *power, uint32_t at, float rpm);

/** @return units of this length */
uint32_t power_units(float mm);

/** A chord ends. @return its units */
uint32_t power_close(struct power *power, float length_mm);

/** Give a segment its duty, from the place to way->to, which becomes the place. Its steps are set: nothing
 * finer can be shown. */
void power_segment(const struct power *power, struct power_place *place, const struct power_way *way,
                   const struct beam *beam, struct segment_queue *queue, struct segment *segment);

#endif
