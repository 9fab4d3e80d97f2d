/* SPDX-License-Identifier: MIT
 * Step edges -> figures. The method and its resolution are in measure.h. */
#include "measure.h"

#include "segment/segment.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

enum {
    GRID_HZ = 1000,
    WINDOW = 10,         /* grid points per window of speed, and the least of acceleration, which needs two */
    LONGEST = 100,       /* the most */
    CENTRE = WINDOW / 2, /* a sample lies in the middle of its speed window */
    HISTORY = 256,       /* > 2 * LONGEST, a power of two */
    FIRST_SAMPLES = 1024,
};

/** Positions on the grid, the latest ones, and how they were reached. */
struct history {
    double steps[HISTORY][AXIS_COUNT];
    bool rapid[HISTORY];
};

struct sampling {
    struct path_sample *samples;
    size_t count, room;
    uint64_t every;      /* grid points per sample; 0: no samples */
    uint64_t next_point; /* grid point of the next sample */
    bool lost;
};

struct measure {
    uint64_t next_grid_ticks; /* events before it cost no window work */
    struct measured sum;
    uint64_t edge_ticks[AXIS_COUNT];         /* of the axis's last edge */
    uint64_t min_interval_ticks[AXIS_COUNT]; /* UINT64_MAX: none yet */
    uint64_t grid_ticks;
    uint64_t point; /* number of the grid point at next_grid_ticks; 0 is at the first event */
    double max_speed[AXIS_COUNT], max_accel[AXIS_COUNT]; /* steps per window and per window^2 */
    uint64_t accel_window[AXIS_COUNT];                   /* grid points */
    uint64_t settle; /* after so many points of even motion nothing changes any more */
    uint64_t begin_ticks;
    uint32_t timer_hz;
    uint8_t dwells; /* of the last event */
    bool rapid;     /* the last event */
    bool started, ended;
    double mm_per_step[AXIS_COUNT];
    struct history history;
    struct sampling sampling;
};

/** Even motion from one event to the next. */
struct stretch {
    uint64_t from_ticks;
    double from_steps[AXIS_COUNT];
    double steps_per_tick[AXIS_COUNT];
    bool rapid;
};

struct measure *measure_create(uint32_t timer_hz) {
    struct measure *m = calloc(1, sizeof *m);
    if (m == NULL)
        return NULL;
    m->timer_hz = timer_hz;
    m->grid_ticks = (timer_hz + GRID_HZ / 2) / GRID_HZ;
    for (int axis = 0; axis < AXIS_COUNT; axis++) {
        m->mm_per_step[axis] = 1.0;
        m->min_interval_ticks[axis] = UINT64_MAX;
        m->accel_window[axis] = WINDOW;
    }
    m->settle = 2 * WINDOW + 1;
    return m;
}

void measure_expect_accel(struct measure *m, int axis, double accel_steps_s2) {
    uint64_t window = WINDOW;
    if (accel_steps_s2 > 0.0) {
        /* From rest: steps = a W^2 / 2. */
        double points = ceil(sqrt(2.0 * MEASURE_WINDOW_STEPS / accel_steps_s2) * (double)GRID_HZ);
        window = points < (double)LONGEST ? (uint64_t)points : LONGEST;
    }
    m->accel_window[axis] = window > WINDOW ? window : WINDOW;
    uint64_t settle = 2 * m->accel_window[axis] + 1;
    m->settle = settle > m->settle ? settle : m->settle;
}

void measure_destroy(struct measure *m) {
    if (m == NULL)
        return;
    free(m->sampling.samples);
    free(m);
}

void measure_begin(struct measure *m, uint64_t t_ticks, const double steps_per_mm[AXIS_COUNT]) {
    struct measured sum = {.last_ticks = t_ticks};
    for (int axis = 0; axis < AXIS_COUNT; axis++) {
        const int32_t position = m->sum.position_steps[axis];
        sum.position_steps[axis] = sum.min_steps[axis] = sum.max_steps[axis] = position;
        m->mm_per_step[axis] = 1.0 / steps_per_mm[axis];
        m->min_interval_ticks[axis] = UINT64_MAX;
        m->max_speed[axis] = m->max_accel[axis] = 0.0;
    }
    m->sum = sum;
    m->begin_ticks = t_ticks;
    m->started = false;
}

void measure_sample_every(struct measure *m, double interval_ms) {
    m->sampling.every = interval_ms < 1.5 ? 1 : (uint64_t)(interval_ms + 0.5);
}

/* ---- samples ---- */

/* Every second sample goes, the first one stays; from now on they come half as often. */
static void thin(struct sampling *s) {
    size_t kept = 0;
    for (size_t i = 0; i < s->count; i += 2)
        s->samples[kept++] = s->samples[i];
    s->count = kept;
    s->every *= 2;
}

static bool make_room(struct sampling *s) {
    if (s->count == MEASURE_MAX_SAMPLES)
        thin(s);
    if (s->count < s->room)
        return true;
    size_t room = s->room == 0 ? FIRST_SAMPLES : 2 * s->room;
    struct path_sample *grown = realloc(s->samples, room * sizeof *grown);
    if (grown == NULL) {
        s->lost = true;
        return false;
    }
    s->samples = grown;
    s->room = room;
    return true;
}

