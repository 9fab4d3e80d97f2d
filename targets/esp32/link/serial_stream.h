/* SPDX-License-Identifier: MIT
 * The chip's own serial ports as streams of the hub: UART0, the USB-Serial-JTAG of the S3, and a UART for a
 * pendant. [task] They
 * have no connection that could be lost: whoever is at the other end is one client, always there. */
#ifndef WIFICNC_ESP32_SERIAL_STREAM_H
#define WIFICNC_ESP32_SERIAL_STREAM_H

#include "net_stream.h"

#include <stdbool.h>

enum { SERIAL_BAUD = 115200, SERIAL_RX_SIZE = 2048, SERIAL_TX_SIZE = 4096 };

/** UART0 has no flow control, and no one reads while flash is erased: 400 ms at most for a sector, 4.6 KB. */
enum { UART_RX_BYTES = 6144 };

/** @param[out] stream  of UART0 @return false: the driver did not start */
bool serial_stream_uart(struct net_stream *stream);

/** UART and pins of the board file. */
struct serial_pendant {
    uint32_t baud;
    uint8_t uart, tx, rx;
    uint8_t kind; /* enum net_pendant */
};

/** [start] @param[out] stream  of a pendant @return false: the driver did not start, or no memory is left */
bool serial_stream_pendant(const struct serial_pendant *wire, struct net_stream *stream);

/** @param[out] stream  of the native USB port @return false: the chip has none, or the driver did not start
 */
bool serial_stream_usb(struct net_stream *stream);

#endif
