/* SPDX-License-Identifier: MIT
 * A request of HTTP. Whatever arrives: every text of it ends inside of the request, what is taken as good
 * has a version, one Host at most and a path without its query, only a GET with a whole handshake upgrades,
 * and bytes behind the empty line change nothing. The server answers it once, however it is cut and however
 * little the connection takes: with a whole head and the body that this promises, of a file that it has, or
 * with the stream; then the connection ends.
 *
 * The input is the request as it comes from a connection. */
#include "fuzz.h"
#include "net_http.h"
#include "net_http_request.h"
#include "net_websocket.h"

#include <ctype.h>
#include <fcntl.h>
#include <string.h>
#include <strings.h>

enum { TEXT_MAX = 1536 }; /* NET_HTTP_HEAD of the smallest target */

/* One parse, in memory of exactly the request's size. */
struct parsed {
    char *text;
    size_t size; /* with its NUL */
    enum net_http_parsed how;
    struct net_http_request request;
};

static struct parsed parse(const char *text) {
    struct parsed parsed = {.size = strlen(text) + 1};
    parsed.text = malloc(parsed.size);
    if (parsed.text == NULL)
        abort();
    memcpy(parsed.text, text, parsed.size);
    parsed.how = net_http_parse(parsed.text, &parsed.request);
    return parsed;
}

static void check_inside(const struct parsed *parsed, const char *text) {
    bool inside = text >= parsed->text && text < parsed->text + parsed->size;
    CLAIM(*text == '\0' || (inside && strlen(text) < (size_t)(parsed->text + parsed->size - text)),
          "a text is elsewhere");
}

/* How many lines before the empty one begin with this, in any case. */
static unsigned count_headers(const char *text, const char *header) {
    unsigned count = 0;
    for (const char *line = strstr(text, "\r\n") + 2; strncmp(line, "\r\n", 2) != 0;
         line = strstr(line, "\r\n") + 2)
        count += strncasecmp(line, header, strlen(header)) == 0;
    return count;
}

static void check_good(const char *text, const struct net_http_request *request) {
    const char *end = strstr(text, "\r\n"), *version = end - 8;
    CLAIM(strstr(text, "\r\n\r\n") != NULL, "it has no end");
    CLAIM(version > text && strncmp(version, "HTTP/1.", 7) == 0 && isdigit((unsigned char)version[7]),
          "%.9s is no version", version);
    CLAIM(count_headers(text, "host:") <= 1, "more than one Host (RFC 9112, 3.2)");
    CLAIM(request->path[0] == '/' && strpbrk(request->path, "?# ") == NULL, "the path %s", request->path);
    for (const char *at = request->path; *at != '\0'; at++)
        CLAIM(*at > ' ' && *at <= '~' && *at != '\\', "the path %s", request->path);
    CLAIM(strstr(request->path, "%00") == NULL, "the path %s", request->path);
    CLAIM(request->host[0] != '\0' && strpbrk(request->host, " /@,%\\\"<>*") == NULL, "Host %s",
          request->host);
    CLAIM(strpbrk(request->origin, " ,@%\\\"<>*") == NULL, "Origin %s", request->origin);
    CLAIM(request->head_only == (strncmp(text, "HEAD ", 5) == 0), "HEAD");
    CLAIM(request->posts == (strncmp(text, "POST ", 5) == 0), "POST");
    CLAIM(request->head_only || request->posts || strncmp(text, "GET ", 4) == 0, "none of GET, HEAD, POST");
}

static void check_upgrade(const struct net_http_request *request) {
    char accept[NET_WEBSOCKET_ACCEPT_SIZE];
    CLAIM(!request->head_only && strlen(request->key) == NET_WEBSOCKET_KEY_SIZE, "the key %s", request->key);
    net_websocket_accept(request->key, accept);
    CLAIM(strlen(accept) == NET_WEBSOCKET_ACCEPT_SIZE - 1 && accept[NET_WEBSOCKET_ACCEPT_SIZE - 2] == '=',
          "the answer %s", accept);
}

/* A name of others is none of ours, and an origin is ours only with our host in it. */
static void check_judges(const struct net_http_request *request) {
    bool ours = net_http_host_is_ours(request->host, "wificnc", "shop.lan,cnc.lan");
    size_t size = strlen(request->host), end = sizeof ".example" - 1;
    bool is_named = strpbrk(request->host, ":[") == NULL;
    CLAIM(!ours || size > 0, "no Host is ours");
    CLAIM(!ours || !is_named || size < end || strcasecmp(request->host + size - end, ".example") != 0,
          "%s is another's", request->host);
    if (net_http_origin_is_ours(request) && request->origin[0] != '\0')
        CLAIM(strlen(request->origin) >= size + 3 &&
                  strcasecmp(request->origin + strlen(request->origin) - size, request->host) == 0,
              "%s of %s", request->origin, request->host);
}

static void check_more_changes_nothing(const char *text, const struct parsed *before) {
    char longer[TEXT_MAX + 64];
    snprintf(longer, sizeof longer, "%sGET /other HTTP/1.1\r\nHost: other\r\n\r\n", text);
    struct parsed after = parse(longer);
    CLAIM(after.how == before->how && after.request.upgrades == before->request.upgrades,
          "what follows counts");
    CLAIM(strcmp(after.request.path, before->request.path) == 0, "%s", after.request.path);
    CLAIM(strcmp(after.request.host, before->request.host) == 0, "%s", after.request.host);
    free(after.text);
}

/* ---- the server ---- */