/* Keep the centre of the speed window that ends at the current point. */
static void take_sample(struct measure *m, const double moved[AXIS_COUNT]) {
    struct sampling *s = &m->sampling;
    if (!make_room(s))
        return;
    struct path_sample *sample = &s->samples[s->count++];
    /* Speed is the mean over the window, so it belongs to its middle, and so does the position. */
    size_t centre = (m->point - CENTRE) % HISTORY;
    double moved_sq = 0.0;
    for (int axis = 0; axis < AXIS_COUNT; axis++) {
        double moved_mm = moved[axis] * m->mm_per_step[axis];
        moved_sq += moved_mm * moved_mm;
        sample->position_mm[axis] = (float)(m->history.steps[centre][axis] * m->mm_per_step[axis]);
    }
    uint64_t t_ticks = m->next_grid_ticks - CENTRE * m->grid_ticks - m->begin_ticks;
    sample->t_s = (float)((double)t_ticks / m->timer_hz);
    sample->speed_mm_s = (float)(sqrt(moved_sq) * m->timer_hz / (double)(WINDOW * m->grid_ticks));
    sample->rapid = m->history.rapid[centre];
    s->next_point = m->point - CENTRE + s->every;
}

/* ---- the grid ---- */

static void steps_at(const struct stretch *stretch, double ticks_after, double out[AXIS_COUNT]) {
    for (int axis = 0; axis < AXIS_COUNT; axis++)
        out[axis] = stretch->from_steps[axis] + stretch->steps_per_tick[axis] * ticks_after;
}

/* Take the grid point at next_grid_ticks, which lies in the stretch, and look at the windows that end there.
 */
static void take_point(struct measure *m, const struct stretch *stretch) {
    double (*steps)[AXIS_COUNT] = m->history.steps;
    double *now = steps[m->point % HISTORY];
    const double *before = steps[(m->point - WINDOW) % HISTORY];
    double moved[AXIS_COUNT];
    steps_at(stretch, (double)(m->next_grid_ticks - stretch->from_ticks), now);
    m->history.rapid[m->point % HISTORY] = stretch->rapid;
    for (int axis = 0; axis < AXIS_COUNT; axis++) {
        uint64_t window = m->accel_window[axis];
        double mid = steps[(m->point - window) % HISTORY][axis];
        double old = steps[(m->point - 2 * window) % HISTORY][axis];
        moved[axis] = now[axis] - before[axis];
        double speed = fabs(moved[axis]);
        double accel = fabs((now[axis] - mid) - (mid - old));
        m->max_speed[axis] = speed > m->max_speed[axis] ? speed : m->max_speed[axis];
        m->max_accel[axis] = accel > m->max_accel[axis] ? accel : m->max_accel[axis];
    }
    if (m->sampling.every != 0 && m->point >= m->sampling.next_point + CENTRE)
        take_sample(m, moved);
    m->point++;
    m->next_grid_ticks += m->grid_ticks;
}

/* Jump over grid points of a stretch in which speed and acceleration do not change; history is what it would
 * be. */
static void skip_points(struct measure *m, const struct stretch *stretch, uint64_t count) {
    m->point += count;
    m->next_grid_ticks += count * m->grid_ticks;
    double after = (double)(m->next_grid_ticks - stretch->from_ticks);
    for (unsigned back = 1; back < m->settle; back++) {
        size_t slot = (m->point - back) % HISTORY;
        steps_at(stretch, after - (double)(back * m->grid_ticks), m->history.steps[slot]);
        m->history.rapid[slot] = stretch->rapid;
    }
    m->sampling.next_point = 0; /* one before the jump, one after it: a straight line in time */
}

static void take_points(struct measure *m, const struct stretch *stretch, uint64_t count) {
    /* A long stretch: both ends point by point, until every window lies within the stretch, and a jump
     * between them. */
    if (count > 3 * m->settle) {
        for (unsigned i = 0; i < m->settle; i++)
            take_point(m, stretch);
        m->sampling.next_point = 0;
        take_point(m, stretch);
        skip_points(m, stretch, count - 2 * m->settle - 1);
        count = m->settle;
    }
    while (count-- > 0)
        take_point(m, stretch);
}

/* The first event: nothing has moved for a long time. */
static void start_grid(struct measure *m, const struct trace_event *event) {
    m->started = true;
    m->next_grid_ticks = event->t_ticks;
    m->point = 2 * HISTORY; /* so that "two windows ago" is a number above 0 */
    m->sampling.next_point = 2 * HISTORY;
    bool rapid = (event->flags & SEGMENT_RAPID) != 0;
    for (unsigned i = 0; i < HISTORY; i++) {
        for (int axis = 0; axis < AXIS_COUNT; axis++)
            m->history.steps[i][axis] = m->sum.position_steps[axis];
        m->history.rapid[i] = rapid;
    }
}

