/* SPDX-License-Identifier: MIT */
#include "tasks.h"

#include "task_rest.h"

static uint64_t ticks_of_us(const struct tasks *tasks, uint64_t us) {
    return us * tasks->timer_hz / 1000000u;
}

static uint64_t random_below(struct tasks *tasks, uint64_t below) {
    /* Marsaglia's xorshift64, so that a seed always makes the same stalls. Its state must not be 0. */
    tasks->random ^= tasks->random << 13;
    tasks->random ^= tasks->random >> 7;
    tasks->random ^= tasks->random << 17;
    return below > 0 ? (tasks->random >> 16) % below : 0;
}

static void set_task(struct tasks *tasks, enum host_side side, uint32_t period_us, uint32_t late_us) {
    tasks->task[side].period_ticks = ticks_of_us(tasks, period_us);
    tasks->task[side].late_ticks = ticks_of_us(tasks, late_us);
}

void tasks_init(struct tasks *tasks, uint8_t of, uint32_t timer_hz) {
    *tasks = (struct tasks){.timer_hz = timer_hz, .wakes_on_step = true, .random = 88172645463325252u};
    if (of == HOST_TASKS_ESP32) {
        tasks->own_motion = tasks->wakes_motion = tasks->rests = true;
        tasks->wakes_on_step = false;
        set_task(tasks, HOST_CONTROLLER, ESP32_CONTROLLER_PERIOD_US, ESP32_CONTROLLER_LATE_US);
        set_task(tasks, HOST_MOTION, ESP32_MOTION_PERIOD_US, ESP32_MOTION_LATE_US);
    } else if (of == HOST_TASKS_PIC32MZ) {
        tasks->one_loop = true;
        set_task(tasks, HOST_CONTROLLER, PIC32MZ_LOOP_PERIOD_US, PIC32MZ_LOOP_LATE_US);
    }
}

void tasks_look_each(struct tasks *tasks, uint32_t period_us) {
    tasks->wakes_on_step = false;
    set_task(tasks, HOST_CONTROLLER, period_us, 0);
}

/* ---- stalls ---- */

/* The next one of the random stalls. Short ones are as frequent as long ones: each octave has its share. */
static void next_random_stall(struct tasks *tasks, uint64_t after_ticks) {
    const struct host_random_stalls *stalls = &tasks->random_stalls;
    uint8_t side = (uint8_t)random_below(tasks, HOST_SIDES);
    while ((stalls->sides >> side & 1) == 0)
        side = (uint8_t)((side + 1) % HOST_SIDES);
    uint64_t longest_us = stalls->longest_ms * 1000ull;
    while (longest_us > 2000 && random_below(tasks, 2) != 0)
        longest_us /= 2;
    uint64_t gap_us = random_below(tasks, 2000ull * stalls->gap_ms);
    uint64_t from = after_ticks + ticks_of_us(tasks, gap_us);
    uint64_t length = ticks_of_us(tasks, longest_us / 2 + random_below(tasks, longest_us / 2 + 1));
    tasks->random_stall = (struct task_stall){.from_ticks = from, .until_ticks = from + length, .side = side};
}

bool tasks_stall(struct tasks *tasks, const struct task_stall *stall, uint64_t now_ticks) {
    uint32_t kept = 0;
    for (uint32_t n = 0; n < tasks->stall_count; n++)
        if (tasks->stall[n].until_ticks > now_ticks)
            tasks->stall[kept++] = tasks->stall[n];
    tasks->stall_count = kept;
    if (kept == TASKS_STALLS_MAX)
        return false;
    tasks->stall[tasks->stall_count++] = *stall;
    return true;
}

void tasks_stall_randomly(struct tasks *tasks, const struct host_random_stalls *stalls, uint64_t now_ticks) {
    tasks->random_stalls = *stalls;
    /* 2^64 divided by the golden ratio: seeds that differ by 1 begin far apart. */
    tasks->random = stalls->seed * 0x9E3779B97F4A7C15u | 1u;
    tasks->random_stall = (struct task_stall){0};
    if (stalls->sides != 0)
        next_random_stall(tasks, now_ticks);
}

/* In one loop controller and motion side are late together; the reader is an interrupt there, and is not. */
static bool concerns(const struct tasks *tasks, const struct task_stall *stall, enum host_side side) {
    bool both_loop = tasks->one_loop && stall->side != HOST_READER && side != HOST_READER;
    return stall->side == side || both_loop;
}

uint64_t tasks_stalled_until(struct tasks *tasks, enum host_side side, uint64_t now_ticks) {
    uint64_t until = now_ticks;
    while (tasks->random_stalls.sides != 0 && tasks->random_stall.until_ticks <= now_ticks)
        next_random_stall(tasks, tasks->random_stall.until_ticks);
    for (uint32_t n = 0; n <= tasks->stall_count; n++) {
        const struct task_stall *stall = n < tasks->stall_count ? &tasks->stall[n] : &tasks->random_stall;
        if (concerns(tasks, stall, side) && stall->from_ticks <= now_ticks && stall->until_ticks > until)
            until = stall->until_ticks;
    }
    return until;
}

