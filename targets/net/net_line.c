/* SPDX-License-Identifier: MIT */
#include "net_line.h"

#include <string.h>

uint8_t net_line_upper(char character) {
    return (uint8_t)(character >= 'a' && character <= 'z' ? character - 'a' + 'A' : character);
}

bool net_line_is_realtime(uint8_t byte) {
    return byte >= 0x80 || byte == '?' || byte == '!' || byte == '~' || byte == 0x18;
}

/* Blanks and control characters are passed over: the controller's line reader drops them, too. */
bool net_line_is_jog(const char *line, size_t size) {
    static const char jog[] = "$J=";
    size_t at = 0;
    for (size_t i = 0; i < size && jog[at] != '\0'; i++)
        if ((uint8_t)line[i] > ' ' && net_line_upper(line[i]) != (uint8_t)jog[at++])
            return false;
    return jog[at] == '\0';
}

size_t net_line_sound(const char *line, size_t size) {
    const char *spoiled = memchr(line, NET_LINE_SPOILED, size);
    return spoiled == NULL ? size : (size_t)(spoiled - line);
}

/* G-code, or $H: neither a mark nor a command that begins nothing. */
static bool begins_something(const char *line, size_t size) {
    size_t at = 0;
    while (at < size && (uint8_t)line[at] <= ' ')
        at++;
    if (at == size || (uint8_t)line[at] >= 0x80)
        return false;
    return line[at] != '$' || (at + 1 < size && net_line_upper(line[at + 1]) == 'H');
}

size_t net_line_call_off(char *lines, size_t whole, size_t *count, const char *stopped) {
    const size_t mark = stopped == NULL ? 0 : strlen(stopped);
    size_t to = 0, from = 0;
    while (from < whole) {
        const char *end = memchr(lines + from, '\n', whole - from);
        const size_t size = end == NULL ? whole - from : (size_t)(end + 1 - (lines + from));
        const bool jog = net_line_is_jog(lines + from, size);
        if (jog) {
            lines[to++] = '\n';
        } else if (mark > 0 && mark < size && begins_something(lines + from, size)) {
            memcpy(lines + to, stopped, mark);
            to += mark;
            lines[to++] = '\n';
        } else {
            memmove(lines + to, lines + from, size);
            to += size;
        }
        from += size;
    }
    memmove(lines + to, lines + whole, *count - whole);
    *count -= whole - to;
    return to;
}

size_t net_line_plain_run(const char *bytes, size_t count) {
    /* what is printed, but for ! ? ~; a byte for each, because every received byte is looked up */
    static const bool plain[256] = {[' '] = true, ['"' ... '>'] = true, ['@' ... '}'] = true};
    const uint8_t *const all = (const uint8_t *)bytes;
    size_t run = 0;
    while (run < count && plain[all[run]])
        run++;
    return run;
}

bool net_line_commands(const char *line, size_t size, const char *command) {
    size_t same = 0;
    while (same < size && command[same] != '\0' && net_line_upper(line[same]) == (uint8_t)command[same])
        same++;
    return command[same] == '\0';
}

bool net_line_begins(const char *line, size_t size, const char *with) {
    size_t length = strlen(with);
    return size >= length && memcmp(line, with, length) == 0;
}

bool net_line_is_news(const char *line, size_t size) {
    return net_line_begins(line, size, "<") || net_line_begins(line, size, "[MSG:") ||
           net_line_begins(line, size, "ALARM:") || net_line_begins(line, size, "Grbl ");
}
