/* SPDX-License-Identifier: MIT
 * The interrupt controller: who asks, at which level. Flags of the UART and of change notice are persistent:
 * they come back as long as their cause lasts. */
#include "chip.h"

#include <stdio.h>

static uint32_t read_intstat(struct chip *chip, struct sfr *sfr) {
    (void)sfr;
    return chip->level << 8 | chip->irq;
}

void evic_create(struct chip *chip) {
    char name[12];
    (void)sfr_add(chip, "INTCON", 0x1F810000, 0, 0x0000171F);
    chip->priss = sfr_add(chip, "PRISS", 0x1F810010, 0, 0xFFFFFFF1);
    struct sfr *intstat = sfr_add(chip, "INTSTAT", 0x1F810020, 0, 0);
    intstat->read = read_intstat;
    for (unsigned i = 0; i < 7; i++) {
        snprintf(name, sizeof name, "IFS%u", i);
        chip->ifs[i] = sfr_add(chip, name, 0x1F810040 + 0x10 * i, 0, 0xFFFFFFFF);
        snprintf(name, sizeof name, "IEC%u", i);
        chip->iec[i] = sfr_add(chip, name, 0x1F8100C0 + 0x10 * i, 0, 0xFFFFFFFF);
    }
    for (unsigned i = 0; i < 54; i++) {
        snprintf(name, sizeof name, "IPC%u", i);
        chip->ipc[i] = sfr_add(chip, name, 0x1F810140 + 0x10 * i, 0, 0x1F1F1F1F);
    }
}

void evic_raise(struct chip *chip, unsigned irq) {
    chip->ifs[irq / 32]->value |= 1u << irq % 32;
    chip->look = true;
    chip->limit = 0;
}

static void raise_persistent(struct chip *chip) {
    uint32_t lines = uart_lines(chip);
    chip->ifs[IRQ_U3_RX / 32]->value |= (lines & 1u) << IRQ_U3_RX % 32;
    chip->ifs[IRQ_U3_TX / 32]->value |= (lines >> 1 & 1u) << IRQ_U3_TX % 32;
    chip->ifs[IRQ_U2_RX / 32]->value |= (lines >> 2 & 1u) << IRQ_U2_RX % 32;
    chip->ifs[IRQ_U2_TX / 32]->value |= (lines >> 3 & 1u) << IRQ_U2_TX % 32;
    for (unsigned port = 0; port < PORTS; port++)
        if (chip->port[port].cnf->value != 0)
            chip->ifs[(IRQ_CHANGE + port) / 32]->value |= 1u << (IRQ_CHANGE + port) % 32;
}

/* The highest level wins, then the higher order within it, then the lower number. */
void evic_update(struct chip *chip) {
    unsigned best = 0;
    raise_persistent(chip);
    chip->level = 0;
    for (unsigned word = 0; word < 7; word++) {
        uint32_t asks = chip->ifs[word]->value & chip->iec[word]->value;
        for (; asks != 0; asks &= asks - 1) {
            unsigned irq = word * 32 + (unsigned)__builtin_ctz(asks);
            unsigned priority = chip->ipc[irq / 4]->value >> irq % 4 * 8 & 31u;
            if (priority >> 2 != 0 && priority > best) {
                best = priority;
                chip->irq = irq;
                chip->level = priority >> 2;
            }
        }
    }
}
