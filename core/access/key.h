/* SPDX-License-Identifier: MIT
 * Access keys as texts. [task] Pure. */
#ifndef WIFICNC_ACCESS_KEY_H
#define WIFICNC_ACCESS_KEY_H

#include <stddef.h>
#include <stdint.h>

enum {
    ACCESS_KEY_BYTES = 63, /* at most */
    ACCESS_MADE_SIZE = 23  /* 20 letters and digits of 32, so 100 bits, in groups of five */
};

/** A new key from unpredictable bytes. @param[out] key  NUL-terminated */
void access_make_key(const uint8_t bytes[ACCESS_MADE_SIZE], char key[ACCESS_MADE_SIZE + 1]);

/** The form in which keys are compared and digested. @return bytes of `normal`, which has room for
 * ACCESS_KEY_BYTES; 0: this is no key */
size_t access_normal_key(const char *key, size_t size, char normal[ACCESS_KEY_BYTES]);

#endif
