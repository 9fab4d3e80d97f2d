/* SPDX-License-Identifier: MIT
 * What we use of ESP-IDF 5.5's bootloader_random.h, declared again: enough to compile against, checked
 * against the real one by tools/xtensa with IDF_PATH set. */
#pragma once

void bootloader_random_enable(void);
void bootloader_random_disable(void);
