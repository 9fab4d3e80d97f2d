/* SPDX-License-Identifier: MIT
 * Names as Windows takes them. */
#ifndef WIFICNC_PC_PORT_WINDOWS_TEXT_H
#define WIFICNC_PC_PORT_WINDOWS_TEXT_H

#include <stdbool.h>
#include <wchar.h>

enum { PORT_PATH_SIZE = 4096 };

/** @param text  UTF-8 @return false: errno says why */
bool port_wide(const char *text, wchar_t wide[PORT_PATH_SIZE]);

#endif
