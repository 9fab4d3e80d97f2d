/* SPDX-License-Identifier: MIT
 * What we use of ESP-IDF 5.5's esp_private/periph_ctrl.h, declared again: enough to compile against, checked
 * against the real one by tools/xtensa with IDF_PATH set. */
#pragma once

#include <stdint.h>

typedef enum { PERIPH_TIMG0_MODULE } periph_module_t;

uint8_t periph_rcc_acquire_enter(periph_module_t module);
void periph_rcc_acquire_exit(periph_module_t module, uint8_t users);

void periph_rcc_enter(void);
void periph_rcc_exit(void);

#define PERIPH_RCC_ATOMIC()                                                                                  \
    for (int once_ = (periph_rcc_enter(), 1); once_ != 0; periph_rcc_exit(), once_ = 0)

#define PERIPH_RCC_ACQUIRE_ATOMIC(module, users)                                                             \
    for (uint8_t users = periph_rcc_acquire_enter(module), once_ = 1; once_ != 0;                            \
         periph_rcc_acquire_exit(module, users), once_ = 0)
