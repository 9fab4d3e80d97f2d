/* SPDX-License-Identifier: MIT
 * What we use of ESP-IDF 5.5's netinet/tcp.h (lwIP), declared again: enough to compile against, checked
 * against the real one by tools/xtensa with IDF_PATH set. */
#pragma once

#define TCP_NODELAY   0x01
#define TCP_KEEPIDLE  0x03
#define TCP_KEEPINTVL 0x04
#define TCP_KEEPCNT   0x05
