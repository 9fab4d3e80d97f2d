/* SPDX-License-Identifier: MIT */
#include "motion/filter.h"

#include <string.h>

#define SAMPLE_S 0.00125f /* as near to this as the time and FILTER_MOST allow */
#define LEAST    2.0f

void filter_set(struct filter *filter, float time_s) {
    float count = time_s / SAMPLE_S + 0.5f;
    count = count < LEAST ? LEAST : count;
    count = count < (float)FILTER_MOST ? count : (float)FILTER_MOST;
    filter->count = (uint8_t)(time_s > 0.0f ? count : 0.0f);
    filter->sample_s = filter->count > 0 ? time_s / (float)filter->count : 0.0f;
}

void filter_reset(struct filter *filter, const int64_t in[AXIS_COUNT]) {
    memset(filter->moves, 0, sizeof filter->moves);
    memset(filter->sum, 0, sizeof filter->sum);
    filter->at = filter->moving = 0;
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++) {
        filter->in[ax] = in[ax];
        filter->out[ax] = in[ax] * filter->count;
    }
}

void filter_push(struct filter *filter, const int64_t in[AXIS_COUNT], struct filter_tag tag) {
    bool starts = filter->moving == 0, moves = false;
    filter->at = (uint8_t)(filter->at + 1u < filter->count ? filter->at + 1u : 0u);
    int32_t *slot = filter->moves[filter->at];
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++) {
        int64_t move = in[ax] - filter->in[ax];
        filter->sum[ax] += move - slot[ax];
        filter->out[ax] += filter->sum[ax];
        filter->in[ax] = in[ax];
        slot[ax] = (int32_t)move;
        moves = moves || move != 0;
    }
    filter->tags[filter->at] = tag;
    for (unsigned n = 0; starts && n < filter->count; n++)
        filter->tags[n] = tag;
    if (moves)
        filter->moving = filter->count;
    if (filter->moving > 0)
        filter->moving--;
}
