/* SPDX-License-Identifier: MIT
 * The hub of clients, with connections that come and go from some addresses, say anything, and wait: what
 * strangers send never reaches the controller, a browser's request never does, a proof counts once and on its
 * connection, whoever is logged in stays, and the owner's address always gets in.
 *
 * The first byte chooses whether there is a password, and how its owner logs in at the end. Then two bytes
 * make one thing that happens: what, and to which connection or how. Strangers' lines have a 6 in them,
 * browsers' a 5, those of one who is logged in neither. */
#include "fuzz.h"

#include "base/sha256.h"
#include "net_hub.h"

#include <string.h>

enum { PLACES = 6, WIRES = 12, ADDRESSES = 4, FRIEND = 1, THINGS_MAX = 300, WIRE_IN = 256 };
enum { SPOKEN = 200 /* what is above is of proofs */ };
enum { ROUND_US = 1000, TURNS_MS = (PLACES + 1) * 5000 };

#define KEY      "$LOGIN=correct horse\n"
#define QUESTION "$LOGIN\n"
enum { LABEL = 16, NONCE_AT = sizeof "[LOGIN:" - 1, ANSWER = NONCE_AT + 2 * ACCESS_NONCE };

struct wire {
    char in[WIRE_IN];
    size_t in_count;
    uint64_t peer;
    bool open;       /* the hub has it */
    bool telnet;     /* else a WebSocket, whose request net_http.c has seen */
    bool ended;      /* we have sent the end */
    bool failed;     /* we have broken it off */
    bool knows;      /* sent the key, where one is asked for */
    bool is_browser; /* its first bytes were a request */
    bool spoke;
    bool heard_ok;
    bool asks; /* for a nonce, and has said nothing since */
    char answer[ANSWER];
    size_t answer_count;
    bool has_nonce;
    uint8_t nonce[ACCESS_NONCE];
};

static struct scene {
    struct net_hub hub;
    struct access access;
    struct wire wire[WIRES];
    uint32_t now_us;
    bool by_proof;        /* the owner logs in so at the end */
    bool locks, any_knew; /* ... the key, ever: its lines may wait for long */
    char overheard[128];  /* the newest right proof */
} scene;

/* What each kind of client says; %: nothing. */
static const char *const strangers[] = {
    "G0X66\n",
    "?",
    "!",
    "$TAKE\n",
    "$X 6\n",
    "\x18",
    "\x85",
    "$LOGIN=6\n",
    "$LOGIN=\n",
    "\r\n",
    "$J=G91X66",
    "\xff\xfb\x1f",
    "$login=66!",
    "6666666666",
    "~",
    "\xff",
    "G",
    "G ",
    "$LOGIN=6\n6",
    "\n",
    "$LOGIN\n",
    "$TRUST=always 6\n",
    "$LOGIN=6666666666666666666666666666666666666666666666666666666666666666\n"};
static const char *const friends[] = {
    "G0X1\n",        "?",    "!",        "$TAKE\n",  "$$\n",          "\x18",          "G1",
    "X2\n",          "M0\n", "$LOGIN\n", "$TRUST\n", "$TRUST=no 1\n", "$TRUST=none\n", "$TRUST=x\n",
    "$TRUST=no 99\n"};
static const char *const browsers[] = {"POST / HTTP/1.1\r\n\r\n$J=X5\n",
                                       "GET /~5 HTTP/1.1\r\nG0X5\n~",
                                       "OPTIONS * HTTP/1.1\n$X5\n",
                                       "MKCOL /5\n5\n",
                                       "\x16\x03\x01\n5\n~",
                                       "CONNECT a:5 HTTP/1.1\n~5\n",
                                       "PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n5"};
#define COUNT(table) (sizeof(table) / sizeof((table)[0]))

/* ---- streams ---- */

static long wire_read(const struct net_stream *stream, char *bytes, size_t size) {
    struct wire *wire = stream->ctx;
    size_t count = wire->in_count < size ? wire->in_count : size;
    if (wire->failed)
        return NET_GONE;
    memcpy(bytes, wire->in, count);
    memmove(wire->in, wire->in + count, wire->in_count -= count);
    return count == 0 && wire->ended ? NET_ENDED : (long)count;
}

/* The nonce of `[LOGIN:nonce,`. */
static void hear_nonce(struct wire *wire, char byte) {
    static const char digits[] = "0123456789abcdef";
    wire->answer_count = byte == '[' ? 0 : wire->answer_count;
    if (wire->answer_count == ANSWER)
        return;
    wire->answer[wire->answer_count++] = byte;
    if (wire->answer_count < ANSWER || memcmp(wire->answer, "[LOGIN:", NONCE_AT) != 0)
        return;
    for (size_t n = 0; n < ACCESS_NONCE; n++) {
        const char *high = strchr(digits, wire->answer[NONCE_AT + 2 * n]);
        const char *low = strchr(digits, wire->answer[NONCE_AT + 2 * n + 1]);
        CLAIM(high != NULL && low != NULL, "a nonce of %.32s", wire->answer + NONCE_AT);
        wire->nonce[n] = (uint8_t)((high - digits) * 16 + (low - digits));
    }
    wire->has_nonce = true;
}

