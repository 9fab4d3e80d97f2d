/* SPDX-License-Identifier: MIT */
#include "net_http_request.h"

#include "net_websocket.h"

#include <stdlib.h>
#include <string.h>
#include <strings.h>

enum { NAME_MAX_SIZE = 64, BODY_MAX = 1000000 };

/* ---- pieces ---- */

/* The text up to the separator, which becomes its end. *rest goes behind it. @return NULL: it does not come
 */
static char *cut(char **rest, const char *separator) {
    char *text = *rest, *end = strstr(text, separator);
    if (end == NULL)
        return NULL;
    *end = '\0';
    *rest = end + strlen(separator);
    return text;
}

static char *trim(char *text) {
    text += strspn(text, " \t");
    char *end = text + strlen(text);
    while (end > text && (end[-1] == ' ' || end[-1] == '\t'))
        *--end = '\0';
    return text;
}

/* Whether a list of tokens, as of Connection, has this one. */
static bool has_token(const char *list, const char *token) {
    size_t size = strlen(token);
    while (*list != '\0') {
        list += strspn(list, ", \t");
        size_t length = strcspn(list, ", \t;");
        if (length == size && strncasecmp(list, token, size) == 0)
            return true;
        list += strcspn(list, ",");
    }
    return false;
}

/* ---- hosts ---- */

static size_t span_of_name(const char *text) {
    return strspn(text, "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-._");
}

static bool is_port_or_end(const char *text) {
    size_t size = strlen(text);
    return size == 0 ||
           (*text == ':' && strspn(text + 1, "0123456789") == size - 1 && size <= sizeof ":65535" - 1);
}

/* "name", "10.0.0.7", "[fe80::1]", each with or without ":port" (RFC 3986, 3.2). */
static bool is_host(const char *text) {
    if (*text != '[')
        return span_of_name(text) > 0 && is_port_or_end(text + span_of_name(text));
    size_t size = strspn(text + 1, "0123456789abcdefABCDEF:.");
    return size > 0 && text[1 + size] == ']' && is_port_or_end(text + size + 2);
}

/* "null" is what a browser says of a page without an address. */
static bool is_origin(const char *text) {
    size_t scheme = strspn(text, "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+-.");
    return strcmp(text, "null") == 0 ||
           (scheme > 0 && strncmp(text + scheme, "://", 3) == 0 && is_host(text + scheme + 3));
}

/* ---- the request ---- */

/* What headers say before they are judged together. */
struct handshake {
    const char *upgrade, *connection, *version, *length, *transfer;
    unsigned hosts; /* Host lines: a request with two means either (RFC 9112, 3.2) */
};

static void take_header(const char *name, const char *value, struct net_http_request *request,
                        struct handshake *handshake) {
    const struct {
        const char *name, **value;
    } known[] = {{"Host", &request->host},
                 {"Origin", &request->origin},
                 {"If-None-Match", &request->tag},
                 {"Sec-WebSocket-Key", &request->key},
                 {"Sec-WebSocket-Version", &handshake->version},
                 {"Content-Type", &request->type},
                 {"Content-Length", &handshake->length},
                 {"Transfer-Encoding", &handshake->transfer},
                 {"Upgrade", &handshake->upgrade},
                 {"Connection", &handshake->connection}};
    handshake->hosts += strcasecmp(name, "Host") == 0;
    if (strcasecmp(name, "Accept-Encoding") == 0)
        request->takes_gzip = has_token(value, "gzip") || has_token(value, "*");
    for (unsigned i = 0; i < sizeof known / sizeof known[0]; i++)
        if (strcasecmp(name, known[i].name) == 0)
            *known[i].value = value;
}

static bool take_headers(char *rest, struct net_http_request *request, struct handshake *handshake) {
    for (;;) {
        char *line = cut(&rest, "\r\n"), *value = line;
        if (line == NULL)
            return false;
        if (*line == '\0')
            return handshake->hosts <= 1;
        char *name = cut(&value, ":");
        if (name == NULL || *name == '\0' || strpbrk(name, " \t") != NULL)
            return false;
        take_header(name, trim(value), request, handshake);
    }
}

static bool is_version(const char *text) {
    return strncmp(text, "HTTP/1.", 7) == 0 && text[7] >= '0' && text[7] <= '9' && text[8] == '\0';
}

static bool is_hex(char digit) {
    return (digit >= '0' && digit <= '9') || ((digit | 0x20) >= 'a' && (digit | 0x20) <= 'f');
}

/* What is printed, without a backslash; each % is a byte in hex, and not the end of a text (RFC 3986, 2.1).
 */
static bool is_target(const char *text) {
    for (; *text != '\0'; text++) {
        if (*text <= ' ' || *text > '~' || *text == '\\')
            return false;
        if (*text == '%' && (!is_hex(text[1]) || !is_hex(text[2]) || (text[1] == '0' && text[2] == '0')))
            return false;
    }
    return true;
}

