/* SPDX-License-Identifier: MIT */
#include "net/ota.h"

#include <inttypes.h>
#include <stdio.h>
#include <string.h>

/* An image of ESP-IDF: its header of 24 bytes (esp_image_header_t, chip_id at 12), that of the first segment,
 * 8 bytes, and esp_app_desc_t, whose project_name is at 48. */
enum { IMAGE_MAGIC = 0xE9, CHIP_ID_AT = 12, NAME_AT = 80, NAME_SIZE = 32, PIECES_A_POLL = 4 };

void ota_init(struct ota *ota, const struct ota_ops *ops, void *ctx, const struct ota_image *image,
              struct access *access) {
    *ota = (struct ota){.ops = ops, .ctx = ctx, .image = *image, .access = access};
}

static const char request_form[] = "expected SIZE SHA256 SIGNATURE [any-board] MAC, or confirm MAC";
static const char confirm_word[] = "confirm ";
static const char any_board_word[] = " any-board";
static const char board_mark[] = "\"board\": \"";
enum {
    MARK_SIZE = sizeof board_mark - 1,
    MARK_QUOTE = 7 /* a mark may begin with the quotation mark before it */
};

/* ---- words ---- */

/* Whoever does not read its few answers loses them. */
static void say(struct ota *ota, const char *text) {
    size_t length = strlen(text);
    if (ota->said_size + length > sizeof ota->said)
        return;
    memcpy(ota->said + ota->said_size, text, length);
    ota->said_size += length;
}

static void say_all(struct ota *ota) {
    while (ota->said_size > 0) {
        long sent = ota->stream.ops->write(&ota->stream, ota->said, ota->said_size);
        if (sent == NET_GONE)
            ota->said_size = 0;
        if (sent <= 0)
            return;
        memmove(ota->said, ota->said + sent, ota->said_size -= (size_t)sent);
    }
}

static void hang_up(struct ota *ota) {
    if (ota->state == OTA_TAKES)
        ota->ops->abort(ota->ctx);
    ota->stream.ops->close(&ota->stream);
    ota->state = OTA_FREE;
    if (!ota->proved)
        ota->left = ota->stream.peer;
}

static void refuse(struct ota *ota, const char *why) {
    char text[OTA_SAID_SIZE];
    snprintf(text, sizeof text, "ERROR %s\n", why);
    if (ota->state == OTA_TAKES)
        ota->ops->abort(ota->ctx);
    ota->state = OTA_PARTS;
    say(ota, text);
}

static void put_hex(char *text, const uint8_t *bytes, size_t count) {
    for (size_t i = 0; i < count; i++)
        snprintf(text + 2 * i, 3, "%02x", bytes[i]);
}

static bool get_hex(const char *text, uint8_t *bytes, size_t count) {
    static const char digits[] = "0123456789abcdef";
    for (size_t i = 0; i < 2 * count; i++) {
        const char *digit = text[i] == '\0' ? NULL : strchr(digits, text[i]);
        if (digit == NULL)
            return false;
        bytes[i / 2] = (uint8_t)(bytes[i / 2] << 4 | (digit - digits));
    }
    return true;
}

/* ---- the first line ---- */

static void dismiss(const struct net_stream *stream, const char *text) {
    stream->ops->write(stream, text, strlen(text));
    stream->ops->close(stream);
}

static bool is_trusted(const struct ota *ota, uint64_t peer) {
    return !ota->access->open && access_may(ota->access, peer);
}

/* One that returns without end would else keep out everyone. */
static bool may_displace(const struct ota *ota, uint64_t peer) {
    const bool trusted = is_trusted(ota, peer);
    if (ota->proved)
        return false;
    if (trusted != is_trusted(ota, ota->stream.peer))
        return trusted;
    return ota->left == 0 || peer != ota->left;
}

