/* SPDX-License-Identifier: MIT
 * A target that has no hardware yet: a place to start from. Copy the folder, then replace the body of each
 * function with what the chip does; core/hal/hal.h says what that must be. */
#include "hal/hal.h"
#include "hal/hal_step.h"
#include "machine/machine.h"
#include "machine/parts.h"

#include <string.h> // memset

/** Outputs, inputs and clock of this chip. */
struct hal {
    struct hal_step step;
    uint32_t now_us;
};

uint32_t hal_time_us(const struct hal *hal) {
    return hal->now_us;
}

struct duty_register hal_spindle_pwm(struct hal *hal, uint32_t hz) {
    (void)hal;
    (void)hz;
    return (struct duty_register){0, 0, 0}; /* no PWM yet */
}

void hal_spindle_set(struct hal *hal, const struct hal_spindle *spindle) {
    (void)hal;
    (void)spindle;
}

void hal_coolant_set(struct hal *hal, uint8_t bits) {
    (void)hal;
    (void)bits;
}

void hal_digital_set(struct hal *hal, uint8_t bits) {
    (void)hal;
    (void)bits;
}

void hal_motors_set(struct hal *hal, bool on, bool invert) {
    (void)hal;
    (void)on;
    (void)invert;
}

void hal_estop(struct hal *hal, bool invert, uint16_t dark) {
    (void)hal;
    (void)invert;
    (void)dark;
}

/* Levels: with $5=0 a limit line that is low is a switch that is hit. */
void hal_inputs_read(const struct hal *hal, struct hal_inputs *inputs) {
    (void)hal;
    memset(inputs, 0, sizeof *inputs);
    memset(&inputs->switches, 0xFF, sizeof inputs->switches);
    memset(&inputs->pins, 0xFF, sizeof inputs->pins);
    inputs->probe = inputs->toolsetter = true;
}

void hal_switch_timer_start(struct hal *hal, uint32_t us) {
    (void)hal;
    (void)us; /* after this time the interrupt calls machine_switch_timer_isr() */
}

void hal_probe_watch(struct hal *hal, enum hal_probe probe, bool high) {
    (void)hal;
    (void)probe;
    (void)high;
}

static void write_bytes(void *ctx, const char *bytes, size_t count) {
    (void)ctx;
    (void)bytes;
    (void)count; /* to the serial port */
}

static struct machine machine;
static struct hal hal;
static const struct text_out out = {.write = write_bytes};
static const struct machine_board board = {
    .timer_hz = 10000000,
    .step_pulse_ns = 2000,
    .dir_setup_ns = 2000,
    .max_step_rate_hz = 100000,
    .axis_count = 3,
};

/* Bytes of the serial port go into machine_rx() by rx_put(); the edges of limit and e-stop lines call
 * machine_edge_isr(). */
int main(void) {
    machine_init(&machine, &board, &hal, &hal.step, &out);
    for (;;)
        machine_poll(&machine);
}
