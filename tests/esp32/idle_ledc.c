/* SPDX-License-Identifier: MIT
 * ESP-IDF's LED PWM and hooks, for programs that set a servo or a charge pump up and do not look at it. */
#include "freertos/FreeRTOS.h"

#include "driver/ledc.h"
#include "esp_freertos_hooks.h"

esp_err_t esp_register_freertos_tick_hook_for_cpu(esp_freertos_tick_cb_t hook, unsigned cpu) {
    (void)hook;
    (void)cpu;
    return ESP_OK;
}
esp_err_t ledc_timer_set(ledc_mode_t mode, ledc_timer_t timer, uint32_t divider, uint32_t bits,
                         ledc_clk_src_t source) {
    (void)mode;
    (void)timer;
    (void)divider;
    (void)bits;
    (void)source;
    return ESP_OK;
}

esp_err_t ledc_timer_config(const ledc_timer_config_t *config) {
    (void)config;
    return ESP_OK;
}
esp_err_t ledc_channel_config(const ledc_channel_config_t *config) {
    (void)config;
    return ESP_OK;
}
esp_err_t ledc_set_duty(ledc_mode_t mode, ledc_channel_t channel, uint32_t duty) {
    (void)mode;
    (void)channel;
    (void)duty;
    return ESP_OK;
}
esp_err_t ledc_update_duty(ledc_mode_t mode, ledc_channel_t channel) {
    (void)mode;
    (void)channel;
    return ESP_OK;
}
