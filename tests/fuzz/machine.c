/* SPDX-License-Identifier: MIT
 * The whole controller with a machine behind it, in virtual time. Whatever arrives:
 *
 *   - every line gets one answer, in order, until a reset; a reset drops what waits and gives a banner
 *   - what is reported is made of whole lines of the protocol, and of numbers
 *   - the position counter is the pulses that left the pins (homing alone sets it again)
 *   - it always comes back: after a reset a ? is answered
 *
 * The first byte gives the number of axes and the way bytes are put. Then bytes go to the stream as they are;
 * 0xF0 .. 0xFF, which mean nothing there, act on time and on the machine together with the byte behind. */
#include "fuzz.h"

#include "host.h"
#include "input/line_reader.h"
#include "virtual.h"

#include <string.h>

enum { LINES_MAX = 1 << 12, OUT_MAX = 512 };
enum { HZ = 1000000, STEP_RATE_HZ = 20000 };

/* Virtual time one input may take, and the end of it. */
#define INPUT_TICKS (10u * HZ)
#define SLICE_TICKS (HZ / 100)

/* What a line must be answered with, as far as its length says. */
enum answer { ANSWER_ANY, ANSWER_OK, ANSWER_TOO_LONG, ANSWER_OTHER };

struct session {
    struct host *host;
    uint64_t end_ticks; /* of the time this input may take */
    bool loses;         /* bytes are put as by a UART; then only the number of answers is known */
    /* lines */
    struct line_reader model;
    bool after_cr, homed; /* $H was sent: the counter may be set again */
    uint8_t expected[LINES_MAX];
    uint32_t sent, answered;
    /* what was answered */
    char line[OUT_MAX];
    size_t length;
    uint32_t banners, reports;
    char state; /* first letter of the state in the last report */
    /* pulses */
    int32_t pulses[AXIS_COUNT], offset[AXIS_COUNT];
};

/* --- the stream --- */

static void count_pulses(void *ctx, const struct trace_event *events, size_t count) {
    struct session *session = ctx;
    for (size_t n = 0; n < count; n++)
        for (unsigned ax = 0; ax < AXIS_COUNT; ax++)
            if ((events[n].step_mask >> ax & 1) != 0)
                session->pulses[ax] += (events[n].dir_mask >> ax & 1) != 0 ? -1 : 1;
}

static void expect(struct session *session, enum answer answer) {
    CLAIM(session->loses || session->sent - session->answered < LINES_MAX,
          "more lines wait than there is room for");
    session->expected[session->sent++ % LINES_MAX] = (uint8_t)(session->loses ? ANSWER_ANY : answer);
}

/* Bytes of the stream make lines; a UART may lose them, but not count them wrongly. */
static void note_byte(struct session *session, uint8_t byte) {
    if (byte >= 0x80 || byte == 0x18 || byte == '?' || byte == '!' || byte == '~')
        return; /* taken out before the lines */
    enum line_result result = line_reader_put(&session->model, byte);
    if (result == LINE_NONE)
        return;
    const char *text = session->model.text;
    if (strncmp(text, "$H", 2) == 0 || session->loses)
        session->homed = true;
    expect(session, result == LINE_OVERFLOW ? ANSWER_TOO_LONG : text[0] == '\0' ? ANSWER_OK : ANSWER_OTHER);
}

/* --- answers --- */

static bool begins(const char *text, const char *with) {
    return strncmp(text, with, strlen(with)) == 0;
}

static void take_answer(struct session *session, const char *line) {
    CLAIM(session->answered != session->sent, "an answer without a line: %s", line);
    enum answer answer = session->expected[session->answered++ % LINES_MAX];
    bool too_long = strcmp(line, "error:11") == 0;
    CLAIM(answer != ANSWER_OK || strcmp(line, "ok") == 0, "an empty line: %s", line);
    CLAIM(answer == ANSWER_ANY || (answer == ANSWER_TOO_LONG) == too_long, "a line of another length: %s",
          line);
}

