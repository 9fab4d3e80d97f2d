/* SPDX-License-Identifier: MIT
 * Timed segments of a network host -> slices in the segment queue, just in time. [task]
 *
 * A host plans the motion: steps of each axis in a time. The queue changes neither path nor steps, but it may
 * stretch time: at pace s (0 .. 1) a segment of T seconds takes T/s. So it starts, holds, brakes before the
 * queue ends and passes jumps of speed within the limits of the axes, and no step is ever lost:
 *
 *   s^2 ^  jump ___________        entry(k) = min(1, jump(k), entry(k+1) + 2 c(k) T(k)),
 *       |      /           \       0 at the queue's end
 *       |     /             \      c: how fast the pace may change in this segment, 1/s:
 *       +--------------------> T   the least a/v of all axes
 *
 * d(s v)/dt = v ds/dt must not exceed a, hence c. On the way up, s^2 rises by 2 c per second of segment time.
 *
 * The host's own acceleration a' comes on top, d(s v)/dt = v ds/dt + s^2 a', so c is the part of a that a'
 * leaves. It is known when enough has come after the segment to tell it from rounding to whole steps; until
 * then, and where little is left, c is a fifth of a/v.
 *
 * With enough in the queue the pace is 1 and durations are exact, the fractions of a nanosecond carried.
 *
 * Segments may be put before others that are to come earlier (a lossy network): they lie at their places
 * until the gap is filled. */
#ifndef WIFICNC_SEGMENT_HOST_QUEUE_H
#define WIFICNC_SEGMENT_HOST_QUEUE_H

#include "config.h"
#include "segment/ahead.h"

/** What a host asks for. */
struct host_queue_segment {
    int32_t steps[AXIS_COUNT];
    uint32_t duration_us;
    uint32_t entry_speed_sq, exit_speed_sq; /* (steps/s)^2 x 1000 of the dominant axis; when duration is 0 */
    uint16_t id;
    uint8_t flags; /* enum segment_flags: RAPID, LAST, PROBE, EXACT_STOP */
};

/** Of the machine. Axes from axis_count up do not exist. */
struct host_queue_limits {
    float rate_steps_s[AXIS_COUNT];   /* > 0 */
    float accel_steps_s2[AXIS_COUNT]; /* > 0 */
    uint8_t axis_count;
    bool rests_to_probe; /* before and after segments that probe: they are not shaped (motion/hosted.h) */
};

enum host_queue_result {
    HOST_QUEUE_OK,
    HOST_QUEUE_FULL,
    HOST_QUEUE_NO_AXIS,
    HOST_QUEUE_NO_TIMING, /* steps, but neither a duration nor a speed */
    HOST_QUEUE_TOO_FAST,  /* needs more than HOST_QUEUE_STRETCH_MAX times its duration */
};

#define HOST_QUEUE_STRETCH_MAX 10.0

/** So many of the newest segments can be named: those that wait, and those that the axes have still to do
 * when they are shaped (motion/hosted.h). */
#define HOST_QUEUE_NAMES 256u

struct host_queue_slot {
    int32_t steps[AXIS_COUNT];
    uint32_t dominant;    /* of the axis with most steps; 0: a dwell */
    uint64_t duration_ns; /* > 0; at full pace */
    float change;         /* c, as far as it is known */
    float change_most;    /* the same of a host whose speed is even */
    float jump_sq;        /* greatest s^2 at which it may follow the one before */
    float entry_sq;       /* greatest s^2 at its begin */
    uint16_t id;
    uint8_t flags;
};

/** State that is kept at a mark (segment/ahead.h). */
struct host_queue_place {
    uint32_t tail, done;
    float pace_sq;
    bool ran_dry;
    double dwelt_ns, waited_ns, time_ns;
    uint64_t queued_ns; /* of the segments from tail to head then */
    uint32_t head;
};

struct host_queue {
    struct ahead *ahead;
    struct host_queue_limits limits;
    uint32_t head, tail;                    /* segments ever taken in order, and ever finished here; wrap */
    uint32_t kept;                          /* from here on they may have to be made again ... */
    uint32_t named;                         /* ... and named, by ids and flags */
    uint32_t first;                         /* came after a rest */
    uint32_t graded;                        /* from here on c is not known yet */
    float own;                              /* the host's part of the acceleration where that one begins */
    uint32_t present[HOST_QUEUE_SIZE / 32]; /* places from head on that are filled already */
    bool hold, hold_asked;               /* slow down along the path and stand; asked: not only for a stop */
    bool ran_dry;                        /* came to the end, which was not marked as the last */
    float pace_sq;                       /* s^2 now */
    uint32_t done;                       /* dominant steps of the segment at tail */
    double dwelt_ns, waited_ns, time_ns; /* of a dwell; before a very slow step; fraction carried */
    uint16_t duty;                       /* of a laser on a cut */
    uint64_t queued_ns;                  /* of all segments taken and not finished, at full pace */
    uint32_t underruns, stretched;
    struct host_queue_slot slots[HOST_QUEUE_SIZE];
    uint16_t ids[HOST_QUEUE_NAMES];
    uint8_t flags[HOST_QUEUE_NAMES];
};

