/* SPDX-License-Identifier: MIT
 * Text -> block. Checks in Grbl 1.1h's order, word by word. */
#include "gcode/block.h"
#include "gcode/number.h"

#define WORDS_CODE (WORD_BIT('G') | WORD_BIT('M'))
/* Words with any number, and words with a rule of their own. */
#define WORDS_FREE                                                                                           \
    (WORDS_AXES | WORD_BIT('E') | WORD_BIT('I') | WORD_BIT('J') | WORD_BIT('K') | WORD_BIT('L') |            \
     WORD_BIT('R'))
#define WORDS_NOT_NEGATIVE                                                                                   \
    (WORD_BIT('F') | WORD_BIT('H') | WORD_BIT('N') | WORD_BIT('P') | WORD_BIT('Q') | WORD_BIT('S') |         \
     WORD_BIT('T'))
/* Words that any positive number suits. */
#define WORDS_POSITIVE (WORDS_FREE | (WORDS_NOT_NEGATIVE & ~WORD_BIT('T')))

enum { TOOL_NUMBER_MAX = 255, CODE_X10_MAX = 999 };

/* The table: entry 0 is not a code. */
enum code_index {
    CODE_UNKNOWN,
#define CODE(letter, x10, group, value, axes, ...) CODE_##letter##x10,
#include "gcode/codes.def"
#undef CODE
};

struct code {
    uint8_t group, value, axes;
};

static const struct code codes[] = {
    [CODE_UNKNOWN] = {0, 0, 0},
#define CODE(letter, x10, group, value, axes, ...) [CODE_##letter##x10] = {GROUP_##group, value, axes},
#include "gcode/codes.def"
#undef CODE
};

/* The place of a code in it, by ten times its number: a search would cost more than the rest of the word. */
#define G(x10) [x10] = CODE_G##x10,
#define M(x10)
#define CODE(letter, x10, group, value, axes, ...) letter(x10)
static const uint8_t g_codes[CODE_X10_MAX + 1] = {
#include "gcode/codes.def"
};
#undef G
#undef M
#define G(x10)
#define M(x10) [x10] = CODE_M##x10,
static const uint8_t m_codes[CODE_X10_MAX + 1] = {
#include "gcode/codes.def"
};
#undef G
#undef M
#undef CODE

/* Grbl's answer to a code that is not in the table: a fraction on an M code or on a G code that has no
 * variants is "not a whole number" (G1.5, G54.1); anything else is unsupported (G5, G38.9, M56). */
static COLD enum status unknown_code(char letter, struct number number) {
    const double value = number_value(number);
    const int whole = value >= 0.0 && value <= (double)CODE_X10_MAX ? (int)value : -1;
    bool plain = false, variants = false;

    if (whole < 0 || value == whole)
        return STATUS_UNSUPPORTED;
    if (letter == 'M')
        return STATUS_NOT_INTEGER;
#define CODE(code_letter, x10, group, value, axes, ...)                                                      \
    if (#code_letter[0] == 'G' && (x10) / 10 == whole) {                                                     \
        plain |= (x10) % 10 == 0;                                                                            \
        variants |= (x10) % 10 != 0;                                                                         \
    }
#include "gcode/codes.def"
#undef CODE
    return plain && !variants ? STATUS_NOT_INTEGER : STATUS_UNSUPPORTED;
}

/* G38.2 -> 382; -1 for a number that cannot be in the table. */
static COLD int fraction_x10(struct number number) {
    ptrdiff_t decimals = number.decimals;
    int64_t digits = number.digits;

    for (; decimals > 1 && digits % 10 == 0; decimals--)
        digits /= 10; /* G38.20 */
    return !number.negative && decimals == 1 && digits <= CODE_X10_MAX ? (int)digits : -1;
}

/* G1 -> 10 immediately; the others by the way above. */
static HOT unsigned code_index(char letter, struct number number) {
    const uint8_t *const indices = letter == 'G' ? g_codes : m_codes;
    int x10;

    if (number.decimals == 0 && !number.negative && number.digits <= CODE_X10_MAX / 10)
        return indices[number.digits * 10];
    x10 = fraction_x10(number);
    return x10 >= 0 ? indices[x10] : CODE_UNKNOWN;
}

/* Whether the line has axis words, among those before `rest` or in it. */
static COLD bool has_axis_words(uint32_t words, const char *rest) {
    for (; *rest != '\0' && *rest != '\n' && *rest != '\r'; rest++)
        if (*rest >= 'A' && *rest <= 'Z')
            words |= WORD_BIT(*rest);
    return (words & WORDS_AXES) != 0;
}

/* Two codes that use axis words: without any there is nothing to share, and the motion is but a mode. */
static COLD enum status share_axes(struct gcode_block *block, uint8_t axes, uint32_t words,
                                   const char *rest) {
    if (has_axis_words(words, rest))
        return STATUS_AXIS_COMMANDS;
    if (block->axes == AXES_MOTION)
        block->axes = axes;
    return STATUS_OK;
}

/* Two codes of a group. G80 next to another motion ends the canned cycle, and the other one is the motion, as
 * in LinuxCNC: G0 G80 in the head of a program. */
