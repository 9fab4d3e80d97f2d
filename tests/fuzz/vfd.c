/* SPDX-License-Identifier: MIT
 * spindle/vfd: a drive that sends anything at any time. Nothing but a whole answer to the newest request,
 * with a right CRC, confirms a command or is a reading; silence is noticed; a drive that is lost is commanded
 * to stop.
 *
 * The first byte chooses the model; then each byte is an operation: time passes, the machine commands, the
 * drive sends bytes of the input, or the right answer to the newest request, whole, damaged or late. */
#include "fuzz.h"

#include "spindle/vfd.h"

#include <math.h>
#include <string.h>

enum { SENT_MAX = 16, LINE_SIZE = 256, STEP_US = 500, SILENCE_US = 1000000 };

/* The bus and what is on it. */
static struct {
    uint8_t sent[SENT_MAX];
    size_t sent_count;
    unsigned requests;
    uint8_t line[LINE_SIZE]; /* for the controller */
    size_t line_count;
    uint8_t since[LINE_SIZE]; /* that it has received since its newest request */
    size_t since_count;
    uint8_t late[MODBUS_FRAME_MAX]; /* the right answer to the request before */
    size_t late_count;
} bus;

static bool configure(struct hal *hal, const struct hal_bus_format *format) {
    (void)hal;
    CLAIM(format->baud >= 2400 && format->baud <= 115200, "%u baud", (unsigned)format->baud);
    return true;
}

static void send_bytes(struct hal *hal, const uint8_t *bytes, size_t count) {
    (void)hal;
    CLAIM(count >= 4 && count <= SENT_MAX, "%zu bytes", count);
    memcpy(bus.sent, bytes, count);
    bus.sent_count = count;
    bus.since_count = 0;
    bus.requests++;
}

static size_t receive_bytes(struct hal *hal, uint8_t *bytes, size_t size) {
    (void)hal;
    const size_t count = bus.line_count < size ? bus.line_count : size;
    memcpy(bytes, bus.line, count);
    memmove(bus.line, bus.line + count, bus.line_count - count);
    bus.line_count -= count;
    for (size_t n = 0; n < count; n++) {
        if (bus.since_count == LINE_SIZE)
            memmove(bus.since, bus.since + 1, --bus.since_count);
        bus.since[bus.since_count++] = bytes[n];
    }
    return count;
}

static const struct hal_bus ops = {.configure = configure, .send = send_bytes, .receive = receive_bytes};

/* By the polynomial division that the standard describes, as a check of the core's. */
static uint16_t crc_of(const uint8_t *bytes, size_t count) {
    uint16_t crc = 0xFFFF;
    for (size_t n = 0; n < count; n++) {
        crc = (uint16_t)(crc ^ bytes[n]);
        for (int bit = 0; bit < 8; bit++)
            crc = (uint16_t)((crc & 1) != 0 ? (crc >> 1) ^ 0xA001 : crc >> 1);
    }
    return crc;
}

/* A frame with a right CRC, of this address and function, has been received since the newest request. */
static bool was_answered(const struct vfd *vfd) {
    for (size_t from = 0; from < bus.since_count; from++)
        for (size_t size = 4; from + size <= bus.since_count; size++) {
            const uint8_t *frame = bus.since + from;
            const uint16_t crc = crc_of(frame, size - 2);
            if (frame[0] == vfd->config.address && frame[1] == bus.sent[1] &&
                frame[size - 2] == (crc & 0xFF) && frame[size - 1] == crc >> 8)
                return true;
        }
    return false;
}

static void put(const uint8_t *bytes, size_t count) {
    for (size_t n = 0; n < count && bus.line_count < LINE_SIZE; n++)
        bus.line[bus.line_count++] = bytes[n];
}

/* The right answer to the newest request, with a value of the input in a reading. */
static size_t right_answer(const struct vfd *vfd, uint16_t value, uint8_t frame[MODBUS_FRAME_MAX]) {
    struct modbus_pattern answer = vfd->request.answer;
    if (vfd->request.kind >= VFD_READ_SPEED) {
        answer.bytes[vfd->request.value_at] = (uint8_t)(value >> 8);
        answer.bytes[vfd->request.value_at + 1] = (uint8_t)value;
    }
    return modbus_build(frame, vfd->config.address, answer.bytes, answer.count);
}

