/* SPDX-License-Identifier: MIT
 * What the network contributes to the status light. [controller task] Plain C. */
#ifndef WIFICNC_ESP32_LIGHT_H
#define WIFICNC_ESP32_LIGHT_H

#include "net_light.h"

/** Fill in joined, joining and own. */
void light_add_network(struct net_light_facts *facts);

#endif
