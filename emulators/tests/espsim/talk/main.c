/* SPDX-License-Identifier: MIT
 * A firmware without an operating system for `--on-chip`: our core and step engine as in bare/main.c, lines
 * and answers by UART 0. It has no store, and no inputs. */
#include "app/board.h"
#include "bare.h"
#include "hal/step_shift.h"
#include "input/rx.h"
#include "machine/parts.h"
#include "task_periods.h"

#include "sdkconfig.h"

/* UART 0: technical reference manuals, UART Registers. */
#if CONFIG_IDF_TARGET_ESP32
#define UART(offset) (*(volatile uint32_t *)(0x3FF40000 + (offset)))
#else
#define UART(offset) (*(volatile uint32_t *)(0x60000000 + (offset)))
#endif
#define UART_FIFO   UART(0x00)
#define UART_CLKDIV UART(0x14)
#define UART_STATUS UART(0x1C)

enum { APB_HZ = 80000000, BAUD = 115200, FIFO_SIZE = 127, COUNT = 0xFF, TX_COUNT = 16, TASK_PERIOD_MS = 2 };

static struct machine machine;
static struct hal hal;
static struct step_engine_board step_board; /* outlives the engine */

/* Waits for room. */
static void answer(void *ctx, const char *bytes, size_t count) {
    (void)ctx;
    for (size_t i = 0; i < count; i++) {
        while ((UART_STATUS >> TX_COUNT & COUNT) >= FIFO_SIZE)
            (void)machine_poll_motion(&machine);
        UART_FIFO = (uint8_t)bytes[i];
    }
}

static void feed(void) {
    while ((UART_STATUS & COUNT) != 0 && rx_free(machine_rx(&machine)) != 0) {
        const uint8_t byte = (uint8_t)UART_FIFO;
        (void)rx_put_all(machine_rx(&machine), &byte, 1);
    }
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
    UART_CLKDIV = APB_HZ / BAUD | (APB_HZ % BAUD * 16 / BAUD) << 20;
    pin_map_init(&pins);
    struct machine_board board = board_machine(&pins);
    board.motion_side = &side;
    step_board = board_step_engine(&pins);
    if (BOARD_STEP_ENGINE == BOARD_STEP_ENGINE_I2S)
        step_shift_out(0);
    if (!step_engine_init(&hal.step, &step_board))
        return false;
    bare_outputs(&step_board);
    machine_init(&machine, &board, &hal, &hal.step, &out);
    step_engine_set_pulse(&hal.step, machine_step_pulse_ns(&machine));
    return step_engine_attach(machine_step(&machine));
}

int main(void) {
    if (!start())
        return 1;
    uint32_t next_us = hal_time_us(&hal);
    for (unsigned turn = 0;; turn++, next_us += ESP32_MOTION_PERIOD_US) {
        (void)machine_poll_motion(&machine);
        step_engine_show(machine_step(&machine));
        feed();
        for (bool more = turn % TASK_PERIOD_MS == 0; more;) {
            more = machine_poll(&machine);
            (void)machine_poll_motion(&machine); /* the controller wakes it: motion_task_wake() */
        }
        bare_wait_until(&hal, next_us + ESP32_MOTION_PERIOD_US);
    }
}
