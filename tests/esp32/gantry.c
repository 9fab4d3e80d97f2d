/* SPDX-License-Identifier: MIT
 * A gantry with two motors at the registers of an ESP32: the whole machine with the chip's step engine,
 * inputs and interrupts, from lines of text to pins, and motors and switches at these pins. Compiled for each
 * chip and engine.
 *
 * Emulated are the cycle counter, both timers, GPIO with its matrix and edge interrupts, RMT channels that
 * play a pulse, and the I2S peripheral or the SPI with its shift registers (shift_model.h). The matrix is
 * what it is on the chip: each pin shows the signal that is routed to it, inverted or not. */
#include "gantry_chip.h"

/* ---- tests ---- */

enum { HIGH_STEPS = 1007, PULL_OFF = 500 };

static void crooked(int32_t at, int32_t skew) {
    motors[FIRST_Y].closes_at = motors[SECOND_Y].closes_at = HIGH_STEPS;
    place(FIRST_Y, at);
    place(SECOND_Y, at + skew);
    take_edges();
    run_us(20000);
}

static void check_stands(int32_t first, int32_t second, int line) {
    if (motors[FIRST_Y].at == first && motors[SECOND_Y].at == second)
        return;
    printf("line %d: %d %d, not %d %d: %s\n", line, motors[FIRST_Y].at, motors[SECOND_Y].at, first, second,
           said);
    failures++;
}
#define STANDS(first, second) check_stands(first, second, __LINE__)

static void home_square(int32_t skew) {
    set_up();
    crooked(-3000, skew);
    CHECK(strcmp(send("$HY\n"), "ok\r\n") == 0);
    STANDS(HIGH_STEPS - PULL_OFF, HIGH_STEPS - PULL_OFF);
}

static void both_motors_end_a_pull_off_before_their_switches(void) {
    static const int32_t skews[] = {0, 1, -1, 37, -250, 1000, -1200};
    for (size_t i = 0; i < sizeof skews / sizeof skews[0]; i++) {
        home_square(skews[i]);
        CHECK(strcmp(send("G91G0Y-3\n"), "ok\r\n") == 0);
        STANDS(HIGH_STEPS - PULL_OFF - 750, HIGH_STEPS - PULL_OFF - 750);
    }
}

static void a_second_motor_that_is_mounted_the_other_way_round(void) {
    set_up();
    motors[SECOND_Y].is_reversed = true;
    CHECK(strcmp(send("$8=2\n"), "ok\r\n") == 0);
    crooked(-3000, 300);
    CHECK(strcmp(send("$HY\n"), "ok\r\n") == 0);
    STANDS(HIGH_STEPS - PULL_OFF, HIGH_STEPS - PULL_OFF);
    /* $2 and $3 turn both, also after a hold. */
    motors[FIRST_Y].is_reversed = !motors[FIRST_Y].is_reversed;
    motors[SECOND_Y].is_reversed = !motors[SECOND_Y].is_reversed;
    CHECK(strcmp(send("$3=2\n"), "ok\r\n") == 0);
    CHECK(strcmp(send("G91G0Y-1\n"), "ok\r\n") == 0);
    STANDS(HIGH_STEPS - PULL_OFF - 250, HIGH_STEPS - PULL_OFF - 250);
}

/* The same as `active = "low"` in the board file, for the pins of the second motor. */
static void lines_that_the_board_calls_active_low(void) {
    calls_low = true;
    home_square(300);
    CHECK(strcmp(send("$2=2\n"), "ok\r\n") == 0);
    motors[FIRST_Y].is_low = true;
    motors[SECOND_Y].is_low = motors[FIRST_Y].high = motors[SECOND_Y].high = false;
    crooked(HIGH_STEPS - PULL_OFF, 0); /* the edge that $2 has made is not a step */
    CHECK(strcmp(send("G91G0Y-1\n"), "ok\r\n") == 0);
    STANDS(HIGH_STEPS - PULL_OFF - 250, HIGH_STEPS - PULL_OFF - 250);
    calls_low = false;
}

static void each_motor_has_its_own_pull_off(void) {
    set_up();
    CHECK(strcmp(send("$201=3\n"), "ok\r\n") == 0);
    crooked(-2000, -90);
    CHECK(strcmp(send("$HY\n"), "ok\r\n") == 0);
    STANDS(HIGH_STEPS - PULL_OFF, HIGH_STEPS - 750);
}

