/* SPDX-License-Identifier: MIT
 * Compiled for every target: a hot entry with a wrong signature does not compile. */
#include "base/axis.h"
#include "hal/hal_step.h"

#include <stdbool.h>
#include <stdint.h>

struct hal_step_contract {
    void (*set)(struct hal_step *, axis_mask_t);
    void (*clear)(struct hal_step *);
    void (*direction)(struct hal_step *, axis_mask_t);
    bool (*probe)(const struct hal_step *);
    void (*timer_start)(struct hal_step *, uint32_t);
    void (*timer_next)(struct hal_step *, uint32_t);
    void (*timer_stop)(struct hal_step *);
    void (*span)(struct hal_step *, uint16_t, uint32_t);
};

extern const struct hal_step_contract hal_step_contract;
const struct hal_step_contract hal_step_contract = {
    .set = hal_step_set,
    .clear = hal_step_clear,
    .direction = hal_step_direction,
    .probe = hal_step_probe,
    .timer_start = hal_step_timer_start,
    .timer_next = hal_step_timer_next,
    .timer_stop = hal_step_timer_stop,
    .span = hal_step_span,
};
