/* SPDX-License-Identifier: MIT
 * Strings, numbers and printing of the boot ROM. */
#include "rom.h"

#include <string.h>

static uint32_t byte_at(struct esp *esp, uint32_t at) {
    return bus_load(esp, at, 1);
}

static bool works(const struct esp *esp) {
    return esp->stop != ES_FAULT && !esp->cpu->broken;
}

/* ---- copies ---- */

uint32_t rom_copy_text(struct esp *esp, uint32_t to, uint32_t from, uint32_t room, bool pads) {
    bool ended = false;
    for (uint32_t i = 0; i < room && works(esp) && !(ended && !pads); i++) {
        const uint32_t byte = ended ? 0 : byte_at(esp, from + i);
        bus_store(esp, to + i, byte, 1);
        ended = byte == 0;
    }
    return to;
}

static uint32_t length_of(struct esp *esp, uint32_t text, uint32_t most) {
    uint32_t length = 0;
    while (length < most && works(esp) && byte_at(esp, text + length) != 0)
        length++;
    return length;
}

/* strlcpy, strlcat. @return the length that it would have had */
uint32_t rom_copy_limited(struct esp *esp, uint32_t to, uint32_t from, uint32_t room, bool appends) {
    const uint32_t begin = appends ? length_of(esp, to, room) : 0, length = length_of(esp, from, UINT32_MAX);
    for (uint32_t i = 0; begin + i < room && i <= length && works(esp); i++)
        bus_store(esp, to + begin + i, begin + i + 1 == room ? 0 : byte_at(esp, from + i), 1);
    return begin + length;
}

uint32_t rom_append(struct esp *esp, uint32_t to, uint32_t from, uint32_t most) {
    const uint32_t end = to + length_of(esp, to, UINT32_MAX), count = length_of(esp, from, most);
    for (uint32_t i = 0; i < count && works(esp); i++)
        bus_store(esp, end + i, byte_at(esp, from + i), 1);
    bus_store(esp, end + count, 0, 1);
    return to;
}

/* ---- searches ---- */

uint32_t rom_find(struct esp *esp, uint32_t at, uint32_t byte, uint32_t count, bool is_text, bool last) {
    uint32_t found = 0;
    for (uint32_t i = 0; i < count && works(esp); i++) {
        const uint32_t here = byte_at(esp, at + i);
        if (here == (byte & 255)) {
            found = at + i;
            if (!last)
                break;
        }
        if (is_text && here == 0)
            break;
    }
    return found;
}

uint32_t rom_find_text(struct esp *esp, uint32_t text, uint32_t part) {
    for (; works(esp); text++) {
        uint32_t i = 0;
        while (works(esp) && byte_at(esp, part + i) != 0 && byte_at(esp, text + i) == byte_at(esp, part + i))
            i++;
        if (byte_at(esp, part + i) == 0)
            return text;
        if (byte_at(esp, text) == 0)
            return 0;
    }
    return 0;
}

uint32_t rom_span(struct esp *esp, uint32_t text, uint32_t set, bool in_set) {
    uint32_t length = 0;
    for (uint32_t byte; works(esp) && (byte = byte_at(esp, text + length)) != 0; length++)
        if ((rom_find(esp, set, byte, UINT32_MAX, true, false) != 0) != in_set)
            break;
    return length;
}

uint32_t rom_fold(uint32_t byte, bool to_upper) {
    const uint32_t first = to_upper ? 'a' : 'A';
    return byte - first < 26 ? byte ^ 32 : byte;
}

uint32_t rom_compare_folded(struct esp *esp, uint32_t a, uint32_t b, uint32_t count) {
    for (uint32_t i = 0; i < count && works(esp); i++) {
        const uint32_t x = rom_fold(byte_at(esp, a + i), false), y = rom_fold(byte_at(esp, b + i), false);
        if (x != y || x == 0)
            return x - y;
    }
    return 0;
}

/* ---- characters of the C locale ---- */

enum { UPPER = 1, LOWER = 2, DIGIT = 4, SPACE = 8, PUNCT = 16, CONTROL = 32, HEX = 64, BLANK = 128 };

static uint8_t class_of(uint32_t byte) {
    if (byte >= 127)
        return byte == 127 ? CONTROL : 0;
    if (byte < 32)
        return byte >= 9 && byte <= 13 ? CONTROL | SPACE : CONTROL;
    if (byte == ' ')
        return SPACE | BLANK;
    if (byte - '0' < 10)
        return DIGIT;
    if ((byte | 32) - 'a' < 26)
        return (uint8_t)(((byte & 32) != 0 ? LOWER : UPPER) | ((byte | 32) <= 'f' ? HEX : 0));
    return PUNCT;
}

uint32_t rom_is(uint32_t byte, enum rom_class what) {
    static const uint8_t masks[] = {[ROM_ALNUM] = UPPER | LOWER | DIGIT,
                                    [ROM_ALPHA] = UPPER | LOWER,
                                    [ROM_DIGIT] = DIGIT,
                                    [ROM_SPACE] = SPACE,
                                    [ROM_UPPER] = UPPER,
                                    [ROM_LOWER] = LOWER,
                                    [ROM_PRINT] = UPPER | LOWER | DIGIT | PUNCT | BLANK,
                                    [ROM_PUNCT] = PUNCT,
                                    [ROM_CONTROL] = CONTROL};
    return class_of(byte) & masks[what];
}

