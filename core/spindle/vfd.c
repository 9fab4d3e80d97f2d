/* SPDX-License-Identifier: MIT
 * A spindle drive on a bus: which request comes next, and what its answer means. */
#include "spindle/vfd.h"

#include <string.h>

#define ANSWER_CHARS (MODBUS_FRAME_MAX + 2u) /* an answer, when it has begun */
#define BUS_BUSY_US  200000u                 /* a bus that is never silent for this long is garbled */
#define LOAD_EACH    5u                      /* every so manieth poll reads the load */
#define LOOK_US      1000u                   /* while an answer is awaited */
#define VALUE_MAX    65535.0f
#define SIGN         0x8000u
#define BITS         10u /* of a character without parity: start, 8, stop */

static const uint32_t bauds[] = {2400, 4800, 9600, 19200, 38400, 115200};

const struct vfd_model *vfd_model(uint8_t number) {
    return number >= 1 && number <= VFD_MODEL_COUNT ? &vfd_models[number - 1] : NULL;
}

uint32_t vfd_baud(const struct vfd_model *model, uint8_t setting) {
    return setting < sizeof bauds / sizeof bauds[0] ? bauds[setting] : model->baud;
}

enum hal_bus_parity vfd_parity(const struct vfd_model *model, uint8_t setting) {
    return (enum hal_bus_parity)(setting <= HAL_BUS_ODD ? setting : model->parity);
}

static unsigned char_bits(const struct vfd *vfd) {
    return vfd->config.format.parity == HAL_BUS_NONE ? BITS : BITS + 1;
}

static uint32_t chars_us(const struct vfd *vfd, unsigned count) {
    return modbus_chars_us(vfd->config.format.baud, char_bits(vfd), count);
}

static uint32_t gap_us(const struct vfd *vfd) {
    const uint32_t own_us = vfd_model(vfd->config.model)->gap_ms * 1000u;
    const uint32_t us = modbus_gap_us(vfd->config.format.baud, char_bits(vfd));
    return own_us > us ? own_us : us;
}

/* ---- values ---- */

static float maximum_rpm(const struct vfd *vfd) {
    const float rpm = vfd->knows_maximum ? vfd->maximum_rpm : vfd->full_rpm;
    return rpm > 1.0f ? rpm : 1.0f;
}

/* Value in 1 rpm: of a frame that carries a speed. */
static float per_rpm(const struct vfd *vfd, const struct vfd_frame *frame, bool reads) {
    const struct vfd_own *own = &vfd->config.own;
    const float factor = (float)frame->factor;
    switch ((enum vfd_unit)frame->unit) {
    case VFD_HZ:
        return factor / vfd->config.rpm_per_hz;
    case VFD_MAX:
        return factor / maximum_rpm(vfd);
    case VFD_OWN:
        return reads ? own->read_divider / own->read_multiplier : own->set_multiplier / own->set_divider;
    case VFD_RPM:
    case VFD_AMPERE:
    case VFD_NO_VALUE:
        break;
    }
    return factor;
}

static uint16_t value_of(const struct vfd *vfd, const struct vfd_frame *frame) {
    const float most = frame->unit == VFD_MAX ? (float)frame->factor : VALUE_MAX;
    const float value = vfd->rpm * per_rpm(vfd, frame, false) + 0.5f;
    return value >= most ? (uint16_t)most : value > 0.0f ? (uint16_t)value : 0;
}

static float rpm_of(const struct vfd *vfd, const struct vfd_frame *frame, uint16_t value) {
    uint32_t size = value;
    if (frame->is_signed && (value & SIGN) != 0)
        size = 0x10000u - value;
    return (float)size / per_rpm(vfd, frame, true);
}

/* ---- frames ---- */

static uint16_t own_command(const struct vfd_own *own, enum vfd_frame_kind kind) {
    switch (kind) {
    case VFD_CLOCKWISE:
        return own->clockwise;
    case VFD_COUNTER_CLOCKWISE:
        return own->counter_clockwise;
    default:
        return own->stop;
    }
}

