/* SPDX-License-Identifier: MIT
 * The peripherals that send words to shift registers: I2S on the ESP32, GP-SPI2 on the ESP32-S3. Of
 * step_shift.c, which takes the board's. */
#ifndef WIFICNC_ESP32_SHIFT_PORT_H
#define WIFICNC_ESP32_SHIFT_PORT_H

#include "hal/hal_step.h"

/** A pin of the three gets a signal of the peripheral. */
void shift_port_connect(uint8_t gpio, uint32_t signal);

/** [start] It begins, and drives the three pins from then on. @param word  that the registers show already */
void shift_i2s_start(uint32_t word);
void shift_spi_start(uint32_t word);

/** [motion task or e-stop's interrupt, no step interrupt comes] One more word. The I2S peripheral sends it
 * after those that wait; the SPI waits for the word that is leaving. */
void shift_i2s_put(uint32_t word);
void shift_spi_put(uint32_t word);

/** [task] A word found no place since it was asked last. */
bool shift_i2s_has_lost(void);
bool shift_spi_has_lost(void);

#endif
