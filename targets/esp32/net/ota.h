/* SPDX-License-Identifier: MIT
 * Takes a new firmware over TCP. [task] One upload at a time. Sockets are a net_stream, the flash is ops, the
 * clock is an argument: it runs on a computer, too.
 *
 *   we      WIFICNC-OTA 3 BOARD NONCE SALT ROUNDS DIGEST STATE\n
 *                                               twice 32 hex digits, the nonce new for every connection; 16
 * of the digest of the firmware that runs (net/ota_flash.h); STATE: "trial" (net/update_trial.h) or "kept"
 *   they    SIZE SHA256 SIGNATURE MAC\n         bytes; 64 hex digits of the image; 128 of its signature
 *                                               (net/signature.h); 64 of HMAC-SHA256(secret,
 *                                               "NONCE SIZE SHA256 SIGNATURE"), the secret
 *                                               PBKDF2(access key, SALT, ROUNDS)
 *       or  SIZE SHA256 SIGNATURE any-board MAC\n   the image may be one for another board; the word is in
 *                                               the MAC's message, too
 *       or  confirm MAC\n                      no image: the firmware that runs is reached, so it can be kept
 *   we      OK\n  or  ERROR text\n
 *   they    the image
 *   we      AT bytes\n                          now and then
 *   we      DONE\n  or  ERROR text\n            it is whole, and starts next
 *
 * The line with its proof comes within OTA_PROOF_US; until it is accepted, a new connection takes the place,
 * unless the last one that has left without a proof had the same address. Trusted addresses precede others.
 *
 * An image names its board where net/page.c has it: `"board": "ID"`. One that names none is taken.
 *
 * So the key never travels, an old upload cannot be played again, and what arrives is what who has built the
 * running firmware has signed.
 * The old firmware stays in its slot until the new one has run for a while. */
#ifndef WIFICNC_ESP32_OTA_H
#define WIFICNC_ESP32_OTA_H

#include "access/access.h"
#include "net/signature.h"
#include "net_stream.h"

enum {
    OTA_PORT = 58430,
    OTA_NONCE_SIZE = 16,
    OTA_TOLD_EVERY = 65536,
    OTA_PROOF_US = 10000000, /* from the connection to the end of the first line */
    OTA_IDLE_US = 15000000,
    OTA_LINGER_US = 2000000
};
enum { OTA_LINE_SIZE = 288, OTA_SAID_SIZE = 160, OTA_HEADER_SIZE = 112, OTA_PIECE = 1024 };
enum { OTA_BOARD_SIZE = 48, OTA_DIGEST_DIGITS = 16 };

/** Of the image's first bytes (ESP-IDF, "App Image Format"): magic 0xE9, chip id at 12; at 32 the app
 * descriptor: magic, project name at +48. */
struct ota_image {
    const char *board;   /* told to the sender */
    uint16_t chip_id;    /* 0 ESP32, 9 ESP32-S3 */
    const char *project; /* of CMake */
    const char *digest;  /* of the firmware that runs, OTA_DIGEST_DIGITS hex digits; outlives the receiver */
};

/** The flash, and who could mind. Each text is a reason for the sender; NULL: it went well. */
struct ota_ops {
    /** May it begin? The machine must be still, and stays locked until end(), abort(). */
    const char *(*begin)(void *ctx, size_t size);
    /** Whether the image of this digest is signed with the key of this firmware. Behind begin(): it takes
     * some 0.1 s. */
    bool (*is_signed)(void *ctx, const uint8_t digest[SHA256_SIZE], const uint8_t signature[SIGNATURE_SIZE]);
    const char *(*write)(void *ctx, const uint8_t *bytes, size_t count);
    /** All is written and its digest is right: make it the next one to start. */
    const char *(*end)(void *ctx);
    void (*abort)(void *ctx);
};

enum ota_state {
    OTA_FREE,
    OTA_ASKED, /* connected, the first line is on its way */
    OTA_WAITS, /* the first line is there, and its proof waits for its turn (base/lockout.h) */
    OTA_TAKES, /* the image is */
    OTA_PARTS, /* a last word is to be sent, then the connection ends */
    OTA_DROPS, /* likewise, and the rest of an image is on its way: read until its sender has the word, which
                  a close before that would lose */
};

struct ota {
    const struct ota_ops *ops;
    void *ctx;
    struct ota_image image;
    struct access *access; /* whose key it needs, also where access is open; outlives this */
    enum ota_state state;
    bool done;     /* a new firmware is there: restart */
    bool on_trial; /* the firmware that runs is not confirmed; of the target */
    bool reached;  /* someone has proved to know the key since the start */
    bool proved;   /* ... by this connection */
    uint64_t left; /* address of the last one that left without a proof; 0: none has */
    struct net_stream stream;
    uint32_t heard_us;
    uint32_t tried_us; /* when the first line was complete */
    char nonce[2 * OTA_NONCE_SIZE + 1];
    union {
        char line[OTA_LINE_SIZE];        /* received */
        uint8_t header[OTA_HEADER_SIZE]; /* ... then the first bytes, until they can be judged */
    };
    size_t line_size;
    char said[OTA_SAID_SIZE]; /* not yet sent */
    size_t said_size;
    size_t size, taken; /* bytes of the image */
    uint8_t digest[SHA256_SIZE];
    struct sha256 sha;
    bool any_board; /* another board is meant */
    uint8_t mark_at,
        made_size; /* of what precedes the board's name in the image, and of the name, found so far */
    char made[OTA_BOARD_SIZE];
};

void ota_init(struct ota *ota, const struct ota_ops *ops, void *ctx, const struct ota_image *image,
              struct access *access);

/** A connection. @param nonce  random @return false: another upload is in progress, or the controller is
 * about to restart; the stream got a message and closed */
bool ota_connect(struct ota *ota, const struct net_stream *stream, const uint8_t nonce[OTA_NONCE_SIZE],
                 uint32_t now_us);

/** Continue with what has come, at most some pieces. @return true: there was something */
bool ota_poll(struct ota *ota, uint32_t now_us);

#endif
