/* SPDX-License-Identifier: MIT */
#include "io/dial.h"

#include "base/quadrature.h"
#include "io/dial_counts.h"
#include "io/encoder_counts.h"
#include "machine/dial.h"
#include "pin_config.h"

#include "driver/gpio.h"
#include "driver/pulse_cnt.h"

#include <stdlib.h>

/* All of it is from the heap: most boards have none. */
struct dial {
    struct dial_wire wire[DIAL_LINES];
    pcnt_unit_handle_t unit;
    struct dial_counts counts;
    struct machine_dial state;
};

static struct dial *dial;

static unsigned is_on(unsigned line) {
    const struct dial_wire *wire = &dial->wire[line];
    if (wire->pin == PIN_NONE)
        return 0;
    return (gpio_get_level((gpio_num_t)wire->pin) != 0) == wire->active_high ? 1u : 0u;
}

static uint8_t phase(void) {
    return quadrature_phase(is_on(DIAL_A), is_on(DIAL_B));
}

static void read_dial(struct hal *hal, struct hal_dial_state *out) {
    int raw = dial->counts.raw;
    unsigned on = 0;
    (void)hal;
    (void)pcnt_unit_get_count(dial->unit, &raw);
    dial_counts_take(&dial->counts, raw, phase());
    for (unsigned line = DIAL_X10; line < DIAL_LINES; line++)
        on |= is_on(line) << line;
    *out = (struct hal_dial_state){.counts = dial->counts.counts, .slips = dial->counts.slips};
    dial_switches(on, out);
}

/* Both edges of one line; the other line says which way. */
static bool add_channel(const struct dial_wire *edge, const struct dial_wire *level,
                        pcnt_channel_edge_action_t rising, pcnt_channel_edge_action_t falling) {
    const pcnt_chan_config_t config = {
        .edge_gpio_num = edge->pin,
        .level_gpio_num = level->pin,
        .flags = {.invert_edge_input = !edge->active_high, .invert_level_input = !level->active_high}};
    pcnt_channel_handle_t channel;
    return pcnt_new_channel(dial->unit, &config, &channel) == ESP_OK &&
           pcnt_channel_set_edge_action(channel, rising, falling) == ESP_OK &&
           pcnt_channel_set_level_action(channel, PCNT_CHANNEL_LEVEL_ACTION_KEEP,
                                         PCNT_CHANNEL_LEVEL_ACTION_INVERSE) == ESP_OK;
}

static bool start_counter(const struct dial_wire *a, const struct dial_wire *b) {
    const pcnt_unit_config_t config = {.low_limit = -ENCODER_LIMIT, .high_limit = ENCODER_LIMIT};
    const pcnt_glitch_filter_config_t filter = {.max_glitch_ns = BOARD_DIAL_FILTER_NS};
    const pcnt_channel_edge_action_t up = PCNT_CHANNEL_EDGE_ACTION_INCREASE,
                                     down = PCNT_CHANNEL_EDGE_ACTION_DECREASE;
    return pcnt_new_unit(&config, &dial->unit) == ESP_OK &&
           pcnt_unit_set_glitch_filter(dial->unit, &filter) == ESP_OK && add_channel(a, b, down, up) &&
           add_channel(b, a, up, down) && pcnt_unit_enable(dial->unit) == ESP_OK &&
           pcnt_unit_clear_count(dial->unit) == ESP_OK && pcnt_unit_start(dial->unit) == ESP_OK;
}

/* After pcnt_new_channel(), which sets the pulls as it likes. */
static void set_pull(const struct dial_wire *wire) {
    const gpio_config_t config = {
        .pin_bit_mask = 1ull << wire->pin,
        .mode = GPIO_MODE_INPUT,
        .pull_up_en = wire->pull == PIN_PULL_UP ? GPIO_PULLUP_ENABLE : GPIO_PULLUP_DISABLE,
        .pull_down_en = wire->pull == PIN_PULL_DOWN ? GPIO_PULLDOWN_ENABLE : GPIO_PULLDOWN_DISABLE,
        .intr_type = GPIO_INTR_DISABLE,
    };
    (void)gpio_config(&config);
}

const struct hal_dial *dial_init(const struct dial_wire wire[DIAL_LINES]) {
    static const struct hal_dial ops = {.counts_per_detent = BOARD_DIAL_COUNTS,
                                        .selects_axis = BOARD_DIAL_SELECTS_AXIS != 0,
                                        .read = read_dial};
    dial = calloc(1, sizeof *dial);
    if (dial == NULL)
        return NULL;
    for (unsigned line = 0; line < DIAL_LINES; line++)
        dial->wire[line] = wire[line];
    if (!start_counter(&wire[DIAL_A], &wire[DIAL_B])) {
        free(dial);
        dial = NULL;
        return NULL;
    }
    for (unsigned line = 0; line < DIAL_LINES; line++)
        if (wire[line].pin != PIN_NONE)
            set_pull(&wire[line]);
    dial_counts_begin(&dial->counts, phase());
    return &ops;
}

struct machine_dial *dial_state(void) {
    return dial != NULL ? &dial->state : NULL;
}
