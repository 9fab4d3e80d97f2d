/* SPDX-License-Identifier: MIT
 * Commands, real-time bytes, inputs, stalls and time in any order, with the monitor (targets/sim/monitor.h)
 * as judge. Where machine.c puts any bytes, this puts lines that mean something, so that it comes deep into
 * the states of the machine.
 *
 * The first byte chooses task periods, laser mode, hard limits, and whether sides stall. Then two bytes make
 * one thing that happens: what, and how. WIFICNC_FUZZ_SHOW=1 prints them as they happen. */
#include "fuzz.h"

#include "host_inner.h"
#include "monitor.h"
#include "virtual.h"

#include <string.h>

enum { HZ = 2000000, LINE_MAX = 96, THINGS_MAX = 400 };

/* The longest stall takes 1 s; the slowest stop 7 s: from 63 mm/s ($110 below) at the 10 mm/s2 that $RST=$
 * leaves. Spindle and coolant follow 5 s ($75) after the stop. */
enum { RESTS_MS = 1200, SLOWEST_STOP_MS = 8000 + RESTS_MS, OFF_MS = 6000, LOOK_MS = 200 };

#define CHECKS                                                                                               \
    (MONITOR_COUNTER | MONITOR_ANSWERS | MONITOR_STATE | MONITOR_LIMITS | MONITOR_BEAM | MONITOR_LIVENESS |  \
     MONITOR_STOPS)

enum options { OPTION_LASER = 0x10, OPTION_HARD_LIMITS = 0x20, OPTION_NO_STALLS = 0x40 };

/* %d: 0 .. 63 from the second byte. */
static const char *const lines[] = {
    "G0X%d",
    "G1X%dF1200",
    "G1Y-%dF600",
    "G1X%dY%dZ-1F2000",
    "G2X%dY0I5F900",
    "G3X0Y%dR50",
    "G1Z-%dF300",
    "G4P0.%d",
    "M3S%d",
    "M4S1%d",
    "M5",
    "M8",
    "M9",
    "M0",
    "M1",
    "M6T%d",
    "M2",
    "M30",
    "G91G1X0.%dF400",
    "G90",
    "G28",
    "G30",
    "G92X%d",
    "G92.1",
    "G10L20P1X%d",
    "G54",
    "G55",
    "G38.2Z-%dF100",
    "G38.3Z-%dF200",
    "G38.4Z%dF100",
    "G81X%dZ-2R1F90",
    "G61",
    "G64P0.%d",
    "M62P0",
    "M63P0",
    "M66P0L3Q1",
    "M66P1L0",
    "G20",
    "G21",
    "F",
    "X",
    "G1",
    "",
    "(%d)",
    "N%dG1X1F50",
    "#1=%d",
    "G1X#1F500",
    "S%d",
    "G93G1X%dF2",
    "G94",
    "M48",
    "M49",
    "M53P0",
    "M53P1",
    "G43.1Z%d",
    "G49",
    "G53G0X%d",
    "G1A%dF300",
    "o100 if [1]",
    "G5X9I1J1P1Q1F90",
};
static const char *const dollars[] = {
    "$X",
    "$H",
    "$C",
    "$SLP",
    "$",
    "$$",
    "$#",
    "$G",
    "$I",
    "$N",
    "$HX",
    "$HZ",
    "$J=X%d",
    "$J=G91X%dF900",
    "$J=G91Y-%dF300",
    "$J=F1",
    "$J=G53X0F1500",
    "$20=1",
    "$20=0",
    "$21=1",
    "$21=0",
    "$22=1",
    "$22=0",
    "$32=1",
    "$32=0",
    "$120=2%d",
    "$110=3%d0",
    "$100=4%d",
    "$0=5",
    "$1=255",
    "$1=25",
    "$10=3",
    "$13=0",
    "$N0=G21",
    "$N0=",
    "$RST=#",
    "$RST=$",
    "$I=me",
    "$27=%d",
    "$130=%d0",
    "$5=0",
    "$6=0",
    "$T",
    "$999=1",
};
static const uint8_t bytes[] = {'?',  '!',  '~',  0x18, 0x84, 0x85, 0x90, 0x91, 0x92, 0x93, 0x94,
                                0x95, 0x96, 0x97, 0x99, 0x9A, 0x9B, 0x9E, 0xA0, 0xA1, 0xA3, 0xA3};
static const int inputs[] = {VIRTUAL_LIMIT_MIN, VIRTUAL_LIMIT_MAX + 1, VIRTUAL_PROBE,        VIRTUAL_DOOR,
                             VIRTUAL_ESTOP,     VIRTUAL_HOLD,          VIRTUAL_START,        VIRTUAL_RESET,
                             VIRTUAL_DIGITAL,   VIRTUAL_DIGITAL + 1,   VIRTUAL_LIMIT_MIN + 2};
#define COUNT(table) (sizeof(table) / sizeof((table)[0]))