static uint16_t own_register(const struct vfd_own *own, enum vfd_frame_kind kind) {
    return kind == VFD_SET_SPEED    ? own->set_register
           : kind == VFD_READ_SPEED ? own->read_register
                                    : own->run_register;
}

static void put_word(uint8_t *bytes, uint16_t word) {
    bytes[0] = (uint8_t)(word >> 8);
    bytes[1] = (uint8_t)(word & 0xFFu);
}

static uint16_t take_word(const uint8_t *bytes) {
    return (uint16_t)(bytes[0] << 8 | bytes[1]);
}

/* The bytes between address and CRC. */
static void fill_body(const struct vfd *vfd, enum vfd_frame_kind kind, uint8_t body[MODBUS_BODY_MAX]) {
    const struct vfd_frame *frame = &vfd_model(vfd->config.model)->frame[kind];
    memcpy(body, frame->send, MODBUS_BODY_MAX);
    if (vfd->config.model == VFD_MODEL_OWN) {
        put_word(body + 1, own_register(&vfd->config.own, kind));
        if (kind <= VFD_STOP)
            put_word(body + 3, own_command(&vfd->config.own, kind));
    }
    if (kind == VFD_SET_SPEED)
        put_word(body + frame->value_at, value_of(vfd, frame));
}

static bool has(const struct vfd *vfd, enum vfd_frame_kind kind) {
    if (vfd->config.model == VFD_MODEL_OWN && kind == VFD_READ_SPEED &&
        vfd->config.own.read_register == VFD_NO_READING)
        return false;
    return vfd_model(vfd->config.model)->frame[kind].send_count > 0;
}

static void build(struct vfd *vfd, enum vfd_frame_kind kind) {
    const struct vfd_frame *frame = &vfd_model(vfd->config.model)->frame[kind];
    struct vfd_request *request = &vfd->request;
    uint8_t body[MODBUS_BODY_MAX];
    fill_body(vfd, kind, body);
    request->kind = (uint8_t)kind;
    request->function = body[0];
    request->frame_count =
        (uint8_t)modbus_build(request->frame, vfd->config.address, body, frame->send_count);
    request->answer.count = frame->answer_count;
    request->answer.any = frame->any;
    request->value_at = frame->value_at;
    for (unsigned i = 0; i < frame->answer_count; i++)
        request->answer.bytes[i] = (frame->as_sent >> i & 1) != 0 ? body[i] : frame->answer[i];
}

/* ---- lost answers ---- */

/* From now on it is commanded to stop, and nothing starts again by itself. */
static void lose(struct vfd *vfd) {
    vfd->link = VFD_LOST;
    vfd->tripped = vfd->direction != 0 || vfd->may_turn;
    vfd->direction = 0;
    vfd->run_confirmed = vfd->speed_confirmed = vfd->proved = false;
    vfd->measures = vfd->has_load = vfd->knows_maximum = false;
}

static void fail(struct vfd *vfd, enum vfd_fault fault) {
    vfd->request.open = false;
    vfd->failed = true;
    vfd->fault = fault;
    if (vfd->lost < VFD_LOST_MAX)
        vfd->lost++;
    if (vfd->lost == VFD_LOST_MAX && vfd->link != VFD_LOST)
        lose(vfd);
}

/* ---- which request comes next ---- */

static enum vfd_frame_kind run_kind(const struct vfd *vfd) {
    return vfd->direction > 0 ? VFD_CLOCKWISE : vfd->direction < 0 ? VFD_COUNTER_CLOCKWISE : VFD_STOP;
}

/* Needed before the drive can be given a speed. */
static bool lacks_maximum(const struct vfd *vfd) {
    return has(vfd, VFD_READ_MAXIMUM) && !vfd->knows_maximum;
}

/* Until a reading was answered by anything but itself, a bus that returns what is sent may play the drive. */
static bool lacks_proof(const struct vfd *vfd) {
    return has(vfd, VFD_READ_SPEED) && !vfd->proved;
}

