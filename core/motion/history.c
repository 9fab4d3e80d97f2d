/* SPDX-License-Identifier: MIT */
#include "motion/history.h"

#include "segment/segment.h"

#include <string.h>

#define FOREVER_NS   (1u << 31)
#define NS           1e-9f
#define MOST_RECORDS 2u /* of a sample: a rest before it, and itself */

static const struct history_record *record_at(const struct history *history,
                                              const struct history_place *place, uint32_t before_newest) {
    const struct history_side *side = &history->sides[place->side];
    uint32_t number = place->count - before_newest;
    if ((int32_t)(number - side->base) > 0)
        return &side->records[number - side->base - 1u];
    return &history->main[number & (HISTORY_SIZE - 1)];
}

void history_rest(struct history *history, const int64_t in[SHAPER_LANES]) {
    history->now.still_ns = FOREVER_NS;
    memcpy(history->now.in, in, sizeof history->now.in);
}

/* The records of a side that no mark needs become part of main. It may have fewer of them than main lacks. */
static void adopt(struct history *history, const struct history_side *side) {
    if ((int32_t)(side->base - history->main_count) > 0)
        history->main_count = side->base;
    while ((int32_t)(history->kept - history->main_count) > 0 && history->main_count != history->now.count) {
        uint32_t number = ++history->main_count;
        history->main[number & (HISTORY_SIZE - 1)] = side->records[number - side->base - 1u];
    }
}

/* This side begins with what another one has behind main, or itself. */
static void begin_side(struct history *history, uint8_t side, const struct history_side *from) {
    struct history_side *to = &history->sides[side];
    adopt(history, from);
    uint32_t count = history->now.count - history->main_count;
    if (to != from && count > HISTORY_TRUNK)
        count = HISTORY_WINDOW;
    uint32_t first = history->now.count - count - from->base;
    memmove(to->records, &from->records[first], count * sizeof to->records[0]);
    to->base = history->now.count - count;
}

/* What comes next is of the batch on this side, which begins here if it has not yet. */
static struct history_side *batch_at(struct history *history, uint8_t side) {
    struct history_side *to = &history->sides[side];
    struct history_place *now = &history->now;
    if (now->side == side)
        return to;
    begin_side(history, side, &history->sides[now->side]);
    now->side = side;
    now->batch = to->batch = ++history->batch;
    return to;
}

static void append(struct history *history, const struct history_record *record, uint8_t side) {
    struct history_side *to = batch_at(history, side);
    to->records[history->now.count++ - to->base] = *record;
}

bool history_has_room(struct history *history, uint8_t side) {
    const struct history_side *to = batch_at(history, side);
    if (history->now.count - to->base + MOST_RECORDS <= HISTORY_SIDE)
        return true;
    begin_side(history, side, to);
    return history->now.count - to->base + MOST_RECORDS <= HISTORY_SIDE;
}

/* A mark of a batch before is on what both have: the sides of its time may be another batch's now. */
void history_load(struct history *history, const struct history_place *place, uint8_t in_force) {
    history->now = *place;
    if (history->sides[place->side].batch == place->batch)
        return;
    history->now.side = in_force;
    history->now.batch = history->sides[in_force].batch;
}

void history_release(struct history *history, const struct history_place *place) {
    if ((int32_t)(place->count - history->kept) > 0)
        history->kept = place->count;
}

void history_push(struct history *history, const int64_t in[SHAPER_LANES], uint32_t ns, int16_t ramp,
                  uint16_t piece, uint8_t side) {
    struct history_place *now = &history->now;
    struct history_record record = {.ns = ns, .ramp = ramp, .piece = piece};
    bool moves = false;
    for (unsigned lane = 0; lane < SHAPER_LANES; lane++) {
        record.way[lane] = (int32_t)(in[lane] - now->in[lane]);
        moves = moves || record.way[lane] != 0;
    }
    if (!moves) {
        now->still_ns = ns < FOREVER_NS - now->still_ns ? now->still_ns + ns : FOREVER_NS;
        return;
    }
    if (now->still_ns > 0) {
        struct history_record rest = {.ns = now->still_ns, .piece = piece};
        append(history, &rest, side);
    }
    append(history, &record, side);
    now->still_ns = 0;
    memcpy(now->in, in, sizeof now->in);
}

/* ---- what a shaper makes of it ---- */

/* A record as the shaper's delays see it. In whole ns, so that a delay is in one record and no other. */
struct aged {
    uint32_t age_ns, ns; /* at its end, and how long it is */
    float length_s;
    float ramp;
    const int32_t *way;
};