/* Only the first one's counts, and the difference of the pull-offs is made once. */
static void both_motors_stop_at_one_switch(void) {
    set_up();
    CHECK(strcmp(send("$206=2\n"), "ok\r\n") == 0);
    CHECK(strcmp(send("$201=3\n"), "ok\r\n") == 0);
    for (int homing = 0; homing < 2; homing++) {
        if (homing == 0)
            crooked(-2000, 90);
        CHECK(strcmp(send("$HY\n"), "ok\r\n") == 0);
        STANDS(HIGH_STEPS - PULL_OFF, HIGH_STEPS - 750 + 90);
    }
    CHECK(strcmp(send("G91G0Y-1\n"), "ok\r\n") == 0);
    STANDS(HIGH_STEPS - PULL_OFF - 250, HIGH_STEPS - 1000 + 90);
}

static void more_than_squaring_allows_is_alarm_10(void) {
    for (int32_t skew = -1800; skew <= 1800; skew += 3600) {
        set_up();
        crooked(-4000, skew);
        CHECK(strstr(send("$HY\n"), "ALARM:10\r\n") != NULL);
        int32_t alone = abs(motors[FIRST_Y].at - motors[SECOND_Y].at);
        CHECK(alone >= 1800 - 5 * 250 - 1 && alone <= 1800 - 5 * 250 + 1); /* 5 % of the travel, no further */
        const int32_t first = motors[FIRST_Y].at, second = motors[SECOND_Y].at;
        CHECK(strstr(send("$X\n"), "ok\r\n") != NULL);
        CHECK(strstr(send("G91G0Y-1\n"), "ok\r\n") != NULL);
        STANDS(first - 250, second - 250); /* no one waits any more */
    }
}

static void a_reset_or_an_estop_at_any_moment_leaves_both_motors_stepping(void) {
    for (uint32_t ms = 100; ms < 3600; ms += 250) {
        const bool estop = ms / 250 % 2 == 0;
        set_up();
        crooked(-2500, -700);
        type("$HY\n");
        run_us(ms * 1000 + ms);
        if (estop)
            drive(map.wire[SIGNAL_ESTOP].gpio, true);
        else
            type("\x18");
        take_edges();
        run_us(100000);
        drive(map.wire[SIGNAL_ESTOP].gpio, false);
        run_us(100000);
        type("\x18");
        run_us(2000000); /* the banner */
        CHECK(strstr(send("$X\n"), "ok\r\n") != NULL);
        const int32_t first = motors[FIRST_Y].at, second = motors[SECOND_Y].at;
        CHECK(strstr(send("G91G0Y-1\n"), "ok\r\n") != NULL);
        STANDS(first - 250, second - 250);
        CHECK(strstr(send("$HY\n"), "ok\r\n") != NULL);
        STANDS(HIGH_STEPS - PULL_OFF, HIGH_STEPS - PULL_OFF);
    }
}

/* One event of Y; the other core holds motors as soon as its pulse has begun. */
static void step_and_hold(axis_mask_t first, axis_mask_t second) {
    hal_step_set(&hal.step, 1u << AXIS_Y);
    pass(ACCESS_CYCLES);
    hal.ganged.hold(&hal, first, second);
    hal_step_clear(&hal.step);
    pass(1000 * CYCLES_PER_US);
    CHECK(!motors[FIRST_Y].high && !motors[SECOND_Y].high);
}

static void a_motor_that_begins_to_wait_makes_its_last_pulse(void) {
    set_up();
    crooked(-1000, 0);
    step_and_hold(1u << AXIS_Y, 0);
    STANDS(-999, -999);
    step_and_hold(0, 1u << AXIS_Y);
    STANDS(-999, -998);
    step_and_hold(0, 0);
    STANDS(-998, -998);
}

static void the_second_switch_is_a_hard_limit(void) {
    set_up();
    CHECK(strcmp(send("$21=1\n"), "ok\r\n") == 0);
    crooked(0, 200);
    CHECK(strstr(send("G91G1Y20F3000\n"), "ALARM:1\r\n") != NULL);
    STANDS(HIGH_STEPS - 200, HIGH_STEPS);
}

/* ---- e-stop ---- */

enum { CUT_CYCLES = 10 * CYCLES_PER_US }; /* through registers: the words that wait, and one more */

static bool shows_off(enum switch_output output) {
    const struct output_wire *wire = &hal.outputs.wire[output];
    return wire->pin == NO_PIN || is_high(wire->pin, out) != wire->active_high;
}

