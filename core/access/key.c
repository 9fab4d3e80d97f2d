/* SPDX-License-Identifier: MIT */
#include "access/key.h"

enum { KEY_GROUP = 5 };

size_t access_normal_key(const char *key, size_t size, char normal[ACCESS_KEY_BYTES]) {
    size_t count = 0;
    for (size_t i = 0; i < size; i++) {
        if (key[i] == '-' || key[i] == ' ')
            continue;
        if (count == ACCESS_KEY_BYTES)
            return 0;
        normal[count++] = key[i] >= 'A' && key[i] <= 'Z' ? (char)(key[i] - 'A' + 'a') : key[i];
    }
    return count;
}

void access_make_key(const uint8_t bytes[ACCESS_MADE_SIZE], char key[ACCESS_MADE_SIZE + 1]) {
    static const char letters[] = "0123456789abcdefghjkmnpqrstvwxyz"; /* Crockford's: none is like another */
    for (unsigned i = 0; i < ACCESS_MADE_SIZE; i++)
        key[i] = i % (KEY_GROUP + 1) == KEY_GROUP ? '-' : letters[bytes[i] & 31];
    key[ACCESS_MADE_SIZE] = '\0';
}
