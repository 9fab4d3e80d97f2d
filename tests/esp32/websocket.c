/* SPDX-License-Identifier: MIT
 * The WebSocket of the page: digests and frames of the RFCs, text and binary bytes, what is no WebSocket, and
 * a connection that takes a byte at a time. */
#include "check.h"
#include "net_http_request.h"
#include "net_sha1.h"
#include "net_websocket.h"

#include <stdlib.h>
#include <string.h>

/* ---- the handshake ---- */

static bool is_hex(const uint8_t *digest, const char *hex) {
    char text[2 * NET_SHA1_SIZE + 1];
    for (unsigned i = 0; i < NET_SHA1_SIZE; i++)
        snprintf(text + 2 * i, 3, "%02x", digest[i]);
    return strcmp(text, hex) == 0;
}

/* FIPS 180-2, appendix A; "a" to the longest by Python's hashlib. */
static void digests_are_the_published_ones(void) {
    static const char two_blocks[] = "abcdbcdecdefdefgefghfghighijhijkijkljklmklmnlmnomnopnopq";
    uint8_t digest[NET_SHA1_SIZE];
    char longest[NET_SHA1_TEXT_MAX];
    net_sha1("abc", 3, digest);
    CHECK(is_hex(digest, "a9993e364706816aba3e25717850c26c9cd0d89d"));
    net_sha1(two_blocks, sizeof two_blocks - 1, digest);
    CHECK(is_hex(digest, "84983e441c3bd26ebaae4aa1f95129e5e54670f1"));
    memset(longest, 'a', sizeof longest);
    net_sha1(longest, sizeof longest, digest);
    CHECK(is_hex(digest, "ee971065aaa017e0632a8ca6c77bb3bf8b1dfc56"));
}

/* RFC 6455, 1.3. */
static void the_key_is_accepted_as_the_rfc_says(void) {
    char accept[NET_WEBSOCKET_ACCEPT_SIZE];
    net_websocket_accept("dGhlIHNhbXBsZSBub25jZQ==", accept);
    CHECK(strcmp(accept, "s3pPLMBiTxaQ9kYGzzhZRbK+xOo=") == 0);
}

/* ---- frames: the connection is two buffers ---- */

static struct wire {
    uint8_t in[512], out[8192];
    size_t in_count, in_at, out_count;
    size_t takes; /* bytes that it takes before it must be asked again */
    bool closed;
} wire;

static long wire_read(const struct net_stream *stream, char *bytes, size_t size) {
    size_t left = wire.in_count - wire.in_at, count = left < size ? left : size;
    (void)stream;
    memcpy(bytes, wire.in + wire.in_at, count);
    wire.in_at += count;
    return (long)count;
}

static long wire_write(const struct net_stream *stream, const char *bytes, size_t count) {
    size_t took = count < wire.takes ? count : wire.takes;
    (void)stream;
    memcpy(wire.out + wire.out_count, bytes, took);
    wire.out_count += took;
    return (long)took;
}

static void wire_close(const struct net_stream *stream) {
    (void)stream;
    wire.closed = true;
}

static struct net_stream open_stream(void) {
    static const struct net_stream_ops ops = {.read = wire_read, .write = wire_write, .close = wire_close};
    const struct net_stream inner = {.ops = &ops, .fd = 7, .peer = 9};
    struct net_stream stream;
    struct net_websocket *websocket = malloc(sizeof *websocket);
    if (websocket == NULL)
        abort();
    wire = (struct wire){.takes = SIZE_MAX};
    net_websocket_open(websocket, &inner, &stream);
    return stream;
}

static void come(const void *bytes, size_t count) {
    memcpy(wire.in, bytes, count);
    wire.in_count = count;
    wire.in_at = 0;
}

/* A frame whose mask is 0. */
static void come_frame(uint8_t first, const char *payload) {
    uint8_t frame[256] = {first, (uint8_t)(0x80 | strlen(payload))};
    memcpy(frame + 6, payload, strlen(payload));
    come(frame, 6 + strlen(payload));
}