static bool has(enum switch_output output) {
    return hal.outputs.wire[output].pin != NO_PIN;
}

static bool drivers_are(bool on) {
    bool all = true;
    for (unsigned n = SWITCH_ENABLE; n <= SWITCH_ENABLE_LAST; n++)
        all &= !has((enum switch_output)n) || shows_off((enum switch_output)n) != on;
    return all;
}

static bool all_is_cut(void) {
    return drivers_are(false) && shows_off(SWITCH_SPINDLE_ENABLE) && pwm.operators[0].timestamp[0].val == 0;
}

/* A spindle that turns, Y that moves, and motors that would stay on ($1=255). */
static void work(void) {
    set_up();
    crooked(-2000, 0);
    CHECK(strstr(send("$1=255\n"), "ok\r\n") != NULL && strstr(send("M3S500\n"), "ok\r\n") != NULL);
    type("G91G1Y8F3000\n");
    run_us(300000);
    CHECK(drivers_are(true) && (!has(SWITCH_SPINDLE_ENABLE) || !shows_off(SWITCH_SPINDLE_ENABLE)));
    CHECK(!has(SWITCH_SPINDLE_PWM) || pwm.operators[0].timestamp[0].val != 0);
}

static void an_estop_cuts_drivers_and_spindle_before_any_task(void) {
    work();
    const uint64_t edge = now;
    drive(map.wire[SIGNAL_ESTOP].gpio, true);
    take_edges();
    CHECK(BOARD_STEP_ENGINE == BOARD_STEP_ENGINE_I2S || all_is_cut());
    while (!all_is_cut() && now < edge + CUT_CYCLES)
        pass(ACCESS_CYCLES);
    CHECK(all_is_cut());
    for (unsigned ms = 0; ms < 200; ms++) { /* and they stay off until a reset behind its release */
        run_us(1000);
        CHECK(all_is_cut());
    }
    CHECK(strstr(said, "ALARM:50\r\n") != NULL);
    type("\x18");
    run_us(200000);
    CHECK(all_is_cut());
    drive(map.wire[SIGNAL_ESTOP].gpio, false);
    run_us(100000);
    CHECK(all_is_cut());
    type("\x18");
    run_us(1000000);
    CHECK(drivers_are(true) && shows_off(SWITCH_SPINDLE_ENABLE));
}

/* A hard limit keeps the position: the motors hold. */
static void a_limit_cuts_no_driver(void) {
    work();
    CHECK(strstr(send("$21=1\n"), "ok\r\n") != NULL);
    drive(motors[FIRST_Y].limit, false);
    take_edges();
    pass(CUT_CYCLES);
    CHECK(drivers_are(true));
    run_us(100000);
    CHECK(strstr(said, "ALARM:1\r\n") != NULL && drivers_are(true));
}

/* The interrupt's word finds no room: the motion task's next round repeats it. */
static void a_full_fifo_loses_no_cut(void) {
    work();
    for (unsigned n = 0; BOARD_STEP_ENGINE == BOARD_STEP_ENGINE_I2S && n < 2 * I2S_FIFO_WORDS; n++)
        shift_model_i2s()->fifo_wr = hal.step.shifted | hal.step.shift_lines;
    drive(map.wire[SIGNAL_ESTOP].gpio, true);
    take_edges();
    run_us(2000);
    CHECK(all_is_cut());
}

int main(void) {
    for (unsigned pin = 0; pin < PINS; pin++) {
        matrix[pin].is_gpio = pin < FIRST_JTAG || pin > FIRST_JTAG + 3;
        matrix[pin].signal = SIG_GPIO_OUT_IDX;
    }
    both_motors_end_a_pull_off_before_their_switches();
    a_second_motor_that_is_mounted_the_other_way_round();
    lines_that_the_board_calls_active_low();
    each_motor_has_its_own_pull_off();
    both_motors_stop_at_one_switch();
    more_than_squaring_allows_is_alarm_10();
    a_reset_or_an_estop_at_any_moment_leaves_both_motors_stepping();
    a_motor_that_begins_to_wait_makes_its_last_pulse();
    the_second_switch_is_a_hard_limit();
    an_estop_cuts_drivers_and_spindle_before_any_task();
    a_limit_cuts_no_driver();
    a_full_fifo_loses_no_cut();
    return report();
}
