/* SPDX-License-Identifier: MIT
 * What the core knows of a model of spindle drive: its frames, from protocol/vfd.toml. */
#ifndef WIFICNC_SPINDLE_VFD_MODELS_H
#define WIFICNC_SPINDLE_VFD_MODELS_H

#include "spindle/modbus.h"
#include "spindle/vfd_models_gen.h"

enum vfd_frame_kind {
    VFD_CLOCKWISE,
    VFD_COUNTER_CLOCKWISE,
    VFD_STOP,
    VFD_SET_SPEED,
    VFD_READ_SPEED,
    VFD_READ_LOAD,
    VFD_READ_MAXIMUM,
    VFD_FRAME_KINDS
};

/** What the value of a frame is. */
enum vfd_unit {
    VFD_NO_VALUE,
    VFD_HZ,     /* factor in 1 Hz */
    VFD_RPM,    /* factor in 1 rpm */
    VFD_MAX,    /* factor is the maximum speed */
    VFD_OWN,    /* by settings */
    VFD_AMPERE, /* factor in 1 A */
};

/** A request and its answer, between address and CRC. */
struct vfd_frame {
    uint8_t send[MODBUS_BODY_MAX];
    uint8_t answer[MODBUS_BODY_MAX];
    uint8_t send_count; /* 0: the model has no such frame */
    uint8_t answer_count;
    uint8_t any;      /* bit n: byte n of the answer may be anything */
    uint8_t as_sent;  /* bit n: it is byte n of the request */
    uint8_t value_at; /* place of the value, high byte first: of a read in the answer, else in the request */
    uint8_t unit;     /* enum vfd_unit */
    uint16_t factor;
    bool is_signed; /* negative in reverse */
};

/** A model. */
struct vfd_model {
    const char *title;
    uint32_t baud;
    uint8_t parity; /* as $681 */
    uint8_t gap_ms; /* at least so much silence before a request */
    struct vfd_frame frame[VFD_FRAME_KINDS];
};

/** In the order of $395, from 1 on. */
extern const struct vfd_model vfd_models[VFD_MODEL_COUNT];

#endif
