/* SPDX-License-Identifier: MIT
 * Step pulses of the ESP32's four engines, from segments through prep and the real step interrupt to
 * emulated registers: what leaves the step lines keeps the contract of core/hal/README.md, whichever engine
 * it is.
 *
 * Emulated are the cycle counter, the step timer, GPIO set and clear, RMT channels with their memory, and the
 * I2S peripheral or the SPI with shift registers (shift_model.h).
 * Compiled once for each engine.
 *
 * The model of time (docs/performance.md): an instruction takes 1.5 cycles, and every event has as many as
 * the longest path of one that ends a span (tests/budget/xtensa.json); a register's access takes 12 cycles
 * more, and up to 15 while the other core is on the bus, too. Level 5 is held off by a few instructions of
 * ESP-IDF now and then, and by a line of the cache that comes from flash, once in a round of the motion task.
 */
#include "check.h"
#include "hal/rmt_registers.h"
#include "hal/step_engine.h"
#include "hal/step_shift.h"
#include "hal/step_vector.h"
#include "machine/board.h"
#include "pulses_chip.h"
#include "segment/queue.h"
#include "step/prep.h"

#include "soc/gpio_sig_map.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* ---- a controller of segments ---- */

static struct hal_step hal;
static struct step step;
static struct prep prep;
static struct segment_queue queue;
static struct step_engine_board board;
static uint64_t timer_zero;

/* As tasks see it. */
static uint32_t output_bit(unsigned output) {
    return step_shift_bit((uint8_t)(BOARD_I2SO_FIRST + output));
}

static void start(void) {
    chip_reset();
    now += 1000000;
    board = (struct step_engine_board){.gang = gang_of(BOARD_AXIS_COUNT, 0),
                                       .timer_hz = BOARD_TIMER_HZ,
                                       .step_pulse_ns = BOARD_STEP_PULSE_NS,
                                       .dir_setup_ns = BOARD_DIR_SETUP_NS};
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++) {
        const unsigned step_pin = by_shift ? BOARD_I2SO_FIRST + STEP_OUTPUT(ax) : FIRST_STEP_GPIO + ax;
        const unsigned dir_pin = by_shift ? BOARD_I2SO_FIRST + DIR_OUTPUT(ax) : FIRST_DIR_GPIO + ax;
        board.step_gpio[ax] = ax < BOARD_AXIS_COUNT ? (uint8_t)step_pin : NO_PIN;
        board.dir_gpio[ax] = ax < BOARD_AXIS_COUNT ? (uint8_t)dir_pin : NO_PIN;
    }
    if (by_shift)
        step_shift_out(output_bit(SLOW_OUTPUT));
    const uint32_t step_ns = 2 * BOARD_STEP_PULSE_NS + BOARD_STEP_SPREAD_NS;
    const struct prep_timing timing = {.timer_hz = BOARD_TIMER_HZ,
                                       .min_interval_ticks = (step_ns + 49) / 50,
                                       .dir_setup_ticks = BOARD_DIR_SETUP_NS / 50};
    memset(&hal, 0, sizeof hal);
    CHECK(step_engine_init(&hal, &board));
    CHECK(channels == (by_rmt ? BOARD_AXIS_COUNT : 0));
    step_init(&step, &hal);
    step_set_beam(&step, STEP_BEAM_ALLOWED, 0); /* a laser costs most */
    CHECK(step_engine_attach(&step));
    memset(&queue, 0, sizeof queue);
    prep_init(&prep, &queue, &step, &timing);
}

static bool is_armed(void) {
    const uint32_t both = STEP_TIMER_RUN | STEP_TIMER_ALARM;
    if (timer.hw_timer[0].load.val != 0)
        timer_zero = now;
    timer.hw_timer[0].load.val = 0;
    return (timer.hw_timer[0].config.val & both) == both;
}

static uint64_t busy; /* cycles in interrupts */