struct scene {
    struct host *host;
    struct monitor *monitor;
    bool shows, stalls;
};

static void hear(struct scene *scene) {
    char said[1024];
    size_t count;
    while ((count = host_read(scene->host, said, sizeof said)) > 0)
        if (scene->shows)
            fprintf(stderr, "%.*s", (int)count, said);
    const char *found = monitor_found(scene->monitor);
    CLAIM(found == NULL, "%s", found);
}

static void pass(struct scene *scene, uint64_t us) {
    if (scene->shows)
        fprintf(stderr, "-- %.3f s, %s: %lu us pass\n", (double)host_time_ticks(scene->host) / (double)HZ,
                host_state(scene->host), (unsigned long)us);
    host_input_follows(scene->host, 0);
    (void)host_run_until(scene->host, host_time_ticks(scene->host) + us * (HZ / 1000000));
    hear(scene);
}

/* A sender that waits for room, but not for ever. */
static void send(struct scene *scene, const char *text, size_t count) {
    for (unsigned tries = 0; count > 0 && tries < 100; tries++) {
        size_t took = host_write(scene->host, text, count);
        text += took;
        count -= took;
        if (count > 0)
            pass(scene, 10000);
    }
}

static void send_line(struct scene *scene, const char *format, uint8_t how) {
    char line[LINE_MAX];
    int number = how & 63;
    int count = snprintf(line, sizeof line - 1, format, number, number);
    line[count++] = '\n';
    if (scene->shows)
        fprintf(stderr, "%.*s", count, line);
    send(scene, line, (size_t)count);
    if ((how & 0x80) != 0)
        pass(scene, 1000);
}

static void send_byte(struct scene *scene, uint8_t how) {
    const char byte = (char)bytes[how % COUNT(bytes)];
    if (scene->shows)
        fprintf(stderr, "byte 0x%02x\n", (unsigned)(uint8_t)byte);
    send(scene, &byte, 1);
}

/* An input for a while, or until something else lets it go. */
static void touch(struct scene *scene, uint8_t how) {
    int input = inputs[how % COUNT(inputs)];
    uint64_t now = host_time_ticks(scene->host), us = 500u << (how >> 5);
    if (scene->shows)
        fprintf(stderr, "input %d for %lu us\n", input, (unsigned long)us);
    virtual_set(scene->host, input, true);
    if ((how & 0x10) != 0 || !virtual_at(scene->host, now + us * (HZ / 1000000), input, false))
        return;
}

static void release(struct scene *scene) {
    if (scene->shows)
        fprintf(stderr, "all inputs released\n");
    for (int input = 0; input < VIRTUAL_INPUT_COUNT; input++)
        virtual_set(scene->host, input, false);
}

/* What an operator does: close the door, continue. */
static void resume(struct scene *scene) {
    release(scene);
    send(scene, "~", 1);
    pass(scene, 300000);
}

/* Or begin again. */
static void recover(struct scene *scene) {
    release(scene);
    send(scene, "\x18", 1);
    pass(scene, 700000);
    send(scene, "$X\nG90G21G94F700\n", 18);
    pass(scene, 50000);
}

static void stall(struct scene *scene, uint8_t how) {
    static const uint16_t lengths_ms[] = {1, 2, 5, 10, 30, 100, 300, 1000};
    uint64_t ms = lengths_ms[how >> 2 & 7], after_us = (how >> 5) * 700u, now = host_time_ticks(scene->host);
    enum host_side side = (enum host_side)(how % 3);
    if (scene->shows)
        fprintf(stderr, "side %d stalls for %lu ms in %lu us\n", (int)side, (unsigned long)ms,
                (unsigned long)after_us);
    (void)host_stall(scene->host, side, now + after_us * (HZ / 1000000), ms * (HZ / 1000));
}

/* M53 P0 puts a hold off. */
static bool may_hold(const struct machine *machine) {
    return (machine->interp.gcode.modal.overrides & OVERRIDE_HOLD) != 0 && !machine->suspend.hold_waits;
}

/* @return false: it moves */
static bool comes_to_rest(struct scene *scene) {
    int32_t before[AXIS_COUNT], after[AXIS_COUNT];
    unsigned rests_ms = 0;
    virtual_position(scene->host, before);
    for (unsigned ms = 0; ms < SLOWEST_STOP_MS && rests_ms < RESTS_MS; ms += LOOK_MS) {
        pass(scene, LOOK_MS * 1000);
        virtual_position(scene->host, after);
        rests_ms = memcmp(before, after, sizeof before) == 0 ? rests_ms + LOOK_MS : 0;
        memcpy(before, after, sizeof before);
    }
    return rests_ms >= RESTS_MS;
}

