/* SPDX-License-Identifier: MIT
 * Step pulses of the ESP32's two engines, from segments through prep and the real step interrupt to emulated
 * registers: what leaves the step lines keeps the contract of core/hal/README.md, whichever engine it is.
 *
 * Emulated are the cycle counter, the step timer, GPIO set and clear, and RMT channels with their memory.
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
#include "hal/step_rmt.h"
#include "hal/step_vector.h"
#include "segment/queue.h"
#include "step/prep.h"

#include "driver/rmt_tx.h"
#include "esp_rom_gpio.h"
#include "soc/gpio_sig_map.h"
#include "soc/soc_caps.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum {
    CYCLES_PER_US = 240,
    CYCLES_PER_TICK = 12,
    ACCESS_CYCLES = 12,
    READ_CYCLES = 8,
    RMT_BEGIN_CYCLES = 40
};
/* Instructions before the step lines change, and after the last register was written. The others come between
 * accesses to the timer, three in an event. */
enum { ENTRY_INSTRUCTIONS = 56, EXIT_INSTRUCTIONS = 30, TIMER_ACCESSES = 3 };
enum { BETWEEN_INSTRUCTIONS = EVENT_INSTRUCTIONS - ENTRY_INSTRUCTIONS - EXIT_INSTRUCTIONS };
enum { BUS_CYCLES = 16, HELD_OFF_CYCLES = 60, CACHE_LINE_CYCLES = 940, ROUND_CYCLES = 240000 };
#define CYCLES_OF(instructions) ((instructions) * 3 / 2)
enum { PULSE_CYCLES = BOARD_STEP_PULSE_NS * 240 / 1000, SETUP_CYCLES = BOARD_DIR_SETUP_NS * 240 / 1000 };
enum { CHANNELS = 8, FIRST_STEP_GPIO = 0, FIRST_DIR_GPIO = 34 };

static uint64_t now; /* cycles */

/* ---- what the lines show ---- */

static struct line {
    uint64_t rose, fell, turned; /* step line; direction line */
    bool high, negative;
    int32_t steps;
    unsigned pulses;
} lines[AXIS_COUNT];

/* The present event's alarm: the plan. No drift, as alarms are absolute. */
static uint64_t due;
static uint64_t latest; /* of all pulses, behind it */

static void rise(unsigned axis, uint64_t at) {
    struct line *line = &lines[axis];
    latest = at - due > latest ? at - due : latest;
    CHECK(!line->high && at >= line->fell + PULSE_CYCLES);
    CHECK(at >= line->turned + SETUP_CYCLES);
    line->high = true;
    line->rose = at;
    line->pulses++;
    line->steps += line->negative ? -1 : 1;
}

static void fall(unsigned axis, uint64_t at) {
    struct line *line = &lines[axis];
    CHECK(line->high && at >= line->rose + PULSE_CYCLES);
    line->high = false;
    line->fell = at;
}

static void turn(unsigned axis, bool negative, uint64_t at) {
    struct line *line = &lines[axis];
    if (line->negative == negative)
        return;
    CHECK(at >= line->fell); /* which a channel at work has in the future */
    CHECK(!line->high);
    line->negative = negative;
    line->turned = at;
}

/* ---- registers ---- */

static gpio_dev_t gpio;
static rmt_dev_t rmt;
static uint32_t rmt_known[CHANNELS], rmt_position[CHANNELS];
static uint64_t rmt_busy_until[CHANNELS];
volatile uint32_t RMTMEM[CHANNELS][SOC_RMT_MEM_WORDS_PER_CHANNEL];
static timg_dev_t timer;
static mcpwm_dev_t pwm;

static bool takes(uint64_t bits, unsigned gpio_number) {
    return (bits >> gpio_number & 1) != 0;
}

static uint64_t written; /* when the register was written that is looked at next */