/* The next interrupt. */
static void interrupt(void) {
    static uint64_t round;
    unsigned late = rand() % 10 == 0 ? (unsigned)rand() % HELD_OFF_CYCLES : 0;
    due = timer_zero + (uint64_t)timer.hw_timer[0].alarmlo.val * CYCLES_PER_TICK;
    timer.hw_timer[0].config.val &= ~STEP_TIMER_ALARM;
    now = due > now ? due : now;
    if (now - round > ROUND_CYCLES) {
        round = now;
        late += (unsigned)rand() % CACHE_LINE_CYCLES;
    }
    now += is_traced ? 0 : late;
    const uint64_t begin = now;
    pass(CYCLES_OF(ENTRY_INSTRUCTIONS));
    step_interrupt(step_vector_argument);
    pass(CYCLES_OF(EXIT_INSTRUCTIONS));
    busy += now - begin;
}

/* Until all is done, or so many interrupts. */
static void run(unsigned long interrupts) {
    while (prep_poll(&prep) || is_armed())
        for (int i = 0; i < 8 && is_armed(); i++) {
            if (interrupts-- == 0)
                return;
            interrupt();
        }
}

/* Axes end where a step is half done, so that they begin again. */
static struct segment make(const int16_t steps[AXIS_COUNT], uint32_t duration_ns, bool last) {
    struct segment segment = {.duration_ns = duration_ns, .flags = last ? SEGMENT_LAST : 0};
    for (unsigned ax = 0; ax < BOARD_AXIS_COUNT; ax++) {
        segment.steps[ax] = steps[ax];
        segment.phase[ax] = segment.phase_end[ax] = SEGMENT_PHASE_HALF;
    }
    return segment;
}

static void push(const int16_t steps[AXIS_COUNT], uint32_t duration_ns, bool last, int32_t end[AXIS_COUNT]) {
    const struct segment segment = make(steps, duration_ns, last);
    queue.slots[queue.count++] = segment;
    for (unsigned ax = 0; ax < BOARD_AXIS_COUNT; ax++)
        end[ax] += steps[ax];
}

/* What was pushed follows what was before. */
static void publish(void) {
    static unsigned end = QUEUE_RESET_MARK;
    end = queue.published == 0 ? QUEUE_RESET_MARK : end;
    queue.from = end;
    end = 1 + (end + 1) % 2;
    queue.slots[queue.count - 1].mark = (uint16_t)(end + 1);
    segment_queue_publish(&queue);
    while (segment_queue_is_pending(&queue)) {
        (void)prep_poll(&prep);
        if (is_armed())
            interrupt();
    }
    CHECK(queue.answer == QUEUE_TAKEN);
    queue.count = 0;
}

/* Until all words have left for the shift registers. */
static void drain(void) {
    pass(by_shift ? I2S_FIFO_WORDS * I2S_FRAME_CYCLES : 0);
    pass(0);
}

static void compare(const int32_t end[AXIS_COUNT]) {
    int32_t counted[AXIS_COUNT];
    drain();
    step_position(&step, counted);
    for (unsigned ax = 0; ax < BOARD_AXIS_COUNT; ax++) {
        CHECK(counted[ax] == lines[ax].steps);
        CHECK(end == NULL || counted[ax] == end[ax]);
    }
}

/* ---- tests ---- */

static void axes_of_all_speeds_and_directions_make_their_steps(void) {
    int32_t end[AXIS_COUNT] = {0};
    start();
    for (unsigned n = 0; n < 400; n++) {
        int16_t steps[AXIS_COUNT];
        for (unsigned ax = 0; ax < AXIS_COUNT; ax++)
            steps[ax] = (int16_t)(rand() % 401 - 200);
        steps[n % BOARD_AXIS_COUNT] = 200;
        push(steps,
             (uint32_t)(200000000000ull / (1000u + (unsigned)rand() % (BOARD_MAX_STEP_RATE_HZ - 1000u))),
             n % 40 == 39, end);
        if (n % 40 != 39)
            continue;
        publish();
        run(12000); /* a fast segment that turns takes two of the 448 spans */
    }
    run(~0ul);
    compare(end);
    CHECK(!step.active);
}

/* The promise of the board: its fastest rate without end, each pulse in its time. A late one is made up for.
 */