/* What the stream gives until it has nothing more, at most `piece` bytes at a time. */
static const char *read_all(const struct net_stream *stream, size_t piece) {
    static char text[512];
    size_t count = 0;
    while (wire.in_at < wire.in_count) {
        long got = stream->ops->read(stream, text + count, piece);
        if (got < 0)
            break;
        count += (size_t)got;
    }
    text[count] = '\0';
    return text;
}

static bool said(const void *bytes, size_t count) {
    return wire.out_count == count && memcmp(wire.out, bytes, count) == 0;
}

/* RFC 6455, 5.7. */
static void the_examples_of_the_rfc_are_understood(void) {
    static const uint8_t hello[] = {0x81, 0x85, 0x37, 0xfa, 0x21, 0x3d, 0x7f, 0x9f, 0x4d, 0x51, 0x58};
    static const uint8_t ping[] = {0x89, 0x85, 0x37, 0xfa, 0x21, 0x3d, 0x7f, 0x9f, 0x4d, 0x51, 0x58};
    static const uint8_t pong[] = {0x8a, 0x05, 0x48, 0x65, 0x6c, 0x6c, 0x6f};
    struct net_stream stream = open_stream();
    CHECK(stream.fd == 7 && stream.peer == 9 && !stream.local && !stream.telnet);
    for (size_t piece = 1; piece <= sizeof hello; piece++) {
        come(hello, sizeof hello);
        CHECK(strcmp(read_all(&stream, piece), "Hello") == 0);
    }
    come(ping, sizeof ping);
    CHECK(strcmp(read_all(&stream, 3), "") == 0 && said(pong, sizeof pong));
    stream.ops->close(&stream);
    CHECK(wire.closed);
}

static void a_ping_between_the_pieces_of_a_message_is_answered(void) {
    struct net_stream stream = open_stream();
    come_frame(0x01, "G1 ");
    CHECK(strcmp(read_all(&stream, 100), "G1 ") == 0);
    come_frame(0x89, "");
    CHECK(strcmp(read_all(&stream, 100), "") == 0 && said("\x8a\x00", 2));
    come_frame(0x80, "X1\n");
    CHECK(strcmp(read_all(&stream, 100), "X1\n") == 0);
    stream.ops->close(&stream);
}

/* Jog cancel and the last real-time byte; each letter and sign of a comment is one byte of text. */
static void real_time_bytes_come_as_text_and_as_bytes(void) {
    struct net_stream stream = open_stream();
    come_frame(0x81, "?\xC2\x85\xC2\xA1(\xC3\xA1\xE2\x82\xAC\xF0\x9F\x99\x82)\n");
    CHECK(strcmp(read_all(&stream, 1), "?\x85\xA1(\x7F\x7F\x7F)\n") == 0);
    come_frame(0x82, "\x85\xC3\xFF");
    CHECK(strcmp(read_all(&stream, 100), "\x85\xC3\xFF") == 0);
    stream.ops->close(&stream);
}

/* The stream ends, and the close frame says why. */
static void check_refused(const void *bytes, size_t count, uint16_t code) {
    const uint8_t close[] = {0x88, 0x02, (uint8_t)(code >> 8), (uint8_t)code};
    char byte;
    struct net_stream stream = open_stream();
    come(bytes, count);
    (void)read_all(&stream, 100);
    CHECK(stream.ops->read(&stream, &byte, 1) == NET_GONE && said(close, sizeof close));
    stream.ops->close(&stream);
    CHECK(said(close, sizeof close));
}

