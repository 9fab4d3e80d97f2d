/* SPDX-License-Identifier: MIT
 * The special function registers. What is not here stops the chip: so the firmware uses nothing that is not
 * modelled. */
#include "chip.h"

#include <stdio.h>
#include <string.h>

#define OFF_BASE 0x1F810540u

struct sfr *sfr_add(struct chip *chip, const char *name, uint32_t address, uint32_t at_reset,
                    uint32_t writable) {
    struct sfr *sfr = &chip->sfr[chip->sfr_count++];
    snprintf(sfr->name, sizeof sfr->name, "%s", name);
    sfr->address = address & 0x1FFFFFFFu;
    sfr->at_reset = sfr->value = at_reset;
    sfr->writable = writable;
    chip->slot[(sfr->address - SFR_BASE) / 16] = (uint16_t)chip->sfr_count;
    return sfr;
}

void sfr_reset(struct chip *chip) {
    for (unsigned i = 0; i < chip->sfr_count; i++)
        chip->sfr[i].value = chip->sfr[i].at_reset;
    memset(chip->off, 0, sizeof chip->off);
}

/* Registers without shadows may lie 4 bytes apart: the one that is meant is not the last of its slot. */
static struct sfr *neighbour(struct chip *chip, struct sfr *sfr, uint32_t physical) {
    for (unsigned i = 0; i < chip->sfr_count; i++)
        if (chip->sfr[i].plain && chip->sfr[i].address == (physical & ~3u))
            return &chip->sfr[i];
    return sfr;
}

static struct sfr *find(struct chip *chip, uint32_t physical, const char *what) {
    unsigned slot = chip->slot[(physical - SFR_BASE) / 16];
    if (slot != 0 && chip->sfr[slot - 1].plain && chip->sfr[slot - 1].address != (physical & ~3u))
        return neighbour(chip, &chip->sfr[slot - 1], physical);
    if (slot != 0)
        return &chip->sfr[slot - 1];
    chip_fault(chip, "%s the unknown register %08x by the instruction at %08x", what, physical | 0xA0000000u,
               chip->cpu.at);
    return NULL;
}

/* 0: the register itself, 1 CLR, 2 SET, 3 INV */
static unsigned shadow_of(const struct sfr *sfr, uint32_t physical) {
    return (physical - sfr->address) >> 2 & 3;
}

uint32_t sfr_load(struct chip *chip, uint32_t physical, unsigned size) {
    if (physical - OFF_BASE < 4 * IRQ_COUNT)
        return chip->off[(physical - OFF_BASE) / 4];
    struct sfr *sfr = find(chip, physical, "read of");
    if (sfr == NULL)
        return 0;
    if (shadow_of(sfr, physical) != 0) {
        chip_fault(chip, "read of CLR, SET or INV of %s, which are only written", sfr->name);
        return 0;
    }
    uint32_t value = sfr->read != NULL ? sfr->read(chip, sfr) : sfr->value;
    value >>= 8 * (physical & 3);
    return size == 4 ? value : value & ((1u << 8 * size) - 1);
}

static uint32_t combined(const struct sfr *sfr, unsigned how, uint32_t value) {
    switch (how) {
    case 1:
        return sfr->value & ~value;
    case 2:
        return sfr->value | value;
    case 3:
        return sfr->value ^ value;
    default:
        return value;
    }
}

void sfr_store(struct chip *chip, uint32_t physical, uint32_t value, unsigned size) {
    if (physical - OFF_BASE < 4 * IRQ_COUNT) {
        chip->off[(physical - OFF_BASE) / 4] = value & 0x3FFFEu;
        return;
    }
    struct sfr *sfr = find(chip, physical, "write to");
    if (sfr == NULL)
        return;
    unsigned how = shadow_of(sfr, physical), shift = 8 * (physical & 3);
    if (size != 4) {
        uint32_t mask = ((1u << 8 * size) - 1) << shift;
        value = (sfr->value & ~mask) | (value << shift & mask);
    }
    if (sfr->locked && chip->syskey != 2) {
        chip_fault(chip, "write to %s while SYSKEY locks it", sfr->name);
        return;
    }
    if (how != 0 && sfr->plain) {
        chip_fault(chip, "%s has no CLR, SET and INV", sfr->name);
        return;
    }
    uint32_t before = sfr->value;
    sfr->value = (before & ~sfr->writable) | (combined(sfr, how, value) & sfr->writable);
    if (!nvm_key(chip, sfr, value) || chip->stop != MZ_TIME)
        return;
    if (sfr->written != NULL)
        sfr->written(chip, sfr, before);
    chip_look(chip);
}
