/* SPDX-License-Identifier: MIT
 * A program without an operating system: our core, the ESP32's step engine, and a loop in place of both
 * tasks: the motion side every ms as in the firmware, the task side as often as the test wants. The test
 * writes the job and the period before it starts, and reads `done`. */
#include "app/board.h"
#include "bare.h"
#include "input/rx.h"
#include "machine/parts.h"
#include "task_periods.h"

#include <string.h>

enum { JOB_MAX = 65536, ANSWERS_MAX = 16384 };

char job[JOB_MAX];
volatile uint32_t job_size, period_us, done;
char answers[ANSWERS_MAX];
volatile uint32_t answers_size, blocks;

static struct machine machine;
static struct hal hal;
static struct step_engine_board step_board; /* outlives the engine */
static uint32_t fed;

static void answer(void *ctx, const char *bytes, size_t count) {
    (void)ctx;
    for (size_t i = 0; i < count && answers_size < ANSWERS_MAX; i++)
        answers[answers_size++] = bytes[i];
}

static bool feed(void) {
    struct rx *rx = machine_rx(&machine);
    const uint32_t room = rx_free(rx), left = job_size - fed;
    const uint32_t count = left < room ? left : room;
    fed += (uint32_t)rx_put_all(rx, (const uint8_t *)job + fed, count);
    return count != 0;
}

/* Between two polls of the motion side already; the step interrupt is held off. */
static void call(const void *ctx, void (*work)(void *arg), void *arg) {
    uint32_t before;
    (void)ctx;
    __asm__ volatile("rsil %0, 5" : "=r"(before)::"memory");
    work(arg);
    __asm__ volatile("wsr %0, ps\n\trsync" ::"r"(before) : "memory");
}

static bool start(void) {
    static const struct hal_motion_side side = {.call = call};
    struct pin_map pins;
    const struct text_out out = {.write = answer};
    pin_map_init(&pins);
    struct machine_board board = board_machine(&pins);
    board.motion_side = &side;
    step_board = board_step_engine(&pins);
    if (!step_engine_init(&hal.step, &step_board))
        return false;
    bare_outputs(&step_board);
    machine_init(&machine, &board, &hal, &hal.step, &out);
    return step_engine_attach(machine_step(&machine));
}

static void poll_task_side(void) {
    for (bool more = true; more;) {
        more = feed();
        more = machine_poll(&machine) || more;
        (void)machine_poll_motion(&machine); /* the controller wakes it: motion_task_wake() */
    }
    blocks = machine.drive.motion.plan.moves_total;
    done = fed == job_size && !machine_has_line(&machine) && machine_is_at_rest(&machine);
}

int main(void) {
    if (!start())
        return 1;
    uint32_t next_us = hal_time_us(&hal), task_us = next_us;
    for (;; next_us += ESP32_MOTION_PERIOD_US) {
        (void)machine_poll_motion(&machine);
        if ((int32_t)(next_us - task_us) >= 0) {
            poll_task_side();
            task_us += period_us;
        }
        bare_wait_until(&hal, next_us + ESP32_MOTION_PERIOD_US);
    }
}
