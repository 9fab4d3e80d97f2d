/* SPDX-License-Identifier: MIT */
#include "pulses_chip.h"

#include "check.h"
#include "hal/i2s_registers.h"
#include "hal/rmt_registers.h"
#include "hal/spi_registers.h"
#include "hal/step_vector.h"

#include "driver/gpio.h"
#include "driver/rmt_tx.h"
#include "esp_rom_gpio.h"
#include "esp_rom_sys.h"
#include "soc/soc_caps.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* ---- what the lines show ---- */

struct line lines[AXIS_COUNT];
uint64_t now, due, latest;
bool is_traced;
unsigned pulse_cycles;

static void rise(unsigned axis, uint64_t at) {
    struct line *line = &lines[axis];
    latest = at - due > latest ? at - due : latest;
    CHECK(!line->high && at >= line->fell + pulse_cycles);
    CHECK(at >= line->turned + SETUP_CYCLES);
    line->high = true;
    line->rose = at;
    line->pulses++;
    line->steps += line->negative ? -1 : 1;
    if (is_traced)
        printf("%u %d %llu\n", axis, line->negative, (unsigned long long)at);
}

static void fall(unsigned axis, uint64_t at) {
    struct line *line = &lines[axis];
    CHECK(line->high && at >= line->rose + pulse_cycles);
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

axis_mask_t low_steps, low_dirs;
uint64_t changed;

void lines_show(uint32_t before, uint32_t word, uint64_t at, uint64_t planned) {
    const uint64_t kept = due;
    due = planned;
    for (unsigned ax = 0; ax < BOARD_AXIS_COUNT; ax++)
        if (lines[ax].high && ((word >> STEP_OUTPUT(ax) ^ low_steps >> ax) & 1) == 0)
            fall(ax, at);
    for (unsigned ax = 0; ax < BOARD_AXIS_COUNT; ax++)
        turn(ax, ((word >> DIR_OUTPUT(ax) ^ low_dirs >> ax) & 1) != 0, at);
    for (unsigned ax = 0; ax < BOARD_AXIS_COUNT; ax++)
        if (!lines[ax].high && ((word >> STEP_OUTPUT(ax) ^ low_steps >> ax) & 1) != 0)
            rise(ax, at);
    if (((before ^ word) >> SLOW_OUTPUT & 1) != 0)
        changed = at;
    due = kept;
}

/* ---- registers ---- */

static gpio_dev_t gpio;
static rmt_dev_t rmt;
static uint32_t rmt_known[CHANNELS], rmt_position[CHANNELS];
static uint64_t rmt_busy_until[CHANNELS];
volatile uint32_t RMTMEM[CHANNELS][SOC_RMT_MEM_WORDS_PER_CHANNEL];
timg_dev_t timer;
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

void pass(unsigned cycles) {
    look_at_gpio();
    look_at_rmt();
    shift_model_pass(written, now + cycles, due);
    now += cycles;
    written = now;
}

uint32_t emulated_cycles(void) {
    pass(READ_CYCLES);
    return (uint32_t)now;
}

static unsigned access_cycles(void) {
    return ACCESS_CYCLES + (!is_traced && rand() % 4 == 0 ? (unsigned)rand() % BUS_CYCLES : 0);
}

gpio_dev_t *emulated_gpio(void) {
    pass(access_cycles());
    return &gpio;
}

rmt_dev_t *emulated_rmt(void) {
    pass(ACCESS_CYCLES / 4); /* without a wait for the one before: pulse_rmt.h */
    return &rmt;
}

volatile struct i2s_registers *emulated_i2s(void) {
    pass(access_cycles());
    return shift_model_i2s();
}

void (*spi_interrupt)(void);
unsigned spi_accesses;

volatile struct spi_registers *emulated_spi(void) {
    void (*const interrupt)(void) = spi_interrupt;
    if (interrupt != NULL && spi_accesses-- == 0) {
        spi_interrupt = NULL;
        interrupt();
    }
    pass(access_cycles());
    return shift_model_spi();
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
unsigned channels;
struct connected connected[64];

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
    shift_model_connect(number, signal, now);
}

esp_err_t gpio_set_level(gpio_num_t number, uint32_t level) {
    shift_model_pin((unsigned)number, level != 0);
    return ESP_OK;
}
esp_err_t gpio_config(const gpio_config_t *config) {
    CHECK(config->mode == GPIO_MODE_OUTPUT);
    return ESP_OK;
}
void esp_rom_delay_us(uint32_t us) {
    pass(us * CYCLES_PER_US);
}
esp_err_t rmt_new_tx_channel(const rmt_tx_channel_config_t *config, rmt_channel_handle_t *channel) {
    CHECK(config->gpio_num == FIRST_STEP_GPIO + (int)channels && config->resolution_hz == 80000000);
    *channel = (rmt_channel_handle_t)(uintptr_t)(channels + 1);
    *conf_of(channels) = rmt_known[channels] = 1u << 6 | 1u << 19; /* rests low */
    channels++;
    return ESP_OK;
}

void chip_reset(void) {
    memset(lines, 0, sizeof lines);
    memset(rmt_busy_until, 0, sizeof rmt_busy_until);
    low_steps = low_dirs = 0;
    changed = 0;
    channels = 0;
    pulse_cycles = PULSE_CYCLES;
    shift_model_reset(now);
}
