/* SPDX-License-Identifier: MIT */
#include "port_file.h"

#include "port_windows_text.h"

#include <windows.h>

#include <errno.h>
#include <io.h>
#include <stdlib.h>

wchar_t *port_wide(const char *text) {
    int size = MultiByteToWideChar(CP_UTF8, MB_ERR_INVALID_CHARS, text, -1, NULL, 0);
    wchar_t *wide = size > 0 ? malloc((size_t)size * sizeof *wide) : NULL;
    if (wide != NULL)
        MultiByteToWideChar(CP_UTF8, MB_ERR_INVALID_CHARS, text, -1, wide, size);
    else
        errno = size > 0 ? ENOMEM : EILSEQ;
    return wide;
}

FILE *port_open(const char *path, const char *mode) {
    wchar_t *name = port_wide(path), *wide_mode = port_wide(mode);
    FILE *file = name != NULL && wide_mode != NULL ? _wfopen(name, wide_mode) : NULL;
    free(name);
    free(wide_mode);
    return file;
}

bool port_sync(FILE *file) {
    return fflush(file) == 0 && _commit(_fileno(file)) == 0;
}

/* A scanner of viruses may have the file open for a moment: MOVEFILE_WRITE_THROUGH alone does not wait. */
enum { REPLACE_TRIES = 20, REPLACE_AGAIN_MS = 10 };

static bool replaced(const wchar_t *old_name, const wchar_t *new_name) {
    for (int tries = 0; tries < REPLACE_TRIES; tries++) {
        if (MoveFileExW(old_name, new_name, MOVEFILE_REPLACE_EXISTING | MOVEFILE_WRITE_THROUGH))
            return true;
        if (GetLastError() != ERROR_SHARING_VIOLATION && GetLastError() != ERROR_ACCESS_DENIED)
            break;
        Sleep(REPLACE_AGAIN_MS);
    }
    return false;
}

bool port_replace(const char *from, const char *to) {
    wchar_t *old_name = port_wide(from), *new_name = port_wide(to);
    bool done = old_name != NULL && new_name != NULL && replaced(old_name, new_name);
    free(old_name);
    free(new_name);
    return done;
}
