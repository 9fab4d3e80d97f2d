/* SPDX-License-Identifier: MIT
 * What a line of text is, by its first characters: for a hub that passes lines on and executes none. */
#ifndef WIFICNC_COMMON_NET_WORDS_H
#define WIFICNC_COMMON_NET_WORDS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/** A letter of a command, whatever its case. */
uint8_t net_words_upper(char character);

/** `$J=`, with or without spaces. */
bool net_words_is_jog(const char *line, size_t size);

bool net_words_begins(const char *line, size_t size, const char *with);

/** Said by the controller on its own, or as a reply to `?`: no part of a line's answer. */
bool net_words_is_news(const char *line, size_t size);

#endif