static void what_is_no_websocket_is_refused_with_the_reason(void) {
    check_refused("\x81\x05Hello", 7, 1002);                       /* without a mask */
    check_refused("\xC1\x80\0\0\0\0", 6, 1002);                    /* reserved bits */
    check_refused("\x83\x80\0\0\0\0", 6, 1002);                    /* an opcode that is none */
    check_refused("\x8B\x80\0\0\0\0", 6, 1002);                    /* ... of control */
    check_refused("\x80\x80\0\0\0\0", 6, 1002);                    /* continues with nothing */
    check_refused("\x09\x80\0\0\0\0", 6, 1002);                    /* a ping in pieces */
    check_refused("\x89\xFE\0\x7E\0\0\0\0", 8, 1002);              /* a ping of 126 bytes */
    check_refused("\x82\xFF\x80\0\0\0\0\0\0\0\0\0\0\0", 14, 1002); /* 2^63 bytes */
    check_refused("\x81\x81\0\0\0\0\xC3", 7, 1007);                /* half a character */
    check_refused("\x81\x81\0\0\0\0\x85", 7, 1007);                /* no begin of one */
    check_refused("\x81\x82\0\0\0\0\xC3G", 8, 1007);               /* not the rest of one */
    check_refused("\x81\x83\0\0\0\0\xE0\x82\x85", 9, 1007);        /* 0x85, longer than need be */
    check_refused("\x81\x83\0\0\0\0\xED\xA0\x80", 9, 1007);        /* a surrogate */
    check_refused("\x81\x84\0\0\0\0\xF4\x90\x80\x80", 10, 1007);   /* beyond U+10FFFF */
    check_refused("\x01\x80\0\0\0\0\x81\x80\0\0\0\0", 12, 1002);   /* a message within a message */
}

static void a_close_is_answered_with_its_code(void) {
    char byte;
    struct net_stream stream = open_stream();
    come("\x88\x85\0\0\0\0\x03\xE8"
         "bye",
         11);
    CHECK(strcmp(read_all(&stream, 100), "") == 0 && said("\x88\x02\x03\xE8", 4));
    CHECK(stream.ops->read(&stream, &byte, 1) == NET_GONE);
    stream.ops->close(&stream);
}

/* ---- out ---- */

/* Payloads of binary messages, as a browser puts them together. */
static size_t unframe(uint8_t *payload) {
    size_t at = 0, count = 0;
    while (at < wire.out_count) {
        CHECK(wire.out[at] == 0x82);
        size_t size = wire.out[at + 1];
        at += 2;
        if (size == 126) {
            size = (size_t)wire.out[at] << 8 | wire.out[at + 1];
            at += 2;
        }
        memcpy(payload + count, wire.out + at, size);
        count += size;
        at += size;
    }
    CHECK(at == wire.out_count);
    return count;
}

static void answers_are_whole_whatever_the_connection_takes(void) {
    char text[3000];
    uint8_t payload[8192];
    for (size_t i = 0; i < sizeof text; i++)
        text[i] = (char)(i * 7 + i / 251);
    for (size_t takes = 1; takes < 2000; takes = takes * 3 + 1)
        for (size_t size = 1; size <= sizeof text; size = size * 5 + 3) {
            struct net_stream stream = open_stream();
            wire.takes = takes;
            for (size_t at = 0, idle = 0; at < size && idle < 9; idle++) {
                long took = stream.ops->write(&stream, text + at, size - at);
                at += (size_t)took;
                idle = took > 0 ? 0 : idle;
            }
            CHECK(unframe(payload) == size && memcmp(payload, text, size) == 0);
            stream.ops->close(&stream);
        }
}

static void a_pong_waits_for_the_end_of_a_message(void) {
    struct net_stream stream = open_stream();
    wire.takes = 3;
    CHECK(stream.ops->write(&stream, "ok\r\n", 4) == 1);
    wire.takes = SIZE_MAX;
    come_frame(0x89, "a");
    (void)read_all(&stream, 100);
    CHECK(wire.out_count == 3);
    CHECK(stream.ops->write(&stream, "k\r\n", 3) == 3);
    CHECK(stream.ops->write(&stream, "!", 1) == 1);
    CHECK(said("\x82\x04ok\r\n\x8a\x01"
               "a\x82\x01!",
               12));
    stream.ops->close(&stream);
}

/* ---- requests ---- */

static enum net_http_parsed parse(const char *text, struct net_http_request *request) {
    static char copy[1024];
    snprintf(copy, sizeof copy, "%s", text);
    return net_http_parse(copy, request);
}