static void the_fastest_rate_holds(void) {
    static const int16_t steps[AXIS_COUNT] = {1000, -1000, 999, 7, -500, 1};
    const uint64_t rate_hz = BOARD_MAX_STEP_RATE_HZ, period = CYCLES_PER_US * 1000000ull / rate_hz;
    for (unsigned turn = 0; turn < 10; turn++) {
        int32_t end[AXIS_COUNT] = {0};
        start();
        for (unsigned n = 0; n < 20; n++)
            push(steps, (uint32_t)(1000ull * 1000000000u / rate_hz), n == 19, end);
        publish();
        busy = latest = 0;
        uint64_t begin = now;
        run(~0ul);
        const uint64_t ended = now;
        compare(end);
        CHECK(lines[0].pulses == 20000);
        CHECK(latest < period + CYCLES_PER_US + (by_shift ? 2 * I2S_FRAME_CYCLES : 0));
        uint64_t us = (ended - begin) / CYCLES_PER_US, wanted_us = 20000ull * 1000000u / rate_hz;
        CHECK(us + 50 >= wanted_us && us < wanted_us + 50);
        CHECK(busy * 100 / (ended - begin) <= BUSY_PERCENT);
        if (turn == 0)
            printf("%u Hz: core 1 busy %.1f %%, latest pulse %.2f us\n", (unsigned)rate_hz,
                   100.0 * (double)busy / (double)(ended - begin), (double)latest / CYCLES_PER_US);
    }
}

static void a_halt_at_any_event_leaves_counter_and_pulses_alike(void) {
    static const int16_t steps[AXIS_COUNT] = {300, -200, 100, -50, 25, 300};
    for (unsigned long n = 1; n < 300; n += 7) {
        int32_t end[AXIS_COUNT] = {0};
        start();
        push(steps, 3000000, true, end);
        publish();
        run(n);
        step_halt(&step);
        const uint64_t halted = now;
        unsigned pulses = lines[0].pulses;
        CHECK(!is_armed());
        step_interrupt(step_vector_argument); /* one that was on its way */
        pass(1000000);
        pass(0);
        CHECK((by_shift || lines[0].pulses == pulses) && !lines[0].high);
        CHECK(lines[0].rose < halted + (by_shift ? HALT_WORDS * I2S_FRAME_CYCLES : 0));
        compare(NULL);
    }
}

static void lines_are_inverted_by_the_matrix_and_keep_their_signal(void) {
    if (by_shift)
        return;
    start();
    step_engine_invert(&hal, 1u << 1, 1u << 2, 0);
    for (unsigned ax = 0; ax < BOARD_AXIS_COUNT; ax++) {
        CHECK(connected[FIRST_STEP_GPIO + ax].signal == (by_rmt ? RMT_SIG_OUT0_IDX + ax : SIG_GPIO_OUT_IDX));
        CHECK(connected[FIRST_DIR_GPIO + ax].signal == SIG_GPIO_OUT_IDX);
        CHECK(connected[FIRST_STEP_GPIO + ax].inverted == (ax == 1));
        CHECK(connected[FIRST_DIR_GPIO + ax].inverted == (ax == 2));
    }
}

/* ---- shift registers ---- */

static void registers_show_the_safe_word_from_the_first_moment(void) {
    start();
    CHECK(shift_model_is_running() && shift_model_shown() == 1u << SLOW_OUTPUT);
    drain();
    CHECK(shift_model_shown() == 1u << SLOW_OUTPUT && changed == 0);
    CHECK(hal.shifted == output_bit(SLOW_OUTPUT));
}

static void inverted_lines_rest_high_and_pulse_low(void) {
    int32_t end[AXIS_COUNT] = {0};
    static const int16_t steps[AXIS_COUNT] = {50, 50, -50};
    start();
    low_steps = 1u << 1;
    low_dirs = 1u << 2;
    lines[1].high = lines[2].negative = true; /* as before the setting is known */
    step_engine_invert(&hal, low_steps, low_dirs, 0);
    step_engine_show(&step);
    drain();
    CHECK(!lines[1].high && !lines[2].negative);
    lines[1].pulses = 0;
    push(steps, 3000000, true, end);
    publish();
    run(~0ul);
    compare(end);
    CHECK(lines[1].pulses == 50);
}

