/* SPDX-License-Identifier: MIT
 * What the core uses of <string.h>; C11 7.24. The compiler inlines short copies. */
#ifndef WIFICNC_PIC32MZ_STRING_H
#define WIFICNC_PIC32MZ_STRING_H

#include <stddef.h>

void *memcpy(void *restrict to, const void *restrict from, size_t count);
void *memmove(void *to, const void *from, size_t count);
void *memset(void *at, int value, size_t count);
int memcmp(const void *a, const void *b, size_t count);
void *memchr(const void *at, int value, size_t count);
size_t strlen(const char *text);
int strcmp(const char *a, const char *b);
int strncmp(const char *a, const char *b, size_t count);
char *strcpy(char *restrict to, const char *restrict from);
char *strchr(const char *text, int wanted);
size_t strcspn(const char *text, const char *wanted);
char *strpbrk(const char *text, const char *wanted);

#define memcpy(to, from, count)  __builtin_memcpy(to, from, count)
#define memset(at, value, count) __builtin_memset(at, value, count)

#endif
