/* SPDX-License-Identifier: MIT
 * How much the shared network code (targets/net) may hold, where RAM is short: four network clients and
 * the two serial ports. */
#ifndef WIFICNC_NET_SIZES_H
#define WIFICNC_NET_SIZES_H

enum { NET_CLIENTS = 6 };

/** Connections of browsers, and bytes of a request's head: Chromium's has some 500. */
enum { NET_HTTP_PLACES = 4, NET_HTTP_HEAD = 1536 };

#endif