static void look_at_gpio(void) {
    uint64_t set = gpio.out_w1ts | (uint64_t)gpio.out1_w1ts.val << 32;
    uint64_t clear = gpio.out_w1tc | (uint64_t)gpio.out1_w1tc.val << 32;
    gpio.out_w1ts = gpio.out_w1tc = gpio.out1_w1ts.val = gpio.out1_w1tc.val = 0;
    for (unsigned ax = 0; ax < BOARD_AXIS_COUNT; ax++) {
        if (takes(set, FIRST_STEP_GPIO + ax))
            rise(ax, written);
        if (takes(clear, FIRST_STEP_GPIO + ax) && lines[ax].high)
            fall(ax, written);
        if (takes(set | clear, FIRST_DIR_GPIO + ax))
            turn(ax, takes(set, FIRST_DIR_GPIO + ax), written);
    }
}

/* Words of duration, level, duration, level; a duration of 0 is the end. The line rests low. */
static void play(unsigned channel) {
    const uint32_t *words = (const uint32_t *)RMTMEM[channel];
    uint64_t at = written + RMT_BEGIN_CYCLES;
    CHECK(written >= rmt_busy_until[channel] && rmt_position[channel] == 0);
    bool level = false;
    for (unsigned half = 0; half < 2 * SOC_RMT_MEM_WORDS_PER_CHANNEL; half++) {
        uint32_t part = words[half / 2] >> (half % 2 * 16) & 0xFFFF;
        bool next = (part & 0x7FFF) != 0 && part >> 15 != 0;
        if (next && !level)
            rise(channel, at);
        if (!next && level)
            fall(channel, at);
        level = next;
        if ((part & 0x7FFF) == 0)
            break;
        at += (uint64_t)(part & 0x7FFF) * 3; /* 80 MHz */
    }
    CHECK(!level);
    rmt_position[channel] = 2;
    rmt_busy_until[channel] = at;
}

static volatile uint32_t *conf_of(unsigned channel) {
    return &rmt.STEP_RMT_CONF(channel);
}

static void look_at_rmt(void) {
    for (unsigned channel = 0; channel < BOARD_AXIS_COUNT; channel++) {
        uint32_t word = *conf_of(channel);
        if (word == rmt_known[channel])
            continue;
        if ((word & STEP_RMT_REWIND) != 0) {
            CHECK(written >= rmt_busy_until[channel]);
            rmt_position[channel] = 0;
        }
        if ((word & 1) != 0)
            play(channel);
        *conf_of(channel) = rmt_known[channel] = word & ~1u;
    }
}

static void pass(unsigned cycles) {
    look_at_gpio();
    look_at_rmt();
    now += cycles;
    written = now;
}

uint32_t emulated_cycles(void) {
    pass(READ_CYCLES);
    return (uint32_t)now;
}

static unsigned access_cycles(void) {
    return ACCESS_CYCLES + (rand() % 4 == 0 ? (unsigned)rand() % BUS_CYCLES : 0);
}

gpio_dev_t *emulated_gpio(void) {
    pass(access_cycles());
    return &gpio;
}

rmt_dev_t *emulated_rmt(void) {
    pass(ACCESS_CYCLES / 4); /* without a wait for the one before: pulse_rmt.h */
    return &rmt;
}

mcpwm_dev_t *emulated_pwm(void) {
    pass(access_cycles());
    return &pwm;
}

timg_dev_t *emulated_timer(void) {
    pass(access_cycles() + CYCLES_OF(BETWEEN_INSTRUCTIONS) / TIMER_ACCESSES);
    return &timer;
}

/* ---- ESP-IDF ---- */

struct step *step_vector_argument;
static unsigned channels;
static struct {
    uint32_t signal;
    bool inverted;
} connected[64];

esp_err_t esp_intr_alloc(int source, int flags, intr_handler_t to, void *arg, intr_handle_t *handle) {
    (void)source;
    (void)handle;
    CHECK(flags == (ESP_INTR_FLAG_LEVEL5 | ESP_INTR_FLAG_IRAM) && to == NULL && arg == NULL);
    return ESP_OK;
}

void esp_rom_gpio_connect_out_signal(uint32_t number, uint32_t signal, bool inverted, bool enable_inverted) {
    (void)enable_inverted;
    connected[number].signal = signal;
    connected[number].inverted = inverted;
}

