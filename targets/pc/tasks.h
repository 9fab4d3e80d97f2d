/* SPDX-License-Identifier: MIT
 * The tasks of a firmware in virtual time: when each of them looks, and when it is kept from that.
 *
 * A task that is due works until nothing is left to do, in no time, and then sleeps for its period. Boards
 * name the periods (targets/chip/task_periods.h); without them (HOST_TASKS_FREE) everything looks all the
 * time. The ESP32's tasks also sleep when they have worked for long (targets/chip/task_rest.h): each look is
 * counted as ESP32_ROUND_US of it. A stall keeps one side from looking while step interrupts, edges of inputs
 * and time continue. */
#ifndef WIFICNC_PC_TASKS_H
#define WIFICNC_PC_TASKS_H

#include "host.h"

enum { TASKS_STALLS_MAX = 1024 };

struct task {
    uint64_t period_ticks, late_ticks; /* period 0: it looks all the time */
    uint64_t due_ticks;                /* when it looks next */
    bool idle;                         /* it has looked and nothing has happened since */
    uint64_t looked_ticks;             /* its newest look with work */
    uint32_t rounds;                   /* such looks at that instant: between two of them it slept */
    bool rests;                        /* until due_ticks, whatever wakes it */
};

struct task_stall {
    uint64_t from_ticks, until_ticks;
    uint8_t side; /* enum host_side */
};

struct tasks {
    uint32_t timer_hz;
    bool own_motion;    /* the motion side is a task of its own */
    bool one_loop;      /* all sides stall together */
    bool wakes_motion;  /* work of the controller wakes the motion task */
    bool wakes_on_step; /* step interrupts wake the loop */
    bool rests;         /* a task that works for long sleeps */
    uint32_t rounds_max;
    bool motion_woken;
    struct task task[HOST_SIDES];
    struct task_stall stall[TASKS_STALLS_MAX];
    uint32_t stall_count;
    struct host_random_stalls random_stalls; /* sides 0: none */
    struct task_stall random_stall;          /* the present one, or the next */
    uint64_t random;                         /* state of the generator */
};

/** @param of  enum host_tasks_of */
void tasks_init(struct tasks *tasks, uint8_t of, uint32_t timer_hz);

/** The controller has a period of its own from now on. */
void tasks_look_each(struct tasks *tasks, uint32_t period_us);

/** Keep a side from looking. @return false: TASKS_STALLS_MAX are waiting */
bool tasks_stall(struct tasks *tasks, const struct task_stall *stall, uint64_t now_ticks);
void tasks_stall_randomly(struct tasks *tasks, const struct host_random_stalls *stalls, uint64_t now_ticks);

/** @return when this side may look again; now_ticks: it may now */
uint64_t tasks_stalled_until(struct tasks *tasks, enum host_side side, uint64_t now_ticks);

/** @return when the last stall that is known now ends, or 0 */
uint64_t tasks_stalls_end(const struct tasks *tasks);

/** This side looks now. */
bool tasks_is_due(struct tasks *tasks, enum host_side side, uint64_t now_ticks);

/** It has looked. @param done  something was done: others may find work */
void tasks_looked(struct tasks *tasks, enum host_side side, bool done, uint64_t now_ticks);

/** Something has happened: a task that found nothing to do looks again at its next tick. */
void tasks_wake(struct tasks *tasks, uint64_t now_ticks);

/** Each side that looks has a tick at which it does: nothing that happens makes it look sooner. */
bool tasks_await_ticks(const struct tasks *tasks);

/** The most looks with work, since the begin, that a task has not slept between, where they are more than the
 * ESP32's tasks may make (ESP32_WORK_MAX_US). @return 0: they are not, or its periods are not used */
uint32_t tasks_rounds_over(const struct tasks *tasks);

/** Tasks sleep between two looks; else everything is looked at all the time. */
bool tasks_sleep(const struct tasks *tasks);

/** What feeds the step interrupt may look whenever step events were made. */
bool tasks_refill(struct tasks *tasks, uint64_t now_ticks);

/** Step events were made. */
void tasks_stepped(struct tasks *tasks, uint64_t now_ticks);

/** When a side looks next, or UINT64_MAX: it has nothing to look for, or looks all the time.
 * @param moves  the step timer runs: no one is idle */
uint64_t tasks_next_ticks(struct tasks *tasks, bool moves, uint64_t now_ticks);

#endif
