/* SPDX-License-Identifier: MIT
 * What we use of ESP-IDF 5.5's soc/interrupts.h, declared again: enough to compile against, checked against
 * the real one by tools/xtensa with IDF_PATH set. */
#pragma once

enum { ETS_TG0_T0_LEVEL_INTR_SOURCE = 14, ETS_TG0_T1_LEVEL_INTR_SOURCE = 15 };
