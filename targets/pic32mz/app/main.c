/* SPDX-License-Identifier: MIT
 * The firmware: a start in stages, and one loop that never waits. What can hurt is made safe before anything
 * else can go wrong; there is no one who could command the machine before it is up. */
#include "app/board.h"
#include "app/follow.h"
#include "app/lost_clock.h"
#include "chip/interrupts.h"
#include "chip/system.h"
#include "chip_ganged.h"
#include "hal/chip_hal.h"
#include "io/charge_pump.h"
#include "io/dial.h"
#include "link/bus2.h"
#include "link/uart3.h"
#include "machine/parts.h"
#include "machine/vfd_spindle.h"
#include "store/nvm.h"

#define US_PER_MS      1000u
#define LONGEST_ANSWER 2048u /* bytes: $$ and $I+ have about 500 */

static struct machine machine;
static struct hal hal;
static struct step_engine_board step_pins;
static struct follow follow;
static struct machine_vfd vfd; /* with a bus */
static struct flash_work store_work;
static struct flash_store store = {.ops = &nvm_flash_ops, .work = &store_work};

static void say(void *ctx, const char *bytes, size_t count) {
    (void)ctx;
    uart_write(bytes, count);
}

static bool has_room(void *ctx) {
    (void)ctx;
    return uart_room() >= LONGEST_ANSWER;
}

static const struct text_out out = {.write = say, .has_room = has_room};

/* The motion side is this same loop: what is asked of it is done immediately. */
static void call(const void *ctx, void (*work)(void *arg), void *arg) {
    (void)ctx;
    uint32_t held = interrupts_hold();
    work(arg);
    interrupts_restore(held);
}

static const struct hal_motion_side motion_side = {.call = call};

static void start_hal(void) {
    struct input_wire inputs[INPUT_COUNT];
    struct output_wire outputs[SWITCH_COUNT];
    board_inputs(inputs);
    board_outputs(outputs);
    step_pins = board_step_engine();
    inputs_init(&hal.inputs, inputs, &step_pins.gang);
    outputs_init(&hal.outputs, outputs);
    if (!step_engine_init(&hal.step, &step_pins))
        system_reset(); /* the board file's check says so before: no such pin */
}

static void start_machine(const struct hal_restart *restart) {
    struct machine_board board = board_machine();
    board.restart = restart;
    nvm_wait();
    board.start_id = system_start_id();
    board.store = &flash_hal_store;
    board.store_ctx = &store;
    board.motion_side = &motion_side;
    board.pump = charge_pump_hal();
    board.bus = bus_init();
    board.vfd = board.bus != NULL ? &vfd : NULL;
    board.dial = BOARD_HAS_DIAL ? dial_init() : NULL;
    board.dial_state = BOARD_HAS_DIAL ? dial_state() : NULL;
    board.ganged = chip_ganged(&hal, &step_pins.gang);
    machine_init(&machine, &board, &hal, &hal.step, &out);
    follow_init(&follow, &machine, &hal);
    /* After machine_init(), which sets up what these interrupts use. */
    uart_init(machine_rx(&machine));
    step_engine_attach(machine_step(&machine));
    inputs_attach(&hal.inputs, &machine);
    if (BOARD_HAS_DIAL)
        dial_attach();
}

/* What has to be done every ms. */
static void poll_slow(void) {
    static uint32_t polled_us;
    uint32_t now_us = system_time_us();
    if (now_us - polled_us < US_PER_MS)
        return;
    polled_us = now_us;
    inputs_sample(&hal.inputs);
    charge_pump_beat();
    system_watchdog_clear();
}

int main(void) {
    outputs_make_safe();
    if (!system_has_clock())
        lost_clock();
    system_init();
    const struct hal_restart *restart = system_take_restart();
    start_hal();
    start_machine(restart);
    interrupts_init();
    system_start_tick();
    system_watchdog_start();
    for (;;) {
        poll_slow();
        bool any = machine_poll(&machine);
        follow_poll(&follow);
        any |= machine_poll_motion(&machine);
        any |= flash_store_poll(&store);
        system_note_motion(!machine_is_at_rest(&machine));
        if (!any)
            system_wait();
    }
}
