/* SPDX-License-Identifier: MIT
 * Files by their names in UTF-8: port_file_posix.c, port_file_windows.c. */
#ifndef WIFICNC_PC_PORT_FILE_H
#define WIFICNC_PC_PORT_FILE_H

#include <stdbool.h>
#include <stdio.h>

/** As fopen(). */
FILE *port_open(const char *path, const char *mode);

/** What was written is on the disk. */
bool port_sync(FILE *file);

/** A reader of `to` sees the old file or the new one. */
bool port_replace(const char *from, const char *to);

#endif
