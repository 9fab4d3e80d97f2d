/* SPDX-License-Identifier: MIT
 * Text -> block. Checks in Grbl 1.1h's order, word by word. */
#include "gcode/block.h"
#include "gcode/number.h"

#define WORDS_KNOWN                                                                                          \
    (WORD_BIT('A') | WORD_BIT('B') | WORD_BIT('C') | WORD_BIT('F') | WORD_BIT('I') | WORD_BIT('J') |         \
     WORD_BIT('K') | WORD_BIT('L') | WORD_BIT('N') | WORD_BIT('P') | WORD_BIT('R') | WORD_BIT('S') |         \
     WORD_BIT('T') | WORD_BIT('X') | WORD_BIT('Y') | WORD_BIT('Z'))
#define WORDS_NOT_NEGATIVE (WORD_BIT('F') | WORD_BIT('N') | WORD_BIT('P') | WORD_BIT('S') | WORD_BIT('T'))

enum { TOOL_NUMBER_MAX = 255, CODE_X10_MAX = 9999 };

struct code {
    bool known;
    uint8_t group, value, axes;
};

enum { KEY_G = 0, KEY_M = CODE_X10_MAX + 1 };

static struct code find_code(unsigned key) {
    switch (key) {
#define CODE(letter, x10, group, value, axes)                                                                \
    case KEY_##letter + (x10):                                                                               \
        return (struct code){true, GROUP_##group, value, axes};
#include "gcode/codes.def"
#undef CODE
    default:
        return (struct code){false, 0, 0, 0};
    }
}

/* Grbl's answer to a code that is not in the table: a fraction on an M code or on a G code that has no
 * variants is "not a whole number" (G1.5, G54.1); anything else is unsupported (G5, G38.9, M6). */
static enum status unknown_code(char letter, double number) {
    const double whole = number < CODE_X10_MAX ? (double)(int)number : number;
    bool plain = false, variants = false;

    if (number < 0.0 || number == whole)
        return STATUS_UNSUPPORTED;
    if (letter == 'M')
        return STATUS_NOT_INTEGER;
#define CODE(code_letter, x10, group, value, axes)                                                           \
    if (#code_letter[0] == 'G' && (x10) / 10 == whole) {                                                     \
        plain |= (x10) % 10 == 0;                                                                            \
        variants |= (x10) % 10 != 0;                                                                         \
    }
#include "gcode/codes.def"
#undef CODE
    return plain && !variants ? STATUS_NOT_INTEGER : STATUS_UNSUPPORTED;
}

static enum status take_code(struct gcode_block *block, char letter, double number) {
    /* n/10 * 10 is exactly n again (10 = 2^3 + 2^1, Kahan), so no rounding is needed. */
    const double x10 = number * 10.0;
    struct code code = {false, 0, 0, 0};

    if (x10 >= 0.0 && x10 <= CODE_X10_MAX && (double)(int)x10 == x10)
        code = find_code((unsigned)(int)x10 + (letter == 'M' ? KEY_M : KEY_G));
    if (!code.known)
        return unknown_code(letter, number);
    if (code.axes != AXES_FREE) {
        if (block->axes != AXES_FREE)
            return STATUS_AXIS_COMMANDS;
        block->axes = code.axes;
    }
    if (block->groups >> code.group & 1u)
        return STATUS_MODAL_GROUP;
    block->groups |= (uint16_t)(1u << code.group);
    block->value[code.group] = code.value;
    return STATUS_OK;
}

static enum status take_word(struct gcode_block *block, unsigned word, double number) {
    const uint32_t bit = (uint32_t)1 << word;

    if (!(bit & WORDS_KNOWN))
        return STATUS_UNSUPPORTED;
    if (bit == WORD_BIT('T') && number > TOOL_NUMBER_MAX)
        return STATUS_TOOL_NUMBER;
    if (block->words & bit)
        return STATUS_WORD_REPEATED;
    if (number < 0.0 && (bit & WORDS_NOT_NEGATIVE))
        return STATUS_NEGATIVE;
    block->words |= bit;
    block->number[word] = number;
    return STATUS_OK;
}

enum status gcode_parse(const char *line, struct gcode_block *block) {
    block->words = 0;
    block->groups = 0;
    block->axes = AXES_FREE;

    while (*line != '\0') {
        const char letter = *line;
        const unsigned word = (unsigned)(unsigned char)letter - 'A';
        enum status status;
        double number;

        if (word > WORD('Z'))
            return STATUS_EXPECTED_LETTER;
        line = number_read(line + 1, &number);
        if (line == NULL)
            return STATUS_BAD_NUMBER;
        status = letter == 'G' || letter == 'M' ? take_code(block, letter, number)
                                                : take_word(block, word, number);
        if (status != STATUS_OK)
            return status;
    }
    return STATUS_OK;
}