bool ota_connect(struct ota *ota, const struct net_stream *stream, const uint8_t nonce[OTA_NONCE_SIZE],
                 uint32_t now_us) {
    char text[OTA_SAID_SIZE], salt[2 * ACCESS_SALT + 1];
    if (ota->done) {
        dismiss(stream, "ERROR the controller is about to restart with a new firmware\n");
        return false;
    }
    if (ota->state != OTA_FREE && !may_displace(ota, stream->peer)) {
        dismiss(stream, "ERROR another upload is in progress\n");
        return false;
    }
    if (ota->state != OTA_FREE) {
        say(ota, "ERROR another sender has connected before the access key was proved\n");
        say_all(ota);
        hang_up(ota);
    }
    ota->stream = *stream;
    ota->state = OTA_ASKED;
    ota->proved = false;
    ota->line_size = ota->said_size = ota->taken = 0;
    ota->mark_at = ota->made_size = 0;
    ota->heard_us = now_us;
    put_hex(ota->nonce, nonce, OTA_NONCE_SIZE);
    put_hex(salt, ota->access->salt, ACCESS_SALT);
    snprintf(text, sizeof text, "WIFICNC-OTA 3 %s %s %s %d %s %s\n", ota->image.board, ota->nonce, salt,
             ACCESS_ROUNDS, ota->image.digest, ota->on_trial ? "trial" : "kept");
    say(ota, text);
    say_all(ota);
    return true;
}

/* Words of hexadecimal digits, a blank between each two and nothing behind the last. */
static bool get_words(const char *text, uint8_t *const words[], const size_t sizes[], unsigned count) {
    for (unsigned i = 0; i < count; i++) {
        if (!get_hex(text, words[i], sizes[i]) || text[2 * sizes[i]] != (i + 1 < count ? ' ' : '\0'))
            return false;
        text += 2 * sizes[i] + 1;
    }
    return true;
}

/* Behind the signature. @return whether it was there; it is not any more */
static bool take_any_board(char *line) {
    char *word = strstr(line, any_board_word), *behind = word + sizeof any_board_word - 1;
    if (word == NULL || *behind != ' ')
        return false;
    memmove(word, behind, strlen(behind) + 1);
    return true;
}

static bool is_confirmation(const char *line) {
    return strncmp(line, confirm_word, sizeof confirm_word - 1) == 0;
}

/* -> size, digest and signature, which a confirmation lacks, and mac. @return it is well-formed */
static bool read_words(struct ota *ota, char *line, uint8_t signature[SIGNATURE_SIZE],
                       uint8_t mac[SHA256_SIZE]) {
    uint8_t *const words[] = {ota->digest, signature, mac};
    static const size_t sizes[] = {SHA256_SIZE, SIGNATURE_SIZE, SHA256_SIZE};
    unsigned long long size;
    int words_at = 0;
    if (is_confirmation(line))
        return get_words(line + sizeof confirm_word - 1, &words[2], &sizes[2], 1);
    ota->any_board = take_any_board(line);
    if (sscanf(line, "%10llu %n", &size, &words_at) != 1 || words_at == 0)
        return false;
    ota->size = (size_t)size;
    return get_words(line + words_at, words, sizes, 3);
}

/* @return NULL: it is well-formed, and its sender knows the access key */
static const char *read_request(struct ota *ota, char *line, uint8_t signature[SIGNATURE_SIZE]) {
    uint8_t mac[SHA256_SIZE], wanted[SHA256_SIZE];
    char message[OTA_LINE_SIZE + 2 * OTA_NONCE_SIZE];
    const char *last = strrchr(line, ' ');
    int length =
        snprintf(message, sizeof message, "%s %.*s", ota->nonce, last == NULL ? 0 : (int)(last - line), line);
    if (!read_words(ota, line, signature, mac))
        return request_form;
    sha256_hmac(ota->access->secret, SHA256_SIZE, message, (size_t)length, wanted);
    ota->proved = access_prove(ota->access, ota->stream.peer, ota->tried_us, mac, wanted) == ACCESS_GOOD;
    ota->reached |= ota->proved;
    return ota->proved ? NULL : "wrong access key";
}

