/* SPDX-License-Identifier: MIT */
#include "chip/config_words.h"

#include <stdint.h>

/* Table 34-1: BFC0FFC0 .. BFC0FFEC */
struct config_words {
    uint32_t devcfg3, devcfg2, devcfg1, devcfg0;
    uint32_t devcp[4];   /* 3 .. 0 */
    uint32_t devsign[4]; /* 3 .. 0 */
};

extern const struct config_words config_words;

__attribute__((section(".config"))) const struct config_words config_words = {
    .devcfg3 = DEVCFG3_WORD,
    .devcfg2 = DEVCFG2_WORD,
    .devcfg1 = DEVCFG1_WORD,
    .devcfg0 = DEVCFG0_WORD,
    .devcp = {0xFFFFFFFFu, 0xFFFFFFFFu, 0xFFFFFFFFu, DEVCP0_WORD},
    .devsign = {0xFFFFFFFFu, 0xFFFFFFFFu, 0xFFFFFFFFu, DEVSIGN0_WORD},
};
