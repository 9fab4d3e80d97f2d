/* SPDX-License-Identifier: MIT
 * Improv Wi-Fi over a serial port (improv-wifi.com/serial): a browser gives the board the name and password
 * of a network, and sees which there are. [task] Plain C: no chip, no radio; tested on a computer.
 *
 * A filter between the port and the hub. Packets are taken out of what comes in, whatever bytes they hold, so
 * that a `!` in a password holds nothing; all else continues to the hub. Answers go out between two lines of
 * the controller, never inside one.
 *
 *   IMPROV | version 1 | type | length | data | checksum, the sum of all before it | LF */
#ifndef WIFICNC_ESP32_IMPROV_H
#define WIFICNC_ESP32_IMPROV_H

#include "net_stream.h"
#include "store/nvs_names.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum { IMPROV_DATA_MAX = 128, IMPROV_HEAD = 9, IMPROV_OUT = 256, IMPROV_TEXT_MAX = 40 };

/** A network that the radio hears. */
struct improv_network {
    char name[WIFI_SSID_MAX + 1];
    int rssi_dbm;
    bool secured; /* it wants a password */
};

enum improv_scan { IMPROV_SCANNING, IMPROV_NETWORK, IMPROV_NO_MORE };

/** What the board says of itself; static. */
struct improv_info {
    const char *firmware, *version, *chip, *name;
};

struct improv_ops {
    /** Keep this network and join it. @param password  "": it has none @return false: not now, or not kept */
    bool (*join)(void *ctx, const char *network, const char *password);
    /** @param[out] address  where the board is found in that network, at most IMPROV_TEXT_MAX with its NUL
     *  @return false: not connected */
    bool (*joined)(void *ctx, char *address);
    /** Search for networks. @return false: not now */
    bool (*scan)(void *ctx);
    /** What the last look has found. @param index  0 is the strongest
     *  @param[out] network  of IMPROV_NETWORK */
    enum improv_scan (*scanned)(void *ctx, size_t index, struct improv_network *network);
    /** Wraps. */
    uint32_t (*now_us)(void *ctx);
    void *ctx;
};

/** One port. */
struct improv {
    struct net_stream inner;
    const struct improv_ops *ops;
    const struct improv_info *info;
    uint8_t packet[IMPROV_HEAD + IMPROV_DATA_MAX + 1]; /* as far as it has come */
    size_t count;
    uint32_t heard_us;
    uint8_t out[IMPROV_OUT]; /* answers that wait */
    size_t out_count, out_sent;
    bool mid_line; /* the hub's last byte was no line end */
    bool joining;
    uint32_t join_us; /* since when */
    bool scanning;
    uint32_t scan_us;
    size_t scan_told; /* networks of this look */
};

/** [start] @param inner  the port, always open @param info, ops  outlive this
 *  @param[out] stream  for the hub; it leads to `improv`, which outlives it */
void improv_init(struct improv *improv, const struct net_stream *inner, const struct improv_info *info,
                 const struct improv_ops *ops, struct net_stream *stream);

#endif
