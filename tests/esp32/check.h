/* SPDX-License-Identifier: MIT
 * What the C tests of the ESP32's portable parts have in common: a failed check says where and what. */
#ifndef WIFICNC_TESTS_ESP32_CHECK_H
#define WIFICNC_TESTS_ESP32_CHECK_H

#include <stdbool.h>
#include <stdio.h>

/* One for all files of a program. */
__attribute__((weak)) unsigned failures;

#define CHECK(good) check((good), #good, __LINE__)

static inline void check(bool good, const char *what, int line) {
    if (good)
        return;
    printf("line %d: %s\n", line, what);
    failures++;
}

static inline int report(void) {
    printf("%u failures\n", failures);
    return failures == 0 ? 0 : 1;
}

#endif