/* Grid points up to this event. Called before the event is counted. */
static void reach_event(struct measure *m, const struct trace_event *event) {
    struct stretch stretch = {.from_ticks = m->sum.last_ticks, .rapid = (event->flags & SEGMENT_RAPID) != 0};
    double ticks = (double)(event->t_ticks - stretch.from_ticks);
    for (unsigned axis = 0; axis < AXIS_COUNT; axis++) {
        stretch.from_steps[axis] = m->sum.position_steps[axis];
        if (event->step_mask & 1u << axis && ticks > 0.0)
            stretch.steps_per_tick[axis] = ((event->dir_mask & 1u << axis) != 0 ? -1.0 : 1.0) / ticks;
    }
    take_points(m, &stretch, (event->t_ticks - m->next_grid_ticks) / m->grid_ticks + 1);
}

/* ---- events ---- */

static inline void count_edge(struct measure *m, unsigned axis, bool negative, uint64_t t_ticks) {
    struct measured *sum = &m->sum;
    int32_t position = negative ? sum->position_steps[axis] - 1 : sum->position_steps[axis] + 1;
    sum->position_steps[axis] = position;
    if (position > sum->max_steps[axis])
        sum->max_steps[axis] = position;
    if (position < sum->min_steps[axis])
        sum->min_steps[axis] = position;
    uint64_t interval = t_ticks - m->edge_ticks[axis];
    m->edge_ticks[axis] = t_ticks;
    /* The first edge has none before it. */
    if (interval < m->min_interval_ticks[axis] && sum->steps_total[axis] != 0)
        m->min_interval_ticks[axis] = interval;
    sum->steps_total[axis]++;
}

static inline void count_event(struct measure *m, const struct trace_event *event) {
    uint64_t ticks = event->t_ticks - m->sum.last_ticks;
    if (event->dwells == m->dwells)
        *(event->flags & SEGMENT_RAPID ? &m->sum.rapid_ticks : &m->sum.cutting_ticks) += ticks;
    m->dwells = event->dwells;
    m->rapid = (event->flags & SEGMENT_RAPID) != 0;
    m->sum.last_ticks = event->t_ticks;
    m->sum.events++;
    for (unsigned axis = 0; axis < AXIS_COUNT; axis++)
        if (event->step_mask & 1u << axis)
            count_edge(m, axis, (event->dir_mask & 1u << axis) != 0, event->t_ticks);
}

void measure_events(void *ctx, const struct trace_event *events, size_t count) {
    struct measure *m = ctx;
    for (size_t i = 0; i < count; i++) {
        const struct trace_event *event = &events[i];
        bool first = !m->started;
        if (!first && event->t_ticks >= m->next_grid_ticks)
            reach_event(m, event);
        count_event(m, event);
        if (first)
            start_grid(m, event);
    }
}

/* After its last step an axis still brakes for half a step. */
static void count_tail(struct measure *m, uint64_t end_ticks, uint8_t dwells) {
    if (dwells == m->dwells && end_ticks > m->sum.last_ticks)
        *(m->rapid ? &m->sum.rapid_ticks : &m->sum.cutting_ticks) += end_ticks - m->sum.last_ticks;
}

void measure_end(struct measure *m, uint64_t end_ticks, uint8_t dwells) {
    if (!m->started || m->ended)
        return;
    m->ended = true;
    count_tail(m, end_ticks, dwells);
    size_t last = (m->point - 1) % HISTORY;
    struct stretch rest = {.from_ticks = m->sum.last_ticks, .rapid = m->history.rapid[last]};
    for (int axis = 0; axis < AXIS_COUNT; axis++)
        rest.from_steps[axis] = m->sum.position_steps[axis];
    uint64_t end_point = m->point; /* the first one at rest */
    take_points(m, &rest, CENTRE);
    if (m->sampling.every != 0)
        m->sampling.next_point = end_point; /* the end is a sample */
    take_points(m, &rest, 1);
    m->sampling.next_point = UINT64_MAX - CENTRE;
    take_points(m, &rest, m->settle - 1 - CENTRE);
}

/* ---- results ---- */

void measure_result(const struct measure *m, struct measured *out) {
    *out = m->sum;
    double point_s = (double)m->grid_ticks / m->timer_hz;
    for (int axis = 0; axis < AXIS_COUNT; axis++) {
        uint64_t interval = m->min_interval_ticks[axis];
        out->min_interval_ticks[axis] = interval == UINT64_MAX ? 0 : interval > 0 ? interval : 1;
        double window_s = (double)m->accel_window[axis] * point_s;
        out->max_speed_steps_s[axis] = m->max_speed[axis] / ((double)WINDOW * point_s);
        out->max_accel_steps_s2[axis] = m->max_accel[axis] / (window_s * window_s);
        out->accel_window_s[axis] = window_s;
    }
}

size_t measure_samples(const struct measure *m, const struct path_sample **out) {
    *out = m->sampling.samples;
    return m->sampling.count;
}

int measure_samples_lost(const struct measure *m) {
    return m->sampling.lost;
}
