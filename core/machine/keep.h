/* SPDX-License-Identifier: MIT
 * What is stored and could not be read at power-on, until the user has acknowledged that. */
#ifndef WIFICNC_MACHINE_KEEP_H
#define WIFICNC_MACHINE_KEEP_H

#include "settings/store.h"

/** Values of the store, bit = key. While one of them is damaged the machine is locked and nothing is stored:
 * its copy in the store is the only one. */
struct machine_kept {
    uint16_t damaged;       /* bit = key */
    struct store_lost lost; /* of the settings */
};

#endif
