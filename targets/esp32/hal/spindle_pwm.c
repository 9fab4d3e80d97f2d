/* SPDX-License-Identifier: MIT */
#include "hal/spindle_pwm.h"

#include "io/outputs.h"

#include "driver/mcpwm_prelude.h"
#include "freertos/FreeRTOS.h"
#include "freertos/task.h"

#define PERIODS_TICKS pdMS_TO_TICKS(2) /* 1 ms at least: five periods */

static bool make_timer(mcpwm_timer_handle_t *timer) {
    const mcpwm_timer_config_t config = {.group_id = 0,
                                         .clk_src = MCPWM_TIMER_CLK_SRC_DEFAULT,
                                         .resolution_hz = SPINDLE_PWM_CLOCK_HZ,
                                         .count_mode = MCPWM_TIMER_COUNT_MODE_UP,
                                         .period_ticks = SPINDLE_PWM_PERIOD};
    return mcpwm_new_timer(&config, timer) == ESP_OK;
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
    mcpwm_timer_handle_t timer;
    mcpwm_oper_handle_t oper;
    mcpwm_cmpr_handle_t compare;
    if (!make_timer(&timer) || !make_comparator(timer, &oper, &compare))
        return false;
    spindle_pwm_set(SPINDLE_PWM_DARK);
    if (mcpwm_timer_enable(timer) != ESP_OK ||
        mcpwm_timer_start_stop(timer, MCPWM_TIMER_START_NO_STOP) != ESP_OK)
        return false;
    vTaskDelay(
        PERIODS_TICKS); /* the comparator takes it at the end of a period: before the pin can show one */
    return make_generator(oper, compare, wire);
}
