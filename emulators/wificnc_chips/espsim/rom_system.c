/* SPDX-License-Identifier: MIT
 * What the boot ROM does with the chip's parts, for ESP-IDF. */
#include "digest.h"
#include "rom.h"
#include "romcode/code.h"

#include <string.h>

uint32_t rom_reset_reason(const struct esp *esp, uint32_t core) {
    /* Core 0 has reset the other one, too; the S3 has no number for that (soc/reset_reasons.h). */
    const bool is_cpu = esp->reset_cause == 12 && esp->chip == ES_ESP32;
    return core == 1 && is_cpu ? 14 : esp->reset_cause;
}

void rom_boot_app(struct esp *esp, uint32_t address) {
    esp->app.boot = address;
    cores_hold(esp);
}

void rom_route(struct esp *esp, uint32_t core, uint32_t source, uint32_t interrupt) {
    if (core >= CORES || source >= SOURCES)
        chip_fault(esp, "the boot ROM is to route the interrupt source %u of core %u", source, core);
    else
        esp->route[core][source] = interrupt & 31;
    chip_look(esp);
}

/* ---- output: it takes no time, and passes by the FIFO ---- */

void rom_put_byte(struct esp *esp, uint32_t byte) {
    if (byte == '\n')
        uart_print(esp, 0, '\r');
    uart_print(esp, 0, (uint8_t)byte);
}

uint64_t rom_sending(const struct esp *esp) {
    const struct uart *uart = &esp->uart[0];
    return uart->tx_count == 0 ? 1 : uart->tx_count * (uint64_t)(ES_CPU_HZ / 11520);
}

/* ---- digests ---- */

static const uint8_t *bytes_of(struct esp *esp, uint32_t at, uint32_t count) {
    const uint8_t *bytes = bus_bytes(esp, at, count);
    if (bytes == NULL)
        chip_fault(esp, "the boot ROM is to read %u bytes at %08x, where no memory is", count, at);
    return bytes;
}

/* The register is inverted before and after, the lowest bit comes first. */
uint32_t rom_crc(struct esp *esp, uint32_t crc, uint32_t from, uint32_t count, unsigned bits) {
    static const uint32_t polynomial[] = {0xE0, 0x8408, 0xEDB88320};
    const uint32_t mask = bits == 32 ? UINT32_MAX : (1u << bits) - 1;
    const uint8_t *bytes = count == 0 ? NULL : bytes_of(esp, from, count);
    if (bytes == NULL)
        return crc;
    crc = ~crc & mask;
    for (uint32_t i = 0; i < count; i++) {
        crc ^= bytes[i];
        for (unsigned bit = 0; bit < 8; bit++)
            crc = crc >> 1 ^ ((crc & 1) != 0 ? polynomial[bits / 16] : 0);
    }
    return ~crc & mask;
}

/* @param step  0: begin, 1: add, 2: end */
void rom_md5(struct esp *esp, uint32_t context, uint32_t from, uint32_t count, int step) {
    struct md5 *md5 = (struct md5 *)(void *)bus_bytes(esp, context, sizeof *md5);
    if (md5 == NULL) {
        chip_fault(esp, "the boot ROM is to use a context of MD5 at %08x, where no memory is", context);
        return;
    }
    const uint8_t *bytes = step == 1 && count != 0 ? bytes_of(esp, from, count) : NULL;
    uint8_t digest[16];
    if (step == 0)
        md5_begin(md5);
    else if (step == 1 && bytes != NULL)
        md5_add(md5, bytes, count);
    else if (step == 2) {
        md5_end(md5, digest);
        (void)es_write(esp, from, digest, sizeof digest);
    }
}

/* ---- pins: the GPIO matrix ---- */

static uint32_t gpio(const struct esp *esp, uint32_t of_esp32, uint32_t of_s3) {
    return esp->chip == ES_ESP32 ? 0x3FF44000 + of_esp32 : 0x60004000 + of_s3;
}

void rom_output_signal(struct esp *esp, uint32_t pin, uint32_t signal, uint32_t inverts,
                       uint32_t enable_inverts) {
    const uint32_t value = signal | (inverts & 1) << 9 | (enable_inverts & 1) << 11;
    bus_store(esp, gpio(esp, 0x530, 0x554) + 4 * pin, value, 4);
    bus_store(esp, gpio(esp, pin < 32 ? 0x24 : 0x30, pin < 32 ? 0x24 : 0x30), 1u << pin % 32, 4);
}

