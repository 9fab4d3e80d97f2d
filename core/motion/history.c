/* SPDX-License-Identifier: MIT */
#include "motion/history.h"

#include "base/minmax.h"
#include "segment/segment.h"

#include <string.h>

#define FOREVER_NS   (1u << 31)
#define PART_ONE     (1 << 24) /* of a record's way; a float's 24 bits */
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
        now->still_ns = now->still_ns < FOREVER_NS - ns ? now->still_ns + ns : FOREVER_NS;
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

/* A record as the shaper's delays see it: in whole ns, so that a delay is in one record and no other. */
struct aged {
    uint32_t age_ns, ns; /* at its end, and how long it is */
    float length_s;
    float ramp;
};

/* How much longer than a record's end a delay is, s. */
static float beyond_s(const struct aged *aged, uint32_t delay_ns) {
    return (float)(int32_t)(delay_ns - aged->age_ns) * NS;
}

/* Part of its way that is not made yet at a delay, and of the time from 0 to that delay. 1 - s is the part of
 * the time that has passed then: way = (1 - s) (1 - ramp s). */
static float undone(const struct aged *aged, uint32_t delay_ns) {
    if (delay_ns <= aged->age_ns)
        return 0.0f;
    if (delay_ns - aged->age_ns >= aged->ns)
        return 1.0f;
    float s = beyond_s(aged, delay_ns) / aged->length_s;
    return s * (1.0f + aged->ramp * (1.0f - s));
}

static float undone_s(const struct aged *aged, uint32_t delay_ns) {
    float beyond = beyond_s(aged, delay_ns), s = max_f(min_f(beyond / aged->length_s, 1.0f), 0.0f);
    float within_s = aged->length_s * s * s * (0.5f * (1.0f + aged->ramp) - aged->ramp * s * (1.0f / 3.0f));
    return within_s + max_f(beyond - aged->length_s, 0.0f);
}

/* Of a record's way: the part that the axes still lack, and how fast that part falls. */
struct part {
    float lacks, falls;
};

static struct part tap(const struct aged *aged, uint32_t delay_ns, uint32_t mean_ns) {
    if (delay_ns >= aged->age_ns && delay_ns - aged->age_ns >= aged->ns)
        return (struct part){1.0f, 0.0f};
    if (delay_ns + mean_ns < aged->age_ns)
        return (struct part){0.0f, 0.0f};
    if (mean_ns > 0) {
        float mean_s = (float)mean_ns * NS;
        return (struct part){(undone_s(aged, delay_ns + mean_ns) - undone_s(aged, delay_ns)) / mean_s,
                             (undone(aged, delay_ns + mean_ns) - undone(aged, delay_ns)) / mean_s};
    }
    float s = beyond_s(aged, delay_ns) / aged->length_s;
    return (struct part){undone(aged, delay_ns), (1.0f + aged->ramp * (1.0f - 2.0f * s)) / aged->length_s};
}

static struct part part_of(const struct shaper_row *row, const struct aged *aged, uint32_t mean_ns) {
    struct part part = {0.0f, 0.0f};
    for (unsigned i = 0; i < row->count; i++) {
        struct part one = tap(aged, row->delay_ns[i], mean_ns);
        part.lacks += row->weight[i] * one.lacks;
        part.falls += row->weight[i] * one.falls;
    }
    return part;
}

/* What the lanes lack, and their speeds. */
struct sums {
    int64_t lacks[SHAPER_LANES]; /* times PART_ONE */
    float speed[SHAPER_LANES];
};

static void add_row(struct sums *sums, const struct shaper_row *row, const struct part *part,
                    const int32_t way[SHAPER_LANES]) {
    int32_t lacks = (int32_t)(part->lacks * (float)PART_ONE + 0.5f);
    for (unsigned lane = 0, lanes = row->lanes; lanes != 0; lane++, lanes >>= 1) {
        if ((lanes & 1u) == 0)
            continue;
        sums->lacks[lane] += (int64_t)lacks * way[lane];
        if (part->falls != 0.0f)
            sums->speed[lane] += part->falls * (float)way[lane];
    }
}

/* Sum and difference of the first two axes in their places. */
static void mix(int32_t way[SHAPER_LANES]) {
    int32_t a = way[0], b = way[1];
    way[0] = a + b;
    way[1] = a - b;
}

static void unmix(struct sums *sums) {
    int64_t a = sums->lacks[0], b = sums->lacks[1];
    float speed_a = sums->speed[0], speed_b = sums->speed[1];
    sums->lacks[0] = (a + b) / 2;
    sums->lacks[1] = (a - b) / 2;
    sums->speed[0] = 0.5f * (speed_a + speed_b);
    sums->speed[1] = 0.5f * (speed_a - speed_b);
}

static void add_record(struct sums *sums, const struct shaper *shaper, const struct history_record *record,
                       uint32_t age_ns) {
    const float ramp = (float)record->ramp * (1.0f / (float)SEGMENT_RAMP_ONE);
    struct aged aged = {age_ns, record->ns, (float)record->ns * NS, ramp};
    int32_t way[SHAPER_LANES];
    memcpy(way, record->way, sizeof way);
    if (shaper->sums)
        mix(way);
    for (unsigned n = 0; n < shaper->row_count; n++) {
        struct part part = part_of(&shaper->rows[n], &aged, shaper->mean_ns);
        add_row(sums, &shaper->rows[n], &part, way);
    }
}

void history_shape(const struct history *history, const struct shaper *shaper, struct history_shape *shape) {
    const struct history_place *now = &history->now;
    uint32_t age_ns = now->still_ns;
    struct sums sums = {{0}, {0}};
    bool found = false;
    shape->piece = record_at(history, now, 0)->piece;
    for (uint32_t n = 0; age_ns <= shaper->window_ns; n++) {
        const struct history_record *record = record_at(history, now, n);
        if (!found)
            shape->piece = record->piece;
        found = found || age_ns + record->ns > shaper->late_ns;
        add_record(&sums, shaper, record, age_ns);
        age_ns += record->ns;
    }
    if (shaper->sums)
        unmix(&sums);
    for (unsigned lane = 0; lane < SHAPER_LANES; lane++)
        shape->out[lane] = now->in[lane] - ((sums.lacks[lane] + PART_ONE / 2) >> 24);
    memcpy(shape->speed, sums.speed, sizeof shape->speed);
}

uint16_t history_oldest_piece(const struct history *history, const struct history_place *place,
                              uint32_t window_ns) {
    uint32_t n = 0, age_ns = place->still_ns + record_at(history, place, 0)->ns;
    while (age_ns < window_ns)
        age_ns += record_at(history, place, ++n)->ns;
    return record_at(history, place, n)->piece;
}
