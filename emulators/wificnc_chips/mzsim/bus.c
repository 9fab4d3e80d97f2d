/* SPDX-License-Identifier: MIT
 * Addresses: KSEG0 and KSEG1 are the same 512 MB. All others go through the TLB, whose entries are never
 * valid here. */
#include "chip.h"

#include <string.h>

static bool is_mapped(struct chip *chip, uint32_t address, enum exception_code code) {
    if (address >> 30 == 2)
        return true;
    if (chip->cpu.tlb_written != (1u << TLB_ENTRIES) - 1) {
        chip_fault(chip, "access to %08x by the instruction at %08x, and the TLB was never written", address,
                   chip->cpu.at);
        return false;
    }
    chip->cpu.bad_address = address;
    cpu_exception(chip, code, (chip->cpu.status & STATUS_EXL) != 0 ? 0x180 : 0);
    return false;
}

/* The memory behind a physical address, or NULL. */
static uint8_t *memory(struct chip *chip, uint32_t physical) {
    if (physical < RAM_SIZE)
        return (uint8_t *)chip->ram + physical;
    if (physical - FLASH_BASE < MZ_FLASH_SIZE)
        return (uint8_t *)chip->flash + (physical - FLASH_BASE);
    if (physical - BOOT_BASE < BOOT_SIZE)
        return (uint8_t *)chip->boot + (physical - BOOT_BASE);
    return NULL;
}

uint32_t bus_load(struct chip *chip, uint32_t address, unsigned size) {
    uint32_t physical = address & 0x1FFFFFFFu, value = 0;
    if (!is_mapped(chip, address, EXCEPTION_TLB_LOAD))
        return 0;
    if (physical - SFR_BASE < 0x100000u) {
        timing_register(chip, false);
        chip_catch_up(chip);
        return sfr_load(chip, physical, size);
    }
    chip->cycles += timing_data(chip, address, false);
    const uint8_t *at = memory(chip, physical);
    if (at == NULL)
        chip_fault(chip, "load from %08x, where nothing is, by the instruction at %08x", address,
                   chip->cpu.at);
    else if (chip->nvm.done_at != NEVER && physical - FLASH_BASE < MZ_FLASH_SIZE &&
             (physical ^ chip->nvm.addr->value) >> 20 == 0)
        chip_fault(chip, "load from %08x while its bank is being written", address);
    else
        memcpy(&value, at, size);
    return value;
}

void bus_store(struct chip *chip, uint32_t address, uint32_t value, unsigned size) {
    uint32_t physical = address & 0x1FFFFFFFu;
    if (!is_mapped(chip, address, EXCEPTION_TLB_STORE))
        return;
    if (physical - SFR_BASE < 0x100000u) {
        chip_catch_up(chip);
        sfr_store(chip, physical, value, size);
        timing_register(chip, true);
    } else if (physical < RAM_SIZE)
        memcpy((uint8_t *)chip->ram + physical, &value, size);
    else
        chip_fault(chip, "store to %08x, which cannot be stored to, by the instruction at %08x", address,
                   chip->cpu.at);
}

uint32_t bus_fetch(struct chip *chip, uint32_t address) {
    uint32_t value = 0;
    const uint8_t *at = memory(chip, address & 0x1FFFFFFFu);
    chip->cpu.broken = false;
    if (!is_mapped(chip, address, EXCEPTION_TLB_LOAD))
        return 0;
    if ((address & 3) != 0 || at == NULL) {
        chip_fault(chip, "the program runs to %08x, from %08x", address, chip->cpu.r[31]);
        chip->cpu.broken = true;
        return 0;
    }
    memcpy(&value, at, sizeof value);
    return value;
}
