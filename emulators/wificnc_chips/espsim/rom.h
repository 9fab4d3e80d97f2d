/* SPDX-License-Identifier: MIT
 * What the boot ROM's functions do, by the files of rom.def: rom.c has the calls. */
#ifndef WIFICNC_ESPSIM_ROM_H
#define WIFICNC_ESPSIM_ROM_H

#include "esp.h"

/** Argument word n of the call: in a register, or on the caller's stack from the seventh on. */
uint32_t rom_word(struct esp *esp, unsigned number);

/* rom_text.c: strings in the chip's memory. @return an address, a length, or less, 0, more */
uint32_t rom_copy_text(struct esp *esp, uint32_t to, uint32_t from, uint32_t room, bool pads);
uint32_t rom_copy_limited(struct esp *esp, uint32_t to, uint32_t from, uint32_t room, bool appends);
uint32_t rom_append(struct esp *esp, uint32_t to, uint32_t from, uint32_t most);
uint32_t rom_find(struct esp *esp, uint32_t at, uint32_t byte, uint32_t count, bool is_text, bool last);
uint32_t rom_find_text(struct esp *esp, uint32_t text, uint32_t part);
uint32_t rom_span(struct esp *esp, uint32_t text, uint32_t set, bool in_set);
uint32_t rom_compare_folded(struct esp *esp, uint32_t a, uint32_t b, uint32_t count);
uint32_t rom_number(struct esp *esp, uint32_t text, uint32_t end, uint32_t base, bool is_signed);
uint32_t rom_fold(uint32_t byte, bool to_upper);
enum rom_class {
    ROM_ALNUM,
    ROM_ALPHA,
    ROM_DIGIT,
    ROM_SPACE,
    ROM_UPPER,
    ROM_LOWER,
    ROM_PRINT,
    ROM_PUNCT,
    ROM_CONTROL
};
uint32_t rom_is(uint32_t byte, enum rom_class what);
uint32_t rom_put_number(struct esp *esp, uint32_t value, uint32_t to, uint32_t base); /* itoa */
void rom_print(struct esp *esp, uint32_t format);
void rom_put_tables(struct esp *esp); /* what programs read in the ROM: newlib's _ctype_ */

/* rom_system.c */
enum { ROM_CODE = 0x4006F000 }; /* of functions that are the processor's own instructions */
void rom_put_code(struct esp *esp);
void rom_continue(struct esp *esp, uint32_t address);
void rom_begin_streams(struct esp *esp, uint32_t reent);
uint32_t rom_crc8(struct esp *esp, uint32_t from, uint32_t count);
void rom_clear_interrupts(struct esp *esp, uint32_t mask);
uint32_t rom_reset_reason(const struct esp *esp, uint32_t core);
void rom_boot_app(struct esp *esp, uint32_t address);
void rom_route(struct esp *esp, uint32_t core, uint32_t source, uint32_t interrupt);
void rom_put_byte(struct esp *esp, uint32_t byte);
uint64_t rom_sending(const struct esp *esp); /* cycles until UART 0 has sent all */
uint32_t rom_crc(struct esp *esp, uint32_t crc, uint32_t from, uint32_t count, unsigned bits);
void rom_md5(struct esp *esp, uint32_t context, uint32_t from, uint32_t count, int step);
void rom_output_signal(struct esp *esp, uint32_t pin, uint32_t signal, uint32_t inverts,
                       uint32_t enable_inverts);
void rom_input_signal(struct esp *esp, uint32_t pin, uint32_t signal, uint32_t inverts);
void rom_select_gpio(struct esp *esp, uint32_t pin);
uint32_t rom_analog_load(const struct esp *esp, uint32_t block, uint32_t reg, uint32_t high, uint32_t low);
void rom_analog_store(struct esp *esp, uint32_t block, uint32_t reg, uint32_t high, uint32_t low,
                      uint32_t value);
uint32_t rom_set_level(struct esp *esp, uint32_t level);
void rom_unmap_all(struct esp *esp, uint32_t core);
uint32_t rom_map_flash(struct esp *esp, uint32_t core, uint32_t address, uint32_t place, uint32_t count);
void rom_invalidate_s3(struct esp *esp, uint32_t from, uint32_t size);
void rom_cache_s3(struct esp *esp, unsigned bit, bool on);
uint32_t rom_flash_status(struct esp *esp, uint32_t to, uint32_t code);
uint32_t rom_flash_read(struct esp *esp, uint32_t from, uint32_t to, uint32_t count);

/* rom_boot.c: for the S3's bootloader. @return 0: done */
uint32_t rom_sha_init(struct esp *esp, uint32_t context, uint32_t type);
void rom_sha_update(struct esp *esp, uint32_t context, uint32_t from, uint32_t count);
uint32_t rom_sha_finish(struct esp *esp, uint32_t context, uint32_t to);
uint32_t rom_flash_erase_sector(struct esp *esp, uint32_t sector);
uint32_t rom_flash_write(struct esp *esp, uint32_t to, uint32_t from, uint32_t count);

/* rom_watchdog.c: wdt_hal_*. @param context  a wdt_hal_context_t of ESP-IDF */
void rom_dog_init(struct esp *esp, uint32_t context, uint32_t which, uint32_t prescaler, bool interrupts);
void rom_dog_stage(struct esp *esp, uint32_t context, uint32_t stage, uint32_t ticks, uint32_t action);
void rom_dog_lock(struct esp *esp, uint32_t context, bool on);
void rom_dog_feed(struct esp *esp, uint32_t context);
void rom_dog_enable(struct esp *esp, uint32_t context, bool on);
void rom_dog_flashboot(struct esp *esp, uint32_t context, bool on);
void rom_dog_handle(struct esp *esp, uint32_t context);
uint32_t rom_dog_is_enabled(struct esp *esp, uint32_t context);

#endif
