/* SPDX-License-Identifier: MIT
 * What we use of ESP-IDF 5.5's netinet/tcp.h (lwIP), declared anew: enough to compile against, checked
 * against the real one by tools/xtensa with IDF_PATH set. */
#pragma once

#define TCP_NODELAY 0x01
