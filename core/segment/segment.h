/* SPDX-License-Identifier: MIT
 * The segment: the one type in which motion reaches the motion side, whoever planned it.
 *
 * A segment says how many steps each axis makes, how long that takes, and how much faster it ends than it
 * begins:
 *
 *     speed along the segment:  v(t) = vm (1 + r (2t/T - 1)),   vm = steps/T,   r = ramp / 32767
 *
 * Steps and duration are exact; the ramp only shapes the time between. So a segment cannot contradict itself
 * (speeds, acceleration and distance that do not fit each other), no speed or square of a speed can overflow,
 * and a timed segment of a network host (steps and duration, speeds unknown) is the same thing with ramp 0.
 *
 * The dominant axis is the one with most steps; the others follow by DDA. All of them may be anywhere
 * between two steps when the segment begins and ends: `phase` and `phase_end` say where, so that steps come
 * when they are due, and stay even across segments. Steps are exact whatever the phases say. */
#ifndef WIFICNC_SEGMENT_SEGMENT_H
#define WIFICNC_SEGMENT_SEGMENT_H

#include "base/axis.h"

#include <stdint.h>

/** The low four are those of the wire, too (protocol/wmc3.toml); core/session/segment.c asserts that. */
enum segment_flags {
    SEGMENT_RAPID = 0x01,      /* G0 */
    SEGMENT_LAST = 0x02,       /* ends at rest, and nothing is known to follow */
    SEGMENT_PROBE = 0x04,      /* the step ISR watches the probe pin */
    SEGMENT_EXACT_STOP = 0x08, /* ends at rest because the program asked for it */
    SEGMENT_DWELL = 0x10,      /* no steps, only time */
    SEGMENT_JOG = 0x20,
    SEGMENT_CUT = 0x40, /* a laser may burn here; without it `duty` is 0 */
};

enum {
    SEGMENT_RAMP_ONE = 32767,  /* ramp of a segment that starts at rest; -32767: ends at rest */
    SEGMENT_PHASE_HALF = 128,  /* is exactly on a step: the next one is half a step past it */
    SEGMENT_MAX_STEPS = 16383, /* of the dominant axis; longer moves are cut */
};

/** Phases: 1/256 step already travelled towards the next step, in the direction of travel. */
struct segment {
    int16_t steps[AXIS_COUNT];     /* signed, |steps| <= SEGMENT_MAX_STEPS */
    uint8_t phase[AXIS_COUNT];     /* at the start */
    uint8_t phase_end[AXIS_COUNT]; /* at the end */
    uint32_t duration_ns;          /* > 0; longer motion (dwell) is several segments */
    int16_t ramp;                  /* (v_end - v_start)/(v_end + v_start) in 1/32767 */
    uint16_t id;                   /* counts up; a host's own number for host segments */
    uint32_t line;                 /* source line, 0 = unknown */
    uint8_t flags;                 /* enum segment_flags */
    uint8_t mark;                  /* motion may branch off after it: place of the mark + 1; 0: it may not */
    uint8_t power_first, power_count; /* changes of S within it: of segment_queue.power */
    uint32_t end_us;                  /* motion time at its end (segment/queue.h) */
    float v_mm_s;                     /* path speed at its end */
    uint16_t duty[2]; /* of a laser at the start and at the end, 0 .. DUTY_FULL; between them as the speed */
};

/** Another S from a place within a segment on. */
struct segment_power {
    uint16_t at;      /* part of the segment's way, 1/65536; more than that of the one before */
    uint16_t duty[2]; /* as segment.duty: what it would be at the segment's start and end */
};

#endif