/* A while after its sender has gone, and with no one else, a machine is at rest, dark, and off. */
static void claim_unattended(struct scene *scene) {
    int32_t before[AXIS_COUNT], after[AXIS_COUNT];
    struct virtual_outputs outputs;
    const bool rests = comes_to_rest(scene);
    if (!may_hold(host_machine(scene->host)))
        return;
    CLAIM(rests, "%s does not come to rest with nobody there", host_state(scene->host));
    pass(scene, OFF_MS * 1000);
    virtual_outputs(scene->host, &outputs);
    virtual_position(scene->host, before);
    pass(scene, 1000000);
    virtual_position(scene->host, after);
    CLAIM(memcmp(before, after, sizeof before) == 0, "%s moves with nobody there", host_state(scene->host));
    CLAIM(outputs.spindle_direction == 0 && outputs.spindle_duty == 0 && outputs.coolant == 0,
          "spindle or coolant of %s is on with nobody there", host_state(scene->host));
}

/* The connection ends, at times with a last line still on its way. */
static void lose_sender(struct scene *scene, uint8_t how) {
    bool lines_wait = (how & 1) != 0;
    if (scene->shows)
        fprintf(stderr, "sender lost%s\n", lines_wait ? ", a line still comes" : "");
    if ((how & 2) != 0)
        release(scene);
    while (scene->host->waiting_count > 0) /* the end comes behind the last byte */
        pass(scene, 1000);
    host_sender_lost(scene->host, lines_wait);
    if (lines_wait)
        send_line(scene, lines[how % COUNT(lines)], how & 0x3F);
    if ((how & 2) != 0)
        claim_unattended(scene);
}

/* What everyone who connects gets, and asks. */
static void welcome(struct scene *scene) {
    char text[128];
    unsigned number = 0;
    for (bool more = true; more; number++) {
        more = host_notice(scene->host, number, text, sizeof text);
        if (scene->shows)
            fprintf(stderr, "notice %u: %s\n", number, text);
        CLAIM(memchr(text, '\0', sizeof text) != NULL && (text[0] != '\0') == more, "notice %u", number);
    }
    send(scene, "?", 1);
}

static void happen(struct scene *scene, uint8_t what, uint8_t how) {
    if (what < 96)
        send_line(scene, lines[what % COUNT(lines)], how);
    else if (what < 144)
        send_line(scene, dollars[(what - 96) % COUNT(dollars)], how | 0x80);
    else if (what < 176)
        send_byte(scene, how);
    else if (what < 192)
        touch(scene, how);
    else if (what < 196)
        release(scene);
    else if (what < 202)
        resume(scene);
    else if (what < 208)
        recover(scene);
    else if (what < 216 && scene->stalls)
        stall(scene, how);
    else if (what >= 254)
        welcome(scene);
    else if (what >= 251)
        lose_sender(scene, how);
    else
        pass(scene, (uint64_t)how * ((what & 1) != 0 ? 150 : 4000));
}

static void begin(struct scene *scene, uint8_t options) {
    static const char settings[] = "$100=40\n$101=40\n$102=40\n$110=3000\n$111=3000\n$112=3000\n"
                                   "$120=200\n$121=200\n$122=200\n$22=1\n$130=40\n$131=40\n$132=40\n";
    const struct host_board board = {
        .timer_hz = HZ,
        .step_pulse_ns = 2000,
        .dir_setup_ns = 1000,
        .max_step_rate_hz = 40000,
        .axis_count = 4,
        .digital_inputs = DIGITAL_INPUT_COUNT,
        .analog = 1,
        .digital_outputs = OUTPUT_COUNT,
        .tasks = options % 3,
    };
    scene->host = host_create(&board);
    scene->stalls = (options & OPTION_NO_STALLS) == 0;
    scene->monitor = scene->host != NULL ? monitor_create(scene->host, CHECKS) : NULL;
    if (scene->monitor == NULL)
        abort();
    scene->shows = getenv("WIFICNC_FUZZ_SHOW") != NULL;
    for (unsigned ax = 0; ax < 3; ax++)
        virtual_travel(scene->host, ax, -60 * 40, 70 * 40);
    pass(scene, 10000);
    send(scene, settings, sizeof settings - 1);
    if ((options & OPTION_LASER) != 0)
        send(scene, "$32=1\n", 6);
    if ((options & OPTION_HARD_LIMITS) != 0)
        send(scene, "$21=1\n", 6);
    send(scene, "$X\n", 3);
    pass(scene, 100000);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    struct scene scene = {0};
    struct input input = {data, data + size};
    begin(&scene, input_byte(&input));
    for (unsigned n = 0; n < THINGS_MAX && input_left(&input) > 0; n++) {
        uint8_t what = input_byte(&input);
        happen(&scene, what, input_byte(&input));
        hear(&scene);
    }
    pass(&scene, 1000000);
    const char *found = monitor_end(scene.monitor);
    CLAIM(found == NULL, "%s", found);
    monitor_destroy(scene.monitor);
    host_destroy(scene.host);
    return 0;
}
