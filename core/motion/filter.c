/* SPDX-License-Identifier: MIT */
#include "motion/filter.h"

#include <string.h>

#define SAMPLE_S 0.00125f /* as near to this as the time and FILTER_MAX allow */
#define LEAST    2.0f

void filter_set(struct filter *filter, float time_s) {
    float count = time_s / SAMPLE_S + 0.5f;
    count = count < LEAST ? LEAST : count;
    count = count < (float)FILTER_MAX ? count : (float)FILTER_MAX;
    filter->count = (uint8_t)(time_s > 0.0f ? count : 0.0f);
    filter->sample_s = filter->count > 0 ? time_s / (float)filter->count : 0.0f;
}

void filter_reset(struct filter *filter, const int64_t in[AXIS_COUNT]) {
    struct filter_past *past = &filter->past;
    memset(past->moves, 0, sizeof past->moves);
    memset(filter->sum, 0, sizeof filter->sum);
    past->at = past->moving = 0;
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++) {
        past->in[ax] = in[ax];
        filter->out[ax] = in[ax] * filter->count;
    }
}

void filter_push(struct filter *filter, const int64_t in[AXIS_COUNT], struct filter_tag tag) {
    struct filter_past *past = &filter->past;
    bool starts = past->moving == 0, moves = false;
    past->at = (uint8_t)(past->at + 1u < filter->count ? past->at + 1u : 0u);
    int32_t *slot = past->moves[past->at];
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++) {
        int64_t move = in[ax] - past->in[ax];
        filter->sum[ax] += move - slot[ax];
        filter->out[ax] += filter->sum[ax];
        past->in[ax] = in[ax];
        slot[ax] = (int32_t)move;
        moves = moves || move != 0;
    }
    past->tags[past->at] = tag;
    for (unsigned n = 0; starts && n < filter->count; n++)
        past->tags[n] = tag;
    if (moves)
        past->moving = filter->count;
    if (past->moving > 0)
        past->moving--;
}

/* Sum and mean are of the last `count` positions, which the newest one and the moves say exactly. */
void filter_load(struct filter *filter, const struct filter_past *past) {
    filter->past = *past;
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++) {
        int64_t at = past->in[ax], out = 0, sum = 0;
        unsigned n = past->at;
        for (unsigned made = 0; made < filter->count; made++) {
            out += at;
            at -= past->moves[n][ax];
            sum += past->moves[n][ax];
            n = n > 0 ? n - 1u : filter->count - 1u;
        }
        filter->sum[ax] = sum;
        filter->out[ax] = out;
    }
}