/** Empty; counters at zero. */
void host_queue_init(struct host_queue *queue, struct ahead *ahead);

/** Of a laser on all cuts that are not made yet; 0 .. DUTY_FULL. */
void host_queue_set_duty(struct host_queue *queue, uint16_t duty);

/** For segments put from now on. */
void host_queue_set_limits(struct host_queue *queue, const struct host_queue_limits *limits);

/** Forget all that is queued and stand. The motion side is halted or has nothing. */
void host_queue_clear(struct host_queue *queue);

/** Places from head on. */
static inline uint32_t host_queue_free(const struct host_queue *queue) {
    uint32_t made = HOST_QUEUE_SIZE - (queue->head - queue->kept);
    uint32_t told = HOST_QUEUE_NAMES - (queue->head - queue->named);
    return made < told ? made : told;
}

/** The segment that comes `ahead` places after head is there. @param ahead  0 .. HOST_QUEUE_SIZE - 1 */
bool host_queue_has(const struct host_queue *queue, uint32_t ahead);

/** Segments that lie from head on without a gap and are not taken. */
uint32_t host_queue_laid(const struct host_queue *queue);

/** Lay a segment `ahead` places after head. One that is there already stays.
 *  @return other than HOST_QUEUE_OK: nothing was changed */
enum host_queue_result host_queue_lay(struct host_queue *queue, uint32_t ahead,
                                      const struct host_queue_segment *segment);

/** The segment at head if it is there: it may be taken. NULL: it has not come. */
const struct host_queue_slot *host_queue_next(const struct host_queue *queue);

/** Take the segment that host_queue_next() gave: from now on it will be executed. */
void host_queue_take(struct host_queue *queue);

/** Forget what lies beyond head. */
void host_queue_forget_ahead(struct host_queue *queue);

/** Slow down along the path and stand; or continue. */
void host_queue_hold(struct host_queue *queue, bool on);

/** How long slices are: as a queue alone makes them, or for what samples them. */
struct host_queue_pieces {
    float slice_s;    /* aim for this duration of a slice */
    uint32_t wait_ns; /* of one slice of a dwell, or before a very slow step */
};
extern const struct host_queue_pieces host_queue_usual;

/** The next slice: flags, steps, phases, duration, ramp, line, duty. @return false: none comes now */
bool host_queue_make(struct host_queue *queue, const struct host_queue_pieces *pieces,
                     struct segment *segment);

/** At rest after what was made, or in a dwell. */
bool host_queue_rests(const struct host_queue *queue);

/** More segments cannot change how fast the next slices are. */
bool host_queue_is_firm(const struct host_queue *queue);

/** Stop along the path, for the end of a batch; or not, as the host has asked. */
static inline void host_queue_stop(struct host_queue *queue, bool on) {
    queue->hold = on || queue->hold_asked;
}

/** About how long a stop takes from here. */
float host_queue_stop_s(const struct host_queue *queue);

/** The state, to be taken back; segments taken meanwhile stay taken. */
void host_queue_save(const struct host_queue *queue, struct host_queue_place *place);
void host_queue_load(struct host_queue *queue, const struct host_queue_place *place);

/** Segments before `kept` are not made again, and those before `named`, which is not beyond it, not named. */
void host_queue_release(struct host_queue *queue, uint32_t kept, uint32_t named);

/** The line of a slice: whose it is, also when the segment's place has been given to another one. */
static inline uint32_t host_queue_line(uint32_t number, uint16_t id) {
    return (uint32_t)id << 16 | (number & 0xFFFFu);
}
static inline uint16_t host_queue_line_id(uint32_t line) {
    return (uint16_t)(line >> 16);
}
/** Number of the segment as head and tail count. @param line  of a slice that is not over; one of a stop may
 * be beyond tail */
static inline uint32_t host_queue_line_number(const struct host_queue *queue, uint32_t line) {
    int16_t beyond = (int16_t)(uint16_t)(line - queue->tail);
    return (uint32_t)((int32_t)queue->tail + beyond);
}

/** Nothing is queued. (It may not be stepped yet.) */
static inline bool host_queue_is_empty(const struct host_queue *queue) {
    return queue->head == queue->tail;
}

/** Nothing comes before the hold is lifted, or at all. (It may not be stepped yet.) */
static inline bool host_queue_is_quiet(const struct host_queue *queue) {
    return host_queue_is_empty(queue) || (queue->hold && queue->pace_sq == 0.0f);
}

#endif