static enum vfd_frame_kind proof_kind(const struct vfd *vfd) {
    return has(vfd, VFD_READ_MAXIMUM) ? VFD_READ_MAXIMUM : VFD_READ_SPEED;
}

static bool is_settled(const struct vfd *vfd) {
    return vfd->run_confirmed && (vfd->direction == 0 || vfd->speed_confirmed) && !lacks_maximum(vfd) &&
           !lacks_proof(vfd);
}

/* A reading; of a drive that reports nothing its command again. */
static enum vfd_frame_kind poll_kind(const struct vfd *vfd) {
    if (has(vfd, VFD_READ_LOAD) && vfd->polls % LOAD_EACH == 0)
        return VFD_READ_LOAD;
    return has(vfd, VFD_READ_SPEED) ? VFD_READ_SPEED : run_kind(vfd);
}

/* Stop before all else; before a start what it needs. */
static enum vfd_frame_kind next_kind(const struct vfd *vfd) {
    if (vfd->direction == 0 && !vfd->run_confirmed)
        return VFD_STOP;
    if (lacks_proof(vfd) || lacks_maximum(vfd))
        return proof_kind(vfd);
    if (!vfd->run_confirmed)
        return run_kind(vfd);
    if (vfd->direction != 0 && !vfd->speed_confirmed)
        return VFD_SET_SPEED;
    return poll_kind(vfd);
}

/* The answer to the lost request may still come: it must not fit this one. */
static enum vfd_frame_kind other_kind(const struct vfd *vfd) {
    const enum vfd_frame_kind next = next_kind(vfd), lost = (enum vfd_frame_kind)vfd->request.kind;
    const bool was_command = lost <= VFD_SET_SPEED;
    if (was_command != (next <= VFD_SET_SPEED))
        return next;
    if (was_command)
        return !has(vfd, VFD_READ_SPEED) ? next : lacks_proof(vfd) ? proof_kind(vfd) : VFD_READ_SPEED;
    return run_kind(vfd);
}

/* ---- sending ---- */

static uint32_t period_us(const struct vfd *vfd) {
    if (vfd->link == VFD_LOST)
        return VFD_RETRY_US;
    return vfd->direction != 0 ? VFD_POLL_ON_US : VFD_POLL_OFF_US;
}

/* Confirmations are not waited for, but a drive that is lost is not asked all the time. */
static bool is_due(const struct vfd *vfd, uint32_t now_us) {
    if (vfd->due_now || (vfd->link != VFD_LOST && (vfd->failed || !is_settled(vfd))))
        return true;
    return now_us - vfd->poll_us >= period_us(vfd);
}

static void begin(struct vfd *vfd, struct hal *hal, const struct hal_bus *bus, uint32_t now_us) {
    const enum vfd_frame_kind kind = vfd->failed ? other_kind(vfd) : next_kind(vfd);
    struct vfd_request *request = &vfd->request;
    build(vfd, kind);
    modbus_rx_reset(&request->rx);
    request->open = true;
    request->from_us = now_us;
    request->wait_us = chars_us(vfd, request->frame_count) + vfd->config.timeout_ms * 1000u;
    vfd->wants = vfd->due_now = false;
    vfd->poll_us = now_us;
    vfd->polls++;
    if (kind == VFD_CLOCKWISE || kind == VFD_COUNTER_CLOCKWISE)
        vfd->may_turn = true;
    bus->send(hal, request->frame, request->frame_count);
}

/* ---- answers ---- */

static void take_value(struct vfd *vfd, uint16_t value) {
    const struct vfd_frame *frame = &vfd_model(vfd->config.model)->frame[vfd->request.kind];
    switch (vfd->request.kind) {
    case VFD_READ_SPEED:
        vfd->measured_rpm = rpm_of(vfd, frame, value);
        vfd->measures = true;
        break;
    case VFD_READ_LOAD:
        vfd->ampere = (float)value / (float)frame->factor;
        vfd->has_load = true;
        break;
    case VFD_READ_MAXIMUM:
        vfd->knows_maximum = true;
        vfd->maximum_rpm = rpm_of(vfd, frame, value);
        break;
    default:
        break;
    }
}

