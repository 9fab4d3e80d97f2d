/* SPDX-License-Identifier: MIT
 * The spindle drive of the virtual machine. It knows the frames from the same table as the controller, so it
 * proves nothing about them: tests have drives of their own (tests/spindle). */
#include "virtual_vfd.h"

#include "host_inner.h"
#include "spindle/vfd_models.h"

#include <math.h>
#include <string.h>

#define ANSWER_US   2000u /* from a request to its answer */
#define IDLE_AMPERE 1.0   /* of a spindle that turns in air */
#define LOAD_AMPERE 10.0  /* ... and more of one that is braked wholly */
#define HEAD_BYTES  1u    /* address */

/* ---- what the settings say that the drive is ---- */

static uint16_t own_register(const struct settings *settings, enum vfd_frame_kind kind) {
    return kind == VFD_SET_SPEED    ? settings->vfd_set_register
           : kind == VFD_READ_SPEED ? settings->vfd_read_register
                                    : settings->vfd_run_register;
}

static uint16_t own_command(const struct settings *settings, enum vfd_frame_kind kind) {
    return kind == VFD_CLOCKWISE           ? settings->vfd_clockwise
           : kind == VFD_COUNTER_CLOCKWISE ? settings->vfd_counter_clockwise
                                           : settings->vfd_stop;
}

static struct vfd_frame frame_of(const struct settings *settings, enum vfd_frame_kind kind) {
    struct vfd_frame frame = vfd_models[settings->spindle_type - 1].frame[kind];
    if (settings->spindle_type != VFD_MODEL_OWN || frame.send_count == 0)
        return frame;
    frame.send[1] = (uint8_t)(own_register(settings, kind) >> 8);
    frame.send[2] = (uint8_t)own_register(settings, kind);
    if (kind <= VFD_STOP) {
        frame.send[3] = (uint8_t)(own_command(settings, kind) >> 8);
        frame.send[4] = (uint8_t)own_command(settings, kind);
    }
    return frame;
}

/* Value in 1 rpm. */
static double per_rpm(const struct settings *settings, const struct vfd_frame *frame, bool reads) {
    const double factor = frame->factor;
    switch ((enum vfd_unit)frame->unit) {
    case VFD_HZ:
        return factor / settings->vfd_rpm_per_hz;
    case VFD_MAX:
        return factor / (double)settings->spindle_max_rpm;
    case VFD_OWN:
        return reads ? (double)settings->vfd_read_divider / (double)settings->vfd_read_multiplier
                     : (double)settings->vfd_set_multiplier / (double)settings->vfd_set_divider;
    default:
        return factor;
    }
}

/* ---- requests ---- */

static bool is_request(const struct vfd_frame *frame, enum vfd_frame_kind kind, const uint8_t *body,
                       size_t count) {
    if (frame->send_count == 0 || count != frame->send_count)
        return false;
    for (unsigned i = 0; i < count; i++) {
        const bool value = kind == VFD_SET_SPEED && (i == frame->value_at || i == frame->value_at + 1u);
        if (!value && body[i] != frame->send[i])
            return false;
    }
    return true;
}

static void turn(struct hal *hal) {
    struct virtual_machine *machine = &hal->virtual_machine;
    vspindle_note(&machine->spindle, hal->step.now_ticks, hal->timer_hz);
    machine->driven = true;
    machine->spindle.told_rpm = machine->drive_direction * machine->drive_rpm;
}

static void obey(struct hal *hal, enum vfd_frame_kind kind, const struct vfd_frame *frame,
                 const uint8_t *body) {
    struct virtual_machine *machine = &hal->virtual_machine;
    if (kind == VFD_SET_SPEED)
        machine->drive_rpm =
            (body[frame->value_at] << 8 | body[frame->value_at + 1]) / per_rpm(hal->settings, frame, false);
    else
        machine->drive_direction = kind == VFD_CLOCKWISE ? 1 : kind == VFD_COUNTER_CLOCKWISE ? -1 : 0;
    turn(hal);
}

static uint16_t reading(const struct hal *hal, enum vfd_frame_kind kind, const struct vfd_frame *frame) {
    const struct virtual_spindle *spindle = &hal->virtual_machine.spindle;
    const double rpm = vspindle_rpm(spindle, hal->step.now_ticks, hal->timer_hz);
    const double shown = kind == VFD_READ_MAXIMUM ? (double)hal->settings->spindle_max_rpm : fabs(rpm);
    if (kind == VFD_READ_LOAD)
        return (uint16_t)(rpm == 0.0 ? 0.0
                                     : (IDLE_AMPERE + LOAD_AMPERE * fabs(spindle->load)) * frame->factor);
    const long value = lround(shown * per_rpm(hal->settings, frame, true));
    return (uint16_t)(frame->is_signed && rpm < 0.0 ? -value : value);
}

static void answer(struct hal *hal, uint64_t end_ticks, enum vfd_frame_kind kind,
                   const struct vfd_frame *frame, const uint8_t *body) {
    uint8_t bytes[MODBUS_BODY_MAX], whole[MODBUS_FRAME_MAX];
    for (unsigned i = 0; i < frame->answer_count; i++)
        bytes[i] = (frame->as_sent >> i & 1) != 0 ? body[i] : frame->answer[i];
    if (kind >= VFD_READ_SPEED) {
        const uint16_t value = reading(hal, kind, frame);
        bytes[frame->value_at] = (uint8_t)(value >> 8);
        bytes[frame->value_at + 1] = (uint8_t)value;
    }
    const size_t count = modbus_build(whole, hal->settings->vfd_address, bytes, frame->answer_count);
    host_bus_put(hal, end_ticks + ((uint64_t)ANSWER_US * hal->timer_mhz_q8 >> 8), whole, count);
}

void virtual_vfd_hear(struct hal *hal, uint64_t end_ticks, const uint8_t *bytes, size_t count) {
    const uint8_t *body = bytes + HEAD_BYTES;
    if (hal->settings->spindle_type == 0 || hal->settings->spindle_type > VFD_MODEL_COUNT)
        return;
    for (enum vfd_frame_kind kind = VFD_CLOCKWISE; kind < VFD_FRAME_KINDS; kind++) {
        const struct vfd_frame frame = frame_of(hal->settings, kind);
        if (!is_request(&frame, kind, body, count - 3))
            continue;
        if (kind <= VFD_SET_SPEED)
            obey(hal, kind, &frame, body);
        answer(hal, end_ticks, kind, &frame, body);
        return;
    }
}
