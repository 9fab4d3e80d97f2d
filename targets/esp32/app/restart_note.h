/* SPDX-License-Identifier: MIT
 * Why the chip starts, for machine_board.restart: by the cause of the reset, and by what a panic and the
 * motion have noted in memory that a reset keeps and a power cut does not. Pure. */
#ifndef WIFICNC_ESP32_RESTART_NOTE_H
#define WIFICNC_ESP32_RESTART_NOTE_H

#include "hal/hal.h"

#include <stdbool.h>
#include <stdint.h>

enum { RESTART_DETAIL_SIZE = 28 };

/** In RTC memory: its content is anything after power-on. */
struct restart_note {
    uint32_t panicked; /* a mark: address and detail are a panic's */
    uint32_t moves;    /* a mark: the machine is not at rest */
    struct hal_restart restart;
    char detail[RESTART_DETAIL_SIZE];
};

/** [panic] Where the program was, then its callers. @param detail  NULL: none; is copied */
void restart_note_panic(struct restart_note *note, const uint32_t *address, uint8_t count,
                        const char *detail);

/** [task] In each round. */
void restart_note_moves(struct restart_note *note, bool moves);

/** [start, once] @param cause  by the chip; HAL_RESTART_EXTERNAL: only if the machine was moving
 * @return NULL: this start was requested, or is power-on; else it is part of the note */
const struct hal_restart *restart_note_begin(struct restart_note *note, enum hal_restart_cause cause);

#endif
