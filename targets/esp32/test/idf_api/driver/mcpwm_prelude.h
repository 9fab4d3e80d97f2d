/* SPDX-License-Identifier: MIT
 * What we use of ESP-IDF 5.5's driver/mcpwm_prelude.h, declared again: enough to compile against, checked
 * against the real one by tools/xtensa with IDF_PATH set. */
#pragma once

#include "esp_err.h"

#include <stdint.h>

typedef struct mcpwm_timer_t *mcpwm_timer_handle_t;
typedef struct mcpwm_oper_t *mcpwm_oper_handle_t;
typedef struct mcpwm_cmpr_t *mcpwm_cmpr_handle_t;
typedef struct mcpwm_gen_t *mcpwm_gen_handle_t;

typedef enum { MCPWM_TIMER_CLK_SRC_DEFAULT } mcpwm_timer_clock_source_t;
typedef enum { MCPWM_TIMER_COUNT_MODE_PAUSE, MCPWM_TIMER_COUNT_MODE_UP } mcpwm_timer_count_mode_t;
typedef enum { MCPWM_TIMER_DIRECTION_UP } mcpwm_timer_direction_t;
typedef enum { MCPWM_TIMER_EVENT_EMPTY, MCPWM_TIMER_EVENT_FULL } mcpwm_timer_event_t;
typedef enum { MCPWM_GEN_ACTION_KEEP, MCPWM_GEN_ACTION_LOW, MCPWM_GEN_ACTION_HIGH } mcpwm_generator_action_t;
typedef enum {
    MCPWM_TIMER_STOP_EMPTY,
    MCPWM_TIMER_STOP_FULL,
    MCPWM_TIMER_START_NO_STOP
} mcpwm_timer_start_stop_cmd_t;

typedef struct {
    int group_id;
    mcpwm_timer_clock_source_t clk_src;
    uint32_t resolution_hz;
    mcpwm_timer_count_mode_t count_mode;
    uint32_t period_ticks;
} mcpwm_timer_config_t;

typedef struct {
    int group_id;
} mcpwm_operator_config_t;

typedef struct {
    struct {
        uint32_t update_cmp_on_tez : 1;
    } flags;
} mcpwm_comparator_config_t;

typedef struct {
    int gen_gpio_num;
    struct {
        uint32_t invert_pwm : 1;
    } flags;
} mcpwm_generator_config_t;

typedef struct {
    mcpwm_timer_direction_t direction;
    mcpwm_timer_event_t event;
    mcpwm_generator_action_t action;
} mcpwm_gen_timer_event_action_t;

typedef struct {
    mcpwm_timer_direction_t direction;
    mcpwm_cmpr_handle_t comparator;
    mcpwm_generator_action_t action;
} mcpwm_gen_compare_event_action_t;

#define MCPWM_GEN_TIMER_EVENT_ACTION(dir, ev, act)                                                           \
    (mcpwm_gen_timer_event_action_t) {                                                                       \
        dir, ev, act                                                                                         \
    }
#define MCPWM_GEN_COMPARE_EVENT_ACTION(dir, cmp, act)                                                        \
    (mcpwm_gen_compare_event_action_t) {                                                                     \
        dir, cmp, act                                                                                        \
    }

esp_err_t mcpwm_new_timer(const mcpwm_timer_config_t *config, mcpwm_timer_handle_t *timer);
esp_err_t mcpwm_timer_enable(mcpwm_timer_handle_t timer);
esp_err_t mcpwm_timer_start_stop(mcpwm_timer_handle_t timer, mcpwm_timer_start_stop_cmd_t command);
esp_err_t mcpwm_new_operator(const mcpwm_operator_config_t *config, mcpwm_oper_handle_t *oper);
esp_err_t mcpwm_operator_connect_timer(mcpwm_oper_handle_t oper, mcpwm_timer_handle_t timer);
esp_err_t mcpwm_new_comparator(mcpwm_oper_handle_t oper, const mcpwm_comparator_config_t *config,
                               mcpwm_cmpr_handle_t *comparator);
esp_err_t mcpwm_new_generator(mcpwm_oper_handle_t oper, const mcpwm_generator_config_t *config,
                              mcpwm_gen_handle_t *generator);
esp_err_t mcpwm_generator_set_action_on_timer_event(mcpwm_gen_handle_t generator,
                                                    mcpwm_gen_timer_event_action_t action);
esp_err_t mcpwm_generator_set_action_on_compare_event(mcpwm_gen_handle_t generator,
                                                      mcpwm_gen_compare_event_action_t action);