void rom_input_signal(struct esp *esp, uint32_t pin, uint32_t signal, uint32_t inverts) {
    bus_store(esp, gpio(esp, 0x130, 0x154) + 4 * signal, pin | (inverts & 1) << 6 | 1u << 7, 4);
}

/* IO_MUX: the ESP32's registers have no order, and nothing here depends on them. */
void rom_select_gpio(struct esp *esp, uint32_t pin) {
    (void)esp;
    (void)pin;
}

/* ---- analog registers: they keep what is written ---- */

static uint8_t *analog(struct esp *esp, uint32_t block, uint32_t reg) {
    return &esp->analog[block & 255][reg & 15];
}

uint32_t rom_analog_load(const struct esp *esp, uint32_t block, uint32_t reg, uint32_t high, uint32_t low) {
    const uint32_t value = *analog((struct esp *)esp, block, reg);
    return value >> low & ((2u << (high - low)) - 1);
}

void rom_analog_store(struct esp *esp, uint32_t block, uint32_t reg, uint32_t high, uint32_t low,
                      uint32_t value) {
    uint8_t *byte = analog(esp, block, reg);
    const uint32_t mask = ((2u << (high - low)) - 1) << low;
    *byte = (uint8_t)((*byte & ~mask) | (value << low & mask));
}

/* ---- processor, caches ---- */

uint32_t rom_set_level(struct esp *esp, uint32_t level) {
    const uint32_t before = esp->cpu->ps;
    esp->cpu->ps = (before & ~(uint32_t)PS_LEVEL) | (level & PS_LEVEL);
    cpu_check(esp);
    return before;
}

void rom_unmap_all(struct esp *esp, uint32_t core) {
    const uint32_t none = esp->chip == ES_ESP32S3 ? 1u << 14 : 1u << 8;
    for (unsigned entry = 0; entry < MMU_ENTRIES; entry++) {
        if (core == 0)
            mmu_map(esp, entry, none);
        else
            esp->mmu.app_entry[entry] = none;
    }
}

/* Pages of 64 KB. @return 0: done */
uint32_t rom_map_flash(struct esp *esp, uint32_t core, uint32_t address, uint32_t place, uint32_t count) {
    for (uint32_t i = 0; i < count && core == 0; i++)
        mmu_map(esp, mmu_entry(esp, address + (i << 16)), (place >> 16) + i);
    return 0;
}

/* @param bit  0: instructions, 1: data. Flash is there while both are on. */
void rom_cache_s3(struct esp *esp, unsigned bit, bool on) {
    uint32_t *off = &esp->cache_control[1];
    *off = on ? *off & ~(1u << bit) : *off | 1u << bit;
    mmu_show(esp, *off == 0);
}

void rom_invalidate_s3(struct esp *esp, uint32_t from, uint32_t size) {
    cache_invalidate(esp, CACHE_CODE, from, size);
    cache_invalidate(esp, CACHE_DATA, from, size);
}

/* ---- flash ---- */

/* @return 0: done */
uint32_t rom_flash_status(struct esp *esp, uint32_t to, uint32_t code) {
    uint8_t status = 0;
    flash_do(esp, &(struct flash_command){.code = (uint8_t)code, .in = &status, .in_count = 1});
    if (to != 0)
        bus_store(esp, to, status, 4);
    return 0;
}

uint32_t rom_flash_read(struct esp *esp, uint32_t from, uint32_t to, uint32_t count) {
    for (uint32_t i = 0; i < count && esp->stop != ES_FAULT; i++) {
        uint8_t byte = 0;
        flash_do(esp, &(struct flash_command){.code = 0x03, .address = from + i, .in = &byte, .in_count = 1});
        bus_store(esp, to + i, byte, 1);
    }
    return 0;
}

/* ---- functions that call the program's: their code is the processor's own, romcode/code.c ---- */

