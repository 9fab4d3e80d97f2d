/* SPDX-License-Identifier: MIT
 * What we use of ESP-IDF 5.5's esp_attr.h, declared again: enough to compile against, checked against the
 * real one by tools/xtensa with IDF_PATH set. */
#pragma once

#define IDF_API_SECTION_(name, number) __attribute__((section(name "." #number)))
#define IDF_API_SECTION(name, number)  IDF_API_SECTION_(name, number)
#define IRAM_ATTR                      IDF_API_SECTION(".iram1", __COUNTER__)
#define DRAM_ATTR                      IDF_API_SECTION(".dram1", __COUNTER__)
#define RTC_NOINIT_ATTR                IDF_API_SECTION(".rtc_noinit", __COUNTER__)
