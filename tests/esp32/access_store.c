/* SPDX-License-Identifier: MIT
 * The stored access key of network clients: a new controller makes one, and an unreadable one opens nothing.
 */
#include "net/access_store.h"
#include "check.h"

#include <string.h>

static enum nvs_text finds;
static const char *holds;
static char kept[64];
static bool full;
static uint8_t noise;

static enum nvs_text read_text(void *ctx, const char *key, char *text, size_t size) {
    (void)ctx;
    CHECK(strcmp(key, "access_key") == 0 && size == 64);
    if (holds != NULL)
        strcpy(text, holds);
    return finds;
}

static bool write_text(void *ctx, const char *key, const char *text) {
    (void)ctx;
    CHECK(strcmp(key, "access_key") == 0);
    strcpy(kept, full ? "" : text);
    return !full;
}

static void make_noise(void *ctx, uint8_t *bytes, size_t count) {
    (void)ctx;
    for (size_t i = 0; i < count; i++)
        bytes[i] = noise += 37;
}

static enum access_found load(enum nvs_text found, const char *held, char key[64]) {
    static const struct access_store_ops ops = {.read = read_text, .write = write_text, .random = make_noise};
    finds = found;
    holds = held;
    memset(key, 0x55, 64);
    kept[0] = '\0';
    return access_store_load(key, &ops, NULL);
}

static void a_stored_key_is_the_key(void) {
    char key[64];
    CHECK(load(NVS_TEXT_GOOD, "correct horse", key) == ACCESS_FOUND);
    CHECK(strcmp(key, "correct horse") == 0 && kept[0] == '\0');
}

/* 20 of Crockford's 32 letters and digits. */
static bool is_made(const char *key) {
    unsigned letters = 0;
    for (unsigned i = 0; i < strlen(key); i++)
        letters += strchr("0123456789abcdefghjkmnpqrstvwxyz", key[i]) != NULL;
    return strlen(key) == 23 && letters == 20 && key[5] == '-' && key[11] == '-' && key[17] == '-';
}

static void a_new_controller_makes_its_own(void) {
    char key[64], before[64];
    CHECK(load(NVS_TEXT_NONE, NULL, before) == ACCESS_MADE && is_made(before));
    CHECK(strcmp(kept, before) == 0);
    CHECK(load(NVS_TEXT_NONE, "left over", key) == ACCESS_MADE && is_made(key));
    CHECK(strcmp(key, before) != 0);
    full = true;
    CHECK(load(NVS_TEXT_NONE, NULL, key) == ACCESS_UNKEPT && is_made(key));
    full = false;
}

/* A read error, and lengths that no tool writes: 12 to 63 bytes. */
static void what_cannot_be_read_is_a_key_that_nobody_knows(void) {
    static const char *const held[] = {NULL, "half a rea", "", "eleven char"};
    static const enum nvs_text found[] = {NVS_TEXT_UNREADABLE, NVS_TEXT_UNREADABLE, NVS_TEXT_GOOD,
                                          NVS_TEXT_GOOD};
    char before[64] = "", key[64];
    for (unsigned i = 0; i < 4; i++) {
        CHECK(load(found[i], held[i], key) == ACCESS_LOST && is_made(key));
        CHECK(strcmp(key, before) != 0 && kept[0] == '\0'); /* what is there stays */
        memcpy(before, key, sizeof before);
    }
}

static char trusted[TRUSTED_MAX + 1];

static enum nvs_text read_trusted(void *ctx, const char *key, char *text, size_t size) {
    (void)ctx;
    CHECK(strcmp(key, "trusted") == 0 && size > strlen(trusted));
    strcpy(text, trusted);
    return trusted[0] == '\0' ? NVS_TEXT_NONE : NVS_TEXT_GOOD;
}

static bool write_trusted(void *ctx, const char *key, const char *text) {
    (void)ctx;
    CHECK(strcmp(key, "trusted") == 0 && strlen(text) > 0 && strlen(text) <= TRUSTED_MAX);
    strcpy(trusted, text);
    return !full;
}

static void begin_with(struct access *access, const char *key) {
    static const struct access_store_ops ops = {.read = read_trusted};
    static const uint8_t salt[ACCESS_SALT];
    access_init(access, key, false, salt, 0);
    access_store_load_trust(access, &ops, NULL);
}

