/* SPDX-License-Identifier: MIT
 * What we use of ESP-IDF 5.5's driver/ledc.h, declared again: enough to compile against, checked against the
 * real one by tools/xtensa with IDF_PATH set. */
#pragma once

#include "esp_err.h"

#include <stdbool.h>

#if CONFIG_IDF_TARGET_ESP32
typedef enum { LEDC_HIGH_SPEED_MODE, LEDC_LOW_SPEED_MODE } ledc_mode_t;
#else
typedef enum { LEDC_LOW_SPEED_MODE } ledc_mode_t;
#endif
typedef enum { LEDC_TIMER_0, LEDC_TIMER_1, LEDC_TIMER_2 } ledc_timer_t;
typedef enum { LEDC_CHANNEL_0, LEDC_CHANNEL_1, LEDC_CHANNEL_2 } ledc_channel_t;
typedef enum { LEDC_TIMER_13_BIT = 13, LEDC_TIMER_14_BIT = 14 } ledc_timer_bit_t;
typedef enum { LEDC_AUTO_CLK, LEDC_USE_APB_CLK } ledc_clk_cfg_t;
typedef enum { LEDC_APB_CLK = LEDC_USE_APB_CLK } ledc_clk_src_t;

typedef struct {
    ledc_mode_t speed_mode;
    ledc_timer_bit_t duty_resolution;
    ledc_timer_t timer_num;
    uint32_t freq_hz;
    ledc_clk_cfg_t clk_cfg;
} ledc_timer_config_t;

typedef struct {
    int gpio_num;
    ledc_mode_t speed_mode;
    ledc_channel_t channel;
    ledc_timer_t timer_sel;
    uint32_t duty;
    struct {
        unsigned int output_invert : 1;
    } flags;
} ledc_channel_config_t;

__attribute__((deprecated)) esp_err_t ledc_timer_set(ledc_mode_t mode, ledc_timer_t timer, uint32_t divider,
                                                     uint32_t bits, ledc_clk_src_t source);
esp_err_t ledc_timer_config(const ledc_timer_config_t *config);
esp_err_t ledc_channel_config(const ledc_channel_config_t *config);
esp_err_t ledc_set_duty(ledc_mode_t mode, ledc_channel_t channel, uint32_t duty);
esp_err_t ledc_update_duty(ledc_mode_t mode, ledc_channel_t channel);
