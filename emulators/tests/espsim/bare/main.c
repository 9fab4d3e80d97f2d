/* SPDX-License-Identifier: MIT
 * A program without an operating system: our core, the ESP32's step engine, and loops in place of both tasks:
 * the motion side every ms as in the firmware, the task side as often as the test wants. They take turns on
 * one core, or each has a core of its own, as in the firmware; then core 0 may write flash, too. The test
 * writes the job and the periods before it starts, and reads `done`. */
#include "app/board.h"
#include "bare.h"
#include "hal/step_shift.h"
#include "input/rx.h"
#include "machine/parts.h"
#include "task_periods.h"

#include <string.h>

enum { JOB_MAX = 65536, ANSWERS_MAX = 16384 };

char job[JOB_MAX];
volatile uint32_t job_size, period_us, done, two_cores, flash_period_us, flash_erases, flash_writes;
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

/* ---- the motion side on core 1: as app/motion_task.c ---- */

enum { NAP_US = 20 }; /* how soon it sees what the other core wants */

static struct {
    void (*work)(void *arg);
    void *arg;
} asked;
static volatile uint32_t is_ready, wakes;

static void call_core1(const void *ctx, void (*work)(void *arg), void *arg) {
    (void)ctx;
    asked.arg = arg;
    __atomic_store_n(&asked.work, work, __ATOMIC_RELEASE);
    while (__atomic_load_n(&asked.work, __ATOMIC_ACQUIRE) != NULL) {
    }
}

static void do_what_is_asked(void) {
    void (*work)(void *arg) = __atomic_load_n(&asked.work, __ATOMIC_ACQUIRE);
    if (work == NULL)
        return;
    call(NULL, work, asked.arg);
    __atomic_store_n(&asked.work, NULL, __ATOMIC_RELEASE);
}

static void nap_until(uint32_t us) {
    while ((int32_t)(us - hal_time_us(&hal)) > 0 && wakes == 0 && asked.work == NULL) {
        bare_stall();
        bare_wait_until(&hal, hal_time_us(&hal) + NAP_US);
    }
    wakes = 0;
}

static void run_motion(void) {
    is_ready = step_engine_attach(machine_step(&machine));
    for (uint32_t next_us = hal_time_us(&hal);; next_us += ESP32_MOTION_PERIOD_US) {
        do_what_is_asked();
        bare_stall();
        const bool more = machine_poll_motion(&machine);
        step_engine_show(machine_step(&machine));
        if (!more)
            nap_until(next_us);
    }
}

static bool start_core1(void) {
    bare_start_core1(run_motion);
    while (!is_ready) {
    }
    return true;
}

static bool start(void) {
    static const struct hal_motion_side side = {.call = call}, side1 = {.call = call_core1};
    struct pin_map pins;
    const struct text_out out = {.write = answer};
    pin_map_init(&pins);
    struct machine_board board = board_machine(&pins);
    board.motion_side = two_cores != 0 ? &side1 : &side;
    hal.two_cores = two_cores != 0;
    step_board = board_step_engine(&pins);
    if (BOARD_STEP_ENGINE == BOARD_STEP_ENGINE_I2S)
        step_shift_out(0);
    if (!step_engine_init(&hal.step, &step_board))
        return false;
    bare_outputs(&step_board);
    machine_init(&machine, &board, &hal, &hal.step, &out);
    return two_cores != 0 ? start_core1() : step_engine_attach(machine_step(&machine));
}

static void poll_task_side(void) {
    for (bool more = true; more;) {
        more = feed();
        more = machine_poll(&machine) || more;
        if (two_cores != 0)
            wakes = 1; /* motion_task_wake() */
        else
            (void)machine_poll_motion(&machine); /* as if it had woken it */
    }
    blocks = machine.drive.motion.plan.moves_total;
    done = fed == job_size && !machine_has_line(&machine) && machine_is_at_rest(&machine);
}

static void run_task(void) {
    uint32_t flash_us = hal_time_us(&hal) + flash_period_us;
    for (uint32_t next_us = hal_time_us(&hal);; next_us += period_us) {
        poll_task_side();
        if (flash_period_us != 0 && (int32_t)(hal_time_us(&hal) - flash_us) >= 0) {
            bare_write_flash(flash_erases != 0);
            flash_writes++;
            flash_us = hal_time_us(&hal) + flash_period_us;
        }
        bare_wait_until(&hal, next_us + period_us);
    }
}

int main(void) {
    if (!start())
        return 1;
    if (two_cores != 0)
        run_task();
    uint32_t next_us = hal_time_us(&hal), task_us = next_us;
    for (;; next_us += ESP32_MOTION_PERIOD_US) {
        (void)machine_poll_motion(&machine);
        step_engine_show(machine_step(&machine));
        if ((int32_t)(next_us - task_us) >= 0) {
            poll_task_side();
            task_us += period_us;
        }
        bare_wait_until(&hal, next_us + ESP32_MOTION_PERIOD_US);
    }
}
