/* SPDX-License-Identifier: MIT
 * What we use of ESP-IDF 5.5's soc/soc_caps.h, declared again: enough to compile against, checked against the
 * real one by tools/xtensa with IDF_PATH set. */
#pragma once

#include "sdkconfig.h"

#if CONFIG_IDF_TARGET_ESP32S3
#define SOC_RMT_MEM_WORDS_PER_CHANNEL 48
#define SOC_USB_SERIAL_JTAG_SUPPORTED 1
#else
#define SOC_RMT_MEM_WORDS_PER_CHANNEL 64
#endif