/* Exception vectors of register windows: ISA Reference Manual, chapter Windowed Register Option. */
enum { VECTORS = 0x40000000, VECTOR_SIZE = 0x40, VECTOR_CODE = 41 };
static const uint8_t window_vectors[6][VECTOR_CODE] = {
    {0x00, 0xc5, 0x49, 0x10, 0xd5, 0x49, 0x20, 0xe5, 0x49, 0x30, 0xf5, 0x49, 0x00, 0x34}, /* overflow4 */
    {0x00, 0xc5, 0x09, 0x10, 0xd5, 0x09, 0x20, 0xe5, 0x09, 0x30, 0xf5, 0x09, 0x00, 0x35}, /* underflow4 */
    {0x00, 0xc9, 0x49, 0x00, 0xd1, 0x09, 0x10, 0xd9, 0x49, 0x20, 0xe9, 0x49, 0x30, 0xf9, 0x49,
     0x40, 0x80, 0x49, 0x50, 0x90, 0x49, 0x60, 0xa0, 0x49, 0x70, 0xb0, 0x49, 0x00, 0x34}, /* overflow8 */
    {0x00, 0xc9, 0x09, 0x10, 0xd9, 0x09, 0x20, 0xe9, 0x09, 0x70, 0xd1, 0x09, 0x30, 0xf9, 0x09,
     0x40, 0x87, 0x09, 0x50, 0x97, 0x09, 0x60, 0xa7, 0x09, 0x70, 0xb7, 0x09, 0x00, 0x35}, /* underflow8 */
    {0x00, 0xcd, 0x49, 0x00, 0xd1, 0x09, 0x10, 0xdd, 0x49, 0x20, 0xed, 0x49, 0x30, 0xfd,
     0x49, 0x40, 0x40, 0x49, 0x50, 0x50, 0x49, 0x60, 0x60, 0x49, 0x70, 0x70, 0x49, 0x80,
     0x80, 0x49, 0x90, 0x90, 0x49, 0xa0, 0xa0, 0x49, 0xb0, 0xb0, 0x49, 0x00, 0x34}, /* overflow12 */
    {0x00, 0xcd, 0x09, 0x10, 0xdd, 0x09, 0x20, 0xed, 0x09, 0xb0, 0xd1, 0x09, 0x30, 0xfd,
     0x09, 0x40, 0x4b, 0x09, 0x50, 0x5b, 0x09, 0x60, 0x6b, 0x09, 0x70, 0x7b, 0x09, 0x80,
     0x8b, 0x09, 0x90, 0x9b, 0x09, 0xa0, 0xab, 0x09, 0xb0, 0xbb, 0x09, 0x00, 0x35}, /* underflow12 */
};

/* ets_rom_layout_t of the S3, as far as ESP-IDF reads it: RAM that belongs to the boot ROM begins there. */
enum { LAYOUT = 0x3FF1FF00, LAYOUT_POINTER = 0x3FF1FFFC, SHARED = 0x3FCD7E00, RESERVED = 0x3FCED710 };

static void put_layout(struct esp *esp) {
    const uint32_t layout[2] = {SHARED, RESERVED}, pointer = LAYOUT;
    (void)es_write(esp, LAYOUT, (const uint8_t *)layout, sizeof layout);
    (void)es_write(esp, LAYOUT_POINTER, (const uint8_t *)&pointer, sizeof pointer);
}

/* syscall_table_ptr: where a program has put the address of its table. */
enum { CALLS_AT = ROM_CODE + 0xFFC };
static const uint32_t calls[2] = {0x3FFAE024, 0x3FCEFFD4};

void rom_put_code(struct esp *esp) {
    for (unsigned i = 0; i < 6; i++)
        (void)es_write(esp, VECTORS + VECTOR_SIZE * i, window_vectors[i], VECTOR_CODE);
    (void)es_write(esp, ROM_CODE, rom_code, sizeof rom_code);
    (void)es_write(esp, CALLS_AT, (const uint8_t *)&calls[esp->chip], sizeof *calls);
    if (esp->chip == ES_ESP32S3)
        put_layout(esp);
}

/* The call continues there, with its arguments. */
void rom_continue(struct esp *esp, uint32_t address) {
    esp->cpu->next = address;
}

/* newlib's __sinit: streams have been set up when there is a function that ends them. */
void rom_begin_streams(struct esp *esp, uint32_t reent) {
    enum { CLEANUP = 32, CLEANUP_R = 0x40001D48 };
    bus_store(esp, reent + CLEANUP, CLEANUP_R, 4);
}

/* ---- small ones ---- */

uint32_t rom_crc8(struct esp *esp, uint32_t from, uint32_t count) {
    const uint8_t *bytes = bytes_of(esp, from, count);
    return bytes == NULL ? 0 : efuse_crc8(bytes, count);
}

void rom_clear_interrupts(struct esp *esp, uint32_t mask) {
    esp->cpu->latched &= ~(mask & (INTERRUPTS_SOFTWARE | INTERRUPTS_EDGE));
}