static void take_banner(struct session *session) {
    session->banners++;
    session->answered = session->sent;
    line_reader_reset(&session->model);
}

static void take_report(struct session *session, const char *line) {
    size_t length = strlen(line);
    CLAIM(line[length - 1] == '>' && strstr(line, "Pos:") != NULL, "a report: %s", line);
    CLAIM(strstr(line, "nan") == NULL && strstr(line, "inf") == NULL, "a report: %s", line);
    session->reports++;
    session->state = line[1];
}

static void take_said(struct session *session, const char *line) {
    if (strcmp(line, "ok") == 0 || begins(line, "error:"))
        take_answer(session, line);
    else if (begins(line, "Grbl "))
        take_banner(session);
    else if (line[0] == '<')
        take_report(session, line);
    else
        CLAIM(line[0] == '\0' || line[0] == '$' || line[0] == '>' || begins(line, "ALARM:") ||
                  (line[0] == '[' && line[strlen(line) - 1] == ']'),
              "what is this: %s", line);
}

static void take_said_byte(struct session *session, char byte) {
    CLAIM(session->length < OUT_MAX - 1, "a line without end: %.60s", session->line);
    if (byte != '\n') {
        session->line[session->length++] = byte;
        return;
    }
    CLAIM(session->length > 0 && session->line[session->length - 1] == '\r', "LF without CR");
    session->line[session->length - 1] = '\0';
    session->length = 0;
    take_said(session, session->line);
}

static void hear(struct session *session) {
    char bytes[1024];
    size_t count;
    while ((count = host_read(session->host, bytes, sizeof bytes)) > 0)
        for (size_t n = 0; n < count; n++)
            take_said_byte(session, bytes[n]);
    CLAIM(session->length == 0, "half a line was said");
}

/* --- time --- */

static void check_counter(struct session *session) {
    int32_t steps[AXIS_COUNT];
    host_position_steps(session->host, steps);
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++) {
        int32_t offset = (int32_t)((uint32_t)steps[ax] - (uint32_t)session->pulses[ax]);
        CLAIM(offset == session->offset[ax] || session->homed, "axis %u: counter %ld, pulses %ld", ax,
              (long)steps[ax], (long)session->pulses[ax]);
        session->offset[ax] = offset;
    }
}

/* Let time pass. */
static void pass(struct session *session, uint64_t ticks) {
    uint64_t until = host_time_ticks(session->host) + ticks;
    host_input_follows(session->host, 0);
    enum host_wait wait = host_run_until(session->host, until);
    CLAIM(wait == HOST_TIME && host_time_ticks(session->host) >= until, "came back with %d", wait);
    hear(session);
    check_counter(session);
}

static bool has_time(const struct session *session) {
    return host_time_ticks(session->host) < session->end_ticks;
}

/* A byte that finds no room comes again later, or is lost. @return false: there was no time left for it */
static bool put(struct session *session, uint8_t byte) {
    const char character = (char)byte;
    if (session->loses) {
        note_byte(session, byte);
        host_write_or_lose(session->host, &character, 1);
        return true;
    }
    while (host_write(session->host, &character, 1) == 0) {
        if (!has_time(session))
            return false;
        pass(session, SLICE_TICKS);
    }
    note_byte(session, byte);
    return true;
}

/* --- the machine behind it --- */

static void act_on_inputs(struct session *session, uint8_t what, uint8_t how) {
    struct host *host = session->host;
    uint64_t now = host_time_ticks(host);
    switch (what) {
    case 0xf6:
        virtual_set(host, (how & 0x7f) % VIRTUAL_INPUT_COUNT, (how & 0x80) != 0);
        return;
    case 0xf7:
        (void)virtual_at(host, now + (how & 0x60u) * 1000u, (how & 0x1f) % VIRTUAL_INPUT_COUNT,
                         (how & 0x80) != 0);
        return;
    case 0xf8:
        virtual_travel(host, how % AXIS_COUNT, -((int32_t)how * 16) - 1, (int32_t)how * 16 + 1);
        return;
    case 0xf9:
        virtual_surface(host, -(int32_t)how);
        return;
    case 0xfa:
        virtual_no_surface(host);
        return;
    case 0xfb:
        virtual_no_travel(host, how % AXIS_COUNT);
        return;
    default:
        return;
    }
}

