/* SPDX-License-Identifier: MIT
 * The flash controller: pages of 16 KB are erased, units of 16 bytes programmed once. */
#include "chip.h"

#include <stdio.h>
#include <string.h>

enum { WR = 1 << 15, WREN = 1 << 14, QUAD_WORD = 2, ERASE = 4, PAGE = 16384, UNIT = 16 };

#define ERASE_CYCLES   (MZ_CPU_HZ / 50)    /* 20 ms */
#define PROGRAM_CYCLES (MZ_CPU_HZ / 20000) /* 50 us */

static uint32_t *target(struct chip *chip, uint32_t size) {
    uint32_t at = (chip->nvm.addr->value & ~(size - 1)) - FLASH_BASE;
    return at < MZ_FLASH_SIZE ? chip->flash + at / 4 : NULL;
}

/* ---- the power goes ---- */

/* @return true: now */
static bool is_cut(struct chip *chip) {
    struct nvm *nvm = &chip->nvm;
    return nvm->cut_at != 0 && --nvm->cut_at == 0;
}

/* Half of the bits are as they will be: those of every other byte, and the low half of the others. */
static void tear(uint32_t *words, const uint32_t *wanted, size_t count) {
    for (size_t i = 0; i < count; i++) {
        uint32_t done = i % 2 == 0 ? 0x00FF0FF0u : 0xFF0000FFu;
        words[i] = (words[i] & ~done) | (wanted[i] & done);
    }
}

/* ---- operations ---- */

static void carry_out(struct chip *chip, bool torn) {
    static const uint32_t blank[PAGE / 4] = {0};
    uint32_t wanted[PAGE / 4];
    struct nvm *nvm = &chip->nvm;
    bool erases = (nvm->con->value & 15) == ERASE;
    size_t count = erases ? PAGE / 4 : UNIT / 4;
    uint32_t *words = target(chip, erases ? PAGE : UNIT);
    for (size_t i = 0; i < count; i++)
        wanted[i] = erases ? ~blank[i] : nvm->data[i]->value;
    if (torn)
        tear(words, wanted, count);
    else
        memcpy(words, wanted, count * 4);
    chip_flash_changed(chip, (uint32_t)((words - chip->flash) * 4), count * 4);
}

static void begin(struct chip *chip) {
    struct nvm *nvm = &chip->nvm;
    uint32_t operation = nvm->con->value & 15;
    const uint32_t *words = target(chip, operation == ERASE ? PAGE : UNIT);
    if ((nvm->con->value & WREN) == 0 || nvm->keys != 3) {
        chip_fault(chip, "NVMCON.WR set %s", nvm->keys != 3 ? "without the key" : "while WREN is 0");
    } else if ((operation != ERASE && operation != QUAD_WORD) || words == NULL) {
        chip_fault(chip, "flash operation %u at %08x is not modelled", operation, nvm->addr->value);
    } else if ((nvm->addr->value ^ chip->cpu.at) >> 20 == 0 ||
               (nvm->addr->value & 0xFFF00000u) == FLASH_BASE) {
        chip_fault(chip, "the bank at %08x is written from which the program runs", nvm->addr->value);
    } else {
        for (unsigned i = 0; operation == QUAD_WORD && i < UNIT / 4; i++)
            if (words[i] != 0xFFFFFFFFu)
                chip_fault(chip, "flash at %08x is programmed twice", nvm->addr->value);
        nvm->operations++;
        nvm->done_at =
            chip->cycles + (operation == ERASE ? ERASE_CYCLES : PROGRAM_CYCLES) * (uint64_t)chip->speed;
    }
    if (chip->stop == MZ_TIME && is_cut(chip)) {
        if (nvm->torn != 0)
            carry_out(chip, nvm->torn == 1);
        chip->stop = MZ_DARK;
        chip->limit = 0;
    }
}

void nvm_event(struct chip *chip) {
    struct nvm *nvm = &chip->nvm;
    if (nvm->done_at > chip->cycles)
        return;
    carry_out(chip, false);
    nvm->con->value &= ~(uint32_t)WR;
    nvm->done_at = NEVER;
    evic_raise(chip, IRQ_NVM);
}

/* ---- registers ---- */

static void written_con(struct chip *chip, struct sfr *sfr, uint32_t before) {
    if ((before & WR) == 0 && (sfr->value & WR) != 0)
        begin(chip);
}

/* Every write of a register: the key's three must follow each other, and then WR. @return false: a fault */
bool nvm_key(struct chip *chip, const struct sfr *sfr, uint32_t value) {
    static const uint32_t keys[] = {0, 0xAA996655, 0x556699AA};
    struct nvm *nvm = &chip->nvm;
    bool is_ours = sfr->address - nvm->con->address < 0x80;
    if (is_ours && nvm->done_at != NEVER) {
        chip_fault(chip, "%s written while the flash is busy", sfr->name);
        return false;
    }
    if (sfr == nvm->key)
        nvm->keys = nvm->keys < 3 && value == keys[nvm->keys] ? nvm->keys + 1 : value == 0 ? 1 : 0;
    else if (sfr != nvm->con)
        nvm->keys = 0;
    return true;
}

void nvm_create(struct chip *chip) {
    struct nvm *nvm = &chip->nvm;
    nvm->con = sfr_add(chip, "NVMCON", 0x1F800600, 0, 0xC00F);
    nvm->key = sfr_add(chip, "NVMKEY", 0x1F800610, 0, 0);
    nvm->addr = sfr_add(chip, "NVMADDR", 0x1F800620, 0, 0xFFFFFFFF);
    for (unsigned i = 0; i < 4; i++) {
        char name[12];
        snprintf(name, sizeof name, "NVMDATA%u", i);
        nvm->data[i] = sfr_add(chip, name, 0x1F800630 + 0x10 * i, 0, 0xFFFFFFFF);
        nvm->data[i]->plain = true;
    }
    nvm->key->plain = true;
    nvm->con->written = written_con;
    nvm->done_at = NEVER;
}

void nvm_reset(struct chip *chip) {
    chip->nvm.keys = 0;
    chip->nvm.done_at = NEVER;
}

void mz_cut_power(struct chip *chip, uint32_t nth, int torn) {
    chip->nvm.cut_at = nth;
    chip->nvm.torn = torn;
}

uint32_t mz_flash_operations(const struct chip *chip) {
    return chip->nvm.operations;
}
