/* SPDX-License-Identifier: MIT
 * RS-485 for a spindle drive: UART 2, both ways by interrupts. DE is a pin that the end of the last stop bit
 * switches off, in the interrupt that the transmitter raises then; what was received until then is what was
 * sent, and dropped. */
#ifndef WIFICNC_PIC32MZ_BUS2_H
#define WIFICNC_PIC32MZ_BUS2_H

struct hal_bus;

/** [start, interrupts off] @return NULL: the board has no bus */
const struct hal_bus *bus_init(void);

/** From startup.S. [isr] */
void on_bus_rx(void);
void on_bus_tx(void);

#endif
