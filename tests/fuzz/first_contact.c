/* SPDX-License-Identifier: MIT
 * First contact from a phone: its questions for names, and the JSON of the page.
 *
 *   - an answer repeats the question, is longer by one record at most, and leads to the controller
 *   - what is no question gets no answer
 *   - a text that was put into JSON is read as it was, and names and values keep within their sizes
 *
 * The input: a byte that chooses, and a question, a text or an object. */
#include "net_json.h"
#include "net_socket.h"

#include "fuzz.h"

#include <string.h>

/* Before net_dns.c, which is a part of this file: its socket is the input. */
static long ask(uint8_t *bytes, size_t size, struct net_address *from);
static void take_answer(const uint8_t *bytes, size_t count);
#define net_socket_receive(fd, bytes, size, from) ((void)(fd), ask(bytes, size, from))
#define net_socket_send(fd, to, bytes, count)     ((void)(fd), (void)(to), take_answer(bytes, count))
#define net_dns_open                              fuzzed_dns_open /* the library has its own */
#define net_dns_poll                              fuzzed_dns_poll
#include "net_dns.c"

enum { QUESTION_MAX = 600, TEXT_MAX = NET_JSON_VALUE - 1, JSON_MAX = 6 * NET_JSON_VALUE + 32 };

static const uint8_t controller[4] = {192, 168, 4, 1};

static struct world {
    const uint8_t *question;
    size_t size, answers, members;
    const char *text;
} world;

/* ---- names ---- */

static long ask(uint8_t *bytes, size_t size, struct net_address *from) {
    const size_t count = world.size < size ? world.size : size;
    (void)from;
    if (world.question == NULL)
        return NET_NOTHING;
    memcpy(bytes, world.question, count);
    world.question = NULL;
    world.size = count;
    return (long)count;
}

static void take_answer(const uint8_t *bytes, size_t count) {
    world.answers++;
    CLAIM(count >= HEADER && count <= PACKET, "%zu bytes", count);
    CLAIM((bytes[2] & FLAG_RESPONSE) != 0, "no answer");
    CLAIM(u16_at(bytes + 4) == 1 && u16_at(bytes + 8) == 0 && u16_at(bytes + 10) == 0, "other sections");
    const unsigned records = u16_at(bytes + 6);
    CLAIM(records <= 1, "%u records", records);
    CLAIM(count <= world.size + 16 * records, "%zu for %zu", count, world.size);
    if (records == 1)
        CLAIM(memcmp(bytes + count - 4, controller, 4) == 0, "it leads elsewhere");
}

static void ask_names(const uint8_t *data, size_t size) {
    const bool is_answer = size > 2 && (data[2] & FLAG_RESPONSE) != 0;
    world = (struct world){.question = data, .size = size};
    net_dns_poll(0, controller);
    CLAIM(world.answers <= (is_answer ? 0u : 1u), "%zu answers", world.answers);
}

/* ---- JSON ---- */

static bool take_any(void *ctx, const char *name, const char *value, bool is_text) {
    (void)ctx;
    (void)is_text;
    CLAIM(strlen(name) < NET_JSON_NAME && strlen(value) < NET_JSON_VALUE, "%s is too long", name);
    return ++world.members < 20;
}

static bool take_same(void *ctx, const char *name, const char *value, bool is_text) {
    (void)ctx;
    CLAIM(is_text && strcmp(name, "text") == 0 && strcmp(value, world.text) == 0, "%s: %s", name, value);
    world.members++;
    return true;
}

static void read_text(const char *text) {
    char json[JSON_MAX] = "{\"text\": ";
    size_t count = strlen(json);
    world = (struct world){.text = text};
    const size_t more = net_json_put_text(json + count, sizeof json - count - 1, text);
    CLAIM(more > 0, "no room");
    json[count + more] = '}';
    json[count + more + 1] = '\0';
    CLAIM(net_json_read(json, take_same, NULL) && world.members == 1, "%s", json);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    char text[QUESTION_MAX + 1];
    if (size < 1 || size > QUESTION_MAX)
        return 0;
    const uint8_t choice = *data++ % 3;
    memcpy(text, data, --size);
    text[size] = '\0';
    if (choice == 0) {
        ask_names(data, size);
    } else if (choice == 1) {
        world = (struct world){.text = NULL};
        (void)net_json_read(text, take_any, NULL);
    } else {
        text[size < TEXT_MAX ? size : TEXT_MAX] = '\0';
        read_text(text);
    }
    return 0;
}