static void begin(struct access *access) {
    begin_with(access, "correct horse");
}

static void trust_for_ever_survives_a_restart(void) {
    static const struct access_store_ops ops = {.write = write_trusted};
    struct access access;
    begin(&access);
    for (uint64_t who = 1; who <= ACCESS_TRUSTED; who++) {
        CHECK(!access.changed);
        CHECK(access_trust(&access, who << 40 | 0xABCDEF, who == 3 ? ACCESS_DAY : ACCESS_ALWAYS));
        CHECK(access.changed == (who != 3));
        CHECK(access_store_keep_trust(&access, &ops, NULL) && !access.changed);
    }
    begin(&access);
    CHECK(!access.changed);
    for (uint64_t who = 1; who <= ACCESS_TRUSTED; who++)
        CHECK(access_may(&access, who << 40 | 0xABCDEF) == (who != 3));
    for (unsigned place = 0; place < ACCESS_TRUSTED; place++)
        access_revoke(&access, place);
    CHECK(access.changed && access_store_keep_trust(&access, &ops, NULL));
    begin(&access);
    for (unsigned place = 0; place < ACCESS_TRUSTED; place++)
        CHECK(access.trust[place].who == 0);
    full = true;
    CHECK(access_trust(&access, 1, ACCESS_ALWAYS) && !access_store_keep_trust(&access, &ops, NULL));
    full = false;
}

/* As many as there are places; one of the same network is another address. */
static void trust_in_ipv6_addresses_survives_a_restart(void) {
    static const struct access_store_ops ops = {.write = write_trusted};
    const uint64_t network = 0x20010db800010002u;
    struct access access;
    trusted[0] = '\0';
    begin(&access);
    CHECK(access_trust(&access, 500, ACCESS_ALWAYS));
    for (uint64_t host = 1; host < ACCESS_TRUSTED; host++)
        CHECK(access_trust_at(&access, network, host, ACCESS_ALWAYS));
    CHECK(access_store_keep_trust(&access, &ops, NULL));
    begin(&access);
    for (uint64_t host = 1; host < ACCESS_TRUSTED; host++)
        CHECK(access_may_at(&access, network, host) && !access_may(&access, host));
    CHECK(access_may(&access, 500) && !access_may(&access, network) && !access_may_at(&access, network, 99));
    /* What was stored when networks were trusted is none. */
    snprintf(trusted + 17, sizeof trusted - 17, "%s", "20010db800010002");
    memcpy(trusted, "00000000", 8);
    begin(&access);
    CHECK(!access_may_at(&access, network, 1) && !access_may_at(&access, network, 99));
    trusted[0] = '\0';
}

static void another_key_ends_all_trust(void) {
    static const struct access_store_ops ops = {.write = write_trusted};
    struct access access;
    begin(&access);
    CHECK(access_trust(&access, 7, ACCESS_ALWAYS) && access_store_keep_trust(&access, &ops, NULL));
    begin(&access);
    CHECK(access_may(&access, 7));
    begin_with(&access, "battery staple");
    CHECK(!access_may(&access, 7) && !access.changed);
    CHECK(access_trust(&access, 8, ACCESS_ALWAYS) && access_store_keep_trust(&access, &ops, NULL));
    begin(&access);
    CHECK(!access_may(&access, 7) && !access_may(&access, 8));
    trusted[0] = '\0';
}

static void what_is_no_address_is_not_trusted(void) {
    static const char *const texts[] = {"-",
                                        "xyz",
                                        "0000000000000000",
                                        "00000000000000010000000000000002",
                                        "000000000000001",
                                        "000000000000000G,0000000000000001"};
    struct access access;
    for (unsigned i = 0; i < sizeof texts / sizeof texts[0]; i++) {
        strcpy(trusted, texts[i]);
        begin(&access);
        for (unsigned place = 0; place < ACCESS_TRUSTED; place++)
            CHECK(access.trust[place].who == 0);
    }
    trusted[0] = '\0';
}

int main(void) {
    trust_for_ever_survives_a_restart();
    trust_in_ipv6_addresses_survives_a_restart();
    another_key_ends_all_trust();
    what_is_no_address_is_not_trusted();
    a_stored_key_is_the_key();
    a_new_controller_makes_its_own();
    what_cannot_be_read_is_a_key_that_nobody_knows();
    return report();
}
