/* SPDX-License-Identifier: MIT */
#include <string.h>

#include <stdint.h>

#undef memcpy
#undef memset

/* Or the compiler would see a memcpy() in these loops, and call it. */
#if defined(__clang__)
#define OWN_LOOP
#else
#define OWN_LOOP __attribute__((optimize("no-tree-loop-distribute-patterns")))
#endif

/* Words where both are aligned, as structures are. */
OWN_LOOP static void copy_up(uint8_t *to, const uint8_t *from, size_t count) {
    if ((((uintptr_t)to | (uintptr_t)from) & 3u) == 0) {
        for (; count >= 4; count -= 4, to += 4, from += 4)
            *(uint32_t __attribute__((may_alias)) *)to = *(const uint32_t __attribute__((may_alias)) *)from;
    }
    for (; count > 0; count--)
        *to++ = *from++;
}

OWN_LOOP static void copy_down(uint8_t *to, const uint8_t *from, size_t count) {
    while (count-- > 0)
        to[count] = from[count];
}

void *memcpy(void *restrict to, const void *restrict from, size_t count) {
    copy_up(to, from, count);
    return to;
}

void *memmove(void *to, const void *from, size_t count) {
    if ((uintptr_t)to <= (uintptr_t)from)
        copy_up(to, from, count);
    else
        copy_down(to, from, count);
    return to;
}

OWN_LOOP void *memset(void *at, int value, size_t count) {
    uint8_t *byte = at;
    uint32_t word = (uint8_t)value * 0x01010101u;
    for (; count > 0 && ((uintptr_t)byte & 3u) != 0; count--)
        *byte++ = (uint8_t)value;
    for (; count >= 4; count -= 4, byte += 4)
        *(uint32_t __attribute__((may_alias)) *)(void *)byte = word;
    for (; count > 0; count--)
        *byte++ = (uint8_t)value;
    return at;
}

int memcmp(const void *a, const void *b, size_t count) {
    const uint8_t *left = a, *right = b;
    for (; count > 0; count--, left++, right++)
        if (*left != *right)
            return *left - *right;
    return 0;
}

void *memchr(const void *at, int value, size_t count) {
    const uint8_t *byte = at;
    for (; count > 0; count--, byte++)
        if (*byte == (uint8_t)value)
            return (void *)(uintptr_t)byte;
    return NULL;
}

OWN_LOOP size_t strlen(const char *text) {
    size_t length = 0;
    while (text[length] != '\0')
        length++;
    return length;
}

int strcmp(const char *a, const char *b) {
    while (*a != '\0' && *a == *b)
        a++, b++;
    return (uint8_t)*a - (uint8_t)*b;
}

int strncmp(const char *a, const char *b, size_t count) {
    for (; count > 0; count--, a++, b++)
        if (*a != *b || *a == '\0')
            return (uint8_t)*a - (uint8_t)*b;
    return 0;
}

OWN_LOOP char *strcpy(char *restrict to, const char *restrict from) {
    char *at = to;
    while ((*at++ = *from++) != '\0') {
    }
    return to;
}

char *strchr(const char *text, int wanted) {
    for (;; text++) {
        if (*text == (char)wanted)
            return (char *)(uintptr_t)text;
        if (*text == '\0')
            return NULL;
    }
}

size_t strcspn(const char *text, const char *wanted) {
    size_t length = 0;
    while (text[length] != '\0' && strchr(wanted, text[length]) == NULL)
        length++;
    return length;
}

char *strpbrk(const char *text, const char *wanted) {
    text += strcspn(text, wanted);
    return *text != '\0' ? (char *)(uintptr_t)text : NULL;
}
