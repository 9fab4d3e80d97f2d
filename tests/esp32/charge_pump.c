/* SPDX-License-Identifier: MIT
 * The charge pump of the ESP32: the wave at the pin, and its end when the motion task is not heard. */
#include "io/charge_pump.h"
#include "check.h"
#include "pin_config.h"

#include "freertos/FreeRTOS.h"

#include "driver/ledc.h"
#include "esp_freertos_hooks.h"
#include "esp_rom_gpio.h"
#include "soc/gpio_sig_map.h"

enum { PIN = 16, WAVE = LEDC_LS_SIG_OUT0_IDX + 2 };

static esp_freertos_tick_cb_t tick;
static unsigned hook_cpu = 99;
static uint32_t divider, duty, signal_at_pin;
static bool inverted;

esp_err_t esp_register_freertos_tick_hook_for_cpu(esp_freertos_tick_cb_t hook, unsigned cpu) {
    tick = hook;
    hook_cpu = cpu;
    return ESP_OK;
}
void esp_rom_gpio_connect_out_signal(uint32_t gpio, uint32_t signal, bool invert, bool enable_inverted) {
    CHECK(gpio == PIN && !enable_inverted);
    signal_at_pin = signal;
    inverted = invert;
}
esp_err_t ledc_timer_config(const ledc_timer_config_t *config) {
    CHECK(config->timer_num == LEDC_TIMER_2 && config->clk_cfg == LEDC_USE_APB_CLK);
    return ESP_OK;
}
/* As ESP-IDF: the channel's wave is at the pin from here on. */
esp_err_t ledc_channel_config(const ledc_channel_config_t *config) {
    CHECK(config->gpio_num == PIN && config->duty == 0);
    signal_at_pin = WAVE;
    return ESP_OK;
}
esp_err_t ledc_set_duty(ledc_mode_t mode, ledc_channel_t channel, uint32_t levels) {
    CHECK(mode == LEDC_LOW_SPEED_MODE && channel == LEDC_CHANNEL_2);
    duty = levels;
    return ESP_OK;
}
esp_err_t ledc_update_duty(ledc_mode_t mode, ledc_channel_t channel) {
    (void)mode, (void)channel;
    return ESP_OK;
}
esp_err_t ledc_timer_set(ledc_mode_t mode, ledc_timer_t timer, uint32_t ticks, uint32_t bits,
                         ledc_clk_src_t source) {
    CHECK(mode == LEDC_LOW_SPEED_MODE && timer == LEDC_TIMER_2 && bits == 10 && source == LEDC_APB_CLK);
    divider = ticks;
    return ESP_OK;
}

static bool is_waving(void) {
    return signal_at_pin == WAVE;
}

static unsigned ticks_until_it_ends(void) {
    unsigned ticks = 0;
    for (; is_waving() && ticks < 1000; ticks++)
        tick();
    return ticks;
}

int main(void) {
    const struct output_wire wire = {.pin = PIN, .active_high = false};
    CHECK(charge_pump_init(&wire) && hook_cpu == 0);
    CHECK(!is_waving() && duty == 512); /* half of 2^10 levels */

    charge_pump_set(BOARD_PUMP_CLOCK_HZ / 12500);
    tick();
    CHECK(!is_waving() && divider == 1600); /* 80 MHz / (2^10 * 1600 / 2^8) = 12.5 kHz; no one beats yet */
    charge_pump_beat();
    tick();
    CHECK(is_waving() && inverted);

    for (unsigned round = 0; round < 100; round++) { /* a task that is late by some ms each time */
        charge_pump_beat();
        for (unsigned ms = 0; ms < CHARGE_PUMP_LATE_MS; ms++) {
            tick();
            CHECK(is_waving());
        }
    }
    charge_pump_beat();
    CHECK(ticks_until_it_ends() == CHARGE_PUMP_LATE_MS + 1);
    CHECK(signal_at_pin == SIG_GPIO_OUT_IDX && !inverted); /* the pin's own level: off */
    charge_pump_beat();
    tick();
    CHECK(is_waving());

    charge_pump_set(0);
    charge_pump_beat();
    tick();
    CHECK(!is_waving());
    return report();
}