/* One byte for each character, the first for EOF; a pointer to them lies before. */
void rom_put_tables(struct esp *esp) {
    static const uint32_t pointer = 0x3FF96350, table = 0x3FF96354;
    uint8_t bytes[257] = {0};
    for (uint32_t i = 0; i < 256; i++)
        bytes[i + 1] = class_of(i);
    (void)es_write(esp, pointer, (const uint8_t *)&table, sizeof table);
    (void)es_write(esp, table, bytes, sizeof bytes);
}

/* ---- numbers ---- */

static uint32_t digit_of(uint32_t byte) {
    if (byte - '0' < 10)
        return byte - '0';
    return (byte | 32) - 'a' < 26 ? (byte | 32) - 'a' + 10 : 99;
}

/* strtol, strtoul; errno is not set. @param end  where to put the address behind the number; 0: nowhere */
uint32_t rom_number(struct esp *esp, uint32_t text, uint32_t end, uint32_t base, bool is_signed) {
    uint32_t at = text, digit, behind = text;
    uint64_t value = 0;
    while (rom_is(byte_at(esp, at), ROM_SPACE) != 0)
        at++;
    const bool negative = byte_at(esp, at) == '-';
    if (negative || byte_at(esp, at) == '+')
        at++;
    const bool has_x = byte_at(esp, at) == '0' && (byte_at(esp, at + 1) | 32) == 'x';
    if (has_x && (base == 0 || base == 16) && digit_of(byte_at(esp, at + 2)) < 16) {
        base = 16;
        at += 2;
    } else if (base == 0)
        base = byte_at(esp, at) == '0' ? 8 : 10;
    for (; works(esp) && (digit = digit_of(byte_at(esp, at))) < base; behind = ++at)
        value = value > UINT32_MAX ? value : value * base + digit;
    if (end != 0)
        bus_store(esp, end, behind, 4);
    const uint64_t most = !is_signed ? UINT32_MAX : negative ? (uint64_t)INT32_MAX + 1 : INT32_MAX;
    if (value > most)
        return (uint32_t)most;
    return negative ? 0u - (uint32_t)value : (uint32_t)value;
}

uint32_t rom_put_number(struct esp *esp, uint32_t value, uint32_t to, uint32_t base) {
    const bool negative = base == 10 && (int32_t)value < 0;
    uint32_t left = negative ? 0u - value : value;
    char digits[36];
    unsigned count = 0, at = 0;
    if (base < 2 || base > 36)
        return 0;
    do
        digits[count++] = "0123456789abcdefghijklmnopqrstuvwxyz"[left % base];
    while ((left /= base) != 0);
    if (negative)
        digits[count++] = '-';
    while (count-- > 0)
        bus_store(esp, to + at++, (uint8_t)digits[count], 1);
    bus_store(esp, to + at, 0, 1);
    return to;
}

/* ---- ets_printf ---- */

static void put_text(struct esp *esp, uint32_t text) {
    if (text == 0)
        for (const char *at = "(null)"; *at != '\0'; at++)
            rom_put_byte(esp, (uint8_t)*at);
    else
        for (uint32_t byte; works(esp) && (byte = byte_at(esp, text)) != 0; text++)
            rom_put_byte(esp, byte);
}

static void put_number(struct esp *esp, uint32_t value, unsigned base, bool negative, unsigned width,
                       char pad) {
    char digits[34];
    unsigned count = 0;
    do
        digits[count++] = "0123456789abcdef"[value % base];
    while ((value /= base) != 0);
    if (negative)
        digits[count++] = '-';
    for (unsigned i = count; i < width; i++)
        rom_put_byte(esp, (uint8_t)pad);
    while (count-- > 0)
        rom_put_byte(esp, (uint8_t)digits[count]);
}

/* A conversion. @return where the format continues */
static uint32_t convert(struct esp *esp, uint32_t at, unsigned *argument) {
    unsigned width = 0;
    char pad = ' ';
    uint32_t byte = byte_at(esp, at++);
    if (byte == '0')
        pad = '0';
    for (; byte - '0' < 10 || byte == 'l' || byte == '-' || byte == '.' || byte == '#';
         byte = byte_at(esp, at++))
        width = byte - '0' < 10 ? 10 * width + (byte - '0') : width;
    if (byte == '%') {
        rom_put_byte(esp, '%');
        return at;
    }
    const uint32_t value = rom_word(esp, (*argument)++);
    if (byte == 's')
        put_text(esp, value);
    else if (byte == 'c')
        rom_put_byte(esp, value);
    else if (byte == 'd' || byte == 'i')
        put_number(esp, (int32_t)value < 0 ? 0u - value : value, 10, (int32_t)value < 0, width, pad);
    else
        put_number(esp, value, byte == 'u' ? 10 : 16, false, width, pad);
    return at;
}

void rom_print(struct esp *esp, uint32_t format) {
    unsigned argument = 1;
    for (uint32_t at = format, byte; works(esp) && (byte = byte_at(esp, at++)) != 0;) {
        if (byte == '%')
            at = convert(esp, at, &argument);
        else
            rom_put_byte(esp, byte);
    }
}
