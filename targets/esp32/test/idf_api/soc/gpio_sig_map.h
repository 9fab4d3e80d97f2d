/* SPDX-License-Identifier: MIT
 * What we use of ESP-IDF 5.5's soc/gpio_sig_map.h, declared again: enough to compile against, checked against
 * the real one by tools/xtensa with IDF_PATH set. */
#pragma once

#define SIG_GPIO_OUT_IDX     256
#define RMT_SIG_OUT0_IDX     87 /* 81 on the ESP32-S3 */
#define LEDC_LS_SIG_OUT0_IDX 79 /* 73 on the ESP32-S3 */