static void requests_are_read_as_rfc_9112_says(void) {
    struct net_http_request request;
    CHECK(parse("GET /a/b.js?x=1 HTTP/1.1\r\nhost:  cnc.local:80 \r\naccept-encoding: br, GZIP;q=0.5\r\n\r\n",
                &request) == NET_HTTP_GOOD);
    CHECK(strcmp(request.path, "/a/b.js") == 0 && strcmp(request.host, "cnc.local:80") == 0);
    CHECK(request.takes_gzip && !request.upgrades && !request.head_only && *request.origin == '\0');
    CHECK(parse("HEAD / HTTP/1.0\r\nHost: a\r\nAccept-Encoding: identity\r\n\r\n", &request) ==
          NET_HTTP_GOOD);
    CHECK(request.head_only && !request.takes_gzip);
    CHECK(parse("PUT / HTTP/1.1\r\nHost: a\r\n\r\n", &request) == NET_HTTP_METHOD);
    static const char *const bad[] = {"\r\n\r\n",
                                      "GET /\r\n\r\n",
                                      "GET  / HTTP/1.1\r\n\r\n",
                                      "GET http://a/ HTTP/1.1\r\n\r\n",
                                      "GET / HTTP/2.0\r\n\r\n",
                                      "GET / HTTP/1.1\r\nHost a\r\n\r\n",
                                      "GET / HTTP/1.1\r\nHost : a\r\n\r\n",
                                      "GET / HTTP/1.1\r\n: a\r\n\r\n",
                                      "GET /\x80 HTTP/1.1\r\nHost: a\r\n\r\n",
                                      "GET /a\tb HTTP/1.1\r\nHost: a\r\n\r\n",
                                      "GET /a\\b HTTP/1.1\r\nHost: a\r\n\r\n",
                                      "GET /%zz HTTP/1.1\r\nHost: a\r\n\r\n",
                                      "GET /%2 HTTP/1.1\r\nHost: a\r\n\r\n",
                                      "GET /a%00.html HTTP/1.1\r\nHost: a\r\n\r\n",
                                      "GET / HTTP/1.1\r\nHost: a\r\nHost: a\r\n\r\n",
                                      "\x16\x03\x01\r\n\r\n"};
    for (unsigned i = 0; i < sizeof bad / sizeof bad[0]; i++)
        CHECK(parse(bad[i], &request) == NET_HTTP_BAD);
}

static enum net_http_parsed parse_with(const char *host, const char *origin) {
    struct net_http_request request;
    char text[300];
    snprintf(text, sizeof text, "GET / HTTP/1.1\r\nHost: %s\r\n%s%s%s\r\n", host, *origin ? "Origin: " : "",
             origin, *origin ? "\r\n" : "");
    return parse(text, &request);
}

/* RFC 9112, 3.2: a Host that is missing or invalid is a bad request; RFC 6454, 7. */
static void a_malformed_host_or_origin_is_a_bad_request(void) {
    static const char *const good[] = {"a", "a:", "a:80", "[::1]", "[::1]:8080", "10.0.0.7:80", "x_y.lan"};
    static const char *const bad[] = {"",        ":80",        "a b",    "a:b",  "a:123456", "[::1",
                                      "[]",      "[g]",        "a/b",    "a@b",  "a,b",      "[::1]x",
                                      "a:80:80", "a%41",       "\x80",   "a\"b", "<script>", "a\\b",
                                      "*",       "http://a.b", "[::1]:x"};
    static const char *const origins[] = {"null", "http://a", "https://a:1", "http://[::1]:80",
                                          "chrome-extension://abc"};
    static const char *const no_origins[] = {
        "a",       "http:", "http://",    "://a", "http://a/b", "http://a b", "http://a, http://b",
        "http//a", "Null ", "http://a:b", "\x01"};
    for (unsigned i = 0; i < sizeof good / sizeof good[0]; i++)
        CHECK(parse_with(good[i], "") == NET_HTTP_GOOD);
    for (unsigned i = 0; i < sizeof bad / sizeof bad[0]; i++)
        CHECK(parse_with(bad[i], "") == NET_HTTP_BAD_HOST);
    for (unsigned i = 0; i < sizeof origins / sizeof origins[0]; i++)
        CHECK(parse_with("a", origins[i]) == NET_HTTP_GOOD);
    for (unsigned i = 0; i < sizeof no_origins / sizeof no_origins[0]; i++)
        CHECK(parse_with("a", no_origins[i]) == NET_HTTP_BAD_ORIGIN);
}