static enum net_http_parsed take_request_line(char *line, struct net_http_request *request) {
    const char *method = cut(&line, " ");
    char *path = method == NULL ? NULL : cut(&line, " ");
    if (path == NULL || *path != '/' || !is_version(line))
        return NET_HTTP_BAD;
    if (!is_target(path))
        return NET_HTTP_BAD;
    path[strcspn(path, "?#")] = '\0';
    request->path = path;
    request->head_only = strcmp(method, "HEAD") == 0;
    request->posts = strcmp(method, "POST") == 0;
    return request->head_only || request->posts || strcmp(method, "GET") == 0 ? NET_HTTP_GOOD
                                                                              : NET_HTTP_METHOD;
}

/* Digits, few enough for an int. */
static bool is_length(const char *text) {
    const size_t size = strlen(text);
    return size > 0 && size <= 6 && strspn(text, "0123456789") == size;
}

size_t net_http_whole(const char *text, size_t *head) {
    static const char name[] = "\r\nContent-Length:";
    const char *end = strstr(text, "\r\n\r\n");
    if (end == NULL)
        return 0;
    *head = (size_t)(end - text) + 4;
    size_t body = 0;
    for (const char *line = text; strncmp(text, "POST ", 5) == 0 && line != NULL && line < end;
         line = strstr(line + 2, "\r\n"))
        if (strncasecmp(line, name, sizeof name - 1) == 0)
            body = (size_t)strtoul(line + sizeof name - 1, NULL, 10);
    return *head + (body < BODY_MAX ? body : BODY_MAX);
}

/* 16 bytes in base64 (RFC 6455, 4.2.1). */
static bool is_key(const char *key) {
    static const char letters[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    return strspn(key, letters) == NET_WEBSOCKET_KEY_SIZE - 2 &&
           strcmp(key + NET_WEBSOCKET_KEY_SIZE - 2, "==") == 0;
}

enum net_http_parsed net_http_parse(char *text, struct net_http_request *request) {
    struct handshake handshake = {
        .upgrade = "", .connection = "", .version = "", .length = "", .transfer = ""};
    char *line = cut(&text, "\r\n");
    *request = (struct net_http_request){
        /* A client that does not send Accept-Encoding accepts any encoding (RFC 9110, 12.5.3). */
        .path = "", .host = "", .origin = "", .key = "", .tag = "", .type = "", .takes_gzip = true};
    if (line == NULL)
        return NET_HTTP_BAD;
    enum net_http_parsed parsed = take_request_line(line, request);
    if (parsed != NET_HTTP_BAD && !take_headers(text, request, &handshake))
        return NET_HTTP_BAD;
    request->has_length = *handshake.transfer == '\0' && is_length(handshake.length);
    if (parsed == NET_HTTP_GOOD && !is_host(request->host))
        return NET_HTTP_BAD_HOST;
    if (parsed == NET_HTTP_GOOD && *request->origin != '\0' && !is_origin(request->origin))
        return NET_HTTP_BAD_ORIGIN;
    request->upgrades = has_token(handshake.upgrade, "websocket") &&
                        has_token(handshake.connection, "upgrade") && strcmp(handshake.version, "13") == 0 &&
                        is_key(request->key) && !request->head_only;
    return parsed;
}

/* ---- who may come ---- */

/* The host without its port. @return false: that is none */
static bool host_name(const char *host, char name[NAME_MAX_SIZE]) {
    size_t size = *host == '[' ? strcspn(host, "]") : strcspn(host, ":");
    if (size == 0 || size >= NAME_MAX_SIZE)
        return false;
    memcpy(name, host, size);
    name[size] = '\0';
    return true;
}

static bool ends_with(const char *text, const char *end) {
    size_t size = strlen(text), length = strlen(end);
    return size > length && strcasecmp(text + size - length, end) == 0;
}

/* IPv6 is in brackets; a name of digits and dots alone is not a domain name. */
static bool is_address(const char *name) {
    return *name == '[' || name[strspn(name, "0123456789.")] == '\0';
}

bool net_http_host_is_ours(const char *host, const char *name, const char *names) {
    char asked[NAME_MAX_SIZE];
    return host_name(host, asked) &&
           (is_address(asked) || ends_with(asked, ".local") || strcasecmp(asked, "localhost") == 0 ||
            strcasecmp(asked, name) == 0 || (names != NULL && has_token(names, asked)));
}

bool net_http_origin_is_ours(const struct net_http_request *request) {
    const char *scheme_end = strstr(request->origin, "://");
    /* Without an Origin it is not a page in a browser but a program, which could send any. */
    return *request->origin == '\0' || (scheme_end != NULL && strcasecmp(scheme_end + 3, request->host) == 0);
}
