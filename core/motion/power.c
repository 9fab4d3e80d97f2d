/* SPDX-License-Identifier: MIT */
#include "motion/power.h"

#include "base/minmax.h"

/* A span takes the step interrupt a few us: finer changes than this become their mean. */
#define LEAST_S 5e-5f

static const struct power_mark *mark_at(const struct power *power, uint32_t index) {
    return &power->marks[index & (POWER_MARKS - 1)];
}

void power_reset(struct power *power) {
    power->marks[0] = (struct power_mark){0};
    power->kept = power->end = 0;
    power->head = 1;
}

void power_mark(struct power *power, uint32_t at, float rpm) {
    struct power_mark *newest = &power->marks[(power->head - 1) & (POWER_MARKS - 1)];
    if ((int32_t)(at - newest->at) <= 0) /* nothing had the S before */
        newest->rpm = rpm;
    else
        power->marks[power->head++ & (POWER_MARKS - 1)] = (struct power_mark){at, rpm};
}

uint32_t power_units(float mm) {
    return (uint32_t)min_f(mm * POWER_UNITS + 0.5f, (float)POWER_CHORD_MAX);
}

/* Farther than all chords ahead together: nothing looks for a mark's place there. */
#define FAR (3u << 29)

uint32_t power_close(struct power *power, float length_mm) {
    struct power_mark *newest = &power->marks[(power->head - 1) & (POWER_MARKS - 1)];
    uint32_t units = power_units(length_mm);
    int32_t marked = (int32_t)(newest->at - power->end);
    if (marked > (int32_t)units) /* the chord turned out shorter than one to an earlier point of it */
        units = (uint32_t)marked;
    power->end += units;
    if (power->end - newest->at > FAR) /* 393 m of one S: half of all places away, it would lie ahead */
        newest->at = power->end - 1u;
    return units;
}

/* ---- a segment ---- */

struct writer {
    const struct power_way *way;
    const struct beam *beam;
    struct segment_queue *queue;
    struct segment *segment;
    uint32_t length, least; /* units of the segment, and of the shortest stretch of one duty */
    bool begun;             /* the first stretch is complete */
    uint32_t begin;         /* of the stretch, from the start of the segment */
    float sum;              /* of S over the stretch, but for the newest S of it ... */
    uint32_t since;         /* ... which is from here on */
};

static void write_duty(const struct writer *writer, float rpm, uint16_t duty[2]) {
    const struct power_way *way = writer->way;
    duty[0] = beam_duty(writer->beam, rpm, way->v0, way->feed_mm_s);
    duty[1] = beam_duty(writer->beam, rpm, way->v1, way->feed_mm_s);
}

/* A stretch is complete up to here. */
static void end_stretch(struct writer *writer, float rpm, uint32_t end) {
    struct segment_queue *queue = writer->queue;
    struct segment *segment = writer->segment;
    uint32_t length = end - writer->begin;
    float mean = writer->since == writer->begin
                     ? rpm
                     : (writer->sum + rpm * (float)(end - writer->since)) / (float)length;
    if (!writer->begun) {
        write_duty(writer, mean, segment->duty);
        writer->begun = true;
    } else {
        struct segment_power *to = &queue->power[queue->power_count++];
        to->at = (uint16_t)(((uint64_t)writer->begin << 16) / writer->length);
        write_duty(writer, mean, to->duty);
        segment->power_count++;
    }
    writer->begin = writer->since = end;
    writer->sum = 0.0f;
}

/* A mark at a distance from the start of the segment, the next one `after` it. What is too short becomes part
 * of a mean with others that are, but a long one that follows begins where it should. The last entry of the
 * queue is for the rest of the segment. */
static void pass_mark(struct writer *writer, float rpm, uint32_t at, uint32_t after) {
    bool room = writer->queue->power_count + 1 < QUEUE_POWER;
    if (room && (at - writer->begin >= writer->least || after >= writer->least)) {
        end_stretch(writer, rpm, at);
        return;
    }
    writer->sum += rpm * (float)(at - writer->since);
    writer->since = at;
}

