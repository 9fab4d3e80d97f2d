/* SPDX-License-Identifier: MIT
 * How much the shared network code (targets/net) may hold on a PC. */
#ifndef WIFICNC_NET_SIZES_H
#define WIFICNC_NET_SIZES_H

enum { NET_CLIENTS = 16 };

/** Lines of the hub that the controller has at the same time, at most. */
enum { NET_LINES_INSIDE = 64 };

/** Connections of browsers, which open several at the same time and some for later; and bytes of a request's
 * head: at localhost a browser sends the cookies of everything that it has ever found there. */
enum { NET_HTTP_PLACES = 32, NET_HTTP_HEAD = 16384 };

#endif