esp_err_t rmt_new_tx_channel(const rmt_tx_channel_config_t *config, rmt_channel_handle_t *channel) {
    CHECK(config->gpio_num == FIRST_STEP_GPIO + (int)channels && config->resolution_hz == 80000000);
    *channel = (rmt_channel_handle_t)(uintptr_t)(channels + 1);
    *conf_of(channels) = rmt_known[channels] = 1u << 6 | 1u << 19; /* rests low */
    channels++;
    return ESP_OK;
}

/* ---- a controller of segments ---- */

static struct hal_step hal;
static struct step step;
static struct prep prep;
static struct segment_queue queue;
static struct step_engine_board board;
static uint64_t timer_zero;

static void start(void) {
    memset(lines, 0, sizeof lines);
    memset(rmt_busy_until, 0, sizeof rmt_busy_until);
    channels = 0;
    now += 1000000;
    board = (struct step_engine_board){.gang = gang_of(BOARD_AXIS_COUNT, 0),
                                       .probe_gpio = NO_PIN,
                                       .timer_hz = BOARD_TIMER_HZ,
                                       .step_pulse_ns = BOARD_STEP_PULSE_NS,
                                       .dir_setup_ns = BOARD_DIR_SETUP_NS};
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++) {
        board.step_gpio[ax] = ax < BOARD_AXIS_COUNT ? (uint8_t)(FIRST_STEP_GPIO + ax) : NO_PIN;
        board.dir_gpio[ax] = ax < BOARD_AXIS_COUNT ? (uint8_t)(FIRST_DIR_GPIO + ax) : NO_PIN;
    }
    const bool by_rmt = BOARD_STEP_ENGINE == BOARD_STEP_ENGINE_RMT;
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
    now += late;
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

static void compare(const int32_t end[AXIS_COUNT]) {
    int32_t counted[AXIS_COUNT];
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
        run(4000);
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
        compare(end);
        CHECK(lines[0].pulses == 20000);
        CHECK(latest < period + CYCLES_PER_US);
        uint64_t us = (now - begin) / CYCLES_PER_US, wanted_us = 20000ull * 1000000u / rate_hz;
        CHECK(us + 50 >= wanted_us && us < wanted_us + 50);
        CHECK(busy * 100 / (now - begin) <= BUSY_PERCENT);
        if (turn == 0)
            printf("%u Hz: core 1 busy %.1f %%, latest pulse %.2f us\n", (unsigned)rate_hz,
                   100.0 * (double)busy / (double)(now - begin), (double)latest / CYCLES_PER_US);
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
        unsigned pulses = lines[0].pulses;
        CHECK(!is_armed());
        step_interrupt(step_vector_argument); /* one that was on its way */
        pass(1000000);
        pass(0);
        CHECK(lines[0].pulses == pulses && !lines[0].high);
        compare(NULL);
    }
}

static void lines_are_inverted_by_the_matrix_and_keep_their_signal(void) {
    start();
    step_engine_invert(&hal, 1u << 1, 1u << 2, 0);
    for (unsigned ax = 0; ax < BOARD_AXIS_COUNT; ax++) {
        bool by_rmt = BOARD_STEP_ENGINE == BOARD_STEP_ENGINE_RMT;
        CHECK(connected[FIRST_STEP_GPIO + ax].signal == (by_rmt ? RMT_SIG_OUT0_IDX + ax : SIG_GPIO_OUT_IDX));
        CHECK(connected[FIRST_DIR_GPIO + ax].signal == SIG_GPIO_OUT_IDX);
        CHECK(connected[FIRST_STEP_GPIO + ax].inverted == (ax == 1));
        CHECK(connected[FIRST_DIR_GPIO + ax].inverted == (ax == 2));
    }
}

int main(void) {
    srand(1);
    axes_of_all_speeds_and_directions_make_their_steps();
    the_fastest_rate_holds();
    a_halt_at_any_event_leaves_counter_and_pulses_alike();
    lines_are_inverted_by_the_matrix_and_keep_their_signal();
    return report();
}
