/* SPDX-License-Identifier: MIT */
#ifndef WIFICNC_ESPSIM_SHA256_H
#define WIFICNC_ESPSIM_SHA256_H

#include <stddef.h>
#include <stdint.h>

void sha256(const uint8_t *bytes, size_t count, uint8_t out[32]);

#endif