static void act(struct session *session, uint8_t what, uint8_t how) {
    if (what <= 0xf3)
        pass(session, 1 + (uint64_t)how * (what == 0xf0 ? 50 : 2000));
    else if (what == 0xf4) /* as a file is read: work until more input is wanted */
        host_input_follows(session->host, 1), (void)host_run(session->host, 1 + how * 16u), hear(session);
    else if (what == 0xf5) /* nothing but a flood */
        for (unsigned n = 0; n < how * 8u && put(session, (n & 15) == 15 ? '\n' : 'G'); n++)
            ;
    else
        act_on_inputs(session, what, how);
}

static void release_all(struct session *session) {
    for (unsigned ax = 0; ax < AXIS_COUNT; ax++)
        virtual_no_travel(session->host, ax);
    virtual_no_surface(session->host);
    for (int input = 0; input < VIRTUAL_INPUT_COUNT; input++)
        virtual_set(session->host, input, false);
}

/* --- one input --- */

static void begin(struct session *session, uint8_t options) {
    const struct host_board board = {
        .timer_hz = HZ,
        .step_pulse_ns = 3000,
        .dir_setup_ns = 1000,
        .max_step_rate_hz = STEP_RATE_HZ,
        .axis_count = (uint8_t)(1 + (options & 7) % AXIS_COUNT),
        .digital_inputs = DIGITAL_INPUT_COUNT,
        .analog = 1,
        .digital_outputs = OUTPUT_COUNT,
        .encoder = 1,
    };
    memset(session, 0, sizeof *session);
    session->host = host_create(&board);
    if (session->host == NULL)
        abort();
    session->loses = (options & 0x80) != 0;
    session->end_ticks = INPUT_TICKS;
    line_reader_reset(&session->model);
    (void)trace_add(host_trace(session->host), count_pulses, session);
    pass(session, 1);
    CLAIM(session->banners == 1, "%lu banners at power-on", (unsigned long)session->banners);
}

/* Nothing holds it any more: what can be answered is answered. */
static void end_quietly(struct session *session) {
    release_all(session);
    for (unsigned n = 0; n < 8; n++) {
        put(session, '~');
        pass(session, HZ / 4);
    }
    uint32_t reports = session->reports;
    put(session, '?');
    pass(session, 1);
    if (session->reports != reports && strchr("IC", session->state) != NULL) /* Idle, Check */
        CLAIM(session->answered == session->sent, "%lu lines without an answer",
              (unsigned long)(session->sent - session->answered));
}

static void end_by_reset(struct session *session) {
    uint32_t banners = session->banners, reports = session->reports;
    pass(session, HZ); /* the quiet time of an alarm, and the last events */
    release_all(session);
    put(session, 0x18);
    pass(session, HZ);
    CLAIM(session->banners > banners, "a reset without a banner");
    reports = session->reports;
    put(session, '?');
    pass(session, 1);
    CLAIM(session->reports == reports + 1, "%lu reports for a ?",
          (unsigned long)(session->reports - reports));
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    static struct session session;
    struct input input = {data, data + size};
    begin(&session, input_byte(&input));
    while (input_left(&input) > 0 && has_time(&session)) {
        uint8_t byte = input_byte(&input);
        if (byte >= 0xf0)
            act(&session, byte, input_byte(&input));
        else if (!put(&session, byte))
            break;
    }
    session.loses = false;
    end_quietly(&session);
    end_by_reset(&session);
    host_destroy(session.host);
    return 0;
}
