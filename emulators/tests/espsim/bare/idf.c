/* SPDX-License-Identifier: MIT
 * ESP-IDF's functions that the step engine calls, on the ESP32's registers; and a HAL without inputs and
 * outputs. */
#include "bare.h"
#include "hal/step_vector.h"

#include "driver/gpio.h"
#include "esp_intr_alloc.h"
#include "esp_private/periph_ctrl.h"
#include "esp_rom_gpio.h"
#include "hal/i2s_ll.h"
#include "hal/timer_ll.h"
#include "sdkconfig.h"

enum { CYCLES_PER_US = 240, LEVEL5 = 26, TIMER0 = 6, INVERTS = 1 << 9 };

/* The interrupt matrix, the source of timer 0 of group 0 (the small headers have the ESP32's for both), and
 * the GPIO matrix. */
#if CONFIG_IDF_TARGET_ESP32
#define MATRIX       ((volatile uint32_t *)(is_core1() ? 0x3FF00218 : 0x3FF00104))
#define STEP_SOURCE  14
#define FUNC_OUT_SEL ((volatile uint32_t *)0x3FF44530)
#else
#define MATRIX       ((volatile uint32_t *)(is_core1() ? 0x600C2800 : 0x600C2000))
#define STEP_SOURCE  50
#define FUNC_OUT_SEL ((volatile uint32_t *)0x60004554)
#endif

mcpwm_dev_t MCPWM0; /* in RAM: no spindle is on it */

static bool is_core1(void) {
    uint32_t id;
    __asm__ volatile("rsr %0, prid" : "=r"(id));
    return id == 0xABAB;
}

/* ---- ESP-IDF ---- */

esp_err_t esp_intr_alloc(int source, int flags, intr_handler_t handler, void *arg, intr_handle_t *handle) {
    (void)source;
    (void)flags;
    (void)handler;
    (void)arg;
    (void)handle;
    MATRIX[STEP_SOURCE] = LEVEL5;
    __asm__ volatile("wsr %0, intenable\n\trsync" ::"r"(1u << LEVEL5 | 1u << TIMER0));
    return ESP_OK;
}

esp_err_t gpio_set_level(gpio_num_t gpio, uint32_t level) {
    const uint32_t bit = 1u << (unsigned)gpio % 32;
    if (gpio < 32 && level != 0)
        GPIO.out_w1ts = bit;
    else if (gpio < 32)
        GPIO.out_w1tc = bit;
    else if (level != 0)
        GPIO.out1_w1ts.val = bit;
    else
        GPIO.out1_w1tc.val = bit;
    return ESP_OK;
}

/* Outputs. */
esp_err_t gpio_config(const gpio_config_t *config) {
    GPIO.enable_w1ts = (uint32_t)config->pin_bit_mask;
    GPIO.enable1_w1ts.val = (uint32_t)(config->pin_bit_mask >> 32);
    return ESP_OK;
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

void esp_rom_gpio_connect_out_signal(uint32_t gpio, uint32_t signal, bool inverted, bool enable_inverted) {
    (void)enable_inverted;
    FUNC_OUT_SEL[gpio] = signal | (inverted ? INVERTS : 0);
}

uint8_t periph_rcc_acquire_enter(periph_module_t module) {
    (void)module;
    return 0;
}

void periph_rcc_acquire_exit(periph_module_t module, uint8_t users) {
    (void)module;
    (void)users;
}

void timer_ll_enable_bus_clock(int group, bool enable) {
    (void)group;
    (void)enable;
}

void timer_ll_reset_register(int group) {
    (void)group;
}

void timer_ll_enable_clock(int group, uint32_t timer, bool enable) {
    (void)group;
    (void)timer;
    (void)enable;
}

void timer_ll_set_clock_source(int group, uint32_t timer, gptimer_clock_source_t source) {
    (void)group;
    (void)timer;
    (void)source;
}

void timer_ll_enable_intr(timg_dev_t *hw, uint32_t mask, bool enable) {
    hw->int_ena_timers.val = enable ? mask : 0;
}

/* ---- HAL ---- */

static void output(uint8_t gpio) {
    if (gpio < 32)
        GPIO.enable_w1ts = 1u << gpio;
    else if (gpio < 64)
        GPIO.enable1_w1ts.val = 1u << (gpio - 32);
}

void bare_outputs(const struct step_engine_board *board) {
    for (unsigned motor = 0; motor < AXIS_COUNT; motor++) {
        output(board->step_gpio[motor]);
        output(board->dir_gpio[motor]);
    }
}

/* Cores' CCOUNTs have begun at different moments. */
uint32_t hal_time_us(const struct hal *hal) {
    struct hal *now = (struct hal *)hal;
    if (hal->two_cores)
        return bare_timer_us();
    const uint32_t cycles = esp_cpu_get_cycle_count();
    now->cycles += cycles - now->seen_cycles;
    now->seen_cycles = cycles;
    return (uint32_t)(now->cycles / CYCLES_PER_US);
}

void bare_wait_until(struct hal *hal, uint32_t us) {
    for (int32_t left; (left = (int32_t)(us - hal_time_us(hal))) > 0;) {
        const uint32_t at = esp_cpu_get_cycle_count() + (uint32_t)left * CYCLES_PER_US;
        __asm__ volatile("wsr %0, ccompare0\n\trsync\n\twaiti 0" ::"r"(at));
    }
}

struct duty_register hal_spindle_pwm(struct hal *hal, uint32_t hz) {
    (void)hal;
    (void)hz;
    return (struct duty_register){0};
}

void hal_spindle_set(struct hal *hal, const struct hal_spindle *spindle) {
    (void)hal;
    (void)spindle;
}

void hal_coolant_set(struct hal *hal, uint8_t bits) {
    (void)hal;
    (void)bits;
}

void hal_digital_set(struct hal *hal, uint8_t bits) {
    (void)hal;
    (void)bits;
}

void hal_motors_set(struct hal *hal, bool on, bool invert) {
    (void)hal;
    (void)on;
    (void)invert;
}

void hal_estop(struct hal *hal, bool invert, uint16_t dark) {
    (void)hal;
    (void)invert;
    (void)dark;
}

/* Nothing is wired: no switch is closed. */
void hal_inputs_read(const struct hal *hal, struct hal_inputs *inputs) {
    (void)hal;
    *inputs = (struct hal_inputs){.probe = true};
}

void hal_switch_timer_start(struct hal *hal, uint32_t us) {
    (void)hal;
    (void)us;
}

void hal_probe_watch(struct hal *hal, enum hal_probe probe, bool high) {
    (void)hal;
    (void)probe;
    (void)high;
}
