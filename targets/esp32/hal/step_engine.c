/* SPDX-License-Identifier: MIT */
#include "hal/step_engine.h"

#include "hal/step_rmt.h"
#include "hal/step_shift.h"
#include "hal/step_vector.h"

#include "esp_intr_alloc.h"
#include "esp_private/periph_ctrl.h"
#include "esp_rom_gpio.h"
#include "hal/timer_ll.h"
#include "sdkconfig.h"
#include "soc/gpio_sig_map.h"
#include "soc/interrupts.h"

#include <stddef.h>

#define APB_HZ         80000000u
#define CYCLES_PER_US  ((uint32_t)CONFIG_ESP_DEFAULT_CPU_FREQ_MHZ)
#define DIVIDER_MAX    65536u /* TIMG_T0_DIVIDER */
#define BY_RMT         (BOARD_STEP_ENGINE == BOARD_STEP_ENGINE_RMT)
#define BY_I2S         (BOARD_STEP_ENGINE == BOARD_STEP_ENGINE_I2S)
#define BY_SHIFT       (BY_I2S || BOARD_STEP_ENGINE == BOARD_STEP_ENGINE_SPI)
#define BUS_CYCLES     16u /* that a write waits for the other core's, at most */
#define NO_PROBE_LEVEL 1u  /* what (anything & 0) never is */

static uint32_t cycles_of(uint32_t ns) {
    return (ns * CYCLES_PER_US + 999u) / 1000u;
}

void step_engine_watch(struct hal_step *hal, uint8_t gpio, bool high) {
    const bool wired = gpio != NO_PIN;
    hal->probe_in = wired && gpio >= PIN_BANK_WIDTH ? &GPIO.in1.val : &GPIO.in;
    hal->probe_mask = wired ? 1u << gpio % PIN_BANK_WIDTH : 0;
    hal->probe_level = !wired ? NO_PROBE_LEVEL : high ? hal->probe_mask : 0;
}

bool step_engine_init(struct hal_step *hal, const struct step_engine_board *board) {
    uint32_t divider = APB_HZ / board->timer_hz;
    /* Exact, or all speeds would be off by what the division leaves. */
    if (divider < 2 || divider > DIVIDER_MAX || divider * board->timer_hz != APB_HZ)
        return false;
    if (BY_SHIFT ? !step_shift_init(hal, board)
                 : !step_pins_set(&hal->pins, &board->gang, board->step_gpio, board->dir_gpio))
        return false;
    hal->board = board;
    if (!BY_SHIFT)
        hal->step_lines = step_pins_bits(board->step_gpio, AXIS_MASKS - 1);
    hal->timer_rests = STEP_TIMER_UP | STEP_TIMER_LEVEL_INT | STEP_TIMER_DIVIDE(divider & 0xFFFFu);
    hal->timer_runs = hal->timer_rests | STEP_TIMER_RUN | STEP_TIMER_ALARM;
    hal->dir_setup_cycles = cycles_of(board->dir_setup_ns);
    if (BY_RMT && !step_rmt_init(hal, board->step_gpio))
        return false;
    step_engine_set_pulse(hal, board->step_pulse_ns);
    step_engine_watch(hal, NO_PIN, false);
    /* The group's other timer is the switch timer (io/switch_timer.c): only the first user may reset it. */
    PERIPH_RCC_ACQUIRE_ATOMIC(PERIPH_TIMG0_MODULE, users) {
        if (users == 0) {
            timer_ll_enable_bus_clock(0, true);
            timer_ll_reset_register(0);
        }
    }
    timer_ll_enable_clock(0, 0, true);
    timer_ll_set_clock_source(0, 0, GPTIMER_CLK_SRC_APB);
    hal_step_timer_stop(hal);
    return true;
}

void step_engine_set_pulse(struct hal_step *hal, uint32_t step_pulse_ns) {
    hal->pulse_cycles = cycles_of(step_pulse_ns) + (BY_RMT ? 0 : BUS_CYCLES);
    hal->dir_quiet_cycles =
        hal->pulse_cycles > hal->dir_setup_cycles ? hal->pulse_cycles : hal->dir_setup_cycles;
    if (BY_RMT)
        step_rmt_set_pulse(hal, step_pulse_ns);
    if (BY_I2S)
        step_shift_set_pulse(hal, step_pulse_ns);
}