enum {
    OUT_MAX = 4096,
    ROUNDS_MAX = 4 * OUT_MAX,
    ROUND_US = 1000,
    SILENT_ROUND_US = 100000,
    SEARCH_ROUNDS = 3
};

static const uint8_t packed[] = "packed", plain[] = "not packed";

static struct browser {
    const char *text;
    size_t left, cut;
    char out[OUT_MAX];
    size_t count;
    unsigned closed, streams, searches;
} browser;

static size_t cut_off(size_t count) {
    return count < browser.cut ? count : browser.cut;
}

static long browser_read(const struct net_stream *stream, char *bytes, size_t size) {
    size_t count = cut_off(browser.left < size ? browser.left : size);
    (void)stream;
    memcpy(bytes, browser.text, count);
    browser.text += count;
    browser.left -= count;
    return (long)count;
}

static long browser_write(const struct net_stream *stream, const char *bytes, size_t count) {
    (void)stream;
    count = cut_off(count);
    CLAIM(browser.count + count < OUT_MAX, "it never ends");
    memcpy(browser.out + browser.count, bytes, count);
    browser.count += count;
    return (long)count;
}

static void browser_close(const struct net_stream *stream) {
    (void)stream;
    browser.closed++;
}

static void take_stream(void *ctx, const struct net_stream *stream, const char *who) {
    (void)ctx;
    (void)who;
    browser.streams++;
    stream->ops->close(stream);
}

static bool find(void *ctx, const char *path, struct net_http_file *out) {
    (void)ctx;
    *out = (struct net_http_file){.path = path,
                                  .type = "text/plain",
                                  .tag = "1f0c",
                                  .packed = {strlen(path) % 2 == 0 ? packed : NULL, sizeof packed - 1},
                                  .plain = {plain, sizeof plain - 1}};
    return strcmp(path, "/nothing") != 0;
}

static bool discover(void *ctx, struct net_http_late *out) {
    (void)ctx;
    *out = (struct net_http_late){.status = "200 OK", .type = "application/json", .body = "[]"};
    return ++browser.searches % SEARCH_ROUNDS == 0;
}

static bool is_body(const char *body, size_t size, const char *known) {
    return size == strlen(known) && memcmp(body, known, size) == 0;
}

static void check_answer(void) {
    browser.out[browser.count] = '\0';
    const char *end = strstr(browser.out, "\r\n\r\n");
    CLAIM(end != NULL && strncmp(browser.out, "HTTP/1.1 ", 9) == 0, "no head: %s", browser.out);
    const char *length = strstr(browser.out, "Content-Length: "), *body = end + 4;
    size_t size = browser.count - (size_t)(body - browser.out);
    if (browser.streams > 0)
        return; /* a close frame follows */
    CLAIM(length != NULL && length < end, "no length: %s", browser.out);
    CLAIM(size == 0 || size == strtoul(length + 16, NULL, 10), "%zu bytes: %s", size, browser.out);
    if (size == 0 || strncmp(browser.out + 9, "200", 3) != 0)
        return;
    bool is_packed = strstr(browser.out, "Content-Encoding: gzip\r\n") != NULL;
    CLAIM(is_body(body, size, (const char *)(is_packed ? packed : plain)) || is_body(body, size, "{}") ||
              is_body(body, size, "[]"),
          "another body: %s", body);
}

/* @param has_table  files as a firmware has them, or those of a computer */
static void serve(const char *text, size_t cut, bool has_table) {
    static const struct net_http_file files[] = {
        {.path = "/index.html", .type = "text/html", .tag = "1", .packed = {packed, sizeof packed - 1}}};
    static const struct net_stream_ops ops = {
        .read = browser_read, .write = browser_write, .close = browser_close};
    struct net_http_site site = {
        .name = "wificnc", .about = "{}", .connect = take_stream, .silent_us = 5000000};
    struct net_http http = {.site = &site, .listener = open("/dev/null", O_RDONLY)};
    if (has_table) {
        site.files = files;
        site.count = 1;
    } else {
        site.find = find;
        site.discover = discover;
    }
    browser = (struct browser){.text = text, .left = strlen(text), .cut = cut};
    http.place[0] = (struct net_http_place){.stream = {.ops = &ops}, .head = malloc(NET_HTTP_HEAD)};
    uint32_t now_us = 0;
    for (unsigned round = 0; http.place[0].stream.ops != NULL && round < ROUNDS_MAX; round++) {
        (void)net_http_poll(&http, now_us);
        now_us += browser.left > 0 || browser.count > 0 ? ROUND_US : SILENT_ROUND_US;
    }
    CLAIM(browser.closed == 1, "closed %u times", browser.closed);
    if (strstr(text, "\r\n\r\n") != NULL)
        check_answer();
    net_http_close(&http);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    char text[TEXT_MAX];
    size = size < sizeof text ? size : sizeof text - 1;
    memcpy(text, data, size);
    text[size] = '\0';
    struct parsed parsed = parse(text);
    const struct net_http_request *request = &parsed.request;
    const char *const texts[] = {request->path, request->host, request->origin, request->key, request->tag};
    for (unsigned n = 0; n < sizeof texts / sizeof *texts; n++)
        check_inside(&parsed, texts[n]);
    if (parsed.how == NET_HTTP_GOOD)
        check_good(text, request);
    if (parsed.how == NET_HTTP_GOOD && request->upgrades)
        check_upgrade(request);
    check_judges(request);
    if (strstr(text, "\r\n\r\n") != NULL)
        check_more_changes_nothing(text, &parsed);
    free(parsed.text);
    serve(text, 1 + size % 64, true);
    serve(text, 1 + size % 7, false);
    return 0;
}