/* At rest by the motion task, in motion by the next event; no pulse is cut by it. */
static void tasks_switch_outputs_at_rest_and_in_motion(void) {
    static const int16_t steps[AXIS_COUNT] = {300, -200, 100};
    int32_t end[AXIS_COUNT] = {0};
    start();
    hal.shifted |= output_bit(OTHER_OUTPUT);
    hal.shifted &= ~output_bit(SLOW_OUTPUT);
    const uint64_t set = now;
    step_engine_show(&step);
    drain();
    CHECK(shift_model_shown() == 1u << OTHER_OUTPUT && changed <= set + 3 * I2S_FRAME_CYCLES);
    push(steps, 3000000, true, end);
    publish();
    for (unsigned turn = 0; turn < 100; turn++) {
        run(3);
        hal.shifted ^= output_bit(SLOW_OUTPUT);
        step_engine_show(&step);
    }
    CHECK(now - changed < 10 * CYCLES_PER_US * 4);
    run(~0ul);
    step_engine_show(&step);
    compare(end);
    CHECK((shift_model_shown() >> SLOW_OUTPUT & 1) == ((hal.shifted & output_bit(SLOW_OUTPUT)) != 0));
}

/* What the interrupt has shown counts, too: an output that was on only while motion lasted goes off. */
static void an_output_of_one_motion_goes_off(void) {
    static const int16_t steps[AXIS_COUNT] = {3};
    int32_t end[AXIS_COUNT] = {0};
    start();
    step_engine_show(&step);
    hal.shifted |= output_bit(OTHER_OUTPUT);
    push(steps, 30000, true, end);
    publish();
    run(~0ul);
    compare(end);
    CHECK((shift_model_shown() >> OTHER_OUTPUT & 1) != 0);
    hal.shifted &= ~output_bit(OTHER_OUTPUT);
    step_engine_show(&step);
    drain();
    CHECK((shift_model_shown() >> OTHER_OUTPUT & 1) == 0);
}

/* Events that an interrupt has kept waiting follow one another as whole pulses: rise() looks at each. */
static void events_that_pile_up_keep_their_pulses(void) {
    static const int16_t steps[AXIS_COUNT] = {400, -400, 399, 7};
    const uint64_t rate_hz = BOARD_MAX_STEP_RATE_HZ;
    int32_t end[AXIS_COUNT] = {0};
    start();
    for (unsigned n = 0; n < 20; n++) {
        int16_t turned[AXIS_COUNT];
        for (unsigned ax = 0; ax < AXIS_COUNT; ax++)
            turned[ax] = n % 2 == 0 ? steps[ax] : (int16_t)-steps[ax];
        push(turned, (uint32_t)(400ull * 1000000000u / rate_hz), n == 19, end);
    }
    publish();
    for (unsigned turn = 0; turn < 100; turn++) {
        run(37);
        pass(LATE_CYCLES);
    }
    run(~0ul);
    compare(end);
    if (by_i2s)
        CHECK(shift_model_most_words() > 4 && shift_model_most_words() < I2S_FIFO_WORDS);
    CHECK(!step_engine_has_lost());
}

static void cut(void) {
    step_engine_cut(&hal, 0, output_bit(SLOW_OUTPUT) | output_bit(OTHER_OUTPUT));
}

/* The e-stop's interrupt comes at any register of the motion task's word: the task's next round repairs at
 * most what it shows after it, and no word is lost. */
static void a_cut_in_the_middle_of_a_word_is_the_last_word(void) {
    enum { ACCESSES = 12 };
    for (unsigned n = 0; n < ACCESSES; n++) {
        start();
        hal.shifted |= output_bit(OTHER_OUTPUT);
        spi_accesses = n;
        spi_interrupt = cut;
        step_engine_show(&step);
        const bool came = spi_interrupt == NULL;
        spi_interrupt = NULL;
        if (!came)
            cut();
        drain();
        step_engine_show(&step);
        drain();
        CHECK(shift_model_shown() == 0 && !step_engine_has_lost());
        CHECK(n > 0 || came);
    }
}

static void a_clock_that_rests_is_a_fault(void) {
    static const int16_t steps[AXIS_COUNT] = {1000};
    int32_t end[AXIS_COUNT] = {0};
    start();
    push(steps, 10000000, true, end);
    publish();
    run(100);
    CHECK(!step_engine_has_lost());
    shift_model_break();
    run(I2S_FIFO_WORDS);
    CHECK(step_engine_has_lost());
}

