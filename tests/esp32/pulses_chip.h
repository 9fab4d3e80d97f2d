/* SPDX-License-Identifier: MIT
 * The chip of tests/esp32/pulses.c: emulated registers, and lines that look at each pulse, pause and
 * direction set-up. */
#ifndef TEST_PULSES_CHIP_H
#define TEST_PULSES_CHIP_H

#include "hal/step_engine.h"
#include "shift_model.h"

enum {
    CYCLES_PER_US = 240,
    CYCLES_PER_TICK = 12,
    ACCESS_CYCLES = 12,
    READ_CYCLES = 8,
    RMT_BEGIN_CYCLES = 40
};
/* Instructions before the step lines change, and after the last register was written. The others come between
 * accesses to the timer, three in an event. */
enum { ENTRY_INSTRUCTIONS = 56, EXIT_INSTRUCTIONS = 30, TIMER_ACCESSES = 3 };
enum { BETWEEN_INSTRUCTIONS = EVENT_INSTRUCTIONS - ENTRY_INSTRUCTIONS - EXIT_INSTRUCTIONS };
enum { BUS_CYCLES = 16, HELD_OFF_CYCLES = 60, CACHE_LINE_CYCLES = 940, ROUND_CYCLES = 240000 };
#define CYCLES_OF(instructions) ((instructions) * 3 / 2)
enum { PULSE_CYCLES = BOARD_STEP_PULSE_NS * 240 / 1000, SETUP_CYCLES = BOARD_DIR_SETUP_NS * 240 / 1000 };
enum { HALT_WORDS = 4, LATE_CYCLES = 30 * CYCLES_PER_US };
enum { CHANNELS = 8, FIRST_STEP_GPIO = 0, FIRST_DIR_GPIO = 34 };

static const bool by_rmt = BOARD_STEP_ENGINE == BOARD_STEP_ENGINE_RMT;
static const bool by_i2s = BOARD_STEP_ENGINE == BOARD_STEP_ENGINE_I2S;
static const bool by_shift =
    BOARD_STEP_ENGINE == BOARD_STEP_ENGINE_I2S || BOARD_STEP_ENGINE == BOARD_STEP_ENGINE_SPI;

/* Outputs of the shift registers: lines of axis n, and one that tasks switch. */
#define STEP_OUTPUT(axis) (2u * (axis) + 1u)
#define DIR_OUTPUT(axis)  (2u * (axis) + 2u)
enum { SLOW_OUTPUT = 0, OTHER_OUTPUT = 31 };

/** A step line and its direction. */
struct line {
    uint64_t rose, fell, turned; /* cycles; step line; direction line */
    bool high, negative;
    int32_t steps;
    unsigned pulses;
};

extern struct line lines[AXIS_COUNT];
extern axis_mask_t low_steps, low_dirs; /* lines that are active low, through shift registers */
extern uint64_t changed;                /* when the slow output did */

extern uint64_t now;    /* cycles */
extern uint64_t due;    /* the present event's alarm: the plan. No drift, as alarms are absolute */
extern uint64_t latest; /* of all pulses, behind it */

/** The shortest pulse and pause; the board's after chip_reset(). */
extern unsigned pulse_cycles;

/** Nothing is late, every access takes the same time, and each step is printed: axis, direction, cycles. */
extern bool is_traced;

extern timg_dev_t timer;
extern unsigned channels; /* of the RMT that were made */

struct connected {
    uint32_t signal;
    bool inverted;
};
extern struct connected connected[64]; /* by the GPIO matrix */

/** Called once, as an interrupt before the SPI's register is reached that often; NULL: none comes. */
extern void (*spi_interrupt)(void);
extern unsigned spi_accesses;

/** All lines low, all registers as after a reset. */
void chip_reset(void);

/** Registers are looked at, then time passes. */
void pass(unsigned cycles);

#endif
