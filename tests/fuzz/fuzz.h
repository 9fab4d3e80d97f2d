/* SPDX-License-Identifier: MIT
 * What the harnesses share: a claim that ends the run when it is wrong, and numbers taken from the input. */
#ifndef WIFICNC_TESTS_FUZZ_H
#define WIFICNC_TESTS_FUZZ_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>

/** libFuzzer's entry, and replay.c's. @return 0 */
int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

/** Whatever arrives, this holds; what is claimed is printed for the one who has to fix it. */
#define CLAIM(holds, ...)                                                                                    \
    do {                                                                                                     \
        if (!(holds)) {                                                                                      \
            fprintf(stderr, "%s:%d: not so: %s\n  ", __FILE__, __LINE__, #holds);                            \
            fprintf(stderr, __VA_ARGS__);                                                                    \
            fputc('\n', stderr);                                                                             \
            abort();                                                                                         \
        }                                                                                                    \
    } while (0)

struct input {
    const uint8_t *at, *end;
};

static inline size_t input_left(const struct input *input) {
    return (size_t)(input->end - input->at);
}

/** The next byte, or 0 behind the end. */
static inline uint8_t input_byte(struct input *input) {
    return input->at < input->end ? *input->at++ : 0;
}

#endif
