/* SPDX-License-Identifier: MIT
 * A chip as it was: many trials that begin alike need their beginning once. */
#include "chip.h"

#include <stdlib.h>
#include <string.h>

/* Places in memory are the chip's own, so a state is for the chip that it was taken of. */
struct mz_state {
    struct chip chip;
    uint32_t *ram, *flash, *boot;
};

static void *copied(const void *from, size_t size) {
    void *to = malloc(size);
    if (to != NULL)
        memcpy(to, from, size);
    return to;
}

struct mz_state *mz_save(const struct chip *chip) {
    struct mz_state *state = malloc(sizeof *state);
    if (state == NULL)
        return NULL;
    *state = (struct mz_state){.chip = *chip,
                               .ram = copied(chip->ram, RAM_SIZE),
                               .flash = copied(chip->flash, MZ_FLASH_SIZE),
                               .boot = copied(chip->boot, BOOT_SIZE)};
    if (state->ram == NULL || state->flash == NULL || state->boot == NULL) {
        mz_forget(state);
        return NULL;
    }
    return state;
}

void mz_forget(struct mz_state *state) {
    if (state == NULL)
        return;
    free(state->ram);
    free(state->flash);
    free(state->boot);
    free(state);
}

/* Instructions that did not change stay decoded. */
static void restore_flash(struct chip *chip, const uint32_t *flash) {
    for (uint32_t word = 0; word < MZ_FLASH_SIZE / 4; word++) {
        if (chip->flash[word] == flash[word])
            continue;
        chip->flash[word] = flash[word];
        chip_flash_changed(chip, 4 * word, 4);
    }
}

/* Buffers may have grown meanwhile. */
static void keep_buffers(struct uart *uart, const struct uart *now) {
    uart->in = now->in;
    uart->in_room = now->in_room;
    uart->in_count = uart->in_at = 0;
    uart->out = now->out;
    uart->out_room = now->out_room;
    uart->out_count = 0;
}

void mz_restore(struct chip *chip, const struct mz_state *state) {
    struct chip now = *chip;
    *chip = state->chip;
    memcpy(chip->ram, state->ram, RAM_SIZE);
    memcpy(chip->boot, state->boot, BOOT_SIZE);
    restore_flash(chip, state->flash);
    keep_buffers(&chip->uart, &now.uart);
    keep_buffers(&chip->bus, &now.bus);
    chip->edges = now.edges;
    chip->edge_room = now.edge_room;
    chip->edge_count = 0;
    chip->bench.steps = now.bench.steps;
    chip->bench.room = now.bench.room;
    chip->bench.count = 0;
}
