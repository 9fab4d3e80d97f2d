/* SPDX-License-Identifier: MIT
 * The machine on two cores: one thread is the task side, another the motion side with the step ISR. Whatever
 * meets there, a line waits for the motion before it, and the counters stay where the program leads. */
#include "host_inner.h"

#include <pthread.h>
#include <sched.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { ROUNDS = 60, EVENTS_A_POLL = 50, POLLS_MAX = 50000000 };

static struct host *host;
static unsigned failures;

/* ---- the motion side ---- */

static struct {
    void (*work)(void *arg); /* NULL: nothing is asked for */
    void *arg;
    bool ends;
} asked;

static void call(const void *ctx, void (*work)(void *arg), void *arg) {
    (void)ctx;
    asked.arg = arg;
    __atomic_store_n(&asked.work, work, __ATOMIC_RELEASE);
    while (__atomic_load_n(&asked.work, __ATOMIC_ACQUIRE) != NULL)
        sched_yield();
}

static void do_what_is_asked(void) {
    void (*work)(void *arg) = __atomic_load_n(&asked.work, __ATOMIC_ACQUIRE);
    if (work == NULL)
        return;
    work(asked.arg);
    __atomic_store_n(&asked.work, NULL, __ATOMIC_RELEASE);
}

static void *motion_side(void *unused) {
    struct hal_step *hal = &host->hal.step;
    (void)unused;
    while (!__atomic_load_n(&asked.ends, __ATOMIC_ACQUIRE)) {
        bool any = machine_poll_motion(&host->machine);
        do_what_is_asked();
        for (int event = 0; event < EVENTS_A_POLL && host->machine.drive.step.active; event++) {
            hal->now_ticks = hal->alarm_ticks;
            hal->write = host->trace.events;
            step_isr(&host->machine.drive.step);
        }
        if (!any && !host->machine.drive.step.active) {
            hal->now_ticks += 2000; /* time advances at rest, too: dwells and delays end */
            sched_yield();
        }
    }
    return NULL;
}

/* ---- the task side ---- */

/* @return how many of these answers came until then */
static unsigned run_until_answered(unsigned lines) {
    char said[1024];
    unsigned answers = 0;
    for (unsigned long polls = 0; answers < lines; polls++) {
        if (polls == POLLS_MAX) {
            printf("no answer in state %d, stage %d\n", host->machine.life.state, host->machine.task.stage);
            failures++;
            return answers;
        }
        if (!machine_poll(&host->machine))
            sched_yield();
        size_t count = host_read(host, said, sizeof said - 1);
        said[count] = '\0';
        for (const char *at = said; (at = strstr(at, "ok\r\n")) != NULL; at++)
            answers++;
        if (strstr(said, "error:") != NULL || strstr(said, "ALARM") != NULL) {
            printf("%s\n", said);
            failures++;
            return answers;
        }
    }
    return answers;
}

static void say(const char *line) {
    (void)host_write(host, line, strlen(line));
}

static void expect_steps(int32_t x, int32_t y, const char *where, unsigned round) {
    int32_t steps[AXIS_COUNT];
    machine_position(&host->machine, steps);
    if (host->machine.drive.step.active || steps[0] != x || steps[1] != y) {
        if (++failures <= 10)
            printf("round %u, %s: %ld %ld, not %ld %ld\n", round, where, (long)steps[0], (long)steps[1],
                   (long)x, (long)y);
    }
}

/* Moves, then M3 or a dwell: answered when the motion before it has ended, not earlier. */
static void a_line_waits_for_the_motion(unsigned round) {
    char line[80];
    int x = rand() % 41, y = rand() % 41 - 20;
    snprintf(line, sizeof line, "G1 X%d.5 Y%d F20000\nM3 S%d\n", x, y, 10 + rand() % 900);
    say(line);
    (void)run_until_answered(2);
    expect_steps(x * 250 + 125, y * 250, "after M3", round);
    say("G0 X0 Y0\nG4 P0.001\n");
    (void)run_until_answered(2);
    expect_steps(0, 0, "after G4", round);
}

/* A feed hold anywhere, then on: nothing is lost. */
static void a_hold_loses_nothing(unsigned round) {
    char line[80];
    int x = rand() % 100 - 50;
    snprintf(line, sizeof line, "G1 X%d F20000\n", x);
    say(line);
    for (int polls = rand() % 400; polls > 0; polls--)
        machine_poll(&host->machine);
    say("!");
    for (int polls = 0; polls < 200; polls++)
        machine_poll(&host->machine);
    say("~G4 P0\n");
    (void)run_until_answered(2);
    expect_steps(x * 250, 0, "after a hold", round);
    say("G0 X0\nG4 P0\n");
    (void)run_until_answered(2);
}

int main(void) {
    static const struct host_board board = {.timer_hz = 20000000,
                                            .step_pulse_ns = 2000,
                                            .dir_setup_ns = 2000,
                                            .max_step_rate_hz = 250000,
                                            .axis_count = 6};
    static const struct hal_motion_side side = {.call = call};
    pthread_t thread;
    host = host_create(&board);
    if (host == NULL)
        return 2;
    host->machine.board.motion_side = &side;
    if (pthread_create(&thread, NULL, motion_side, NULL) != 0)
        return 2;
    say("$110=20000\n$111=20000\n$120=2000\n$121=2000\nG21\n");
    (void)run_until_answered(5);
    for (unsigned round = 0; round < ROUNDS && failures == 0; round++) {
        a_line_waits_for_the_motion(round);
        a_hold_loses_nothing(round);
    }
    __atomic_store_n(&asked.ends, true, __ATOMIC_RELEASE);
    pthread_join(thread, NULL);
    printf("%u failures\n", failures);
    return failures == 0 ? 0 : 1;
}
