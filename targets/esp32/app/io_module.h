/* SPDX-License-Identifier: MIT
 * Device mode 1: this board is another controller's I/O expansion. [task, core 0] No motion: neither machine
 * nor step timer are started. Its channels are commanded by the binary protocol, which is not there yet; what
 * runs is what every mode has, the network with updates and a name. */
#ifndef WIFICNC_ESP32_IO_MODULE_H
#define WIFICNC_ESP32_IO_MODULE_H

#include "app/services.h"

/** Never returns. @param lockout  of all passwords  @param password  of network clients; "": none */
void io_module_run(struct services *services, struct lockout *lockout, const char *password);

#endif
