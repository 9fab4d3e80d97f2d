/* SPDX-License-Identifier: MIT
 * The receiver of updates, with connections of strangers, of one who knows the key, and of the owner, who can
 * also sign. Whatever arrives, however it is cut and however little the connection takes:
 *
 *   - the machine is locked for a request with the right proof only, and is unlocked again by an end or an
 *     abort, once for each
 *   - nothing is written of what is not signed, and nothing before the image's head was judged
 *   - what is written is what came, in its order; it starts next only when all of the announced image is
 * there
 *   - each answer is a whole line, and each connection is closed once
 *   - who has proved to know the key is not displaced
 *
 * The input: a byte of options, then a row of actions; the first byte says which, what it needs follows. */
#include "net/ota.h"
#include "fuzz.h"

#include <string.h>

enum { IMAGE_MAX = 4096, ACTIONS = 10, IN_MAX = 2048, OUT_MAX = 8192, CHIP = 9, THINGS_MAX = 400 };
enum { BEGIN_FAILS = 1, WRITE_FAILS = 2, END_FAILS = 4, SLOW = 8 };

#define KEY "correct horse"

static const uint8_t good_signature[SIGNATURE_SIZE] = {0x5A};

static struct scene {
    struct ota ota;
    struct access access;
    uint8_t options;
    char in[IN_MAX];
    size_t in_count;
    bool ended, failed, open;
    char out[OUT_MAX]; /* of this connection */
    size_t out_count;
    bool proven;            /* a line with the right proof was sent to this connection */
    bool locked, may_write; /* the machine; an image with a good signature was announced */
    uint8_t flash[IMAGE_MAX + IN_MAX];
    size_t flashed, announced;
    uint32_t now_us;
    unsigned number; /* of the connection: its nonce */
} scene;

static uint8_t image[IMAGE_MAX];

/* ---- the connection ---- */

static long take(const struct net_stream *stream, char *bytes, size_t size) {
    size_t count = scene.in_count < size ? scene.in_count : size;
    (void)stream;
    if (scene.failed)
        return NET_GONE;
    if (count == 0)
        return scene.ended ? NET_ENDED : 0;
    memcpy(bytes, scene.in, count);
    memmove(scene.in, scene.in + count, scene.in_count -= count);
    return (long)count;
}

static long give(const struct net_stream *stream, const char *bytes, size_t count) {
    (void)stream;
    CLAIM(scene.open, "written to a connection that is closed");
    if (scene.failed)
        return NET_GONE;
    if ((scene.options & SLOW) != 0 && count > 7)
        count = 7;
    CLAIM(scene.out_count + count < OUT_MAX, "it never ends");
    memcpy(scene.out + scene.out_count, bytes, count);
    scene.out_count += count;
    return (long)count;
}

static void shut(const struct net_stream *stream) {
    (void)stream;
    CLAIM(scene.open, "closed twice");
    scene.open = false;
}

/* A second connection, which leaves immediately. */
static unsigned seconds_open;
static bool second_is_refused;

static long take_nothing(const struct net_stream *stream, char *bytes, size_t size) {
    (void)stream;
    (void)bytes;
    (void)size;
    return NET_ENDED;
}

static long give_second(const struct net_stream *stream, const char *bytes, size_t count) {
    (void)stream;
    CLAIM(count > 6 && bytes[count - 1] == '\n', "%.20s", bytes);
    second_is_refused = memcmp(bytes, "ERROR ", 6) == 0;
    return (long)count;
}

static void shut_second(const struct net_stream *stream) {
    (void)stream;
    CLAIM(seconds_open > 0, "closed twice");
    seconds_open--;
}

/* ---- the flash ---- */

static const char *begin(void *ctx, size_t size) {
    (void)ctx;
    CLAIM(scene.proven, "a request without the key has locked the machine");
    CLAIM(!scene.locked, "locked twice");
    if ((scene.options & BEGIN_FAILS) != 0 || size > IMAGE_MAX)
        return "no room";
    scene.locked = true;
    scene.flashed = 0;
    scene.announced = size;
    return NULL;
}

static bool is_signed(void *ctx, const uint8_t digest[SHA256_SIZE], const uint8_t signature[SIGNATURE_SIZE]) {
    (void)ctx;
    (void)digest;
    CLAIM(scene.locked, "the signature was looked at while the machine is free");
    scene.may_write = memcmp(signature, good_signature, SIGNATURE_SIZE) == 0;
    return scene.may_write;
}

