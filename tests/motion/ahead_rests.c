/* SPDX-License-Identifier: MIT
 * The batches of segment/ahead, between a source and a motion side that are made up, at random instants.
 *
 * Usage: ahead_rests SEEDS
 *
 * At each instant the polls of both sides must come to rest: a poll that always finds more to do keeps a
 * controller from everything else, for ever where time waits for it. And each mark that a batch continues at
 * must be one that was published with a segment, at the time that the segment ends. */
#include "segment/ahead.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { CHAIN = 4096, POLLS = 3000, INSTANTS = 60, FULL_SPEED = 12 };

static uint64_t random_state;
static unsigned failures, seed;

static uint32_t below(uint32_t limit) {
    random_state ^= random_state << 13;
    random_state ^= random_state >> 7;
    random_state ^= random_state << 17;
    return (uint32_t)(random_state >> 32) % limit;
}

static void fail(const char *what) {
    if (++failures <= 5)
        printf("seed %u: %s\n", seed, what);
}

/* ---- the source: slots of a row, passed at a speed that changes by 1 from each to the next ---- */

struct place {
    uint32_t at, speed;
};

static struct source {
    struct place now, kept[QUEUE_MARKS];
    uint32_t end; /* of the row */
    bool hold, hold_asked;
    uint32_t portion, reach_us, shortest_us, longest_us;
    bool short_of_rest; /* it comes to rest when it is asked for a segment, and makes none */
} source;

static bool rests(const void *ctx) {
    (void)ctx;
    return source.now.speed == 0 || source.now.at == source.end;
}

static bool make(void *ctx, struct segment *segment) {
    struct place *now = &source.now;
    bool brakes = source.hold || source.end - now->at <= now->speed;
    (void)ctx;
    if (now->at == source.end || (source.hold && now->speed <= (source.short_of_rest ? 1u : 0u))) {
        now->speed = 0;
        return false;
    }
    if (brakes)
        now->speed -= now->speed > 0;
    else if (now->speed < FULL_SPEED)
        now->speed++;
    /* The same slot at the same speed always takes the same time. */
    uint32_t hash = (now->at * 2654435761u ^ now->speed * 40503u ^ seed * 2246822519u) >> 8;
    segment->duration_ns =
        1000u * (source.shortest_us + hash % (source.longest_us - source.shortest_us + 1u));
    now->at++;
    return true;
}

static uint32_t reach_us(const void *ctx) {
    (void)ctx;
    return source.reach_us;
}

static uint32_t news(const void *ctx) {
    (void)ctx;
    return source.end;
}

static void go_on(void *ctx, enum ahead_stop how) {
    (void)ctx;
    source.hold = how == AHEAD_STOP || source.hold_asked;
}

static bool stop(void *ctx, enum ahead_stop how) {
    go_on(ctx, how);
    return how != AHEAD_END || source.end - source.now.at < 30;
}

static uint32_t portion(const void *ctx) {
    (void)ctx;
    return source.portion;
}

static uint32_t work(const void *ctx) {
    (void)ctx;
    return 1;
}

static void save(void *ctx, uint32_t place) {
    (void)ctx;
    source.kept[place] = source.now;
}

static void load(void *ctx, uint32_t place, enum ahead_return why) {
    (void)ctx;
    (void)why;
    source.now = source.kept[place];
}

static void release(void *ctx, uint32_t place) {
    (void)ctx;
    (void)place;
}

static const struct ahead_source ops = {make, rests, reach_us, news, stop,   portion,
                                        work, go_on, save,     load, release};

/* ---- the motion side: what is published and not left yet ---- */

static struct segment_queue queue;
static struct ahead ahead;
static struct {
    uint32_t end_us;
    uint32_t mark; /* place + 1 */
} chain[CHAIN];
static uint32_t at, count, most_segments, most_us;

static void begin_chain(void) {
    chain[0].end_us = 0;
    chain[0].mark = QUEUE_RESET_MARK + 1u;
    at = 0;
    count = 1;
    queue.now_us = 0;
}

/* @return its place in the chain, or count */
static uint32_t find_mark(uint32_t place) {
    for (uint32_t i = at; i < count; i++)
        if (chain[i].mark == place + 1u)
            return i;
    return count;
}