static COLD enum status share_group(struct gcode_block *block, struct code code) {
    const bool ends = code.value == MOTION_NONE, ended = block->value[GROUP_MOTION] == MOTION_NONE;

    if (code.group != GROUP_MOTION || ends == ended)
        return STATUS_MODAL_GROUP;
    if (ended)
        block->value[GROUP_MOTION] = code.value;
    return STATUS_OK;
}

/* Errors in Grbl's order: unknown code, two codes that use axis words, two codes of a group.
 * @param words  of the line before this one @param rest  of the line, after it */
static HOT enum status take_code(struct gcode_block *block, char letter, struct number number, uint32_t words,
                                 const char *rest) {
    const unsigned index = code_index(letter, number);
    const struct code code = codes[index];

    if (index == CODE_UNKNOWN)
        return unknown_code(letter, number);
    if (block->axes == AXES_FREE) {
        block->axes = code.axes;
    } else if (code.axes != AXES_FREE) {
        const enum status status = share_axes(block, code.axes, words, rest);

        if (status != STATUS_OK)
            return status;
    }
    if (block->groups >> code.group & 1)
        return share_group(block, code);
    block->groups |= (uint32_t)1 << code.group;
    block->value[code.group] = code.value;
    return STATUS_OK;
}

/* Why a word cannot be taken; the order of Grbl's checks. */
static COLD enum status word_status(const struct gcode_block *block, uint32_t words, uint32_t bit,
                                    double number) {
    const bool spline =
        block_has_group(block, GROUP_MOTION) && BLOCK_MOTION(block->value[GROUP_MOTION]) == MOTION_CUBIC;

    if (!(bit & (WORDS_FREE | WORDS_NOT_NEGATIVE)))
        return STATUS_UNSUPPORTED;
    if (bit == WORD_BIT('T') && number > (double)TOOL_NUMBER_MAX)
        return STATUS_TOOL_NUMBER;
    if (words & bit)
        return STATUS_WORD_REPEATED;
    if (spline && (bit & (WORD_BIT('P') | WORD_BIT('Q')))) /* distances: G5 says so */
        return STATUS_OK;
    if (number < 0.0 && (bit & WORDS_NOT_NEGATIVE))
        return STATUS_NEGATIVE;
    return STATUS_OK;
}

static const char *skip_digits(const char *text) {
    while (number_digit(*text) <= 9)
        text++;
    return text;
}

/* Words up to the first character that is none. @param blanks  spaces may follow a word */
static HOT enum status parse_words(const char **text, bool blanks, struct gcode_block *block) {
    const char *line = *text;
    uint32_t words = 0;
    unsigned word;

    block->groups = 0;
    block->axes = AXES_FREE;
    block->value[GROUP_NONMODAL] = NONMODAL_NONE;

    while ((word = (unsigned)(unsigned char)*line - 'A') <= WORD('Z')) {
        const uint32_t bit = (uint32_t)1 << word;
        const struct number number = number_scan(line + 1);

        if (number.end == NULL)
            return STATUS_BAD_NUMBER;
        if (bit & WORDS_CODE) {
            const enum status status = take_code(block, *line, number, words, number.end);

            if (status != STATUS_OK)
                return status;
        } else {
            /* One test for the usual word: not seen before, and of a letter that takes any number of this
             * sign. */
            const uint32_t doubtful = words | ~(number.negative ? WORDS_FREE : WORDS_POSITIVE);

            block->number[word] = number_value(number);
            if (bit & doubtful) {
                const enum status status = word_status(block, words, bit, block->number[word]);

                if (status != STATUS_OK)
                    return status;
            }
            words |= bit;
        }
        for (line = number.end; blanks && *line == ' ';)
            line++;
    }
    block->words = words;
    *text = line;
    return STATUS_OK;
}

bool gcode_is_program_mark(const char *line) {
    if (*line == 'N')
        line = skip_digits(line + 1);
    if (*line == '%')
        return line[1] == '\0';
    if ((*line != 'O' && *line != ':') || number_digit(line[1]) > 9)
        return false;
    return *skip_digits(line + 1) == '\0';
}

/* A mark asks for nothing: its block is empty. @param status  what else is wrong with the line */
static COLD enum status parse_mark(const char *line, enum status status, struct gcode_block *block) {
    if (!gcode_is_program_mark(line))
        return status;
    block->words = block->groups = 0;
    block->axes = AXES_FREE;
    block->value[GROUP_NONMODAL] = NONMODAL_NONE;
    return STATUS_OK;
}

enum status gcode_parse(const char *line, struct gcode_block *block) {
    const char *const start = line;
    const enum status status = parse_words(&line, false, block);

    if (status != STATUS_OK)
        return parse_mark(start, status, block);
    return *line == '\0' ? STATUS_OK : parse_mark(start, STATUS_EXPECTED_LETTER, block);
}

const char *gcode_parse_plain(const char *line, struct gcode_block *block) {
    const char *const start = line;

    if (parse_words(&line, true, block) != STATUS_OK || line == start || (*line != '\n' && *line != '\r'))
        return NULL;
    return line;
}
