/* SPDX-License-Identifier: MIT
 * ESP-IDF's LED PWM, for programs that set a servo up and do not look at it. */
#include "driver/ledc.h"

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
