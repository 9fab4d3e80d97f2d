/* SPDX-License-Identifier: MIT
 * The serial port: UART 3 at 115200 baud, 8N1, both ways by interrupts. */
#ifndef WIFICNC_PIC32MZ_UART3_H
#define WIFICNC_PIC32MZ_UART3_H

#include "input/rx.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum { UART_OUT_SIZE = 4096 };

/** [start, interrupts off] @param rx  takes every byte in the receive interrupt; outlives this */
void uart_init(struct rx *rx);

/** [task] Send these bytes. Waits while the ring has no room for them: look at uart_room() before. */
void uart_write(const char *bytes, size_t count);

/** [task] Bytes that uart_write() takes without waiting; grows at any moment. */
uint32_t uart_room(void);

/** [NMI, or start on the backup clock; interrupts off] Send this and wait until it is sent: PBCLK2 is
 * CLOCK_BACKUP_HZ. The rate is 2 % off, and the backup clock as much again: most receivers read it. */
void uart_send_on_backup_clock(const char *text);

/** From startup.S. [isr] */
void on_uart_rx(void);
void on_uart_tx(void);

#endif
