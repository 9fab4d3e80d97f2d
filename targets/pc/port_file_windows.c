/* SPDX-License-Identifier: MIT */
#include "port_file.h"

#include "port_windows_text.h"

#include <windows.h>

#include <errno.h>
#include <io.h>

bool port_wide(const char *text, wchar_t wide[PORT_PATH_SIZE]) {
    if (MultiByteToWideChar(CP_UTF8, MB_ERR_INVALID_CHARS, text, -1, wide, PORT_PATH_SIZE) > 0)
        return true;
    errno = GetLastError() == ERROR_INSUFFICIENT_BUFFER ? ENAMETOOLONG : EILSEQ;
    return false;
}

FILE *port_open(const char *path, const char *mode) {
    wchar_t name[PORT_PATH_SIZE], wide_mode[PORT_PATH_SIZE];
    return port_wide(path, name) && port_wide(mode, wide_mode) ? _wfopen(name, wide_mode) : NULL;
}

bool port_sync(FILE *file) {
    return fflush(file) == 0 && _commit(_fileno(file)) == 0;
}

/* A scanner of viruses may have the file open for a moment: MOVEFILE_WRITE_THROUGH alone does not wait. */
enum { REPLACE_TRIES = 20, REPLACE_AGAIN_MS = 10 };

bool port_replace(const char *from, const char *to) {
    wchar_t old_name[PORT_PATH_SIZE], new_name[PORT_PATH_SIZE];
    if (!port_wide(from, old_name) || !port_wide(to, new_name))
        return false;
    for (int tries = 0; tries < REPLACE_TRIES; tries++) {
        if (MoveFileExW(old_name, new_name, MOVEFILE_REPLACE_EXISTING | MOVEFILE_WRITE_THROUGH))
            return true;
        if (GetLastError() != ERROR_SHARING_VIOLATION && GetLastError() != ERROR_ACCESS_DENIED)
            break;
        Sleep(REPLACE_AGAIN_MS);
    }
    return false;
}
