/* SPDX-License-Identifier: MIT */
#include "slicer.h"

#include <math.h>
#include <string.h>

static const double CLOCK_PULL = 0.01; /* of a duration, when the queue is empty or twice as long as wanted */
static const double CATCH_UP_MAX = 0.05; /* ... when it is much too long: a cutter feels no more than that */
enum { STANDS_MIN = 10 };                /* segments without a step: it is at rest, and not just slow */
static const double SHORTEST_S = 0.001, LONGEST_S = 0.5; /* of a slice */
static const double STEPS_MAX = 2147483647.0;

/* Steps of a joint at this position, to the nearest. @return false: no number, or too large to be counted */
static bool nearest_steps(const struct slicer *slicer, unsigned joint, double position, int32_t *steps) {
    double exact = position * slicer->scale[joint];
    if (!(fabs(exact) < STEPS_MAX))
        return false;
    *steps = (int32_t)lrint(exact);
    return true;
}

int slicer_far(const struct slicer *slicer, const double *position, double seconds) {
    for (unsigned joint = 0; joint < slicer->joints; joint++) {
        int32_t steps;
        if (!nearest_steps(slicer, joint, position[joint], &steps) ||
            fabs((double)steps - slicer->steps[joint]) > slicer->rate[joint] * seconds + 1.0)
            return (int)joint;
    }
    return -1;
}

bool slicer_is_there(const struct slicer *slicer, const double *position) {
    for (unsigned joint = 0; joint < slicer->joints; joint++) {
        int32_t steps;
        if (!nearest_steps(slicer, joint, position[joint], &steps) || steps != slicer->steps[joint])
            return false;
    }
    return true;
}

/* The part by which a duration is changed. While the machine is at rest there is nothing to be late for. */
static double pull(const struct slicer *slicer, double queued_s) {
    double missing = (slicer->level_s - queued_s) / slicer->level_s;
    if (missing < -1.0 && slicer->stands >= STANDS_MIN)
        return -1.0;
    return missing >= -1.0 ? CLOCK_PULL * missing : -fmin(CLOCK_PULL * missing * missing, CATCH_UP_MAX);
}

int slicer_slice(struct slicer *slicer, const double *position, double seconds, double queued_s,
                 struct wire_segment *segment) {
    int32_t wanted[SLICER_JOINTS] = {0};
    double least_s = 0.0;
    memset(segment, 0, sizeof *segment);
    for (unsigned joint = 0; joint < slicer->joints; joint++) {
        if (!nearest_steps(slicer, joint, position[joint], &wanted[joint]))
            return (int)joint;
        int64_t way = (int64_t)wanted[joint] - slicer->steps[joint];
        if (way > INT32_MAX || way < -INT32_MAX)
            return (int)joint;
        segment->steps[joint] = (int32_t)way;
        if (slicer->rate[joint] > 0.0)
            least_s = fmax(least_s, fabs((double)way) / slicer->rate[joint]);
    }
    bool moves = memcmp(slicer->steps, wanted, slicer->joints * sizeof *wanted) != 0;
    slicer->stands = moves ? 0 : slicer->stands < STANDS_MIN ? slicer->stands + 1 : STANDS_MIN;
    memcpy(slicer->steps, wanted, slicer->joints * sizeof *wanted);
    seconds = fmin(fmax(seconds, SHORTEST_S), LONGEST_S);
    double us = 1e6 * fmax(fmax(seconds * (1.0 + pull(slicer, queued_s)), SHORTEST_S), least_s);
    segment->duration_us = us < (double)UINT32_MAX ? (uint32_t)ceil(us) : UINT32_MAX;
    return -1;
}