static void reply(const struct vfd *vfd, struct input *input, unsigned how) {
    uint8_t frame[MODBUS_FRAME_MAX];
    if (bus.sent_count == 0)
        return;
    const size_t count = right_answer(vfd, (uint16_t)(input_byte(input) * 257), frame);
    if (how == 1)
        frame[input_byte(input) % count] ^= (uint8_t)(input_byte(input) | 1);
    if (how == 2)
        put(bus.late, bus.late_count);
    else
        put(frame, count);
    memcpy(bus.late, frame, count);
    bus.late_count = count;
}

static void check(const struct vfd *before, const struct vfd *after) {
    CLAIM(after->request.rx.count <= MODBUS_RX_SIZE && after->lost <= VFD_LOST_MAX, "%u bytes, %u lost",
          after->request.rx.count, after->lost);
    const bool confirms = (after->run_confirmed && !before->run_confirmed) ||
                          (after->speed_confirmed && !before->speed_confirmed) ||
                          (after->link == VFD_UP && before->link != VFD_UP) ||
                          (before->may_turn && !after->may_turn);
    CLAIM(!confirms || was_answered(after), "confirmed without an answer");
    CLAIM(after->link != VFD_LOST || after->direction == 0, "lost, and to turn");
    CLAIM(!after->tripped || after->direction == 0, "tripped, and to turn");
    CLAIM(!vfd_is_confirmed(after) || after->direction == 0 || after->may_turn, "turns without a command");
    CLAIM(!after->measures || isfinite(after->measured_rpm), "speed is no number");
    CLAIM(after->request.open || bus.since_count <= LINE_SIZE, "no request");
}

static void pass(struct vfd *vfd, uint32_t *now_us, uint32_t us) {
    for (uint32_t passed = 0; passed < us; passed += STEP_US) {
        const struct vfd before = *vfd;
        const unsigned requests = bus.requests;
        *now_us += STEP_US;
        (void)vfd_poll(vfd, NULL, &ops, *now_us);
        CLAIM(bus.requests <= requests + 1, "two requests in a poll");
        CLAIM(vfd_wait_us(vfd, *now_us) > 0, "no time to wait");
        check(&before, vfd);
    }
}

static void command(struct vfd *vfd, struct input *input, uint32_t now_us) {
    const int direction = input_byte(input) % 3 - 1;
    const bool tripped = vfd->tripped;
    vfd_command(vfd, direction, (float)input_byte(input) * 100.0f, 24000.0f, now_us);
    CLAIM(!tripped || direction == 0 || vfd->direction == 0, "started after it was lost");
}

static void operate(struct vfd *vfd, struct input *input, uint32_t *now_us) {
    uint8_t bytes[16];
    const uint8_t operation = input_byte(input);
    const size_t count = operation >> 4;
    switch (operation & 7) {
    case 0:
        command(vfd, input, *now_us);
        break;
    case 1:
    case 2:
    case 3:
        reply(vfd, input, (operation & 7u) == 1 ? 0 : (operation & 7u) - 1);
        break;
    case 4:
        for (size_t n = 0; n < count; n++)
            bytes[n] = input_byte(input);
        put(bytes, count);
        break;
    case 5:
        put(bus.sent, bus.sent_count);
        break;
    default:
        break;
    }
    pass(vfd, now_us, STEP_US * (1u + (uint32_t)(count * count)));
}

/* Nothing comes any more. */
static void fall_silent(struct vfd *vfd, uint32_t *now_us) {
    bus.line_count = 0;
    pass(vfd, now_us, SILENCE_US);
    pass(vfd, now_us, SILENCE_US);
    CLAIM(vfd->link == VFD_LOST && !vfd_is_confirmed(vfd), "silence was not noticed");
    const unsigned requests = bus.requests;
    pass(vfd, now_us, SILENCE_US);
    CLAIM(bus.requests > requests, "it is not tried again");
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    static const struct vfd blank;
    struct input input = {data, data + size};
    struct vfd vfd = blank;
    memset(&bus, 0, sizeof bus);
    struct vfd_config config = {.model = (uint8_t)(1 + input_byte(&input) % VFD_MODEL_COUNT),
                                .address = 1,
                                .format = {.baud = 9600},
                                .timeout_ms = 50,
                                .rpm_per_hz = 60.0f};
    config.own = (struct vfd_own){0x2000, 0x2001, 0x2103, 18, 34, 1, 100.0f, 60.0f, 60.0f, 100.0f};
    uint32_t now_us = UINT32_MAX - 3000000; /* the clock wraps on the way */
    (void)vfd_configure(&vfd, NULL, &ops, &config, now_us);
    while (input_left(&input) > 0)
        operate(&vfd, &input, &now_us);
    fall_silent(&vfd, &now_us);
    return 0;
}
