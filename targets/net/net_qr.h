/* SPDX-License-Identifier: MIT
 * QR codes of short texts (ISO/IEC 18004): versions 1 to 5, error correction L, bytes, mask 0. [task] Pure.
 * These versions have one block of codewords and at most one alignment pattern. */
#ifndef WIFICNC_NET_QR_H
#define WIFICNC_NET_QR_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/** Modules of a side of version 5; bytes of a text that it holds; the light border that readers need. */
enum { NET_QR_SIDE = 37, NET_QR_TEXT = 106, NET_QR_QUIET = 4 };

/** UTF-8 of a row of text: each half block stands for two modules, one above the other. */
enum { NET_QR_ROW = 3 * (NET_QR_SIDE + 2 * NET_QR_QUIET) + 1 };

struct net_qr {
    unsigned side;             /* modules */
    uint64_t row[NET_QR_SIDE]; /* bit x: the module at x is dark */
};

/** @param text  up to NET_QR_TEXT bytes @return false: it is longer */
bool net_qr_make(struct net_qr *qr, const char *text);

/** A row of text for a terminal whose background is dark: light modules are drawn.
 *  @param number  from 0 on @param out  NET_QR_ROW bytes @return false: there is no such row */
bool net_qr_row(const struct net_qr *qr, unsigned number, char *out);

#endif
