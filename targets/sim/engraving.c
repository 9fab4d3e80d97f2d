/* SPDX-License-Identifier: MIT
 * Segments -> pieces of one energy by length, and the stretches that get too much. */
#include "engraving.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define STRAIGHT_MM    0.002 /* a piece bends by no more */
#define ALIKE          0.02  /* part by which the energy of what becomes one piece differs */
#define FIRST_GRAIN_MM 0.01f
#define GRAIN_GROWTH   1.5f

enum { FIRST_PIECES = 1024 };

/* Burnt with constant power since the last judgement; dark gaps between do not count. */
struct stretch {
    double length_mm;
    double feed_mm; /* how far its feeds would have come in its time */
    uint32_t line;
    double from_mm[3];
};

struct engraving {
    float *constant_mm_s; /* of each line: its feed when it is M3; 0: nothing to judge */
    size_t lines;
    struct engraving_piece *pieces;
    size_t count, room;
    float grain_mm;      /* neighbours become one up to this length; 0: there is still room for each */
    double direction[3]; /* in which the last piece began */
    bool lost;
    struct stretch stretch;
    struct engraving_result sum;
};

struct engraving *engraving_create(size_t lines) {
    struct engraving *engraving = calloc(1, sizeof *engraving);
    if (engraving == NULL)
        return NULL;
    *engraving = (struct engraving){.lines = lines, .sum = {.limit = ENGRAVING_LIMIT}};
    engraving->constant_mm_s = calloc(lines + 1, sizeof *engraving->constant_mm_s);
    if (engraving->constant_mm_s == NULL) {
        free(engraving);
        return NULL;
    }
    return engraving;
}

void engraving_destroy(struct engraving *engraving) {
    if (engraving == NULL)
        return;
    free(engraving->constant_mm_s);
    free(engraving->pieces);
    free(engraving);
}

void engraving_line(struct engraving *engraving, size_t index, bool constant, float feed_mm_s) {
    if (index < engraving->lines)
        engraving->constant_mm_s[index] = constant ? feed_mm_s : 0.0f;
}

/* ---- too much ---- */

static void judge(struct engraving *engraving) {
    struct engraving_result *sum = &engraving->sum;
    const struct stretch *stretch = &engraving->stretch;
    double times = stretch->feed_mm / stretch->length_mm;
    if (times > ENGRAVING_LIMIT)
        sum->slow_mm += stretch->length_mm;
    if (times > sum->worst) {
        sum->worst = times;
        sum->worst_line = stretch->line;
        memcpy(sum->worst_mm, stretch->from_mm, sizeof sum->worst_mm);
    }
    engraving->stretch = (struct stretch){0};
}

static void add_to_stretch(struct engraving *engraving, const struct engraving_part *part, double feed_mm_s) {
    struct stretch *stretch = &engraving->stretch;
    if (stretch->length_mm == 0.0) {
        stretch->line = part->line;
        memcpy(stretch->from_mm, part->from_mm, sizeof stretch->from_mm);
    }
    engraving->sum.constant_mm += part->length_mm;
    stretch->length_mm += part->length_mm;
    stretch->feed_mm += feed_mm_s * part->time_s;
    if (stretch->length_mm >= ENGRAVING_STRETCH_MM)
        judge(engraving);
}

/* ---- pieces ---- */

static double distance(const float a_mm[3], const float b_mm[3]) {
    double x = (double)(b_mm[0] - a_mm[0]), y = (double)(b_mm[1] - a_mm[1]), z = (double)(b_mm[2] - a_mm[2]);
    return sqrt(x * x + y * y + z * z);
}

static bool is_at_rest(const struct engraving_piece *piece) {
    return piece->length_mm == 0.0f;
}

/* The mean of both, and of a dark gap between them. */
static void join(struct engraving_piece *piece, const struct engraving_piece *next) {
    piece->length_mm += next->length_mm + (float)distance(piece->to_mm, next->from_mm);
    piece->energy_s += next->energy_s;
    piece->t_s = next->t_s;
    memcpy(piece->to_mm, next->to_mm, sizeof piece->to_mm);
}

static bool fits_grain(const struct engraving *engraving, const struct engraving_piece *piece,
                       const struct engraving_piece *next) {
    double length_mm = (double)(piece->length_mm + next->length_mm) + distance(piece->to_mm, next->from_mm);
    return !is_at_rest(piece) && !is_at_rest(next) && length_mm <= (double)engraving->grain_mm;
}