/* The signature is looked at when the machine is locked and at rest: that takes a while. */
static void take_line(struct ota *ota) {
    if (!access_is_turn(ota->access, ota->stream.peer, ota->tried_us))
        return;
    uint8_t signature[SIGNATURE_SIZE];
    ota->line[ota->line_size] = '\0';
    const char *why = read_request(ota, ota->line, signature);
    if (why == NULL && is_confirmation(ota->line)) {
        ota->state = OTA_PARTS;
        say(ota, "OK\n");
        return;
    }
    if (why == NULL && ota->size <= OTA_HEADER_SIZE)
        why = "not a firmware image: too small";
    if (why == NULL)
        /* Only now: a request without the key must not lock the machine. */
        why = ota->ops->begin(ota->ctx, ota->size);
    if (why != NULL) {
        refuse(ota, why);
        return;
    }
    ota->state = OTA_TAKES;
    if (!ota->ops->is_signed(ota->ctx, ota->digest, signature)) {
        refuse(ota, "not signed with the key of the firmware that runs: install this one over USB");
        return;
    }
    sha256_begin(&ota->sha);
    say(ota, "OK\n");
}

/* ---- the image ---- */

/* Judged before the first byte is written. */
static const char *judge(const struct ota *ota) {
    const uint8_t *header = ota->header;
    if (header[0] != IMAGE_MAGIC)
        return "not an ESP32 firmware image";
    if ((header[CHIP_ID_AT] | header[CHIP_ID_AT + 1] << 8) != ota->image.chip_id)
        return "this firmware is for another chip";
    if (strncmp((const char *)header + NAME_AT, ota->image.project, NAME_SIZE) != 0)
        return "firmware of another product";
    return NULL;
}

static bool is_of_name(uint8_t byte) {
    return (byte >= 'a' && byte <= 'z') || (byte >= '0' && byte <= '9') || byte == '-';
}

/* @return true: it has ended the name of a board, which `made` is now */
static bool follow_mark(struct ota *ota, uint8_t byte) {
    if (ota->mark_at == MARK_SIZE && is_of_name(byte) && ota->made_size + 1 < OTA_BOARD_SIZE) {
        ota->made[ota->made_size++] = (char)byte;
        return false;
    }
    ota->made[ota->made_size] = '\0';
    if (ota->mark_at == MARK_SIZE && byte == '"' && ota->made_size > 0)
        return true;
    if (ota->mark_at == MARK_QUOTE && byte == board_mark[1])
        ota->mark_at = 2;
    else if (ota->mark_at < MARK_SIZE && byte == (uint8_t)board_mark[ota->mark_at])
        ota->mark_at++;
    else
        ota->mark_at = byte == '"';
    ota->made_size = 0;
    return false;
}

/* The first name counts. @return NULL, or whose it is */
static const char *judge_board(struct ota *ota, const uint8_t *bytes, size_t count) {
    for (; count > 0 && !ota->any_board; bytes++, count--) {
        if (!follow_mark(ota, *bytes))
            continue;
        ota->any_board = true; /* nothing more to look for */
        if (strcmp(ota->made, ota->image.board) == 0)
            return NULL;
        snprintf(ota->line, sizeof ota->line, "this firmware is for the board %s, and this board is %s",
                 ota->made, ota->image.board);
        return ota->line;
    }
    return NULL;
}

/* @return NULL, or why the upload ends */
static const char *keep(struct ota *ota, const uint8_t *bytes, size_t count) {
    const char *why = NULL;
    size_t at = ota->taken;
    sha256_add(&ota->sha, bytes, count);
    ota->taken += count;
    if (at < OTA_HEADER_SIZE) {
        size_t room = OTA_HEADER_SIZE - at, piece = count < room ? count : room;
        memcpy(ota->header + at, bytes, piece);
        if (piece < room)
            return NULL;
        bytes += piece;
        count -= piece;
        why = judge(ota);
        why = why == NULL ? ota->ops->write(ota->ctx, ota->header, OTA_HEADER_SIZE) : why;
    }
    why = why == NULL ? judge_board(ota, bytes, count) : why;
    return why == NULL && count > 0 ? ota->ops->write(ota->ctx, bytes, count) : why;
}

