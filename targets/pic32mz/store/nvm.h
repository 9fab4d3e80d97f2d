/* SPDX-License-Identifier: MIT
 * The flash controller, for the pages of flash_store.h. The pages lie in the upper bank, so that code
 * runs on in the lower one while they are written. [task] Waits: 20 ms or so for a page, 50 us for a unit. */
#ifndef WIFICNC_PIC32MZ_NVM_H
#define WIFICNC_PIC32MZ_NVM_H

#include "store/flash_store.h"

extern const struct flash_ops nvm_flash_ops;

#endif
