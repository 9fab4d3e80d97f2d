/* SPDX-License-Identifier: MIT
 * How much the shared network code (targets/net) may hold on a PC. */
#ifndef WIFICNC_NET_SIZES_H
#define WIFICNC_NET_SIZES_H

enum { NET_CLIENTS = 16 };

#endif
