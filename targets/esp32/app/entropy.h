/* SPDX-License-Identifier: MIT
 * Random bytes that cannot be foreseen, for keys, salts and nonces. The chip's generator is unpredictable
 * only while its entropy source runs (the radio, or the ADC's noise), so one seed is drawn while it does, at
 * the start, and everything is expanded from that: HMAC-SHA256 of a counter, with the seed as key. */
#ifndef WIFICNC_ESP32_ENTROPY_H
#define WIFICNC_ESP32_ENTROPY_H

#include <stddef.h>
#include <stdint.h>

/** [start, once] Draw the seed: before anything of ours uses the radio, the ADC or I2S, which the entropy
 * source takes meanwhile, and before the first entropy_fill(). */
void entropy_start(void);

/** [any task] */
void entropy_fill(void *bytes, size_t count);

#endif