/* 1 - s is the part of a record's time that has passed at a delay; of its way: (1 - s) (1 - ramp s). */
static float part_beyond(const struct aged *aged, uint32_t delay_ns) {
    return (float)(delay_ns - aged->age_ns) * NS / aged->length_s;
}

/* The mean of the part of the way that was not made yet, from a part of the time on. */
static float mean_undone(const struct aged *aged, float s) {
    return s * (0.5f * (1.0f + aged->ramp) - aged->ramp * s * (1.0f / 3.0f));
}

/* The walk from the newest record back. Places are relative to where the path is now; all whole numbers, so
 * where it rests they are 0. */
struct walk {
    int64_t place[SHAPER_LANES];             /* at the end of the present record */
    int64_t sum[SHAPER_LANES];               /* of the places since then, times ns */
    int64_t from[SHAPER_TAPS][SHAPER_LANES]; /* the same where the mean of a tap begins */
    float out[SHAPER_LANES], speed[SHAPER_LANES];
    uint8_t taps[CORE_AXES], means[CORE_AXES]; /* of each row: those that began, and ended */
    uint32_t next_ns;                          /* no row has a tap before that */
};

/* Without a mean: the places at a tap. */
static void add_tap(struct walk *walk, const struct shaper_row *row, const struct aged *aged, unsigned tap) {
    float s = part_beyond(aged, row->delay_ns[tap]), weight = row->weight[tap];
    float undone = weight * s * (1.0f + aged->ramp * (1.0f - s));
    float falls = weight * (1.0f + aged->ramp * (1.0f - 2.0f * s)) / aged->length_s;
    for (unsigned lane = 0, lanes = row->lanes; lanes != 0; lane++, lanes >>= 1) {
        if ((lanes & 1u) == 0)
            continue;
        float way = (float)aged->way[lane];
        walk->out[lane] += weight * (float)walk->place[lane] - undone * way;
        walk->speed[lane] += falls * way;
    }
}

/* Sum of the places since then at a delay. */
static int64_t sum_at(const struct walk *walk, const struct aged *aged, unsigned lane, uint32_t delay_ns,
                      float undone) {
    uint32_t ns = delay_ns - aged->age_ns;
    return walk->sum[lane] + walk->place[lane] * ns - (int64_t)((float)aged->way[lane] * undone * (float)ns);
}

/* A tap's mean begins, or with `ends` is complete. */
static void add_mean(struct walk *walk, const struct shaper *shaper, const struct shaper_row *row,
                     const struct aged *aged, unsigned tap, bool ends) {
    uint32_t delay_ns = row->delay_ns[tap] + (ends ? shaper->mean_ns : 0u);
    float s = part_beyond(aged, delay_ns), undone = s * (1.0f + aged->ramp * (1.0f - s));
    float mean = mean_undone(aged, s), weight = row->weight[tap] / ((float)shaper->mean_ns * NS);
    for (unsigned lane = 0, lanes = row->lanes; lanes != 0; lane++, lanes >>= 1) {
        if ((lanes & 1u) == 0)
            continue;
        int64_t sum = sum_at(walk, aged, lane, delay_ns, mean);
        float place = (float)walk->place[lane] - (float)aged->way[lane] * undone;
        walk->speed[lane] += ends ? -weight * place : weight * place;
        if (ends)
            walk->out[lane] += weight * NS * (float)(sum - walk->from[tap][lane]);
        else
            walk->from[tap][lane] = sum;
    }
}

/* What a row makes of a record. */
static void add_row(struct walk *walk, const struct shaper *shaper, unsigned n, const struct aged *aged) {
    const struct shaper_row *row = &shaper->rows[n];
    uint32_t beyond_ns = aged->age_ns + aged->ns;
    for (; walk->taps[n] < row->count && row->delay_ns[walk->taps[n]] < beyond_ns; walk->taps[n]++) {
        if (shaper->mean_ns > 0)
            add_mean(walk, shaper, row, aged, walk->taps[n], false);
        else
            add_tap(walk, row, aged, walk->taps[n]);
    }
    for (; shaper->mean_ns > 0 && walk->means[n] < row->count &&
           row->delay_ns[walk->means[n]] + shaper->mean_ns < beyond_ns;
         walk->means[n]++)
        add_mean(walk, shaper, row, aged, walk->means[n], true);
}