static const char *write_flash(void *ctx, const uint8_t *bytes, size_t count) {
    (void)ctx;
    CLAIM(scene.locked && scene.may_write, "%zu bytes written without a signature", count);
    CLAIM(scene.flashed > 0 || count >= OTA_HEADER_SIZE, "written before the head was judged");
    if ((scene.options & WRITE_FAILS) != 0)
        return "the flash fails";
    CLAIM(scene.flashed + count <= scene.announced, "%zu bytes of %zu", scene.flashed + count,
          scene.announced);
    memcpy(scene.flash + scene.flashed, bytes, count);
    scene.flashed += count;
    CLAIM(scene.flash[0] == 0xE9 && scene.flash[12] == CHIP, "an image for another chip");
    return NULL;
}

static const char *end(void *ctx) {
    (void)ctx;
    CLAIM(scene.locked && scene.flashed == scene.announced, "%zu bytes of %zu start", scene.flashed,
          scene.announced);
    CLAIM(memcmp(scene.flash, image, scene.flashed) == 0, "another image than the announced one starts");
    scene.locked = scene.may_write = false;
    return (scene.options & END_FAILS) != 0 ? "the flash fails" : NULL;
}

static void abort_it(void *ctx) {
    (void)ctx;
    CLAIM(scene.locked, "aborted, and nothing had begun");
    scene.locked = scene.may_write = false;
}

/* ---- what happens ---- */

static void say(const void *bytes, size_t count) {
    if (!scene.open || scene.ended || scene.in_count + count > IN_MAX)
        return;
    memcpy(scene.in + scene.in_count, bytes, count);
    scene.in_count += count;
}

static void pass(uint32_t us) {
    scene.now_us += us;
    access_poll(&scene.access, scene.now_us);
    (void)ota_poll(&scene.ota, scene.now_us);
}

/* What it has said up to the end of the connection, without a last line that was cut. */
static void check_out(void) {
    const char *at = scene.out, *const stop = scene.out + scene.out_count;
    for (const char *next; (next = memchr(at, '\n', (size_t)(stop - at))) != NULL; at = next + 1)
        CLAIM(memcmp(at, "WIFICNC-OTA 3 ", 14) == 0 || memcmp(at, "OK", 2) == 0 ||
                  memcmp(at, "ERROR ", 6) == 0 || memcmp(at, "AT ", 3) == 0 || memcmp(at, "DONE", 4) == 0,
              "what is this: %.40s", at);
}

static void come(void) {
    static const struct net_stream_ops ops = {take, give, shut};
    static const struct net_stream_ops other = {take_nothing, give_second, shut_second};
    uint8_t nonce[OTA_NONCE_SIZE] = {(uint8_t)++scene.number, (uint8_t)(scene.number >> 8)};
    const struct net_stream stream = {.ops = &ops, .peer = 1}, second = {.ops = &other, .peer = 2};
    if (scene.open) {
        const bool proved = scene.ota.proved;
        seconds_open++;
        const bool in = ota_connect(&scene.ota, &second, nonce, scene.now_us);
        CLAIM(!in || (!proved && !scene.open), "two uploads at the same time");
        CLAIM(in != second_is_refused && in == (seconds_open == 1), "a refused connection stays open");
        return;
    }
    scene.ota.done = false; /* it has restarted */
    check_out();
    scene.in_count = scene.out_count = 0;
    scene.ended = scene.failed = scene.proven = false;
    scene.open = true;
    CLAIM(ota_connect(&scene.ota, &stream, nonce, scene.now_us), "the only one was refused");
}

static void put_hex(char *text, const uint8_t *bytes, size_t count) {
    static const char digits[] = "0123456789abcdef";
    for (size_t i = 0; i < count; i++) {
        text[2 * i] = digits[bytes[i] >> 4];
        text[2 * i + 1] = digits[bytes[i] & 15];
    }
    text[2 * count] = '\0';
}

/* @param flaw  0: good in all; 1: another signature; 2: another key; 3: another image; 4: no digits;
 *  7: a confirmation, of no image */
