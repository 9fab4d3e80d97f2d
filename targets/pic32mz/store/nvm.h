/* SPDX-License-Identifier: MIT
 * The flash controller, for the pages of flash_store.h. [task] Nothing here waits: a page takes 20 ms or so,
 * a unit 50 us, and the program runs on meanwhile. That is possible because the pages lie in the upper flash
 * panel and the program in the lower one: a panel that is erased or programmed cannot be read, and a CPU that
 * fetches from it waits until it is done. */
#ifndef WIFICNC_PIC32MZ_NVM_H
#define WIFICNC_PIC32MZ_NVM_H

#include "store/flash_store.h"

extern const struct flash_ops nvm_flash_ops;

/** [start] Wait for an operation that a reset has left behind. */
void nvm_wait(void);

#endif
