/* SPDX-License-Identifier: MIT
 * What we use of ESP-IDF 5.5's soc/mcpwm_struct.h, declared again: enough to compile against, checked
 * against the real one by tools/xtensa with IDF_PATH set. */
#pragma once

#include <stdint.h>

/* Technical reference manuals, MCPWM register summary. */
typedef struct {
    uint32_t val;
} mcpwm_word_t;

typedef struct mcpwm_dev_t {
    mcpwm_word_t clock;
    volatile struct {
        mcpwm_word_t timer_cfg0, timer_cfg1, timer_sync, timer_status;
    } timer[3];
    mcpwm_word_t synchronisation, operator_timer;
    volatile struct {
        mcpwm_word_t update;
        mcpwm_word_t timestamp[2];
        mcpwm_word_t others[11];
    } operators[3];
} mcpwm_dev_t;

extern mcpwm_dev_t MCPWM0;
