/* SPDX-License-Identifier: MIT */
#include "io/switch_timer.h"

#include "hal/hal_step.h"

#include "esp_intr_alloc.h"
#include "hal/timer_ll.h"
#include "soc/interrupts.h"

#include <stddef.h>

/* Timer 1 of the step timer's group. Divided by 80, so that a tick is 1 us. */
#define APB_MHZ          80u
#define RESTS            (STEP_TIMER_UP | STEP_TIMER_LEVEL_INT | STEP_TIMER_DIVIDE(APB_MHZ))
#define RUNS             (RESTS | STEP_TIMER_RUN | STEP_TIMER_ALARM)
#define SWITCH_INTERRUPT (1u << 1)

HAL_ISR void switch_timer_start(uint32_t us) {
    TIMERG0.hw_timer[1].config.val = RESTS;
    TIMERG0.hw_timer[1].loadhi.val = 0;
    TIMERG0.hw_timer[1].loadlo.val = 0;
    TIMERG0.hw_timer[1].load.val = 1; /* any value: the counter takes loadlo and loadhi */
    TIMERG0.hw_timer[1].alarmhi.val = 0;
    TIMERG0.hw_timer[1].alarmlo.val = us;
    TIMERG0.int_clr_timers.val = SWITCH_INTERRUPT;
    /* An alarm of the time before was cleared while the timer rests, so that it cannot count for this one. */
    TIMERG0.hw_timer[1].config.val = RUNS;
}

HAL_ISR void switch_timer_stop(void) {
    TIMERG0.hw_timer[1].config.val = RESTS;
    TIMERG0.int_clr_timers.val = SWITCH_INTERRUPT;
}

bool switch_timer_init(void (*handler)(void *arg), void *arg) {
    const int flags = ESP_INTR_FLAG_IRAM | ESP_INTR_FLAG_LEVEL3; /* as the inputs': they never nest */
    timer_ll_enable_clock(0, 1, true);
    timer_ll_set_clock_source(0, 1, GPTIMER_CLK_SRC_APB);
    switch_timer_stop();
    if (esp_intr_alloc(ETS_TG0_T1_LEVEL_INTR_SOURCE, flags, handler, arg, NULL) != ESP_OK)
        return false;
    timer_ll_enable_intr(&TIMERG0, TIMER_LL_EVENT_ALARM(1), true);
    return true;
}
