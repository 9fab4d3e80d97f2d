/* SPDX-License-Identifier: MIT
 * What the bytes of a client's lines mean to the hub. */
#ifndef WIFICNC_NET_LINE_H
#define WIFICNC_NET_LINE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/** A letter of a command, whatever its case. */
uint8_t net_line_upper(char character);

/** As core/input/rx.h: these never wait in a line. */
bool net_line_is_realtime(uint8_t byte);

/** `$J=`, with or without spaces. */
bool net_line_is_jog(const char *line, size_t size);

/** Begins with this command, in letters of any case. */
bool net_line_commands(const char *line, size_t size, const char *command);

bool net_line_begins(const char *line, size_t size, const char *with);

/** Said by the controller on its own, or as a reply to `?`: no part of a line's answer. */
bool net_line_is_news(const char *line, size_t size);

/** As a byte among lines that wait: the line is to be refused. No text, as all bytes from 0x80 on. */
enum { NET_LINE_SPOILED = 0xFF };

/** As the first byte of a line that waits: the hub answers it, to the client of this place + NET_LINE_MARK.
 */
enum { NET_LINE_MARK = 0xC0, NET_LINE_MARKS = 0x20 };

static inline bool net_line_is_marked(const char *line) {
    return (uint8_t)*line >= NET_LINE_MARK && (uint8_t)*line < NET_LINE_MARK + NET_LINE_MARKS;
}

/** As the first byte of a line that is none: the lines behind it are of the client of place + NET_LINES_OF,
 * up to the next such byte. The last one: of a client that is gone. */
enum { NET_LINES_OF = 0xE0, NET_LINES_OF_NOBODY = 0xFE };

static inline bool net_line_says_whose(const char *line) {
    return (uint8_t)*line >= NET_LINES_OF && (uint8_t)*line <= NET_LINES_OF_NOBODY;
}

/** @return bytes before the first NET_LINE_SPOILED */
size_t net_line_sound(const char *line, size_t size);

/** Make each jog of whole lines an empty line, in place. @param whole  their bytes
 *  @param[in,out] count  these and those of the line that has begun
 *  @param stopped  in place of each line of G-code and of $H, its LF aside; NULL: they stay
 *  @return `whole` afterwards */
size_t net_line_call_off(char *lines, size_t whole, size_t *count, const char *stopped);

/** Of a line that waits, behind NET_LINE_MARK: it waited behind a jog that was stopped. */
enum { NET_LINE_STOPPED = '!' };

/** @return bytes of a line before one that ends it or acts immediately */
size_t net_line_plain_run(const char *bytes, size_t count);

#endif