/* What it was commanded may have changed meanwhile: then this confirms nothing. */
static void take_confirmation(struct vfd *vfd) {
    const struct vfd_request *request = &vfd->request;
    const struct vfd_frame *frame = &vfd_model(vfd->config.model)->frame[request->kind];
    if (request->kind == VFD_SET_SPEED)
        vfd->speed_confirmed |= take_word(request->frame + 1 + frame->value_at) == value_of(vfd, frame);
    if (request->kind == VFD_STOP)
        vfd->may_turn = false;
    if (request->kind == (uint8_t)run_kind(vfd))
        vfd->run_confirmed = true;
}

static void answered(struct vfd *vfd, const uint8_t body[MODBUS_BODY_MAX], uint32_t now_us) {
    const bool reads = vfd->request.kind >= VFD_READ_SPEED;
    const uint16_t value = reads ? take_word(body + vfd->request.value_at) : 0;
    vfd->quiet_us = now_us;
    if (!reads && vfd->echoes) { /* it may be what was sent */
        fail(vfd, VFD_FAULT_ECHO);
        return;
    }
    const bool itself = memcmp(body, vfd->request.frame + 1, vfd->request.answer.count) == 0;
    if (vfd->request.kind == VFD_READ_MAXIMUM && value == 0) { /* no speed can be a part of it */
        vfd->echoes |= itself;
        fail(vfd, itself ? VFD_FAULT_ECHO : VFD_FAULT_OTHER);
        return;
    }
    vfd->request.open = vfd->failed = false;
    vfd->lost = 0;
    vfd->link = VFD_UP;
    vfd->fault = VFD_FAULT_NONE;
    vfd->proved |= reads && !itself;
    vfd->echoes &= !(reads && !itself);
    if (reads)
        take_value(vfd, value);
    take_confirmation(vfd);
}

static enum vfd_fault fault_of(const struct vfd *vfd) {
    const struct vfd_request *request = &vfd->request;
    if (!request->rx.heard)
        return VFD_FAULT_SILENT;
    if (modbus_rx_has(&request->rx, request->frame, request->frame_count))
        return VFD_FAULT_ECHO;
    return modbus_rx_has_frame(&request->rx) ? VFD_FAULT_OTHER : VFD_FAULT_GARBLED;
}

/* A bus that returns what is sent would confirm every command by itself. A reading shows it, unless its
 * answer at rest is its request, as Huanyang's is. */
static bool is_echo(const struct vfd *vfd) {
    const struct vfd_request *request = &vfd->request;
    return request->kind >= VFD_READ_SPEED && !modbus_fits(request->frame + 1, &request->answer) &&
           modbus_rx_has(&request->rx, request->frame, request->frame_count);
}

/* For its begin, and then for its end. */
static uint32_t wait_us(const struct vfd *vfd) {
    return vfd->request.wait_us + (vfd->request.rx.heard ? chars_us(vfd, ANSWER_CHARS) : 0);
}

static bool look_for_answer(struct vfd *vfd, uint32_t now_us) {
    struct vfd_request *request = &vfd->request;
    uint8_t body[MODBUS_BODY_MAX];
    if (is_echo(vfd)) {
        vfd->echoes = true;
        fail(vfd, VFD_FAULT_ECHO);
    } else if (modbus_rx_find(&request->rx, vfd->config.address, &request->answer, body)) {
        answered(vfd, body, now_us);
    } else if (modbus_rx_refusal(&request->rx, vfd->config.address, request->function, &vfd->refusal)) {
        fail(vfd, VFD_FAULT_REFUSED);
    } else if (now_us - request->from_us >= wait_us(vfd)) {
        fail(vfd, fault_of(vfd));
    } else {
        return false;
    }
    return true;
}

