/* SPDX-License-Identifier: MIT
 * What the programs with emulated registers need of ESP-IDF and of the firmware, and that does nothing there.
 */
#include "hal/chip_hal.h"
#include "hal/spindle_pwm.h"

#include "esp_private/periph_ctrl.h"
#include "esp_private/rmt.h"
#include "freertos/FreeRTOS.h"
#include "hal/i2s_ll.h"
#include "hal/spi_ll.h"
#include "hal/timer_ll.h"

#include <stdio.h>
#include <stdlib.h>

/* ---- ESP-IDF ---- */

esp_err_t rmt_get_channel_id(rmt_channel_handle_t channel, int *id) {
    *id = (int)(uintptr_t)channel - 1;
    return ESP_OK;
}
esp_err_t rmt_get_channel_resolution(rmt_channel_handle_t channel, uint32_t *resolution_hz) {
    (void)channel;
    *resolution_hz = 80000000;
    return ESP_OK;
}
esp_err_t rmt_enable(rmt_channel_handle_t channel) {
    (void)channel;
    return ESP_OK;
}
uint8_t periph_rcc_acquire_enter(periph_module_t module) {
    return (uint8_t)module;
}
void periph_rcc_acquire_exit(periph_module_t module, uint8_t users) {
    (void)module;
    (void)users;
}
void periph_rcc_enter(void) {}
void periph_rcc_exit(void) {}
void i2s_ll_enable_bus_clock(int port, bool enable) {
    (void)port;
    (void)enable;
}
void i2s_ll_reset_register(int port) {
    (void)port;
}
void spi_ll_enable_bus_clock(spi_host_device_t host, bool enable) {
    (void)host, (void)enable;
}
void spi_ll_reset_register(spi_host_device_t host) {
    (void)host;
}
void timer_ll_enable_bus_clock(int group, bool enable) {
    (void)group;
    (void)enable;
}
void timer_ll_reset_register(int group) {
    (void)group;
}
void timer_ll_enable_clock(int group, uint32_t number, bool enable) {
    (void)group;
    (void)number;
    (void)enable;
}
void timer_ll_set_clock_source(int group, uint32_t number, gptimer_clock_source_t source) {
    (void)group;
    (void)number;
    (void)source;
}
void timer_ll_enable_intr(timg_dev_t *hw, uint32_t mask, bool enable) {
    (void)hw;
    (void)mask;
    (void)enable;
}
void vPortEnterCritical(portMUX_TYPE *lock) {
    (void)lock;
}
void vPortExitCritical(portMUX_TYPE *lock) {
    (void)lock;
}
void _esp_error_check_failed(esp_err_t code, const char *file, int line, const char *function,
                             const char *expression) {
    printf("%s:%d %s: %s is %d\n", file, line, function, expression, code);
    exit(1);
}

/* ---- the firmware ---- */

void encoder_read(struct encoder *encoder, uint32_t now_us, struct hal_encoder_state *state) {
    (void)encoder;
    (void)now_us;
    (void)state;
}
void encoder_index_isr(struct encoder *encoder) {
    (void)encoder;
}
bool spindle_pwm_init(const struct output_wire *wire) {
    (void)wire;
    return true;
}
struct duty_register spindle_pwm_tune(uint32_t hz) {
    (void)hz;
    return (struct duty_register){.dark = 0, .least = 1, .full = 1000};
}
