/* SPDX-License-Identifier: MIT
 * What a laser burns, from the segments that are executed: energy by length, for pictures; and where constant
 * power (M3) burns too much because the machine is slower than the feed.
 *
 * Energy is in seconds at full power: the controller does not know how many watts that are. */
#ifndef WIFICNC_SIM_ENGRAVING_H
#define WIFICNC_SIM_ENGRAVING_H

#include "base/axis.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/** More than this times the energy of the programmed feed is too much ... */
#define ENGRAVING_LIMIT 1.2
/** ... where it is the mean of so much of the path: about the width of a beam. */
#define ENGRAVING_STRETCH_MM 0.1

enum { ENGRAVING_MAX_PIECES = 1 << 20 };

/** A straight piece with the beam on and one energy by length: X Y Z of the tool, machine coordinates. */
struct engraving_piece {
    float t_s; /* when it ends, since the job's begin */
    float from_mm[3], to_mm[3];
    float length_mm; /* as the feed counts: degrees when only A B C move; 0: burnt at rest */
    float energy_s;
};

struct engraving_result {
    double length_mm;    /* with the beam on */
    double constant_mm;  /* of this with constant power (M3) and a feed to compare with */
    double slow_mm;      /* of this with more than limit times the energy of its feed */
    double limit;        /* ENGRAVING_LIMIT */
    double worst;        /* most energy of a stretch, as part of what its feed gives; 0: no stretch */
    uint32_t worst_line; /* of the file */
    double worst_mm[3];  /* where it begins */
};

struct engraving;

/** @param lines  of the job @return NULL when memory is short */
struct engraving *engraving_create(size_t lines);
void engraving_destroy(struct engraving *engraving);

/** The job's line of this index was accepted. @param constant  power does not follow the speed (M3)
 * @param feed_mm_s  0: none, or inverse time */
void engraving_line(struct engraving *engraving, size_t index, bool constant, float feed_mm_s);

/** A straight part of the path was executed. */
struct engraving_part {
    size_t index;  /* of its line among the job's */
    uint32_t line; /* of the file */
    double end_s;  /* since the job's begin */
    double time_s;
    double duty; /* mean, 0 .. 1 */
    double length_mm;
    double from_mm[AXIS_COUNT], to_mm[AXIS_COUNT];
};
void engraving_take(struct engraving *engraving, const struct engraving_part *part);

/** Of more than ENGRAVING_MAX_PIECES neighbours are one. @return how many */
size_t engraving_pieces(const struct engraving *engraving, const struct engraving_piece **out);
void engraving_result(const struct engraving *engraving, struct engraving_result *out);

/** Memory was too short for all pieces. */
bool engraving_lost(const struct engraving *engraving);

#endif
