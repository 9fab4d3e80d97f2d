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

void filter_reset(struct filter *filter, const int64_t in[FILTER_LANES]) {
    struct filter_past *past = &filter->past;
    memset(past->moves, 0, sizeof past->moves);
    memset(filter->sum, 0, sizeof filter->sum);
    past->at = past->moving = 0;
    for (unsigned lane = 0; lane < FILTER_LANES; lane++) {
        past->in[lane] = in[lane];
        filter->out[lane] = in[lane] * filter->count;
    }
}

void filter_push(struct filter *filter, const int64_t in[FILTER_LANES], uint16_t piece) {
    struct filter_past *past = &filter->past;
    bool starts = past->moving == 0, moves = false;
    past->at = (uint8_t)(past->at + 1u < filter->count ? past->at + 1u : 0u);
    int32_t *slot = past->moves[past->at];
    for (unsigned lane = 0; lane < FILTER_LANES; lane++) {
        int64_t move = in[lane] - past->in[lane];
        filter->sum[lane] += move - slot[lane];
        filter->out[lane] += filter->sum[lane];
        past->in[lane] = in[lane];
        slot[lane] = (int32_t)move;
        moves = moves || move != 0;
    }
    past->pieces[past->at] = piece;
    for (unsigned n = 0; starts && n < filter->count; n++)
        past->pieces[n] = piece;
    if (moves)
        past->moving = filter->count;
    if (past->moving > 0)
        past->moving--;
}

/* Sum and mean are of the last `count` positions, which the newest one and the moves say exactly. */
void filter_load(struct filter *filter, const struct filter_past *past) {
    filter->past = *past;
    for (unsigned lane = 0; lane < FILTER_LANES; lane++) {
        int64_t at = past->in[lane], out = 0, sum = 0;
        unsigned n = past->at;
        for (unsigned made = 0; made < filter->count; made++) {
            out += at;
            at -= past->moves[n][lane];
            sum += past->moves[n][lane];
            n = n > 0 ? n - 1u : filter->count - 1u;
        }
        filter->sum[lane] = sum;
        filter->out[lane] = out;
    }
}