static void route(uint8_t gpio, unsigned signal, bool inverted) {
    if (gpio != NO_PIN)
        esp_rom_gpio_connect_out_signal(gpio, signal, inverted, false);
}

/* An axis' channel drives as many lines as the matrix sends its signal to, so a second motor needs none of
 * its own. A motor that is held has its line at the GPIO register, where it stays low. */
static void route_steps(const struct hal_step *hal) {
    const struct step_engine_board *board = hal->board;
    for (unsigned motor = 0; motor < AXIS_COUNT; motor++) {
        const unsigned axis = board->gang.axis[motor];
        if (axis == NO_AXIS)
            continue;
        const bool by_channel = BY_RMT && (hal->held >> motor & 1) == 0;
        const unsigned inverted = (hal->step_inverted >> axis ^ board->step_low >> motor) & 1u;
        route(board->step_gpio[motor], by_channel ? RMT_SIG_OUT0_IDX + axis : SIG_GPIO_OUT_IDX,
              inverted != 0);
    }
}

/* outputs_make_safe() has put active-low lines high; now the matrix does it. */
static void rest_lines(const struct hal_step *hal) {
    const struct pin_bits *high = &hal->pins.dir[hal->negative];
    const struct pin_bits *dir = &hal->pins.dir[AXIS_MASKS - 1];
    GPIO.out_w1tc = hal->step_lines.bank[0] | (dir->bank[0] & ~high->bank[0]);
    GPIO.out1_w1tc.val = hal->step_lines.bank[1] | (dir->bank[1] & ~high->bank[1]);
}

void step_engine_invert(struct hal_step *hal, axis_mask_t step, axis_mask_t dir, axis_mask_t second) {
    const struct step_engine_board *board = hal->board;
    const unsigned inverted = gang_motors(&board->gang, dir, dir ^ second) ^ board->dir_low;
    hal->step_inverted = step;
    if (BY_SHIFT) {
        step_shift_invert(hal, gang_motors(&board->gang, step, step) ^ board->step_low, inverted);
        return;
    }
    route_steps(hal);
    for (unsigned motor = 0; motor < AXIS_COUNT; motor++)
        route(board->dir_gpio[motor], SIG_GPIO_OUT_IDX, (inverted >> motor & 1) != 0);
    rest_lines(hal);
}

void step_engine_regroup(struct hal_step *hal) {
    const struct step_engine_board *board = hal->board;
    if (BY_SHIFT)
        (void)step_shift_group(hal, board);
    else
        (void)step_pins_set(&hal->pins, &board->gang, board->step_gpio, board->dir_gpio);
}

void step_engine_hold(struct hal_step *hal, axis_mask_t first, axis_mask_t second) {
    const struct step_engine_board *board = hal->board;
    const uint32_t begin = esp_cpu_get_cycle_count();
    if (BY_SHIFT) {
        step_shift_hold(hal, first, second);
        return;
    }
    if (!BY_RMT) {
        step_pins_hold(&hal->pins, &board->gang, board->step_gpio, first, second);
        return;
    }
    /* Nothing moves, so the last pulse has begun: it is not cut short. */
    while (esp_cpu_get_cycle_count() - begin < hal->pulse_end_cycles) {
    }
    hal->held = gang_motors(&board->gang, first, second);
    route_steps(hal);
}

HAL_ISR void step_engine_show(const struct step *step) {
    if (BY_SHIFT && !step->active)
        step_shift_show(step->hal);
}

HAL_ISR void step_engine_cut(struct hal_step *hal, uint32_t high, uint32_t low) {
    if (BY_SHIFT)
        step_shift_cut(hal, high, low);
}

HAL_ISR void step_engine_freeze(struct hal_step *hal) {
    if (BY_SHIFT)
        step_shift_freeze(hal);
}

bool step_engine_has_lost(void) {
    return BY_SHIFT && step_shift_has_lost();
}

bool step_engine_attach(struct step *step) {
    const int flags = ESP_INTR_FLAG_IRAM | ESP_INTR_FLAG_LEVEL5; /* no handler: the level's vector is ours */
    step_vector_argument = step;
    if (esp_intr_alloc(ETS_TG0_T0_LEVEL_INTR_SOURCE, flags, NULL, NULL, NULL) != ESP_OK)
        return false;
    timer_ll_enable_intr(&TIMERG0, TIMER_LL_EVENT_ALARM(0), true);
    return true;
}