static void finish(struct ota *ota) {
    uint8_t digest[SHA256_SIZE];
    sha256_end(&ota->sha, digest);
    if (!sha256_is_equal(digest, ota->digest)) {
        refuse(ota, "the received image is damaged: its SHA-256 differs");
        return;
    }
    ota->state = OTA_PARTS; /* end() leaves nothing to be called off */
    const char *why = ota->ops->end(ota->ctx);
    if (why != NULL) {
        refuse(ota, why);
        return;
    }
    ota->done = true;
    say(ota, "DONE\n");
}

static void take_image(struct ota *ota, const uint8_t *bytes, size_t count) {
    char text[24];
    size_t before = ota->taken, left = ota->size - ota->taken;
    if (count > left) {
        refuse(ota, "received more bytes than announced");
        return;
    }
    const char *why = keep(ota, bytes, count);
    if (why != NULL) {
        refuse(ota, why);
        ota->state = ota->taken < ota->size ? OTA_DROPS : OTA_PARTS;
        return;
    }
    if (before / OTA_TOLD_EVERY != ota->taken / OTA_TOLD_EVERY) {
        snprintf(text, sizeof text, "AT %" PRIu32 "\n", (uint32_t)ota->taken);
        say(ota, text);
    }
    if (ota->taken == ota->size)
        finish(ota);
}

/* ---- */

/* Nothing is to follow before the answer. */
static void end_line(struct ota *ota) {
    ota->state = OTA_WAITS;
    ota->tried_us = ota->access->clock_us;
    take_line(ota);
}

static void take(struct ota *ota, const uint8_t *bytes, size_t count) {
    for (; count > 0 && ota->state == OTA_ASKED; bytes++, count--) {
        if (*bytes == '\n')
            end_line(ota);
        else if (ota->line_size + 1 < sizeof ota->line)
            ota->line[ota->line_size++] = (char)*bytes;
        else
            refuse(ota, request_form);
    }
    if (count > 0 && ota->state == OTA_TAKES)
        take_image(ota, bytes, count);
}

/* @return true: something came */
static bool read_piece(struct ota *ota, uint32_t now_us) {
    uint8_t bytes[OTA_PIECE];
    long count = ota->stream.ops->read(&ota->stream, (char *)bytes, sizeof bytes);
    if (count == NET_GONE || count == NET_ENDED) {
        hang_up(ota);
        return false;
    }
    if (count > 0 && ota->state != OTA_DROPS) {
        take(ota, bytes, (size_t)count);
        if (ota->state != OTA_ASKED)
            ota->heard_us = now_us;
    }
    return count > 0;
}

static bool reads(const struct ota *ota) {
    return ota->state == OTA_ASKED || ota->state == OTA_TAKES || ota->state == OTA_DROPS;
}

/* A byte now and then does not prolong the time for the first line. */
static uint32_t patience_us(const struct ota *ota) {
    if (ota->state == OTA_ASKED)
        return OTA_PROOF_US;
    return ota->state == OTA_DROPS ? OTA_LINGER_US : OTA_IDLE_US;
}

bool ota_poll(struct ota *ota, uint32_t now_us) {
    bool any = false;
    if (ota->state == OTA_FREE)
        return false;
    if (ota->state == OTA_WAITS) {
        ota->heard_us = now_us;
        take_line(ota);
    }
    for (int i = 0; i < PIECES_A_POLL && reads(ota); i++)
        any |= read_piece(ota, now_us);
    if (ota->state == OTA_FREE)
        return any;
    say_all(ota);
    const bool parted = ota->state == OTA_PARTS && ota->said_size == 0;
    if (parted || now_us - ota->heard_us > patience_us(ota))
        hang_up(ota);
    return any;
}
