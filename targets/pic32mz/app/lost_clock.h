/* SPDX-License-Identifier: MIT
 * The oscillator has failed, and the clock monitor has gone over to 8 MHz. No pulse and no byte has its time
 * any more: outputs off, a message at the serial port, and a reset, after which the machine is locked, or
 * this again. */
#ifndef WIFICNC_PIC32MZ_LOST_CLOCK_H
#define WIFICNC_PIC32MZ_LOST_CLOCK_H

/** [NMI, from startup.S: whatever ran does not continue; or start on the backup clock] Sends the message,
 * waits 1 s, resets the chip. */
__attribute__((noreturn)) void lost_clock(void);

#endif
