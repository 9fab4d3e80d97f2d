/* SPDX-License-Identifier: MIT
 * A request of HTTP. Whatever arrives: every text of it ends inside of the request, what is taken as good
 * has a version, one Host at most and a path without its query, only a GET with a whole handshake upgrades,
 * and bytes behind the empty line change nothing.
 *
 * The input is the request as it comes from a connection. */
#include "fuzz.h"
#include "net_http_request.h"
#include "net_websocket.h"

#include <ctype.h>
#include <string.h>
#include <strings.h>

enum { TEXT_MOST = 1536 }; /* NET_HTTP_HEAD of the smallest target */

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
    CLAIM(request->head_only == (strncmp(text, "HEAD ", 5) == 0), "HEAD");
    CLAIM(request->head_only || strncmp(text, "GET ", 4) == 0, "neither GET nor HEAD");
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
    bool ours = net_http_host_is_ours(request->host, "wificnc");
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
    char longer[TEXT_MOST + 64];
    snprintf(longer, sizeof longer, "%sGET /other HTTP/1.1\r\nHost: other\r\n\r\n", text);
    struct parsed after = parse(longer);
    CLAIM(after.how == before->how && after.request.upgrades == before->request.upgrades,
          "what follows counts");
    CLAIM(strcmp(after.request.path, before->request.path) == 0, "%s", after.request.path);
    CLAIM(strcmp(after.request.host, before->request.host) == 0, "%s", after.request.host);
    free(after.text);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    char text[TEXT_MOST];
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
    return 0;
}