static uint32_t earlier(uint32_t a, uint32_t b) {
    return a < b ? a : b;
}

static void add_rows(struct walk *walk, const struct shaper *shaper, const struct aged *aged) {
    walk->next_ns = UINT32_MAX;
    for (unsigned n = 0; n < shaper->row_count; n++) {
        const struct shaper_row *row = &shaper->rows[n];
        add_row(walk, shaper, n, aged);
        if (walk->taps[n] < row->count)
            walk->next_ns = earlier(walk->next_ns, row->delay_ns[walk->taps[n]]);
        if (walk->means[n] < walk->taps[n])
            walk->next_ns = earlier(walk->next_ns, row->delay_ns[walk->means[n]] + shaper->mean_ns);
    }
}

/* On to the record before. */
static void pass(struct walk *walk, const struct shaper *shaper, const struct aged *aged) {
    if (shaper->mean_ns > 0) {
        uint32_t undone_ns = (uint32_t)((float)aged->ns * mean_undone(aged, 1.0f));
        for (unsigned lane = 0; lane < SHAPER_LANES; lane++)
            walk->sum[lane] += walk->place[lane] * aged->ns - (int64_t)aged->way[lane] * undone_ns;
    }
    for (unsigned lane = 0; lane < SHAPER_LANES; lane++)
        walk->place[lane] -= aged->way[lane];
}

/* Sum and difference of the first two axes in their places. */
static void mix(int32_t way[SHAPER_LANES]) {
    int32_t a = way[0], b = way[1];
    way[0] = a + b;
    way[1] = a - b;
}

static void unmix(float lane[SHAPER_LANES]) {
    float a = lane[0], b = lane[1];
    lane[0] = 0.5f * (a + b);
    lane[1] = 0.5f * (a - b);
}

/* Where the shaper's window ends no record is passed any more: it may last for ever. */
static void add_record(struct walk *walk, const struct shaper *shaper, const struct history_record *record,
                       uint32_t age_ns) {
    int32_t mixed[SHAPER_LANES];
    struct aged aged = {.age_ns = age_ns, .ns = record->ns, .way = record->way};
    if (shaper->sums) {
        memcpy(mixed, record->way, sizeof mixed);
        mix(mixed);
        aged.way = mixed;
    }
    if (walk->next_ns < age_ns + record->ns || shaper->mean_ns > 0) {
        aged.length_s = (float)record->ns * NS;
        aged.ramp = (float)record->ramp * (1.0f / (float)SEGMENT_RAMP_ONE);
    }
    if (walk->next_ns < age_ns + record->ns)
        add_rows(walk, shaper, &aged);
    if (age_ns + record->ns <= shaper->window_ns)
        pass(walk, shaper, &aged);
}

/* The time since the path came to rest. */
static void add_rest(struct walk *walk, const struct shaper *shaper, uint32_t ns) {
    static const int32_t no_way[SHAPER_LANES];
    const struct aged rest = {0, ns, (float)ns * NS, 0.0f, no_way};
    if (ns > 0)
        add_rows(walk, shaper, &rest);
}

void history_shape(const struct history *history, const struct shaper *shaper, struct history_shape *shape) {
    const struct history_place *now = &history->now;
    uint32_t age_ns = now->still_ns;
    struct walk walk = {0};
    bool found = false;
    shape->piece = record_at(history, now, 0)->piece;
    add_rest(&walk, shaper, age_ns);
    for (uint32_t n = 0; age_ns <= shaper->window_ns; n++) {
        const struct history_record *record = record_at(history, now, n);
        if (!found)
            shape->piece = record->piece;
        found = found || age_ns + record->ns > shaper->late_ns;
        add_record(&walk, shaper, record, age_ns);
        age_ns += record->ns;
    }
    if (shaper->sums) {
        unmix(walk.out);
        unmix(walk.speed);
    }
    for (unsigned lane = 0; lane < SHAPER_LANES; lane++)
        shape->out[lane] = now->in[lane] + (int64_t)(walk.out[lane] + (walk.out[lane] < 0.0f ? -0.5f : 0.5f));
    memcpy(shape->speed, walk.speed, sizeof shape->speed);
}

uint16_t history_oldest_piece(const struct history *history, const struct history_place *place,
                              uint32_t window_ns) {
    uint32_t n = 0, age_ns = place->still_ns + record_at(history, place, 0)->ns;
    while (age_ns < window_ns)
        age_ns += record_at(history, place, ++n)->ns;
    return record_at(history, place, n)->piece;
}
