/* SPDX-License-Identifier: MIT */
#include "io/encoder.h"

#include "pin_config.h"
#include "step_pins.h"

#include "driver/pulse_cnt.h"
#include "esp_attr.h"
#include "hal/pcnt_ll.h"

#define UNIT 0u /* the first that ESP-IDF's driver gives, and no one else asks for one */

/* Both edges of one line; the other line says which way. */
static bool add_channel(pcnt_unit_handle_t unit, const struct encoder_wire *edge,
                        const struct encoder_wire *level, pcnt_channel_edge_action_t rising,
                        pcnt_channel_edge_action_t falling) {
    const pcnt_chan_config_t config = {
        .edge_gpio_num = edge->gpio,
        .level_gpio_num = level->gpio,
        .flags = {.invert_edge_input = !edge->active_high, .invert_level_input = !level->active_high}};
    pcnt_channel_handle_t channel;
    return pcnt_new_channel(unit, &config, &channel) == ESP_OK &&
           pcnt_channel_set_edge_action(channel, rising, falling) == ESP_OK &&
           pcnt_channel_set_level_action(channel, PCNT_CHANNEL_LEVEL_ACTION_KEEP,
                                         PCNT_CHANNEL_LEVEL_ACTION_INVERSE) == ESP_OK;
}

/* Quadrature: each edge of both lines counts by 1, so that a line of the encoder is four counts. */
static bool start(pcnt_unit_handle_t unit, const struct encoder_wire *a, const struct encoder_wire *b) {
    const pcnt_glitch_filter_config_t filter = {.max_glitch_ns = BOARD_ENCODER_FILTER_NS};
    const pcnt_channel_edge_action_t up = PCNT_CHANNEL_EDGE_ACTION_INCREASE,
                                     down = PCNT_CHANNEL_EDGE_ACTION_DECREASE;
    return pcnt_unit_set_glitch_filter(unit, &filter) == ESP_OK && add_channel(unit, a, b, down, up) &&
           add_channel(unit, b, a, up, down) && pcnt_unit_enable(unit) == ESP_OK &&
           pcnt_unit_clear_count(unit) == ESP_OK && pcnt_unit_start(unit) == ESP_OK;
}

bool encoder_init(struct encoder *encoder, const struct encoder_wire wire[ENCODER_LINES]) {
    const pcnt_unit_config_t config = {.low_limit = -ENCODER_LIMIT, .high_limit = ENCODER_LIMIT};
    const struct encoder_wire *a = &wire[ENCODER_A], *b = &wire[ENCODER_B];
    pcnt_unit_handle_t unit;
    *encoder = (struct encoder){.unit = NULL};
    if (a->gpio == NO_PIN || b->gpio == NO_PIN || pcnt_new_unit(&config, &unit) != ESP_OK)
        return false;
    if (!start(unit, a, b) || pcnt_ll_get_high_limit_value(&PCNT, UNIT) != ENCODER_LIMIT)
        return false;
    encoder->unit = unit;
    return true;
}

void encoder_read(struct encoder *encoder, uint32_t now_us, struct hal_encoder_state *out) {
    int raw = encoder->counts.raw;
    (void)pcnt_unit_get_count(encoder->unit, &raw);
    uint32_t index = __atomic_load_n(&encoder->index, __ATOMIC_ACQUIRE);
    encoder_counts_take(&encoder->counts, raw, index, now_us);
    *out = encoder->counts.state;
}

void IRAM_ATTR encoder_index_isr(struct encoder *encoder) {
    int raw = pcnt_ll_get_count(&PCNT, UNIT);
    __atomic_store_n(&encoder->index, encoder_index_word(encoder->index, raw), __ATOMIC_RELEASE);
}