static void request(unsigned size, unsigned flaw) {
    char digest_hex[2 * SHA256_SIZE + 1], signature_hex[2 * SIGNATURE_SIZE + 1], mac_hex[2 * SHA256_SIZE + 1];
    char words[OTA_LINE_SIZE], message[OTA_LINE_SIZE + 2 * OTA_NONCE_SIZE], line[2 * OTA_LINE_SIZE];
    uint8_t digest[SHA256_SIZE], mac[SHA256_SIZE], signature[SIGNATURE_SIZE] = {0};
    struct sha256 sha;
    size %= IMAGE_MAX + 64;
    sha256_begin(&sha);
    sha256_add(&sha, image, size < IMAGE_MAX ? size : IMAGE_MAX);
    sha256_end(&sha, digest);
    digest[0] ^= flaw == 3;
    if (flaw != 1)
        memcpy(signature, good_signature, sizeof signature);
    put_hex(digest_hex, digest, sizeof digest);
    put_hex(signature_hex, signature, sizeof signature);
    snprintf(words, sizeof words, "%u %s %s", size, digest_hex, signature_hex);
    if (flaw == 7)
        snprintf(words, sizeof words, "confirm");
    int count = snprintf(message, sizeof message, "%s %s", scene.ota.nonce, words);
    sha256_hmac(scene.access.secret, SHA256_SIZE, message, (size_t)count, mac);
    mac[5] ^= flaw == 2;
    put_hex(mac_hex, mac, sizeof mac);
    count = snprintf(line, sizeof line, "%s %s%s\n", words, mac_hex, flaw == 4 ? "g" : "");
    scene.proven |= scene.open && flaw != 2 && flaw != 4;
    say(line, (size_t)count);
}

static void send_image(size_t at, size_t count) {
    at %= IMAGE_MAX;
    say(image + at, count < IMAGE_MAX - at ? count : IMAGE_MAX - at);
}

/* The rest of what was announced. */
static void send_rest(void) {
    size_t at = scene.ota.taken + scene.in_count;
    if (scene.ota.state == OTA_TAKES && at < scene.ota.size)
        send_image(at, scene.ota.size - at < 512 ? scene.ota.size - at : 512);
}

static void say_anything(struct input *input, size_t count) {
    for (; count > 0 && input_left(input) > 0; count--)
        say(&(uint8_t){input_byte(input)}, 1);
}

static void happen(struct input *input) {
    const uint8_t what = input_byte(input) % ACTIONS, how = input_byte(input);
    switch (what) {
    case 0:
    case 1:
        come();
        break;
    case 2:
        request(how * 17u, input_byte(input) % 8u);
        break;
    case 3:
        say_anything(input, how);
        break;
    case 4:
        send_image(how * 16u, input_byte(input));
        break;
    case 5:
    case 6:
        send_rest();
        break;
    case 7:
        pass(how * 65536u);
        break;
    case 8:
        scene.ended = scene.ended || how < 128;
        break;
    default:
        scene.failed = scene.failed || (how < 64 && scene.open);
    }
}

/* Its secret takes some ms: once. */
static const struct access *locked_access(void) {
    static const uint8_t salt[ACCESS_SALT] = {3};
    static struct access made;
    if (!made.has_key)
        access_init(&made, KEY, false, salt, 0);
    return &made;
}

static void begin_scene(uint8_t options) {
    static const struct ota_ops ops = {
        .begin = begin, .is_signed = is_signed, .write = write_flash, .end = end, .abort = abort_it};
    static const struct ota_image wanted = {
        .board = "esp32s3-zero", .chip_id = CHIP, .project = "wificnc", .digest = "0123456789abcdef"};
    for (size_t i = 0; i < IMAGE_MAX; i++)
        image[i] = (uint8_t)(i * 2654435761u >> 13);
    image[0] = 0xE9;
    image[12] = options < 224 ? CHIP : 0;
    image[13] = 0;
    memcpy(image + 80, "wificnc", 8);
    memset(&scene, 0, sizeof scene);
    seconds_open = 0;
    scene.options = options;
    scene.access = *locked_access();
    ota_init(&scene.ota, &ops, NULL, &wanted, &scene.access);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    struct input input = {data, data + size};
    begin_scene(input_byte(&input));
    come();
    for (unsigned n = 0; n < THINGS_MAX && input_left(&input) > 0; n++) {
        happen(&input);
        pass(1000);
    }
    for (unsigned n = 0; n < 40; n++) /* whoever is silent is let go */
        pass(OTA_IDLE_US / 2);
    CLAIM(!scene.open && seconds_open == 0 && scene.ota.state == OTA_FREE, "it waits for ever");
    CLAIM(!scene.locked, "the machine stays locked");
    check_out();
    return 0;
}
