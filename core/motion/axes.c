/* SPDX-License-Identifier: MIT */
#include "motion/axes.h"

#include <math.h>
#include <string.h>

void axes_rest(struct axes *axes, const int32_t steps[AXIS_COUNT]) {
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++) {
        axes->steps[ax] = steps[ax];
        axes->fraction[ax] = SEGMENT_PHASE_HALF;
    }
}

void axes_go(struct axes *axes, struct segment *segment, const int64_t at[CORE_AXES], unsigned axis_count) {
    memset(segment->phase, SEGMENT_PHASE_HALF, sizeof segment->phase); /* of axes that do not move */
    memset(segment->phase_end, SEGMENT_PHASE_HALF, sizeof segment->phase_end);
    for (unsigned ax = 0; ax < axis_count; ax++) {
        int32_t steps = (int32_t)(at[ax] >> 16), made = steps - axes->steps[ax];
        uint8_t fraction = (uint8_t)(at[ax] >> 8 & 255);
        bool down = made < 0;
        segment->steps[ax] = (int16_t)made;
        segment->phase[ax] = (uint8_t)(down ? 255 - axes->fraction[ax] : axes->fraction[ax]);
        segment->phase_end[ax] = (uint8_t)(down ? 255 - fraction : fraction);
        axes->steps[ax] = steps;
        axes->fraction[ax] = fraction;
    }
}

uint32_t axes_ns(struct axes *axes, float time_s) {
    float ns = time_s * 1e9f;
    uint32_t whole = (uint32_t)ns;
    float rest = ns - (float)whole + axes->time_ns;
    bool more = rest >= 1.0f;
    axes->time_ns = more ? rest - 1.0f : rest;
    whole += more;
    return whole > 0 ? whole : 1u;
}

int16_t axes_ramp(float v0, float v1) {
    return (int16_t)(v0 + v1 > 0.0f ? (v1 - v0) / (v0 + v1) * (float)SEGMENT_RAMP_ONE : 0.0f);
}

static float way_mm_of(const struct segment *segment, const struct motion_limits *limits) {
    float sum = 0.0f;
    for (unsigned ax = 0; ax < limits->axis_count; ax++) {
        int32_t steps = segment->steps[ax] < 0 ? -segment->steps[ax] : segment->steps[ax];
        float parts = (float)(steps * 256 + segment->phase_end[ax] - segment->phase[ax]);
        float way_mm = parts / (256.0f * limits->steps_per_mm[ax]);
        sum += way_mm * way_mm;
    }
    return sqrtf(sum);
}

/* Speed of the axes along their path, XYZ and all others, as that of the path itself. */
static float shaped_mm_s(const struct history_shape *shape, const struct motion_limits *limits) {
    float sum = 0.0f;
    for (unsigned ax = 0; ax < limits->axis_count; ax++) {
        float v_mm_s = shape->speed[ax] / ((float)HISTORY_STEP * limits->steps_per_mm[ax]);
        sum += v_mm_s * v_mm_s;
    }
    return sqrtf(sum);
}

float axes_follow(struct axes *axes, struct segment *segment, const struct history_shape *shape, bool behind,
                  const struct motion_limits *limits, float time_s) {
    float v0 = axes->v_mm_s;
    axes_go(axes, segment, shape->out, limits->axis_count);
    axes->v_mm_s = behind ? shaped_mm_s(shape, limits) : 0.0f;
    segment->ramp = axes_ramp(v0, axes->v_mm_s);
    float ends_mm = 0.5f * (v0 + axes->v_mm_s) * time_s;
    return ends_mm > 0.0f ? way_mm_of(segment, limits) / ends_mm : 1.0f;
}