static bool answer(void) {
    if (!segment_queue_is_pending(&queue))
        return false;
    uint32_t from = find_mark(queue.from);
    if (from == count) {
        segment_queue_answer(&queue, QUEUE_PASSED);
        return true;
    }
    if (chain[from].end_us != ahead.mark_us[queue.from])
        fail("a batch continues at another time than that of its mark");
    /* As where spans do not suffice: for the end of the row as the stop, or for so much motion. */
    uint32_t committed_us = ahead.mark_us[ahead.commit] - queue.now_us;
    if (committed_us > most_us || (!ahead.spare && queue.count > most_segments)) {
        segment_queue_answer(&queue, QUEUE_LARGE);
        return true;
    }
    for (uint32_t i = 0; i < queue.count; i++)
        if (queue.slots[i].mark != 0 && find_mark(queue.slots[i].mark - 1u) <= from)
            fail("a place has two marks");
    count = from + 1;
    for (uint32_t i = 0; i < queue.count && count < CHAIN; i++, count++) {
        chain[count].end_us = queue.slots[i].end_us;
        chain[count].mark = queue.slots[i].mark;
    }
    segment_queue_answer(&queue, QUEUE_TAKEN);
    return true;
}

static void pass(uint32_t segments) {
    at = at + segments < count ? at + segments : count - 1;
    queue.now_us = chain[at].end_us;
    for (uint32_t i = at; i < count; i++)
        chain[i - at] = chain[i];
    count -= at;
    at = 0;
}

/* ---- instants ---- */

static void cause(void) {
    switch (below(6)) {
    case 0:
        source.hold = source.hold_asked = !source.hold_asked;
        ahead_change(&ahead);
        break;
    case 1:
        ahead_change(&ahead);
        break;
    case 2:
        if (ahead_open(&ahead)) {
            source.end += 1 + below(40);
            ahead_close(&ahead);
        }
        break;
    case 3:
        source.reach_us = below(2) ? AHEAD_FULL_US : AHEAD_NEAR_US;
        break;
    case 4:
        ahead_abandon(&ahead);
        break;
    default:
        break;
    }
}

/* Both sides look until neither finds anything to do; in between something may come. */
static bool comes_to_rest(bool alone) {
    for (unsigned polls = 0; polls < POLLS; polls++) {
        bool any = ahead_poll(&ahead);
        any |= below(4) != 0 && answer();
        if (!any && !segment_queue_is_pending(&queue))
            return true;
        if (!alone && polls < 8 && below(10) == 0)
            cause();
        if (!alone && polls < 8 && below(10) == 0)
            pass(1);
    }
    return false;
}

static void begin(void) {
    random_state = seed * 0x9E3779B97F4A7C15u | 1u;
    memset(&queue, 0, sizeof queue);
    memset(&source, 0, sizeof source);
    begin_chain();
    ahead_init(&ahead, &queue);
    source.end = below(300);
    source.portion = below(2) ? UINT32_MAX : 1 + below(8);
    source.reach_us = AHEAD_FULL_US;
    source.shortest_us = 100 + below(2) * below(4000);
    source.longest_us = source.shortest_us + below(8000);
    source.short_of_rest = below(2);
    most_segments = below(2) ? SEGMENT_QUEUE_SIZE : below(60);
    most_us = below(2) ? AHEAD_FULL_US : 7000u + below(20000);
    most_us += source.longest_us;
}

/* The way of one controller. */
static void try_seed(void) {
    begin();
    for (unsigned instant = 0; instant < INSTANTS; instant++) {
        cause();
        if (!ahead_claim(&ahead, AHEAD_HOST, &ops, NULL))
            fail("is not given motion");
        if (!comes_to_rest(false)) {
            fail("does not come to rest");
            return;
        }
        pass(below(3) == 0 ? CHAIN : below(12));
    }
    /* Left alone, it goes to the end of the row. */
    source.hold = source.hold_asked = false;
    ahead_close(&ahead);
    ahead_change(&ahead);
    for (unsigned instant = 0; source.now.at != source.end || ahead_queued_us(&ahead) > 0; instant++) {
        if (!comes_to_rest(true) || instant > 40000) {
            fail("does not come to the end");
            return;
        }
        pass(1);
    }
}

int main(int argc, char **argv) {
    unsigned seeds = argc > 1 ? (unsigned)atoi(argv[1]) : 2000;
    for (seed = 1; seed <= seeds; seed++)
        try_seed();
    printf("%u failures\n", failures);
    return failures != 0;
}