static void only_a_whole_handshake_upgrades(void) {
    static const char whole[] = "GET /grbl HTTP/1.1\r\nHost: 10.0.0.7\r\nConnection: keep-alive, Upgrade\r\n"
                                "Upgrade: WebSocket\r\nSec-WebSocket-Version: 13\r\n"
                                "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n";
    static const char *const needed[] = {"Upgrade\r\n", "WebSocket\r\n", "13", "=="};
    struct net_http_request request;
    CHECK(parse(whole, &request) == NET_HTTP_GOOD && request.upgrades);
    for (unsigned i = 0; i < sizeof needed / sizeof needed[0]; i++) {
        char text[sizeof whole];
        memcpy(text, whole, sizeof whole);
        *strstr(text, needed[i]) = 'x';
        CHECK(parse(text, &request) == NET_HTTP_GOOD && !request.upgrades);
    }
}

static void a_name_of_the_internet_is_not_ours(void) {
    static const char *const ours[] = {"192.168.4.1",    "192.168.4.1:80",     "[fe80::1]:80",
                                       "localhost:8080", "WiFiCNC-1A2B.local", "x.LOCAL",
                                       "wificnc-1a2b",   "WiFiCNC-1A2B:80"};
    static const char *const theirs[] = {"",      "evil.example",        "1.2.3.4.evil.example",
                                         "local", ".local.evil.example", "wificnc-1a2b.evil.example",
                                         ":80"};
    for (unsigned i = 0; i < sizeof ours / sizeof ours[0]; i++)
        CHECK(net_http_host_is_ours(ours[i], "WiFiCNC-1A2B", NULL));
    for (unsigned i = 0; i < sizeof theirs / sizeof theirs[0]; i++)
        CHECK(!net_http_host_is_ours(theirs[i], "WiFiCNC-1A2B", NULL));
}

/* A name that the user gives, and nothing that only contains it. */
static void names_of_the_list_are_ours(void) {
    static const char list[] = "shop.lan, CNC.home";
    static const char *const ours[] = {"shop.lan", "SHOP.LAN:8080", "cnc.home"};
    static const char *const theirs[] = {"lan",       "shop.lan.evil.example", "evil.shop.lan", "shop.la",
                                         "shop.lann", "shop.lan,cnc.home",     "cnc.hom,e"};
    for (unsigned i = 0; i < sizeof ours / sizeof ours[0]; i++)
        CHECK(net_http_host_is_ours(ours[i], "x", list) && !net_http_host_is_ours(ours[i], "x", ""));
    for (unsigned i = 0; i < sizeof theirs / sizeof theirs[0]; i++)
        CHECK(!net_http_host_is_ours(theirs[i], "x", list));
}

static void a_page_from_elsewhere_is_not_ours(void) {
    struct net_http_request request = {.host = "10.0.0.7:8080", .origin = ""};
    CHECK(net_http_origin_is_ours(&request));
    request.origin = "http://10.0.0.7:8080";
    CHECK(net_http_origin_is_ours(&request));
    static const char *const theirs[] = {"http://10.0.0.7", "http://evil.example", "null",
                                         "http://10.0.0.7:8080.evil"};
    for (unsigned i = 0; i < sizeof theirs / sizeof theirs[0]; i++) {
        request.origin = theirs[i];
        CHECK(!net_http_origin_is_ours(&request));
    }
}

int main(void) {
    digests_are_the_published_ones();
    the_key_is_accepted_as_the_rfc_says();
    the_examples_of_the_rfc_are_understood();
    a_ping_between_the_pieces_of_a_message_is_answered();
    real_time_bytes_come_as_text_and_as_bytes();
    what_is_no_websocket_is_refused_with_the_reason();
    a_close_is_answered_with_its_code();
    answers_are_whole_whatever_the_connection_takes();
    a_pong_waits_for_the_end_of_a_message();
    requests_are_read_as_rfc_9112_says();
    a_malformed_host_or_origin_is_a_bad_request();
    only_a_whole_handshake_upgrades();
    a_name_of_the_internet_is_not_ours();
    names_of_the_list_are_ours();
    a_page_from_elsewhere_is_not_ours();
    return report();
}