/* What comes while nothing is awaited is late: dropped. */
static bool receive(struct vfd *vfd, struct hal *hal, const struct hal_bus *bus, uint32_t now_us) {
    uint8_t bytes[MODBUS_RX_SIZE];
    const size_t count = bus->receive(hal, bytes, sizeof bytes);
    if (count == 0)
        return false;
    vfd->quiet_us = now_us;
    if (vfd->request.open)
        modbus_rx_put(&vfd->request.rx, bytes, count);
    return true;
}

bool vfd_poll(struct vfd *vfd, struct hal *hal, const struct hal_bus *bus, uint32_t now_us) {
    if (vfd->config.model == 0)
        return false;
    const bool received = receive(vfd, hal, bus, now_us);
    if (vfd->request.open)
        return look_for_answer(vfd, now_us) || received;
    if (!is_due(vfd, now_us))
        return received;
    if (!vfd->wants)
        vfd->want_us = now_us;
    vfd->wants = true;
    if (now_us - vfd->quiet_us >= gap_us(vfd)) {
        begin(vfd, hal, bus, now_us);
        return true;
    }
    if (now_us - vfd->want_us >= BUS_BUSY_US) {
        vfd->want_us = now_us;
        fail(vfd, VFD_FAULT_GARBLED);
    }
    return received;
}

static uint32_t left_us(uint32_t from_us, uint32_t us, uint32_t now_us) {
    return now_us - from_us < us ? us - (now_us - from_us) : 1;
}

uint32_t vfd_wait_us(const struct vfd *vfd, uint32_t now_us) {
    if (vfd->config.model == 0)
        return UINT32_MAX;
    if (vfd->request.open)
        return LOOK_US;
    const uint32_t quiet_us = left_us(vfd->quiet_us, gap_us(vfd), now_us);
    if (is_due(vfd, now_us))
        return quiet_us;
    const uint32_t poll_us = left_us(vfd->poll_us, period_us(vfd), now_us);
    return poll_us > quiet_us ? poll_us : quiet_us;
}

/* ---- what the machine wants ---- */

bool vfd_configure(struct vfd *vfd, struct hal *hal, const struct hal_bus *bus,
                   const struct vfd_config *config, uint32_t now_us) {
    const bool may_turn = vfd->may_turn;
    memset(vfd, 0, sizeof *vfd);
    vfd->config = *config;
    vfd->may_turn = may_turn;
    vfd->quiet_us = vfd->poll_us = now_us;
    if (config->model == 0 || bus->configure(hal, &config->format))
        return true;
    vfd->config.model = 0;
    return false;
}

/* A drive that is lost gets three tries for each start. */
static void start_again(struct vfd *vfd) {
    vfd->link = VFD_STARTING;
    vfd->lost = 0;
}

void vfd_command(struct vfd *vfd, int direction, float rpm, float full_rpm, uint32_t now_us) {
    if (vfd->config.model == 0)
        return;
    if (direction == 0)
        vfd->tripped = false;
    else if (vfd->tripped)
        return;
    const bool switches = direction != vfd->direction;
    if (switches && vfd->link == VFD_LOST && direction != 0)
        start_again(vfd);
    if (switches)
        vfd->run_confirmed = false;
    if (switches || rpm != vfd->rpm || full_rpm != vfd->full_rpm)
        vfd->speed_confirmed = false;
    if (switches)
        vfd->poll_us = now_us;
    vfd->due_now |= switches;
    vfd->direction = (int8_t)direction;
    vfd->rpm = rpm;
    vfd->full_rpm = full_rpm;
}

bool vfd_can_measure(const struct vfd *vfd) {
    return vfd->config.model != 0 && has(vfd, VFD_READ_SPEED);
}

bool vfd_measured_rpm(const struct vfd *vfd, float *rpm) {
    *rpm = vfd->direction < 0 ? -vfd->measured_rpm : vfd->measured_rpm;
    return vfd->measures;
}