uint64_t tasks_stalls_end(const struct tasks *tasks) {
    uint64_t end = 0;
    for (uint32_t n = 0; n < tasks->stall_count; n++)
        end = tasks->stall[n].until_ticks > end ? tasks->stall[n].until_ticks : end;
    return end;
}

/* ---- periods ---- */

/* Its next look is at a tick, a tick being a multiple of its period, or later by chance. */
static void sleep_from(struct tasks *tasks, struct task *task, uint64_t now_ticks) {
    uint64_t tick = (now_ticks / task->period_ticks + 1) * task->period_ticks;
    task->due_ticks = tick + random_below(tasks, task->late_ticks + 1);
}

bool tasks_is_due(struct tasks *tasks, enum host_side side, uint64_t now_ticks) {
    const struct task *task = &tasks->task[side];
    bool woken = side == HOST_MOTION && tasks->motion_woken && !task->rests;
    if (task->due_ticks > now_ticks && !woken)
        return false;
    return tasks_stalled_until(tasks, side, now_ticks) == now_ticks;
}

/* A look with work. @return true: the task has worked for as long as it may */
static bool has_worked_long(struct tasks *tasks, struct task *task, uint64_t now_ticks) {
    const struct task_rest begin = {0};
    task->rounds = task->looked_ticks == now_ticks ? task->rounds + 1 : 1;
    task->looked_ticks = now_ticks;
    tasks->rounds_max = task->rounds > tasks->rounds_max ? task->rounds : tasks->rounds_max;
    return tasks->rests && task_rest_is_due(&begin, task->rounds * ESP32_ROUND_US);
}

void tasks_looked(struct tasks *tasks, enum host_side side, bool done, uint64_t now_ticks) {
    struct task *task = &tasks->task[side];
    task->rests = done && has_worked_long(tasks, task, now_ticks);
    if (task->period_ticks > 0 && (!done || task->rests))
        sleep_from(tasks, task, now_ticks);
    task->idle = !done;
    if (done)
        for (unsigned other = 0; other < HOST_SIDES; other++)
            tasks->task[other].idle = false;
    if (side == HOST_MOTION)
        tasks->motion_woken = done; /* more to do immediately */
    else if (done)
        tasks->motion_woken = tasks->wakes_motion;
}

void tasks_wake(struct tasks *tasks, uint64_t now_ticks) {
    for (unsigned side = 0; side < HOST_SIDES; side++) {
        struct task *task = &tasks->task[side];
        /* It has slept since: its next look is at its next tick, not at the moment of the event. */
        if (task->idle && task->period_ticks > 0 && task->due_ticks < now_ticks)
            sleep_from(tasks, task, now_ticks);
        task->idle = false;
    }
}

bool tasks_await_ticks(const struct tasks *tasks) {
    const struct task *motion = &tasks->task[HOST_MOTION];
    const bool motion_awaits = !tasks->own_motion || (!motion->idle && motion->period_ticks > 0);
    return motion_awaits && tasks_sleep(tasks) && !tasks->task[HOST_CONTROLLER].idle;
}

/* A task without a rest: as long as it may, and the round in which that time ended. */
uint32_t tasks_rounds_over(const struct tasks *tasks) {
    enum { ROUNDS_MAX = ESP32_WORK_MAX_US / ESP32_ROUND_US + 1 };
    return tasks->rests && tasks->rounds_max > ROUNDS_MAX ? tasks->rounds_max : 0;
}

bool tasks_sleep(const struct tasks *tasks) {
    return tasks->task[HOST_CONTROLLER].period_ticks > 0;
}

bool tasks_refill(struct tasks *tasks, uint64_t now_ticks) {
    enum host_side side = tasks->own_motion ? HOST_MOTION : HOST_CONTROLLER;
    return tasks->wakes_on_step && tasks_stalled_until(tasks, side, now_ticks) == now_ticks;
}

void tasks_stepped(struct tasks *tasks, uint64_t now_ticks) {
    tasks_wake(tasks, now_ticks);
    if (tasks->wakes_on_step)
        tasks->task[HOST_CONTROLLER].due_ticks = now_ticks;
}

uint64_t tasks_next_ticks(struct tasks *tasks, bool moves, uint64_t now_ticks) {
    uint64_t next = UINT64_MAX;
    for (unsigned side = HOST_CONTROLLER; side <= (unsigned)HOST_MOTION; side++) {
        const struct task *task = &tasks->task[side];
        bool looks = side == HOST_CONTROLLER || tasks->own_motion;
        if (!looks || (task->idle && !moves))
            continue;
        uint64_t stalled = tasks_stalled_until(tasks, (enum host_side)side, now_ticks);
        bool woken = task->period_ticks == 0 || (side == HOST_MOTION && tasks->motion_woken && !task->rests);
        uint64_t due = !woken && task->due_ticks > stalled ? task->due_ticks : stalled;
        if (due > now_ticks && due < next)
            next = due;
    }
    return next;
}
