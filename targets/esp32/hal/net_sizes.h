/* SPDX-License-Identifier: MIT
 * How much the shared network code (targets/net) may hold, where RAM is short: four network clients and
 * the two serial ports. */
#ifndef WIFICNC_NET_SIZES_H
#define WIFICNC_NET_SIZES_H

enum { NET_CLIENTS = 6 };

#endif
