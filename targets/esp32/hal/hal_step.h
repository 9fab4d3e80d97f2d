/* SPDX-License-Identifier: MIT
 * Hot tier of the ESP32 and ESP32-S3: timer 0 of timer group 0, and the GPIO registers, the RMT peripheral or
 * shift registers for the step pulses, as the board chose (`[step] engine`). Contract: core/hal/README.md.
 *
 * Registers are written whole: one store each, no read-modify-write. The timer counts up from 0 at every
 * start and is compared with an absolute alarm, so intervals add up without drift; an alarm that has passed
 * already fires immediately (ESP-IDF Programming Guide, GPTimer, alarm_count). Active-low step and direction
 * lines of GPIO pins are inverted by the GPIO matrix, not here. */
#ifndef WIFICNC_HAL_STEP_H
#define WIFICNC_HAL_STEP_H

#include "base/axis.h"
#include "hal/compiler.h"
#include "hal/spindle_pwm.h"
#include "pin_config.h"
#include "step_pins.h"

#include "esp_attr.h"
#include "esp_cpu.h"
#include "soc/gpio_struct.h"
#include "soc/timer_group_struct.h"

#include <stdbool.h>
#include <stdint.h>

#define HAL_ISR IRAM_ATTR

/* TIMG_T0CONFIG_REG (technical reference manuals, chapter Timer Group): bits that both chips have. LEVEL_INT
 * exists on the ESP32 only; the S3 ignores it. */
#define STEP_TIMER_ALARM     (1u << 10)
#define STEP_TIMER_LEVEL_INT (1u << 11)
#define STEP_TIMER_DIVIDE(n) ((uint32_t)(n) << 13)
#define STEP_TIMER_UP        (1u << 30)
#define STEP_TIMER_RUN       (1u << 31)

/** TIMG_INT_*_TIMERS_REG: bit of timer 0. */
#define STEP_TIMER_INTERRUPT 1u

struct step_engine_board;

/** Step timer and pins. In internal RAM; filled by step_engine_init(). The tables come last: an instruction
 * reaches 1020 bytes from a pointer. */
struct hal_step {
    uint32_t timer_rests; /* T0CONFIG while the timer is stopped */
    uint32_t timer_runs;  /* the same with RUN and ALARM */
    uint32_t alarm_low, alarm_high;
    /* CPU cycles. The lengths are changed at rest only */
    uint32_t pulse_cycles;         /* from write to write: a step pulse, and the pause behind it */
    uint32_t dir_setup_cycles;     /* from a change of direction to the next pulse */
    uint32_t dir_quiet_cycles;     /* the longer of both */
    uint32_t pulse_end_cycles;     /* RMT: from a start until the line is low again, at most */
    uint32_t rmt_rewind, rmt_rest; /* RMT: a channel's configuration word, with and without rewinding it */
    uint32_t i2s_pulse_words;      /* I2S: of a pulse, and of a pause */
    uint32_t i2s_setup_words;      /* I2S: with a new direction, before a pulse can follow */
    uint32_t shift_inverted;       /* shift registers: step and direction lines that are active low */
    uint32_t shift_lines;          /* shift registers: those lines without a pulse */
    uint32_t shift_shown;          /* shift registers: the last word without a pulse that was put */
    uint32_t shifted; /* shift registers: the other outputs of the registers; any task changes bits of it */
    uint32_t set_at;  /* when the present pulse began */
    uint32_t quiet_at, quiet;          /* no pulse begins within `quiet` cycles of this moment */
    axis_mask_t axes;                  /* of the newest event */
    axis_mask_t negative;              /* axes whose direction line says so */
    const volatile uint32_t *probe_in; /* input register of the probe's bank */
    uint32_t probe_mask;               /* the probe's bit; 0 = no probe */
    uint32_t probe_level;              /* (*probe_in & probe_mask) while it touches */
    const struct step_engine_board *board;
    axis_mask_t step_inverted;  /* RMT: by the GPIO matrix */
    unsigned held;              /* RMT: motors that make no steps, bit n = motor n */
    struct pin_bits step_lines; /* of all motors, whichever make steps */
    struct step_pins pins;
};

/* The interrupt's cause ends. Behind the step lines, so that nothing is on the bus before them. */
static HAL_INLINE void step_alarm_seen(void) {
    TIMERG0.int_clr_timers.val = STEP_TIMER_INTERRUPT;
}

/* Shift registers: all outputs without a pulse. */
static HAL_INLINE uint32_t step_shift_rest(const struct hal_step *hal) {
    return __atomic_load_n(&hal->shifted, __ATOMIC_RELAXED) | hal->shift_lines;
}

#if BOARD_STEP_ENGINE == BOARD_STEP_ENGINE_I2S
#include "hal/pulse_i2s.h"
#elif BOARD_STEP_ENGINE == BOARD_STEP_ENGINE_SPI
#include "hal/pulse_spi.h"
#elif BOARD_STEP_ENGINE == BOARD_STEP_ENGINE_RMT
#include "hal/pulse_rmt.h"

#include "hal/direction_gpio.h"
#else
#include "hal/pulse_gpio.h"

#include "hal/direction_gpio.h"
#endif

static HAL_INLINE void hal_step_duty(struct hal_step *hal, uint32_t value) {
    (void)hal;
    spindle_pwm_set(value);
}

static HAL_INLINE void hal_step_direction(struct hal_step *hal, axis_mask_t negative) {
    if (negative == hal->negative)
        return;
    step_direction_put(hal, negative);
    hal->negative = negative;
}

static HAL_INLINE bool hal_step_probe(const struct hal_step *hal) {
    return (*hal->probe_in & hal->probe_mask) == hal->probe_level;
}

/* The counter's low word wraps: every 214 s of motion at 20 MHz. */
HAL_ISR HAL_SELDOM static void step_alarm_wraps(struct hal_step *hal) {
    TIMERG0.hw_timer[0].alarmhi.val = ++hal->alarm_high;
}

/* @param ticks  below 2^31 */
static HAL_INLINE void hal_step_timer_next(struct hal_step *hal, uint32_t ticks) {
    uint32_t before = hal->alarm_low, alarm = before + ticks;
    if ((int32_t)alarm >= 0 && (int32_t)before < 0)
        step_alarm_wraps(hal);
    hal->alarm_low = alarm;
    TIMERG0.hw_timer[0].alarmlo.val = alarm;
    TIMERG0.hw_timer[0].config.val = hal->timer_runs;
}

static HAL_INLINE void hal_step_timer_stop(struct hal_step *hal) {
    TIMERG0.hw_timer[0].config.val = hal->timer_rests;
    step_alarm_seen();
}

static HAL_INLINE void hal_step_timer_start(struct hal_step *hal, uint32_t ticks) {
    TIMERG0.hw_timer[0].config.val = hal->timer_rests;
    TIMERG0.hw_timer[0].loadhi.val = 0;
    TIMERG0.hw_timer[0].loadlo.val = 0;
    TIMERG0.hw_timer[0].load.val = 1; /* any value: the counter takes loadlo and loadhi */
    TIMERG0.hw_timer[0].alarmhi.val = hal->alarm_high = 0;
    hal->alarm_low = 0;
    hal_step_timer_next(hal, ticks);
}

static HAL_INLINE void hal_step_span(struct hal_step *hal, uint16_t flags, uint32_t line) {
    (void)hal;
    (void)flags;
    (void)line;
}

#endif
