/* SPDX-License-Identifier: MIT
 * What we use of ESP-IDF 5.5's soc/gpio_sig_map.h, declared anew: enough to compile against, checked against
 * the real one by tools/xtensa with IDF_PATH set. */
#pragma once

#include "sdkconfig.h"

#define SIG_GPIO_OUT_IDX 256
#if CONFIG_IDF_TARGET_ESP32
#define RMT_SIG_OUT0_IDX 87
#else
#define RMT_SIG_OUT0_IDX 81
#endif