/* The next one continues the last piece without a bend, with the same energy by length. */
static bool continues(const struct engraving *engraving, const struct engraving_piece *piece,
                      const struct engraving_piece *next) {
    if (is_at_rest(piece) || is_at_rest(next) || distance(piece->to_mm, next->from_mm) > 0.0)
        return false;
    double is = (double)(piece->energy_s / piece->length_mm),
           will = (double)(next->energy_s / next->length_mm);
    if (fabs(is - will) > ALIKE * fmax(is, will))
        return false;
    double along = 0.0, square = 0.0;
    for (unsigned i = 0; i < 3; i++) {
        double way = (double)(next->to_mm[i] - piece->from_mm[i]);
        along += way * engraving->direction[i];
        square += way * way;
    }
    double has = distance(piece->from_mm, piece->to_mm);
    return along > has && square - along * along <= STRAIGHT_MM * STRAIGHT_MM;
}

/* Neighbours become one until a quarter of the room is free. */
static void thin(struct engraving *engraving) {
    const size_t enough = engraving->count - engraving->count / 4;
    while (engraving->count > enough && isfinite(engraving->grain_mm)) { /* infinite: only dots are left */
        size_t last = 0;
        engraving->grain_mm =
            engraving->grain_mm > 0.0f ? GRAIN_GROWTH * engraving->grain_mm : FIRST_GRAIN_MM;
        for (size_t i = 1; i < engraving->count; i++) {
            const struct engraving_piece *next = &engraving->pieces[i];
            if (fits_grain(engraving, &engraving->pieces[last], next))
                join(&engraving->pieces[last], next);
            else
                engraving->pieces[++last] = *next;
        }
        engraving->count = last + 1;
    }
}

static struct engraving_piece *room_for_one(struct engraving *engraving) {
    if (engraving->count == ENGRAVING_MAX_PIECES)
        thin(engraving);
    if (engraving->count == engraving->room && engraving->room < ENGRAVING_MAX_PIECES) {
        size_t room = engraving->room == 0 ? FIRST_PIECES : 2 * engraving->room;
        struct engraving_piece *grown = realloc(engraving->pieces, room * sizeof *grown);
        if (grown != NULL) {
            engraving->pieces = grown;
            engraving->room = room;
        }
    }
    return engraving->count < engraving->room ? &engraving->pieces[engraving->count++] : NULL;
}

static void add_piece(struct engraving *engraving, const struct engraving_piece *piece) {
    struct engraving_piece *last = engraving->count > 0 ? &engraving->pieces[engraving->count - 1] : NULL;
    if (last != NULL && (fits_grain(engraving, last, piece) || continues(engraving, last, piece))) {
        join(last, piece);
        return;
    }
    struct engraving_piece *added = room_for_one(engraving);
    if (added == NULL) {
        engraving->lost = true;
        return;
    }
    *added = *piece;
    double length = distance(piece->from_mm, piece->to_mm);
    for (unsigned i = 0; i < 3; i++)
        engraving->direction[i] = length > 0.0 ? (double)(piece->to_mm[i] - piece->from_mm[i]) / length : 0.0;
}

void engraving_take(struct engraving *engraving, const struct engraving_part *part) {
    if (part->duty <= 0.0)
        return;
    struct engraving_piece piece = {.t_s = (float)part->end_s,
                                    .length_mm = (float)part->length_mm,
                                    .energy_s = (float)(part->duty * part->time_s)};
    for (unsigned i = 0; i < 3; i++) {
        piece.from_mm[i] = (float)part->from_mm[i];
        piece.to_mm[i] = (float)part->to_mm[i];
    }
    add_piece(engraving, &piece);
    engraving->sum.length_mm += part->length_mm;
    double feed_mm_s = part->index < engraving->lines ? (double)engraving->constant_mm_s[part->index] : 0.0;
    if (feed_mm_s > 0.0 && part->length_mm > 0.0)
        add_to_stretch(engraving, part, feed_mm_s);
}

size_t engraving_pieces(const struct engraving *engraving, const struct engraving_piece **out) {
    *out = engraving->pieces;
    return engraving->count;
}

void engraving_result(const struct engraving *engraving, struct engraving_result *out) {
    *out = engraving->sum;
}

bool engraving_lost(const struct engraving *engraving) {
    return engraving->lost;
}
