/* SPDX-License-Identifier: MIT
 * A spindle drive (VFD) on a bus: commands that must be confirmed, and what the drive reports. It knows
 * nothing of a machine: in come the wanted direction and speed, the time and the bus; out go what is
 * confirmed, the real speed, the load, and whether the drive answers. [task]
 *
 * One request is under way at a time, and only its own answer counts: function, register and value must be
 * right. An answer that comes late is none, and after a lost one the next request is of another kind, so that
 * it cannot be taken for that. Three lost answers: the drive is lost, and from then on it is commanded to
 * stop, until it confirms this. */
#ifndef WIFICNC_SPINDLE_VFD_H
#define WIFICNC_SPINDLE_VFD_H

#include "hal/hal.h"
#include "spindle/vfd_models.h"

enum {
    VFD_LOST_MAX = 3,            /* answers in a row */
    VFD_POLL_ON_US = 70000,      /* from one look at the real speed to the next */
    VFD_POLL_OFF_US = 1000000,   /* while it is off */
    VFD_RETRY_US = 100000,       /* from one try to the next while it is lost */
    VFD_NO_READING = UINT16_MAX, /* $464: the drive has no register of its speed */
};

/** The registers of a drive that is not in the table, $462 .. $471. */
struct vfd_own {
    uint16_t run_register, set_register, read_register;
    uint16_t clockwise, counter_clockwise, stop;
    float set_multiplier, set_divider, read_multiplier, read_divider;
};

/** How the drive is reached, and how speeds become values. */
struct vfd_config {
    uint8_t model; /* $395; 0: there is no drive */
    uint8_t address;
    struct hal_bus_format format;
    uint16_t timeout_ms; /* from the end of a request to the begin of its answer */
    float rpm_per_hz;    /* 60: a motor of 2 poles */
    struct vfd_own own;
};

enum vfd_link {
    VFD_STARTING, /* nothing was answered yet, and not three requests were lost */
    VFD_UP,
    VFD_LOST,
};

/** Why the newest answer was lost. */
enum vfd_fault {
    VFD_FAULT_NONE,
    VFD_FAULT_SILENT,  /* nothing was received */
    VFD_FAULT_GARBLED, /* no frame with a right CRC */
    VFD_FAULT_OTHER,   /* a sound frame, but not this answer */
    VFD_FAULT_REFUSED, /* the drive refuses the request */
    VFD_FAULT_ECHO,    /* what is sent comes back: the receiver listens while the driver sends */
};

/** The request under way, or the last one. */
struct vfd_request {
    uint8_t kind; /* enum vfd_frame_kind */
    bool open;    /* its answer is awaited */
    uint8_t function;
    uint8_t value_at; /* of a reading: place of the value in the answer */
    uint32_t from_us; /* when it was begun */
    uint32_t wait_us; /* from then on until its answer must begin */
    uint8_t frame[MODBUS_FRAME_MAX];
    uint8_t frame_count;
    struct modbus_pattern answer;
    struct modbus_rx rx;
};

struct vfd {
    struct vfd_config config;
    /* what is wanted */
    int8_t direction; /* 1 clockwise, -1 counter-clockwise, 0 off */
    float rpm, full_rpm;
    bool tripped; /* it was lost while it may have turned: off until that was wanted once */
    /* what the drive has confirmed */
    bool run_confirmed, speed_confirmed;
    bool proved;   /* a reading was answered since the drive was found */
    bool echoes;   /* a reading came back as it was sent, and none was answered since */
    bool may_turn; /* it was commanded to, and has not confirmed a stop since */
    bool knows_maximum, measures;
    float maximum_rpm, measured_rpm; /* measured: without sign */
    float ampere;
    bool has_load;
    /* the bus */
    enum vfd_link link;
    enum vfd_fault fault;
    uint8_t refusal;   /* the drive's reason */
    uint8_t lost;      /* answers in a row */
    uint8_t polls;     /* which reading comes next */
    bool failed;       /* the last request, and the next is of another kind */
    bool due_now;      /* a poll is not waited for */
    uint32_t quiet_us; /* since when the bus is silent */
    uint32_t poll_us;  /* when the drive was asked last */
    uint32_t want_us;  /* since when a request waits for a silent bus */
    bool wants;        /* ... if one does */
    struct vfd_request request;
};

/** The drive of this configuration: it is commanded to stop first. The bus is as it wants.
 *  @return false: the bus does not have this format */
bool vfd_configure(struct vfd *vfd, struct hal *hal, const struct hal_bus *bus,
                   const struct vfd_config *config, uint32_t now_us);

/** What it is to do from now on. @param full_rpm  maximum speed, for models whose drives do not report it */
void vfd_command(struct vfd *vfd, int direction, float rpm, float full_rpm, uint32_t now_us);

/** Send, receive, notice what was lost. @return true when something was done */
bool vfd_poll(struct vfd *vfd, struct hal *hal, const struct hal_bus *bus, uint32_t now_us);

/** Poll again after this time at the latest. */
uint32_t vfd_wait_us(const struct vfd *vfd, uint32_t now_us);

/** The drive answers, and has confirmed what is wanted. */
static inline bool vfd_is_confirmed(const struct vfd *vfd) {
    return vfd->link == VFD_UP && !vfd->tripped && vfd->run_confirmed &&
           (vfd->direction == 0 || vfd->speed_confirmed);
}

/** It can report its speed. */
bool vfd_can_measure(const struct vfd *vfd);

/** Speed that the drive has reported, signed as it is commanded, rpm. @return false: it has not yet */
bool vfd_measured_rpm(const struct vfd *vfd, float *rpm);

/** Baud rates of $374 and parities of $681 by their values. @return 0: there is none of this value */
uint32_t vfd_baud(const struct vfd_model *model, uint8_t setting);
enum hal_bus_parity vfd_parity(const struct vfd_model *model, uint8_t setting);

/** NULL: there is none of this number. */
const struct vfd_model *vfd_model(uint8_t number);

#endif
