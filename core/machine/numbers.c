/* SPDX-License-Identifier: MIT
 * N words of motion lines under way. More lines cannot be under way than there are blocks and segments with a
 * line of their own, and those are fewer than LINE_NUMBERS. */
#include "machine/inner.h"

void numbers_note(struct line_numbers *numbers, uint32_t line, uint32_t number) {
    uint32_t slot = numbers->count++ % LINE_NUMBERS;
    numbers->slots[slot].line = line;
    numbers->slots[slot].number = number;
}

uint32_t numbers_find(const struct line_numbers *numbers, uint32_t line) {
    for (uint32_t back = 1; back <= LINE_NUMBERS && back <= numbers->count; back++) {
        uint32_t slot = (numbers->count - back) % LINE_NUMBERS;
        if (numbers->slots[slot].line == line)
            return numbers->slots[slot].number;
    }
    return 0;
}
