/* SPDX-License-Identifier: MIT */
#include "app/restart_note.h"

#include "esp_attr.h"

#include <stddef.h>

#define PANICKED 0x50414E43u /* "PANC" */
#define MOVES    0x4D4F5645u /* "MOVE" */

/* The mark last, so that a second panic in here leaves no half of a note. */
void IRAM_ATTR restart_note_panic(struct restart_note *note, const uint32_t *address, uint8_t count,
                                  const char *detail) {
    unsigned at = 0;
    note->restart.address_count = count < HAL_RESTART_ADDRESSES ? count : HAL_RESTART_ADDRESSES;
    for (unsigned n = 0; n < note->restart.address_count; n++)
        note->restart.address[n] = address[n];
    for (; detail != NULL && at < RESTART_DETAIL_SIZE - 1 && detail[at] >= ' ' && detail[at] <= '~'; at++)
        note->detail[at] = detail[at];
    note->detail[at] = '\0';
    note->panicked = PANICKED;
}

void restart_note_moves(struct restart_note *note, bool moves) {
    note->moves = moves ? MOVES : 0;
}

/* A watchdog of ESP-IDF ends in a panic, too. */
static bool is_of_program(enum hal_restart_cause cause) {
    return cause == HAL_RESTART_FAULT || cause == HAL_RESTART_WATCHDOG;
}

const struct hal_restart *restart_note_begin(struct restart_note *note, enum hal_restart_cause cause) {
    const bool panicked = note->panicked == PANICKED && is_of_program(cause);
    const bool moved = note->moves == MOVES;
    /* Once: the next start may have another cause. */
    note->panicked = note->moves = 0;
    note->restart.cause = cause;
    if (!panicked)
        note->restart.address_count = 0;
    note->restart.detail = panicked && note->detail[0] != '\0' ? note->detail : NULL;
    if (cause == HAL_RESTART_NONE || (cause == HAL_RESTART_EXTERNAL && !moved))
        return NULL;
    return &note->restart;
}
