/* SPDX-License-Identifier: MIT
 * The flash chip: NOR memory whose bits a program command clears and an erase command sets, after WREN, in
 * the time of such chips (W25Q32JV: 0.4 ms a page, 45 ms a sector, 150 ms a block). Power may be cut at any
 * of them. */
#include "esp.h"

#include <stdlib.h>
#include <string.h>

enum command {
    WRSR = 0x01,
    PP = 0x02,
    READ = 0x03,
    WRDI = 0x04,
    RDSR = 0x05,
    WREN = 0x06,
    FAST_READ = 0x0B,
    PP_QUAD = 0x32,
    RDSR2 = 0x35,
    WRSR2 = 0x31,
    RDSR3 = 0x15,
    BE_32K = 0x52,
    RDSFDP = 0x5A,
    SE = 0x20,
    RDID = 0x9F,
    RES = 0xAB,
    RSTEN = 0x66,
    RESUME = 0x7A, /* nothing is suspended */
    RST = 0x99,
    CE = 0xC7,
    CE_60 = 0x60,
    BE_64K = 0xD8,
    DUAL_OUT = 0x3B,
    DUAL_IO = 0xBB,
    QUAD_OUT = 0x6B,
    QUAD_IO = 0xEB,
    DP = 0xB9,
};

enum { STATUS_BUSY = 1, STATUS_WEL = 2, PAGE_SIZE = 256, SECTOR = 4096, MANUFACTURER = 0xEF, TYPE = 0x40 };
enum {
    US = ES_CPU_HZ / 1000000,
    PAGE_US = 400,
    SECTOR_US = 45000,
    BLOCK_US = 150000,
    CHIP_US = 10000000,
    STATUS_US = 10000
};

bool flash_create(struct esp *esp, size_t size) {
    struct flash *flash = &esp->flash;
    if (size < 1 << 20 || size > 1 << 24 || (size & (size - 1)) != 0) {
        chip_fault(esp, "a flash of %zu bytes is not emulated: 1, 2, 4, 8 or 16 MB", size);
        return false;
    }
    free(flash->bytes);
    *flash = (struct flash){.bytes = malloc(size), .size = (uint32_t)size};
    if (flash->bytes == NULL)
        abort();
    memset(flash->bytes, 0xFF, size);
    return true;
}

static uint8_t log2_of(uint32_t size) {
    return (uint8_t)__builtin_ctz(size);
}

bool flash_is_busy(const struct esp *esp) {
    return esp->cycles < esp->flash.busy_until;
}

uint64_t flash_busy_cycles(const struct esp *esp) {
    return flash_is_busy(esp) ? esp->flash.busy_until - esp->cycles : 1;
}

/* ---- writes and erases ---- */

/* A byte of an operation: where it goes, and what the operation makes of it. */
static void change(struct flash *flash, uint32_t at, const uint8_t *data, uint32_t i) {
    if (data == NULL)
        flash->bytes[at] = 0xFF;
    else
        flash->bytes[at] &= data[i];
}

/* Half of the bits of the byte at which the power goes: every second one. */
static void tear(struct flash *flash, uint32_t at, const uint8_t *data, uint32_t i) {
    const uint8_t after = data == NULL ? 0xFF : flash->bytes[at] & data[i];
    flash->bytes[at] = (uint8_t)((flash->bytes[at] & 0x55) | (after & 0xAA));
}

/* @param data  NULL: erase. @param wrap  the address wraps in a page of so many bytes */
static void operate(struct esp *esp, uint32_t at, const uint8_t *data, uint32_t count, uint32_t wrap,
                    uint32_t us) {
    struct flash *flash = &esp->flash;
    const uint32_t base = at & ~(wrap - 1);
    const bool is_cut = ++flash->operations == flash->cut_at;
    const uint32_t done = !is_cut || flash->torn == 2 ? count : flash->torn == 1 ? count / 2 : 0;
    for (uint32_t i = 0; i < done; i++)
        change(flash, base + ((at + i) & (wrap - 1)), data, i);
    if (is_cut && flash->torn == 1 && done < count)
        tear(flash, base + ((at + done) & (wrap - 1)), data, done);
    flash->busy_until = esp->cycles + (uint64_t)us * US;
    flash->write_enabled = false;
    mmu_changed(esp, base, wrap > count ? wrap : count);
    if (is_cut) {
        esp->stop = ES_DARK;
        esp->limit = 0;
    }
}

static void erase(struct esp *esp, uint32_t address, uint32_t size, uint32_t us) {
    operate(esp, (address & (esp->flash.size - 1)) & ~(size - 1), NULL, size, size, us);
}

