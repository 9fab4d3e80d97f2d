/* SPDX-License-Identifier: MIT
 * Letters of UTF-8 in a stream of lines: their bytes are text, though alone 0x80 .. 0xBF are real-time
 * commands (as in FluidNC). A letter becomes one byte, TEXT_LETTER: a comment may hold it, and code with it
 * is refused.
 *
 * A byte 0x80 .. 0xBF directly after the first byte of a letter is text even if it was meant as a command; !
 * ~ ? and Ctrl-X always act. The state belongs to one client: its half letter keeps no command of another
 * one.
 *
 * [any] Pure. */
#ifndef WIFICNC_INPUT_TEXT_BYTE_H
#define WIFICNC_INPUT_TEXT_BYTE_H

#include <stdbool.h>
#include <stdint.h>

enum { TEXT_LETTER = 0x7F };

/* Of *left: the letter may be the byte order mark (EF BB BF), which editors put before a text: it is nothing.
 */
enum { TEXT_MARK = 0x80, TEXT_COUNT = 3 };

/** @param[in,out] left  of the letter under way; 0 at first
 *  @param[in,out] byte  of the client; TEXT_LETTER in place of one byte of a letter
 *  @return false: it is another byte of a letter, and none of the stream */
static inline bool text_byte(uint8_t *left, uint8_t *byte) {
    if ((*left & TEXT_COUNT) > 0 && (*byte & 0xC0) == 0x80) {
        --*left;
        if ((*left & TEXT_MARK) == 0)
            return false;
        if (*byte == ((*left & TEXT_COUNT) > 0 ? 0xBB : 0xBF))
            return false;
        *left &= TEXT_COUNT;
        *byte = TEXT_LETTER;
        return true;
    }
    *left = 0;
    if (*byte < 0xC2 || *byte > 0xF4) /* they begin no letter */
        return true;
    *left = (uint8_t)(1 + (*byte >= 0xE0) + (*byte >= 0xF0));
    if (*byte == 0xEF) {
        *left |= TEXT_MARK;
        return false;
    }
    *byte = TEXT_LETTER;
    return true;
}

#endif
