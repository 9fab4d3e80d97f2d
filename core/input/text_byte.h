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

/** @param[in,out] left  bytes that the letter under way still has; 0 at first
 *  @param[in,out] byte  of the client; TEXT_LETTER in place of the first byte of a letter
 *  @return false: it is the rest of a letter, and no byte of the stream */
static inline bool text_byte(uint8_t *left, uint8_t *byte) {
    if (*left > 0 && (*byte & 0xC0) == 0x80) {
        --*left;
        return false;
    }
    *left = 0;
    if (*byte >= 0xC2 && *byte <= 0xF4) { /* the others begin no letter */
        *left = (uint8_t)(1 + (*byte >= 0xE0) + (*byte >= 0xF0));
        *byte = TEXT_LETTER;
    }
    return true;
}

#endif