static void write(struct esp *esp, const struct flash_command *command) {
    const uint32_t address = command->address & (esp->flash.size - 1);
    switch (command->code) {
    case PP:
    case PP_QUAD:
        operate(esp, address, command->out, command->out_count, PAGE_SIZE, PAGE_US);
        break;
    case SE:
        erase(esp, address, SECTOR, SECTOR_US);
        break;
    case BE_32K:
        erase(esp, address, 8 * SECTOR, BLOCK_US);
        break;
    case BE_64K:
        erase(esp, address, 16 * SECTOR, BLOCK_US);
        break;
    case CE:
    case CE_60:
        erase(esp, 0, esp->flash.size, CHIP_US);
        break;
    default: /* status */
        if (command->code == WRSR2)
            esp->flash.status[1] = command->out_count > 0 ? command->out[0] : 0;
        else
            for (uint32_t i = 0; i < command->out_count && i < 2; i++)
                esp->flash.status[i] = command->out[i] & (i == 0 ? 0xFC : 0xFF);
        esp->flash.busy_until = esp->cycles + (uint64_t)STATUS_US * US;
        esp->flash.write_enabled = false;
    }
}

/* ---- reads ---- */

static void read_bytes(const struct flash *flash, const struct flash_command *command) {
    for (uint32_t i = 0; i < command->in_count; i++)
        command->in[i] = flash->bytes[(command->address + i) & (flash->size - 1)];
}

static void put(const struct flash_command *command, const uint8_t *bytes, uint32_t count) {
    for (uint32_t i = 0; i < command->in_count; i++)
        command->in[i] = count == 0 ? 0xFF : bytes[i % count];
}

static uint8_t status_of(const struct esp *esp) {
    return (uint8_t)(esp->flash.status[0] | (flash_is_busy(esp) ? STATUS_BUSY : 0) |
                     (esp->flash.write_enabled ? STATUS_WEL : 0));
}

static bool is_write(uint8_t code) {
    static const uint8_t codes[] = {WRSR, WRSR2, PP, PP_QUAD, SE, BE_32K, BE_64K, CE, CE_60};
    return memchr(codes, code, sizeof codes) != NULL;
}

static void answer(struct esp *esp, const struct flash_command *command) {
    struct flash *flash = &esp->flash;
    const uint8_t id[3] = {MANUFACTURER, TYPE, log2_of(flash->size)}, status = status_of(esp);
    switch (command->code) {
    case READ:
    case FAST_READ:
    case DUAL_OUT:
    case DUAL_IO:
    case QUAD_OUT:
    case QUAD_IO:
        read_bytes(flash, command);
        break;
    case RDID:
        put(command, id, sizeof id);
        break;
    case RDSR:
        put(command, &status, 1);
        break;
    case RDSR2:
        put(command, &flash->status[1], 1);
        break;
    case RDSR3:
    case RDSFDP: /* none: it reads as an empty bus */
        put(command, NULL, 0);
        break;
    case WREN:
    case WRDI:
        flash->write_enabled = command->code == WREN;
        break;
    case RES:
    case RSTEN:
    case RESUME:
    case RST:
    case DP:
        put(command, NULL, 0);
        break;
    default:
        chip_fault(esp, "the command %02x of the flash chip is not emulated", command->code);
    }
}

/* While the chip is busy it answers RDSR alone; without WREN it writes nothing. */
void flash_do(struct esp *esp, const struct flash_command *command) {
    if (esp->flash.bytes == NULL)
        chip_fault(esp, "the flash chip is used, but no image was loaded into one");
    else if (flash_is_busy(esp) && command->code != RDSR)
        chip_fault(esp, "the flash chip gets the command %02x while it is busy", command->code);
    else if (!is_write(command->code))
        answer(esp, command);
    else if (esp->flash.write_enabled)
        write(esp, command);
}

/* ---- from outside ---- */

size_t es_flash(const struct esp *esp, const uint8_t **bytes) {
    *bytes = esp->flash.bytes;
    return esp->flash.size;
}

bool es_flash_write(struct esp *esp, uint32_t address, const uint8_t *bytes, size_t count) {
    struct flash *flash = &esp->flash;
    if (address > flash->size || count > flash->size - address)
        return false;
    memcpy(flash->bytes + address, bytes, count);
    mmu_changed(esp, address, (uint32_t)count);
    return true;
}

bool es_flash_create(struct esp *esp, size_t size) {
    return flash_create(esp, size);
}

void es_cut_power(struct esp *esp, uint32_t nth, int torn) {
    esp->flash.cut_at = nth == 0 ? 0 : esp->flash.operations + nth;
    esp->flash.torn = torn;
}

uint32_t es_flash_operations(const struct esp *esp) {
    return esp->flash.operations;
}