static long wire_write(const struct net_stream *stream, const char *bytes, size_t count) {
    struct wire *wire = stream->ctx;
    CLAIM(wire->open, "written to a connection that is closed");
    for (size_t i = 0; i + 4 <= count; i++)
        wire->heard_ok |= wire->knows && memcmp(bytes + i, "ok\r\n", 4) == 0; /* $LOGIN has one, too */
    for (size_t i = 0; i < count; i++)
        hear_nonce(wire, bytes[i]);
    return wire->failed ? NET_GONE : (long)count;
}

static void wire_close(const struct net_stream *stream) {
    struct wire *wire = stream->ctx;
    CLAIM(wire->open, "closed twice");
    CLAIM(!scene.locks || !wire->heard_ok || wire->ended || wire->failed, "one that is logged in was closed");
    wire->open = false;
}

/* ---- the controller ---- */

static size_t put(void *ctx, const char *bytes, size_t count) {
    (void)ctx;
    for (size_t i = 0; i < count; i++) {
        CLAIM(bytes[i] != '5', "a browser's request reached the controller");
        CLAIM(!scene.locks || (bytes[i] != '6' && bytes[i] != '~'),
              "a stranger's byte %02x reached the controller", (unsigned)(uint8_t)bytes[i]);
    }
    CLAIM(!scene.locks || scene.any_knew || (count == 1 && memchr("?!\x18\x84\x85", bytes[0], 5) != NULL),
          "before any login the controller got %02x", (unsigned)(uint8_t)bytes[0]);
    return count;
}

static size_t hear(void *ctx, char *bytes, size_t size) {
    (void)ctx;
    (void)bytes;
    (void)size;
    return 0;
}

static void act(void *ctx) {
    (void)ctx;
}

static void event(void *ctx, const char *what, const char *who) {
    (void)ctx;
    (void)what;
    (void)who;
}

/* ---- what happens ---- */

static void pass(uint32_t us) {
    scene.now_us += us;
    access_poll(&scene.access, scene.now_us);
    net_hub_tick(&scene.hub, scene.now_us);
    for (struct net_client *client = scene.hub.client; client < scene.hub.client + NET_CLIENTS; client++)
        if (net_hub_wants_read(&scene.hub, client))
            (void)net_hub_read(&scene.hub, client);
    net_hub_ask(&scene.hub);
    (void)net_hub_feed(&scene.hub);
    scene.hub.inside = 0; /* all is answered */
    net_hub_flush(&scene.hub);
}

static bool has_place(uint64_t peer) {
    for (const struct wire *wire = scene.wire; wire < scene.wire + WIRES; wire++)
        if (wire->open && wire->peer == peer)
            return true;
    return false;
}

/* @return NULL: it was refused, or all wires are in use */
static struct wire *come(uint64_t peer, bool telnet) {
    static const struct net_stream_ops ops = {.read = wire_read, .write = wire_write, .close = wire_close};
    struct wire *wire = scene.wire;
    while (wire < scene.wire + WIRES && wire->open)
        wire++;
    if (wire == scene.wire + WIRES)
        return NULL;
    bool is_owners = peer == scene.hub.owner_peer && !has_place(peer);
    *wire = (struct wire){.peer = peer, .open = true, .telnet = telnet};
    const struct net_stream stream = {.ops = &ops, .ctx = wire, .peer = peer, .telnet = telnet};
    bool came = net_hub_connect(&scene.hub, &stream, "client");
    CLAIM(came || !is_owners, "the owner's address was refused");
    CLAIM(came == wire->open, "a refused connection stays open");
    return came ? wire : NULL;
}

static void say(struct wire *wire, const char *text) {
    size_t count = strlen(text);
    if (!wire->open || wire->ended || wire->failed || wire->in_count + count > sizeof wire->in)
        return;
    memcpy(wire->in + wire->in_count, text, count);
    wire->in_count += count;
    wire->spoke = true;
    wire->asks = false;
}

/* The key alone lets in, and only at the begin: behind other words it would be a part of a line. */
static void say_key(struct wire *wire) {
    if (wire->open && !wire->spoke && !wire->ended && !wire->failed && wire->peer == FRIEND) {
        wire->knows = scene.any_knew = true;
        say(wire, KEY);
    }
}

static void say_question(struct wire *wire) {
    const bool first = !wire->spoke;
    if (!wire->open || !wire->telnet || wire->knows || wire->is_browser)
        return;
    say(wire, QUESTION);
    wire->asks = first && wire->spoke;
}

