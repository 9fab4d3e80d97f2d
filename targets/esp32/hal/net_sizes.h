/* SPDX-License-Identifier: MIT
 * How much the shared network code (targets/net) may hold, where RAM is short: four network clients and
 * the serial ports. The ESP32-S3 has one more of these. */
#ifndef WIFICNC_NET_SIZES_H
#define WIFICNC_NET_SIZES_H

#include "soc/soc_caps.h"

/** NET_PENDANT_PLACES: of these, which are a pendant's only. */
#if SOC_USB_SERIAL_JTAG_SUPPORTED
enum { NET_PENDANT_PLACES = 1, NET_CLIENTS = 7 };
#else
enum { NET_PENDANT_PLACES = 0, NET_CLIENTS = 6 };
#endif

/** Lines of the hub that the controller has at the same time, at most. */
enum { NET_LINES_INSIDE = 4 };

/** Connections of browsers, and bytes of a request's head: Chromium's has some 500. */
enum { NET_HTTP_PLACES = 4, NET_HTTP_HEAD = 1536 };

#endif
