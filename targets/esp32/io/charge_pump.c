/* SPDX-License-Identifier: MIT */
#include "io/charge_pump.h"

#include "pin_config.h"

#include "freertos/FreeRTOS.h" /* before esp_freertos_hooks.h, which does not compile without it */

#include "driver/ledc.h"
#include "esp_attr.h"
#include "esp_freertos_hooks.h"
#include "esp_rom_gpio.h"
#include "soc/gpio_sig_map.h"

/* Clock of the timers, its divider's fraction, and levels of the PWM: a wave is as many ticks of
 * BOARD_PUMP_CLOCK_HZ as the divider says. Timers of the S3 have one clock, which is the servo's, too. */
#define APB_HZ      80000000u
#define FRACTION    256u
#define LEVELS_BITS 10
#define LEVELS      (1u << LEVELS_BITS)
#define MODE        LEDC_LOW_SPEED_MODE
#define TIMER       LEDC_TIMER_2
#define CHANNEL     LEDC_CHANNEL_2
#define WAVE        (LEDC_LS_SIG_OUT0_IDX + 2)
_Static_assert(APB_HZ / LEVELS * FRACTION == BOARD_PUMP_CLOCK_HZ, "a tick is one of the divider");
_Static_assert(BOARD_PUMP_TICKS_MIN >= FRACTION, "the divider's smallest value is 1");

enum { LATE_TICKS = pdMS_TO_TICKS(CHARGE_PUMP_LATE_MS) };

static struct {
    uint8_t pin;
    bool active_low;
    bool on;      /* wanted */
    bool shown;   /* the pin has the wave */
    uint8_t left; /* ticks of FreeRTOS */
} pump;

/* The pin's own level is off (outputs_make_safe()), so that without the wave it rests there. */
static void IRAM_ATTR show(bool wave) {
    pump.shown = wave;
    esp_rom_gpio_connect_out_signal(pump.pin, wave ? WAVE : SIG_GPIO_OUT_IDX, wave && pump.active_low, false);
}

/* [isr of core 0] Also while flash is written: nothing here lies in it. */
static void IRAM_ATTR watch(void) {
    const uint8_t left = __atomic_load_n(&pump.left, __ATOMIC_RELAXED);
    if (left > 0)
        __atomic_store_n(&pump.left, (uint8_t)(left - 1), __ATOMIC_RELAXED);
    const bool wave = left > 0 && __atomic_load_n(&pump.on, __ATOMIC_ACQUIRE);
    if (wave != pump.shown)
        show(wave);
}

bool charge_pump_init(const struct output_wire *wire) {
    const ledc_timer_config_t timer = {.speed_mode = MODE,
                                       .duty_resolution = (ledc_timer_bit_t)LEVELS_BITS,
                                       .timer_num = TIMER,
                                       .freq_hz = BOARD_PUMP_DEFAULT_HZ,
                                       .clk_cfg = LEDC_USE_APB_CLK};
    const ledc_channel_config_t channel = {.gpio_num = wire->pin,
                                           .speed_mode = MODE,
                                           .channel = CHANNEL,
                                           .timer_sel = TIMER,
                                           .duty = 0, /* no wave until the pin is taken off it */
                                           .flags = {.output_invert = !wire->active_high}};
    pump.pin = wire->pin;
    pump.active_low = !wire->active_high;
    if (ledc_timer_config(&timer) != ESP_OK || ledc_channel_config(&channel) != ESP_OK)
        return false;
    show(false);
    if (ledc_set_duty(MODE, CHANNEL, LEVELS / 2) != ESP_OK || ledc_update_duty(MODE, CHANNEL) != ESP_OK)
        return false;
    return esp_register_freertos_tick_hook_for_cpu(watch, 0) == ESP_OK;
}

/* ESP-IDF calls it deprecated, but its other functions take whole hertz, and waves lie between them. */
static void set_divider(uint32_t ticks) {
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wdeprecated-declarations"
    (void)ledc_timer_set(MODE, TIMER, ticks, LEVELS_BITS, LEDC_APB_CLK);
#pragma GCC diagnostic pop
}

void charge_pump_set(uint32_t ticks) {
    if (ticks > 0)
        set_divider(ticks);
    __atomic_store_n(&pump.on, ticks > 0, __ATOMIC_RELEASE);
}

void IRAM_ATTR charge_pump_beat(void) {
    __atomic_store_n(&pump.left, (uint8_t)LATE_TICKS, __ATOMIC_RELAXED);
}
