/* SPDX-License-Identifier: MIT
 * What step pulses need of the RMT's registers, on both chips. The start bit is bit 0. */
#ifndef WIFICNC_ESP32_RMT_REGISTERS_H
#define WIFICNC_ESP32_RMT_REGISTERS_H

#include "sdkconfig.h"
#include "soc/rmt_struct.h"

/* RMT_CHnCONF1_REG of the ESP32, RMT_CHnCONF0_REG of the ESP32-S3 (technical reference manuals, chapter
 * Remote Control Peripheral). STEP_RMT_TAKE_OVER: the S3 uses a changed configuration only then.
 * STEP_RMT_ONCE: bits that make something happen, compared with those that stay. */
#if CONFIG_IDF_TARGET_ESP32
#define STEP_RMT_CONF(channel) conf_ch[channel].conf1.val
#define STEP_RMT_REWIND        (1u << 3)
#define STEP_RMT_TAKE_OVER     0u
#define STEP_RMT_ONCE          (STEP_RMT_REWIND | 1u << 0 | 1u << 4)
#else
#define STEP_RMT_CONF(channel) chnconf0[channel].val
#define STEP_RMT_REWIND        (1u << 1)
#define STEP_RMT_TAKE_OVER     (1u << 24)
#define STEP_RMT_ONCE          (STEP_RMT_REWIND | STEP_RMT_TAKE_OVER | 1u << 0 | 1u << 2 | 1u << 23)
#endif

#endif
