/* SPDX-License-Identifier: MIT
 * A monitor that cannot find anything proves nothing: each fault made by hand is found, and a good run is
 * not. */
#include "host_inner.h"

#include "monitor.h"

#include <stdio.h>
#include <string.h>

enum { HZ = 2000000, ALL = 0x7f };

static const struct host_board board = {
    .timer_hz = HZ, .step_pulse_ns = 2000, .dir_setup_ns = 1000, .max_step_rate_hz = 40000, .axis_count = 3};
static unsigned failures;

static void pass(struct host *host, uint64_t ms) {
    (void)host_run_until(host, host_time_ticks(host) + ms * (HZ / 1000));
}

static void send(struct host *host, const char *text) {
    (void)host_write(host, text, strlen(text));
    pass(host, 10);
}

/* ---- faults ---- */

static void no_fault(struct host *host) {
    send(host, "G4P0.1\nM0\n");
    pass(host, 3000);
    send(host, "~");
}

static void counter_moves(struct host *host) {
    pass(host, 5000);
    struct step *step = &host->machine.drive.step;
    step->pool[step_index(step)].position[1]++;
}

static void answers_twice(struct host *host) {
    host->machine.out.write(host->machine.out.ctx, "ok\r\n", 4);
}

static bool has_no_room(void *ctx) {
    (void)ctx;
    return false;
}

static void never_answers(struct host *host) {
    pass(host, 5000);
    host->machine.out.has_room = has_no_room; /* so it reads no line */
    send(host, "G4P0\n");
    pass(host, 300000);
}

static void steps_in_alarm(struct host *host) {
    host->machine.life.state = MACHINE_ALARM;
}

static void brakes_too_hard(struct host *host) {
    for (unsigned ax = 0; ax < 3; ax++)
        host->machine.settings.acceleration_mm_s2[ax] = 1.0f;
    pass(host, 300);
    send(host, "!");
}

static void beam_at_rest(struct host *host) {
    pass(host, 5000);
    host->machine.settings.laser_mode = true;
    host->hal.outputs_set.spindle_duty = 100; /* what the controller commands, not what the pins show */
}

static void beam_in_a_rapid(struct host *host) {
    pass(host, 5000);
    send(host, "$32=1\nG0X0Y0\n");
    pass(host, 100);
    host->hal.outputs_set.spindle_duty = 100;
}

/* As if a ~ from before it were kept. */
static void stop_starts(struct host *host) {
    send(host, "!~!");
    pass(host, 3000);
    host->machine.life.state = MACHINE_RUN;
}

static void reset_ends_a_hold(struct host *host) {
    send(host, "!");
    pass(host, 3000);
    send(host, "\x18");
}

static void expect(void (*fault)(struct host *host), const char *words) {
    struct host *host = host_create(&board);
    struct monitor *monitor = host != NULL ? monitor_create(host, ALL) : NULL;
    if (monitor == NULL) {
        failures++;
        return;
    }
    host_input_follows(host, 0);
    send(host, "$100=400\n$101=400\n$110=3000\n$111=3000\n$120=200\n$121=200\n");
    send(host, "G1X20Y10F1500\n");
    pass(host, 300);
    fault(host);
    pass(host, 500);
    const char *found = monitor_found(monitor);
    if (found == NULL && words == NULL)
        found = monitor_end(monitor);
    if ((found == NULL) != (words == NULL) || (words != NULL && strstr(found, words) == NULL)) {
        printf("wanted: %s; found: %s\n", words != NULL ? words : "nothing",
               found != NULL ? found : "nothing");
        failures++;
    }
    monitor_destroy(monitor);
    host_destroy(host);
}

int main(void) {
    expect(no_fault, NULL);
    expect(counter_moves, "counts");
    expect(answers_twice, "an answer without a line");
    expect(never_answers, "nothing has happened");
    expect(steps_in_alarm, "a step where nothing may move");
    expect(brakes_too_hard, "changes its speed");
    expect(beam_at_rest, "the beam is on");
    expect(beam_in_a_rapid, "nothing is cut");
    expect(stop_starts, "no resume came behind the last stop");
    expect(reset_ends_a_hold, NULL);
    printf("%u failures\n", failures);
    return failures == 0 ? 0 : 1;
}
