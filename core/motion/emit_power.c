/* SPDX-License-Identifier: MIT */
#include "motion/emit_power.h"

#include "motion/emit.h"

#include <math.h>

static bool is_cut(const struct piece *piece) {
    return (piece->flags & MOTION_FLAG_CUT) != 0;
}

/* The piece whose F counts: part of a shaped sample may be of the cut before its piece, and the light of a
 * signal at the end of a rapid comes in the cut that follows. */
static const struct piece *burnt_piece(const struct emit *emit, const struct piece *piece) {
    struct path *path = &emit->plan->path;
    uint32_t index = (uint32_t)(piece - path->pieces);
    const struct piece *before = path_piece(path, index - 1), *next = path_piece(path, index + 1);
    if (!is_cut(piece) && shaper_is_on(emit->axes.shaper) && is_cut(before))
        return before;
    bool newest = piece == path_piece(path, path->head - 1);
    return !is_cut(piece) && emit->beam.rise_s > 0.0f && !newest && is_cut(next) ? next : piece;
}

bool emit_power_counts(const struct emit *emit) {
    return emit->beam.on || emit->power.mark + 1 != emit->plan->power.head;
}

void emit_power(struct emit *emit, struct segment *segment, const struct piece *piece, uint32_t to, float v0,
                float v1, float time_s) {
    float feed_mm_s = emit->beam.on ? sqrtf(burnt_piece(emit, piece)->asked_sq) : 0.0f;
    const struct power_way way = {to, v0, v1, feed_mm_s, time_s, emit->stop != AHEAD_GO || !emit->beam.on};
    if (shaper_is_on(emit->axes.shaper) || emit->beam.rise_s > 0.0f)
        segment->flags |= SEGMENT_CUT; /* S may be that of a cut, whatever most of it is */
    power_segment(&emit->plan->power, &emit->power, &way, &emit->beam, emit->ahead->queue, segment);
    if ((segment->duty[0] | segment->duty[1] | segment->power_count) == 0 && !is_cut(piece))
        segment->flags &= (uint8_t)~SEGMENT_CUT;
}
