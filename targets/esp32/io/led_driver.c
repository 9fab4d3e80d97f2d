/* SPDX-License-Identifier: MIT */
#include "io/led_driver.h"

#include "pin_config.h"
#include "step_pins.h"

#include "driver/gpio.h"
#include "driver/rmt_encoder.h"
#include "driver/rmt_tx.h"
#include "soc/soc_caps.h"

#include <string.h>

/* WS2812 data sheet, "Data transfer time", in steps of 0.1 us: a bit is 1.25 us, high for a third or two. */
enum { RESOLUTION_HZ = 10000000, SHORT_TICKS = 4, LONG_TICKS = 8, COLOUR_BYTES = 3 };

static struct {
    bool works;
    uint8_t gpio;
    bool active_high;
    rmt_channel_handle_t channel;
    rmt_encoder_handle_t encoder;
    uint8_t sent[COLOUR_BYTES]; /* green, red, blue; RMT reads it while it sends */
    bool on;
} led;

static bool start_rmt(void) {
    const rmt_tx_channel_config_t channel = {.gpio_num = (gpio_num_t)led.gpio,
                                             .clk_src = RMT_CLK_SRC_DEFAULT,
                                             .resolution_hz = RESOLUTION_HZ,
                                             .mem_block_symbols = SOC_RMT_MEM_WORDS_PER_CHANNEL,
                                             .trans_queue_depth = 1};
    const rmt_bytes_encoder_config_t encoder = {
        .bit0 = {.level0 = 1, .duration0 = SHORT_TICKS, .level1 = 0, .duration1 = LONG_TICKS},
        .bit1 = {.level0 = 1, .duration0 = LONG_TICKS, .level1 = 0, .duration1 = SHORT_TICKS},
        .flags = {.msb_first = 1}};
    return rmt_new_tx_channel(&channel, &led.channel) == ESP_OK &&
           rmt_new_bytes_encoder(&encoder, &led.encoder) == ESP_OK && rmt_enable(led.channel) == ESP_OK;
}

bool led_driver_init(const struct pin_wire *wire) {
    led.gpio = wire->gpio;
    led.active_high = wire->active_high;
    led.works = wire->gpio != NO_PIN && BOARD_LED_KIND != BOARD_LED_NONE &&
                (BOARD_LED_KIND != BOARD_LED_WS2812 || start_rmt());
    return led.works;
}

static void show_colour(struct net_light_colour colour) {
    const rmt_transmit_config_t once = {.loop_count = 0};
    const uint8_t bytes[COLOUR_BYTES] = {colour.green, colour.red, colour.blue};
    if (memcmp(bytes, led.sent, sizeof bytes) == 0 || rmt_tx_wait_all_done(led.channel, 0) != ESP_OK)
        return;
    memcpy(led.sent, bytes, sizeof bytes);
    (void)rmt_transmit(led.channel, led.encoder, led.sent, sizeof led.sent, &once);
}

void led_driver_show(enum net_light light, uint32_t now_ms) {
    if (!led.works)
        return;
    if (BOARD_LED_KIND == BOARD_LED_WS2812) {
        show_colour(net_light_colour(light, now_ms));
        return;
    }
    (void)gpio_set_level((gpio_num_t)led.gpio, net_light_is_on(light, now_ms) == led.active_high);
}