/* From a mark to the one after it, or to the end of what is marked. */
static uint32_t length_from(const struct power *power, uint32_t index, uint32_t end) {
    return (index + 1 != power->head ? mark_at(power, index + 1)->at : end) - mark_at(power, index)->at;
}

/* Part of a segment that a step of its fastest axis is. */
static float step_part(const struct segment *segment) {
    int32_t most = 1;
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++) {
        int32_t steps = segment->steps[ax] < 0 ? -segment->steps[ax] : segment->steps[ax];
        most = steps > most ? steps : most;
    }
    return 1.0f / (float)most;
}

/* All of it as one stretch. */
static void write_mean(const struct power *power, struct power_place *place, struct writer *writer) {
    float rpm = mark_at(power, place->mark)->rpm, sum = 0.0f;
    uint32_t since = 0;
    while (place->mark + 1 != power->head) {
        const struct power_mark *next = mark_at(power, place->mark + 1);
        int32_t at = (int32_t)(next->at - place->at);
        if (at > 0 && at >= (int32_t)writer->length)
            break;
        uint32_t until = at > 0 ? (uint32_t)at : 0u;
        sum += rpm * (float)(until - since);
        since = until;
        rpm = next->rpm;
        place->mark++;
    }
    if (since > 0)
        rpm = (sum + rpm * (float)(writer->length - since)) / (float)writer->length;
    write_duty(writer, rpm, writer->segment->duty);
}

static void write_stretches(const struct power *power, struct power_place *place, struct writer *writer) {
    float rpm = mark_at(power, place->mark)->rpm;
    while (place->mark + 1 != power->head) {
        const struct power_mark *next = mark_at(power, place->mark + 1);
        int32_t at = (int32_t)(next->at - place->at);
        if (at > 0 && at >= (int32_t)writer->length)
            break;
        if (at >= 0) /* at the very start, too, its event is still to be chosen */
            pass_mark(writer, rpm, (uint32_t)at, length_from(power, place->mark + 1, writer->way->to));
        rpm = next->rpm;
        place->mark++;
    }
    end_stretch(writer, rpm, writer->length);
}

/* From rest nothing of the S before may burn: its first step may take long. */
static void pass_marks_at_rest(const struct power *power, struct power_place *place) {
    while (place->mark + 1 != power->head && (int32_t)(mark_at(power, place->mark + 1)->at - place->at) <= 0)
        place->mark++;
}

/* Units from the end of a segment to where the motion will be when the light follows its signal, if the
 * acceleration stays as it is: never beyond the place of rest that it leads to. */
static uint32_t lead_units(const struct power_way *way, float rise_s) {
    float v = way->v1, dv = (v - way->v0) / way->time_s * rise_s;
    if (v + dv <= 0.0f)
        return v > 0.0f ? (uint32_t)(-0.5f * v * v / dv * rise_s * POWER_UNITS) : 0u;
    return (uint32_t)((v + 0.5f * dv) * rise_s * POWER_UNITS);
}

void power_segment(const struct power *power, struct power_place *place, const struct power_way *way,
                   const struct beam *beam, struct segment_queue *queue, struct segment *segment) {
    uint32_t length = way->to - place->at;
    if (beam->on && beam->rise_s > 0.0f)
        length += lead_units(way, beam->rise_s);
    if ((int32_t)length < 0) /* rounding of a float at the end of a piece, or a lead that shrinks */
        length = 0;
    segment->power_first = (uint8_t)queue->power_count;
    if (!beam->on &&
        place->mark + 1 == power->head) { /* dark, and no mark comes before the end of the path */
        place->at += length;
        return;
    }
    float least = min_f(max_f(step_part(segment), LEAST_S / way->time_s), 1.0f);
    struct writer writer = {.way = way,
                            .beam = beam,
                            .queue = queue,
                            .segment = segment,
                            .length = length,
                            .least = (uint32_t)(least * (float)length)};
    if (way->v0 == 0.0f)
        pass_marks_at_rest(power, place);
    if (way->coarse || length == 0 || (segment->flags & SEGMENT_CUT) == 0)
        write_mean(power, place, &writer);
    else
        write_stretches(power, place, &writer);
    place->at += length;
}