/* Of the nonce that it was asked for; only those of one address have the key. */
static void say_proof(struct wire *wire, uint8_t how) {
    uint8_t message[LABEL + ACCESS_NONCE] = "WiFiCNC login", proof[SHA256_SIZE];
    char text[sizeof scene.overheard] = "$LOGIN=";
    const bool right = wire->peer == FRIEND && scene.locks && how % 4 != 0;
    if (!wire->asks || !wire->has_nonce || !wire->open || wire->ended || wire->failed)
        return;
    memcpy(message + LABEL, wire->nonce, ACCESS_NONCE);
    sha256_hmac(scene.access.secret, SHA256_SIZE, message, sizeof message, proof);
    proof[how % SHA256_SIZE] ^= right ? 0 : 1;
    for (size_t n = 0; n < SHA256_SIZE; n++)
        snprintf(text + strlen(text), 3, "%02x", proof[n]);
    strcat(text, "\n");
    if (right) {
        wire->knows = scene.any_knew = true;
        memcpy(scene.overheard, text, sizeof text);
    }
    say(wire, text);
}

/* It was heard on the network. */
static void say_overheard(struct wire *wire) {
    if (!wire->knows && !wire->is_browser)
        say(wire, scene.overheard);
}

static void say_as(struct wire *wire, uint8_t how) {
    if (wire->is_browser)
        say(wire, "5\n~");
    else if (wire->knows)
        say(wire, friends[how % COUNT(friends)]);
    else
        say(wire, strangers[how % COUNT(strangers)]);
}

static void say_request(struct wire *wire, uint8_t how) {
    if (wire->open && wire->telnet && !wire->spoke) {
        wire->is_browser = true;
        say(wire, browsers[how % COUNT(browsers)]);
    }
}

static void happen(uint8_t what, uint8_t how) {
    struct wire *wire = &scene.wire[how % WIRES];
    switch (what < SPOKEN ? what % 10 : 10 + what % 3) {
    case 0:
        (void)come(1u + how % ADDRESSES, true);
        break;
    case 1:
        (void)come(1u + how % ADDRESSES, how >= 128);
        break;
    case 2:
    case 3:
    case 4:
        say_as(wire, what / 10);
        break;
    case 5:
        say_key(wire);
        break;
    case 6:
        if (scene.hub.client[0].stream.ops == NULL || what >= 128)
            wire = come(1u + how % ADDRESSES, true);
        if (wire != NULL)
            say_request(wire, what / 10);
        break;
    case 7:
        wire->ended = wire->open;
        break;
    case 8:
        wire->failed = wire->open;
        break;
    case 10:
        say_question(wire);
        break;
    case 11:
        say_proof(wire, what / 3);
        break;
    case 12:
        say_overheard(wire);
        break;
    default:
        pass((uint32_t)how * how * 100u);
    }
}

/* Whoever has the key gets in, after what others have tried there. */
static void check_that_the_owner_gets_in(void) {
    if (!scene.locks || scene.hub.owner_peer != FRIEND || has_place(FRIEND))
        return;
    struct wire *wire = come(FRIEND, true);
    if (wire == NULL)
        return;
    if (scene.by_proof) {
        say_question(wire);
        pass(ROUND_US);
        say_proof(wire, 1);
    } else {
        say_key(wire);
    }
    for (unsigned ms = 0; ms < TURNS_MS && !wire->heard_ok; ms += 100)
        pass(100000);
    CLAIM(wire->heard_ok, "the right key was not accepted");
}

/* Its secret takes some ms: once for each kind. */
static struct access fresh_access(bool locks) {
    static const uint8_t salt[ACCESS_SALT];
    static struct access made[2];
    static bool is_made[2];
    if (!is_made[locks])
        access_init(&made[locks], locks ? "correct horse" : "", !locks, salt, 0);
    is_made[locks] = true;
    return made[locks];
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    static const struct net_hub_ops ops = {.put = put, .hear = hear, .act = act, .event = event};
    static const struct net_hub_sizes sizes = {.clients = PLACES, .in = 2048, .out = 16384, .left = 2048};
    struct input input = {data, data + size};
    memset(&scene, 0, sizeof scene);
    const uint8_t first = input_byte(&input);
    scene.locks = (first & 1) == 0;
    scene.by_proof = (first & 2) != 0;
    scene.access = fresh_access(scene.locks);
    net_hub_init(&scene.hub, &sizes, &ops, NULL);
    scene.hub.access = &scene.access;
    for (unsigned n = 0; n < THINGS_MAX && input_left(&input) > 0; n++) {
        uint8_t what = input_byte(&input);
        happen(what, input_byte(&input));
        pass(ROUND_US);
    }
    check_that_the_owner_gets_in();
    for (struct wire *wire = scene.wire; wire < scene.wire + WIRES; wire++)
        wire->ended = true; /* now anyone may be closed */
    net_hub_close(&scene.hub);
    return 0;
}
