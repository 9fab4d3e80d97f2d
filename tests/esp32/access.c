/* SPDX-License-Identifier: MIT
 * The stored password of network clients: none is open, an unreadable one is not. */
#include "net/access.h"
#include "check.h"

#include <string.h>

static enum nvs_text finds;
static const char *holds;
static uint8_t noise;

static enum nvs_text read_text(void *ctx, const char *key, char *text, size_t size) {
    (void)ctx;
    CHECK(strcmp(key, "access_pass") == 0 && size == 64);
    if (holds != NULL)
        strcpy(text, holds);
    return finds;
}

static void make_noise(void *ctx, uint8_t *bytes, size_t count) {
    (void)ctx;
    for (size_t i = 0; i < count; i++)
        bytes[i] = noise += 37;
}

static enum access_state load(enum nvs_text found, const char *held, char password[64]) {
    static const struct access_ops ops = {.read = read_text, .random = make_noise};
    finds = found;
    holds = held;
    memset(password, 0x55, 64);
    return access_load(password, &ops, NULL);
}

static void a_password_locks_and_none_does_not(void) {
    char password[64];
    CHECK(load(NVS_TEXT_GOOD, "correct horse", password) == ACCESS_LOCKED);
    CHECK(strcmp(password, "correct horse") == 0);
    CHECK(load(NVS_TEXT_NONE, NULL, password) == ACCESS_OPEN && password[0] == '\0');
    CHECK(load(NVS_TEXT_NONE, "left over", password) == ACCESS_OPEN && password[0] == '\0');
}

/* A read error, and lengths that no tool writes: 8 to 63 bytes. */
static void what_cannot_be_read_is_a_password_that_nobody_knows(void) {
    static const char *const held[] = {NULL, "half a rea", "", "seven c"};
    static const enum nvs_text found[] = {NVS_TEXT_UNREADABLE, NVS_TEXT_UNREADABLE, NVS_TEXT_GOOD,
                                          NVS_TEXT_GOOD};
    char before[64] = "", password[64];
    for (unsigned i = 0; i < 4; i++) {
        CHECK(load(found[i], held[i], password) == ACCESS_LOST);
        CHECK(memchr(password, '\0', 64) == password + 63); /* as long as it can be */
        CHECK(strcmp(password, before) != 0);
        memcpy(before, password, sizeof before);
    }
}

int main(void) {
    a_password_locks_and_none_does_not();
    what_cannot_be_read_is_a_password_that_nobody_knows();
    return report();
}
