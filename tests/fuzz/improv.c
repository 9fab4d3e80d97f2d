/* SPDX-License-Identifier: MIT
 * Improv on a serial port. Whatever arrives, however it is cut, and however much the port takes:
 *
 *   - the hub gets every byte that is not of a packet, in its order
 *   - what goes out is the hub's lines, whole, and between them packets with a right sum
 *   - a network is joined only with a name and a password that fit
 *
 * The input: a byte of cuts, a byte of what the world answers, and then what comes from the port. */
#include "link/improv.h"
#include "fuzz.h"

#include <string.h>

enum { IN_MAX = 2048, OUT_MAX = 1 << 16, NAME_SIZE = 6, LENGTH_AT = 8, CHUNK_MAX = 300, NETWORKS = 3 };
enum { ACCEPTS = 1, JOINED = 2, SCANNED = 4 };

static const char line[] = "<Idle|MPos:0.000,0.000,0.000|FS:0,0>\r\n";

static struct world {
    struct input input, cuts;
    uint8_t answers;
    uint8_t in[IN_MAX], hub[IN_MAX], out[OUT_MAX];
    size_t in_count, hub_count, out_count, lines;
    uint32_t now_us;
} world;

static size_t next_cut(void) {
    if (input_left(&world.cuts) == 0)
        return CHUNK_MAX;
    return 1u + input_byte(&world.cuts) % 40u;
}

static long port_read(const struct net_stream *port, char *bytes, size_t size) {
    size_t count = input_left(&world.input), cut = next_cut();
    (void)port;
    count = count < size ? count : size;
    count = count < cut ? count : cut;
    memcpy(bytes, world.input.at, count);
    memcpy(world.in + world.in_count, world.input.at, count);
    world.in_count += count;
    world.input.at += count;
    return (long)count;
}

static long port_write(const struct net_stream *port, const char *bytes, size_t count) {
    size_t cut = next_cut();
    (void)port;
    count = count < cut ? count : cut;
    CLAIM(world.out_count + count <= OUT_MAX, "it never ends");
    memcpy(world.out + world.out_count, bytes, count);
    world.out_count += count;
    return (long)count;
}

static void port_close(const struct net_stream *port) {
    (void)port;
}

static bool join(void *ctx, const char *network, const char *password) {
    size_t length = strlen(network), secret = strlen(password);
    (void)ctx;
    CLAIM(length > 0 && length <= WIFI_SSID_MAX, "a name of %zu", length);
    CLAIM(secret == 0 || (secret >= WIFI_PASSWORD_MIN && secret <= WIFI_PASSWORD_MAX), "a password of %zu",
          secret);
    return (world.answers & ACCEPTS) != 0;
}

static bool joined(void *ctx, char *address) {
    (void)ctx;
    memcpy(address, "tcp://192.168.1.20:23", sizeof "tcp://192.168.1.20:23");
    return (world.answers & JOINED) != 0;
}

static bool scan(void *ctx) {
    (void)ctx;
    return (world.answers & ACCEPTS) != 0;
}

static enum improv_scan scanned(void *ctx, size_t index, struct improv_network *network) {
    (void)ctx;
    if ((world.answers & SCANNED) == 0)
        return IMPROV_SCANNING;
    *network = (struct improv_network){.name = "a workshop with a name of 32 ...", .rssi_dbm = -60};
    return index < NETWORKS ? IMPROV_NETWORK : IMPROV_NO_MORE;
}

static uint32_t now_us(void *ctx) {
    (void)ctx;
    return world.now_us += 100;
}

/* Bytes of the packet that begins here; 0: none does; SIZE_MAX: one may, and the rest is to come. */
static size_t packet_at(const uint8_t *bytes, size_t count) {
    static const uint8_t begin[] = {'I', 'M', 'P', 'R', 'O', 'V', 1};
    size_t known = count < sizeof begin ? count : sizeof begin;
    if (memcmp(bytes, begin, known) != 0)
        return 0;
    if (count <= LENGTH_AT)
        return SIZE_MAX;
    if (bytes[LENGTH_AT] > IMPROV_DATA_MAX)
        return 0;
    size_t whole = IMPROV_HEAD + bytes[LENGTH_AT] + 1u;
    return count < whole ? SIZE_MAX : whole;
}

static void check_hub(void) {
    uint8_t wanted[IN_MAX];
    size_t count = 0, at = 0, packet;
    while (at < world.in_count && (packet = packet_at(world.in + at, world.in_count - at)) != SIZE_MAX) {
        if (packet == 0)
            wanted[count++] = world.in[at];
        at += packet == 0 ? 1 : packet;
    }
    CLAIM(count == world.hub_count && memcmp(wanted, world.hub, count) == 0, "%zu bytes, not %zu",
          world.hub_count, count);
}

/* Nothing is cut: the hub has written whole lines, and all has gone out. */
static void check_out(void) {
    size_t lines = 0;
    for (size_t at = 0; at < world.out_count;) {
        const uint8_t *bytes = world.out + at;
        size_t left = world.out_count - at, packet = packet_at(bytes + 1, left - 1);
        if (left >= sizeof line - 1 && memcmp(bytes, line, sizeof line - 1) == 0) {
            at += sizeof line - 1;
            lines++;
            continue;
        }
        CLAIM(bytes[0] == '\n' && packet != 0 && packet != SIZE_MAX && packet + 2 <= left, "%zu: no packet",
              at);
        uint8_t sum = 0;
        for (size_t n = 1; n < packet; n++)
            sum = (uint8_t)(sum + bytes[n]);
        CLAIM(bytes[packet] == sum && bytes[packet + 1] == '\n', "%zu: a wrong sum", at);
        at += packet + 2;
    }
    CLAIM(lines == world.lines, "%zu lines, not %zu", lines, world.lines);
}

static void write_line(const struct net_stream *stream) {
    for (size_t at = 0, idle = 0; at < sizeof line - 1;) {
        long took = stream->ops->write(stream, line + at, sizeof line - 1 - at);
        CLAIM(took >= 0 && ++idle < 10000, "the line does not go");
        at += (size_t)took;
    }
    world.lines++;
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    static const struct net_stream_ops port_ops = {port_read, port_write, port_close};
    static const struct improv_info info = {"WiFiCNC", "1.0", "ESP32-S3", "WiFiCNC-1A2B"};
    static const struct improv_ops ops = {join, joined, scan, scanned, now_us, NULL};
    static struct improv improv;
    const struct net_stream inner = {.ops = &port_ops, .local = true};
    struct net_stream stream;
    char bytes[CHUNK_MAX];
    if (size < 2 || size > IN_MAX)
        return 0;
    size_t cuts = data[0] < size - 2 ? data[0] : 0;
    world = (struct world){.cuts = {data + 2, data + 2 + cuts}, .answers = data[1]};
    world.input = (struct input){data + 2 + cuts, data + size};
    improv_init(&improv, &inner, &info, &ops, &stream);
    while (input_left(&world.input) > 0) {
        long count = stream.ops->read(&stream, bytes, sizeof bytes);
        CLAIM(count >= 0 && world.hub_count + (size_t)count <= world.in_count, "more than came");
        memcpy(world.hub + world.hub_count, bytes, (size_t)count);
        world.hub_count += (size_t)count;
        if ((data[1] & 8) != 0)
            write_line(&stream);
    }
    world.answers |= SCANNED;
    for (unsigned n = 0; n < 200; n++)
        CLAIM(stream.ops->read(&stream, bytes, sizeof bytes) == 0, "something comes of nothing");
    check_hub();
    check_out();
    return 0;
}
