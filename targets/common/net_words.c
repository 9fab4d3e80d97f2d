/* SPDX-License-Identifier: MIT */
#include "net_words.h"

#include <string.h>

uint8_t net_words_upper(char character) {
    return (uint8_t)(character >= 'a' && character <= 'z' ? character - 'a' + 'A' : character);
}

bool net_words_is_jog(const char *line, size_t size) {
    static const char jog[] = "$J=";
    size_t at = 0;
    for (size_t i = 0; i < size && jog[at] != '\0'; i++)
        if (line[i] > ' ' && net_words_upper(line[i]) != (uint8_t)jog[at++])
            return false;
    return jog[at] == '\0';
}

bool net_words_begins(const char *line, size_t size, const char *with) {
    size_t length = strlen(with);
    return size >= length && memcmp(line, with, length) == 0;
}

bool net_words_is_news(const char *line, size_t size) {
    return net_words_begins(line, size, "<") || net_words_begins(line, size, "[MSG:") ||
           net_words_begins(line, size, "ALARM:") || net_words_begins(line, size, "Grbl ");
}
