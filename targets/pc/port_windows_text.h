/* SPDX-License-Identifier: MIT
 * Names as Windows takes them. */
#ifndef WIFICNC_PC_PORT_WINDOWS_TEXT_H
#define WIFICNC_PC_PORT_WINDOWS_TEXT_H

#include <wchar.h>

/** @param text  UTF-8 @return the caller's to free(); NULL: errno says why */
wchar_t *port_wide(const char *text);

#endif
