/* SPDX-License-Identifier: MIT
 * What we use of ESP-IDF 5.5's esp_err.h, declared again: enough to compile against, checked against the real
 * one by tools/xtensa with IDF_PATH set. */
#pragma once

#include <stdint.h>

typedef int esp_err_t;

#define ESP_OK   0
#define ESP_FAIL -1

void _esp_error_check_failed(esp_err_t code, const char *file, int line, const char *function,
                             const char *expression) __attribute__((noreturn));

#define ESP_ERROR_CHECK(x)                                                                                   \
    do {                                                                                                     \
        esp_err_t code_ = (x);                                                                               \
        if (code_ != ESP_OK)                                                                                 \
            _esp_error_check_failed(code_, __FILE__, __LINE__, __func__, #x);                                \
    } while (0)
