/* SPDX-License-Identifier: MIT
 * The spindle's PWM at every frequency of $33, with a driver that shows what the firmware asks of it, and the
 * registers as memory. */
#include "hal/spindle_pwm.h"

#include "check.h"
#include "wires.h"

#include "driver/mcpwm_prelude.h"
#include "freertos/task.h"

#include <stdlib.h>

enum { MIN_HZ = 50, MAX_HZ = 50000, DRIVERS_PRESCALE = 2 };

mcpwm_dev_t MCPWM0;

static struct {
    uint32_t prescale, counts; /* that the stopped timer has begun with */
    bool runs;
    unsigned starts;
    uint32_t waited_ticks;
} timer;

static uint32_t cfg0(void) {
    return MCPWM0.timer[0].timer_cfg0.val;
}

static void begin(void) {
    timer.prescale = (cfg0() & 0xFF) + 1;
    timer.counts = (cfg0() >> 8 & 0xFFFF) + 1;
    timer.runs = true;
    timer.starts++;
}

static uint32_t compare(void) {
    return MCPWM0.operators[0].timestamp[0].val;
}

/* Of the 80 MHz that the driver has made with its own divider. */
static double running_hz(void) {
    return 80e6 * DRIVERS_PRESCALE / timer.prescale / timer.counts;
}

esp_err_t mcpwm_new_timer(const mcpwm_timer_config_t *config, mcpwm_timer_handle_t *handle) {
    CHECK(config->resolution_hz == 80000000 && config->count_mode == MCPWM_TIMER_COUNT_MODE_UP);
    MCPWM0.timer[0].timer_cfg0.val = (DRIVERS_PRESCALE - 1) | (config->period_ticks - 1) << 8;
    *handle = NULL;
    return ESP_OK;
}

esp_err_t mcpwm_timer_enable(mcpwm_timer_handle_t handle) {
    (void)handle;
    return ESP_OK;
}

/* Divider and period change only between the two. */
esp_err_t mcpwm_timer_start_stop(mcpwm_timer_handle_t handle, mcpwm_timer_start_stop_cmd_t command) {
    (void)handle;
    CHECK(compare() == PWM_NEVER);
    if (command == MCPWM_TIMER_START_NO_STOP) {
        CHECK(!timer.runs);
        begin();
        return ESP_OK;
    }
    CHECK(command == MCPWM_TIMER_STOP_EMPTY && timer.runs);
    CHECK(timer.prescale == (cfg0() & 0xFF) + 1 && timer.counts == (cfg0() >> 8 & 0xFFFF) + 1);
    timer.waited_ticks = 0;
    timer.runs = false; /* at the end of its period */
    return ESP_OK;
}

void vTaskDelay(TickType_t ticks) {
    timer.waited_ticks += ticks;
}

esp_err_t mcpwm_new_operator(const mcpwm_operator_config_t *config, mcpwm_oper_handle_t *oper) {
    (void)config;
    *oper = NULL;
    return ESP_OK;
}

esp_err_t mcpwm_operator_connect_timer(mcpwm_oper_handle_t oper, mcpwm_timer_handle_t handle) {
    (void)oper;
    (void)handle;
    return ESP_OK;
}

esp_err_t mcpwm_new_comparator(mcpwm_oper_handle_t oper, const mcpwm_comparator_config_t *config,
                               mcpwm_cmpr_handle_t *comparator) {
    (void)oper;
    CHECK(config->flags.update_cmp_on_tez);
    *comparator = NULL;
    return ESP_OK;
}

esp_err_t mcpwm_new_generator(mcpwm_oper_handle_t oper, const mcpwm_generator_config_t *config,
                              mcpwm_gen_handle_t *generator) {
    (void)oper;
    CHECK(config->flags.invert_pwm == 0 && compare() == PWM_NEVER && timer.runs);
    *generator = NULL;
    return ESP_OK;
}

esp_err_t mcpwm_generator_set_action_on_timer_event(mcpwm_gen_handle_t generator,
                                                    mcpwm_gen_timer_event_action_t action) {
    (void)generator;
    CHECK(action.event == MCPWM_TIMER_EVENT_FULL && action.action == MCPWM_GEN_ACTION_LOW);
    return ESP_OK;
}

esp_err_t mcpwm_generator_set_action_on_compare_event(mcpwm_gen_handle_t generator,
                                                      mcpwm_gen_compare_event_action_t action) {
    (void)generator;
    CHECK(action.action == MCPWM_GEN_ACTION_HIGH);
    return ESP_OK;
}

void _esp_error_check_failed(esp_err_t code, const char *file, int line, const char *function,
                             const char *expression) {
    printf("%s:%d: %s: %s: %d\n", file, line, function, expression, code);
    exit(1);
}

static void at_power_on(void) {
    const struct output_wire wire = {.pin = 38, .active_high = true};
    CHECK(spindle_pwm_init(&wire));
    const unsigned starts = timer.starts;
    const struct duty_register pwm = spindle_pwm_tune(5000);
    CHECK(timer.starts == starts); /* it runs like that already: nothing is touched */
    CHECK(timer.counts == 16000 && timer.prescale == DRIVERS_PRESCALE);
    CHECK(pwm.dark > timer.counts && pwm.least == timer.counts - 2 && pwm.full == 0);
}

static void at_each_frequency(void) {
    for (uint32_t hz = MIN_HZ, before = 5000; hz <= MAX_HZ; before = hz, hz += 1 + hz / 50) {
        const struct duty_register pwm = spindle_pwm_tune(hz);
        CHECK(running_hz() > hz * 0.999 && running_hz() < hz * 1.001);
        CHECK(timer.counts >= 1000 && pwm.dark > timer.counts && compare() == pwm.dark);
        CHECK(pwm.least == timer.counts - 2 && pwm.full == 0);
        CHECK(timer.waited_ticks * 1000.0 / CONFIG_FREERTOS_HZ >= 1000.0 / before); /* a period of the old */
        spindle_pwm_set(timer.counts / 2);
        (void)spindle_pwm_tune(hz);
        CHECK(compare() == timer.counts / 2); /* no change, so not dark */
    }
}

int main(void) {
    at_power_on();
    at_each_frequency();
    return report();
}
