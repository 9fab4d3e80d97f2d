/* SPDX-License-Identifier: MIT */
#include "hal/spindle_pwm.h"

#include "io/outputs.h"

#include "driver/mcpwm_prelude.h"
#include "freertos/FreeRTOS.h"
#include "freertos/task.h"

#define START_HZ      5000u            /* until $33 is there */
#define PERIODS_TICKS pdMS_TO_TICKS(2) /* 1 ms at least: five periods */

#define CFG0_PRESCALE 0xFFu /* minus 1; taken where the timer stops and starts */
#define CFG0_PERIOD   8u    /* minus 1; immediately, as the driver has left it */

static struct {
    mcpwm_timer_handle_t timer;
    uint32_t hz;
    uint32_t prescale; /* of the driver, for SPINDLE_PWM_CLOCK_HZ */
} pwm;

static bool make_timer(mcpwm_timer_handle_t *timer) {
    const mcpwm_timer_config_t config = {.group_id = 0,
                                         .clk_src = MCPWM_TIMER_CLK_SRC_DEFAULT,
                                         .resolution_hz = SPINDLE_PWM_CLOCK_HZ,
                                         .count_mode = MCPWM_TIMER_COUNT_MODE_UP,
                                         .period_ticks = SPINDLE_PWM_CLOCK_HZ / START_HZ};
    if (mcpwm_new_timer(&config, timer) != ESP_OK)
        return false;
    pwm.prescale = (MCPWM0.timer[0].timer_cfg0.val & CFG0_PRESCALE) + 1;
    pwm.hz = START_HZ;
    return true;
}

static bool make_comparator(mcpwm_timer_handle_t timer, mcpwm_oper_handle_t *oper,
                            mcpwm_cmpr_handle_t *compare) {
    const mcpwm_operator_config_t operator_config = {.group_id = 0};
    const mcpwm_comparator_config_t config = {.flags = {.update_cmp_on_tez = true}};
    return mcpwm_new_operator(&operator_config, oper) == ESP_OK &&
           mcpwm_operator_connect_timer(*oper, timer) == ESP_OK &&
           mcpwm_new_comparator(*oper, &config, compare) == ESP_OK;
}

static bool make_generator(mcpwm_oper_handle_t oper, mcpwm_cmpr_handle_t compare,
                           const struct output_wire *wire) {
    const mcpwm_generator_config_t config = {.gen_gpio_num = wire->pin,
                                             .flags = {.invert_pwm = !wire->active_high}};
    const mcpwm_gen_timer_event_action_t ends =
        MCPWM_GEN_TIMER_EVENT_ACTION(MCPWM_TIMER_DIRECTION_UP, MCPWM_TIMER_EVENT_FULL, MCPWM_GEN_ACTION_LOW);
    const mcpwm_gen_compare_event_action_t begins =
        MCPWM_GEN_COMPARE_EVENT_ACTION(MCPWM_TIMER_DIRECTION_UP, compare, MCPWM_GEN_ACTION_HIGH);
    mcpwm_gen_handle_t generator;
    return mcpwm_new_generator(oper, &config, &generator) == ESP_OK &&
           mcpwm_generator_set_action_on_timer_event(generator, ends) == ESP_OK &&
           mcpwm_generator_set_action_on_compare_event(generator, begins) == ESP_OK;
}

bool spindle_pwm_init(const struct output_wire *wire) {
    mcpwm_oper_handle_t oper;
    mcpwm_cmpr_handle_t compare;
    if (!make_timer(&pwm.timer) || !make_comparator(pwm.timer, &oper, &compare))
        return false;
    spindle_pwm_set(PWM_NEVER);
    if (mcpwm_timer_enable(pwm.timer) != ESP_OK ||
        mcpwm_timer_start_stop(pwm.timer, MCPWM_TIMER_START_NO_STOP) != ESP_OK)
        return false;
    vTaskDelay(
        PERIODS_TICKS); /* the comparator takes it at the end of a period: before the pin can show one */
    return make_generator(oper, compare, wire);
}

/* The divider counts from a stop on, so the timer stops at the end of a period, dark. */
static void change(const struct pwm_period *period) {
    spindle_pwm_set(PWM_NEVER);
    ESP_ERROR_CHECK(mcpwm_timer_start_stop(pwm.timer, MCPWM_TIMER_STOP_EMPTY));
    vTaskDelay(pdMS_TO_TICKS(1000u / pwm.hz) + PERIODS_TICKS);
    const uint32_t prescale = pwm.prescale << period->shift;
    MCPWM0.timer[0].timer_cfg0.val = (prescale - 1) | (period->counts - 1) << CFG0_PERIOD;
    ESP_ERROR_CHECK(mcpwm_timer_start_stop(pwm.timer, MCPWM_TIMER_START_NO_STOP));
}

struct duty_register spindle_pwm_tune(uint32_t hz) {
    const struct pwm_period period = pwm_period_of(SPINDLE_PWM_CLOCK_HZ, hz);
    if (hz != pwm.hz)
        change(&period);
    pwm.hz = hz;
    return (struct duty_register){.dark = PWM_NEVER, .least = (uint16_t)(period.counts - 2u), .full = 0};
}
