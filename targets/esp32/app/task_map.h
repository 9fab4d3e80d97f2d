/* SPDX-License-Identifier: MIT
 * Which task runs where, how urgently, with how much stack (bytes; tools/xtensa/stack.py counts what they
 * need). Core 1 is for motion alone. */
#ifndef WIFICNC_ESP32_TASK_MAP_H
#define WIFICNC_ESP32_TASK_MAP_H

enum { NETWORK_CORE = 0, MOTION_CORE = 1 };

/* name            priority                        stack */
enum { MOTION_TASK_PRIORITY = 20, MOTION_TASK_STACK = 4096 };
enum { CONTROLLER_TASK_PRIORITY = 8, CONTROLLER_TASK_STACK = 13312 };
enum { NETWORK_TASK_PRIORITY = 5, NETWORK_TASK_STACK = 4096 };

#endif