/* The longest pulse and direction set-up go into the FIFO at a time, with room for a late interrupt. */
static void the_longest_pulse_fits(void) {
    int32_t end[AXIS_COUNT] = {0};
    start();
    step_engine_set_pulse(&hal, STEP_GRID_MAX * BOARD_STEP_GRID_NS);
    pulse_cycles = STEP_GRID_MAX * I2S_FRAME_CYCLES;
    prep.timing.min_interval_ticks = 2 * STEP_GRID_MAX * BOARD_STEP_GRID_NS / 50;
    for (unsigned n = 0; n < 10; n++) {
        const int16_t turned[AXIS_COUNT] = {n % 2 == 0 ? 100 : -100, n % 2 == 0 ? -100 : 100};
        push(turned, 100u * 2 * STEP_GRID_MAX * BOARD_STEP_GRID_NS, n == 9, end);
    }
    publish();
    for (unsigned turn = 0; turn < 20; turn++) {
        run(17);
        pass(LATE_CYCLES);
    }
    run(~0ul);
    compare(end);
    CHECK(lines[0].pulses == 1000 && lines[1].pulses == 1000);
    CHECK(!step_engine_has_lost());
}

/* The measure: 100 000 events a second, all axes at each of them. @return percent of core 1 */
static double share_at_100k(uint32_t pulse_ns) {
    static const int16_t steps[AXIS_COUNT] = {1000, -1000, 1000, -1000, 1000, 1000};
    int32_t end[AXIS_COUNT] = {0};
    start();
    step_engine_set_pulse(&hal, pulse_ns);
    pulse_cycles = pulse_ns * CYCLES_PER_US / 1000;
    for (unsigned n = 0; n < 20; n++)
        push(steps, 1000 * 10000u, n == 19, end);
    publish();
    busy = 0;
    const uint64_t begin = now;
    run(~0ul);
    const double share = 100.0 * (double)busy / (double)(now - begin);
    compare(end);
    return share;
}

/* With the SPI the interrupt waits for the end of each pulse, as with pins. */
static void six_axes_at_100k_leave_the_core_time(void) {
    const double shortest = share_at_100k(BOARD_STEP_PULSE_NS), usual = share_at_100k(4000);
    printf("100000 Hz: core 1 busy %.1f %% with pulses of %.1f us, %.1f %% of 4 us\n", shortest,
           BOARD_STEP_PULSE_NS / 1000.0, usual);
    CHECK(usual <= (by_i2s ? 25.0 : 60.0));
    CHECK(shortest <= (by_i2s ? 25.0 : 40.0));
}

static void test_shift_registers(void) {
    registers_show_the_safe_word_from_the_first_moment();
    inverted_lines_rest_high_and_pulse_low();
    tasks_switch_outputs_at_rest_and_in_motion();
    an_output_of_one_motion_goes_off();
    events_that_pile_up_keep_their_pulses();
    if (!by_i2s)
        a_cut_in_the_middle_of_a_word_is_the_last_word();
    a_clock_that_rests_is_a_fault();
    if (by_i2s)
        the_longest_pulse_fits();
    six_axes_at_100k_leave_the_core_time();
}

/* The same motion with every engine, for a comparison of their steps: ramps and turns of all axes. */
static void trace(void) {
    int32_t end[AXIS_COUNT] = {0};
    start();
    now = 2000000; /* whatever the start took */
    is_traced = true;
    for (unsigned n = 0; n < 40; n++) {
        int16_t steps[AXIS_COUNT];
        for (unsigned ax = 0; ax < AXIS_COUNT; ax++)
            steps[ax] = (int16_t)((n * 37 + ax * 61) % 241 - 120);
        push(steps, 120u * (1000000000u / (5000u + 2500u * (n % 20))), n == 39, end);
    }
    publish();
    run(~0ul);
    compare(end);
}

int main(int arguments, char **argument) {
    srand(1);
    if (arguments > 1 && strcmp(argument[1], "trace") == 0) {
        trace();
        return report();
    }
    axes_of_all_speeds_and_directions_make_their_steps();
    the_fastest_rate_holds();
    a_halt_at_any_event_leaves_counter_and_pulses_alike();
    lines_are_inverted_by_the_matrix_and_keep_their_signal();
    if (by_shift)
        test_shift_registers();
    return report();
}
