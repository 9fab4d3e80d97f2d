/* SPDX-License-Identifier: MIT
 * All that this firmware consists of, and the stages of its start, in their order. There is one, in main.c;
 * everything gets it by pointer. */
#ifndef WIFICNC_ESP32_FIRMWARE_H
#define WIFICNC_ESP32_FIRMWARE_H

#include "app/boot_guard.h"
#include "app/controller.h"
#include "app/follow.h"
#include "app/io_module.h"
#include "app/restart_note.h"
#include "app/services.h"
#include "hal/chip_hal.h"
#include "io/lines.h"
#include "machine/parts.h"
#include "net/access_store.h"
#include "net/portal.h"
#include "store/nvs_flash_ops.h"

struct firmware {
    struct machine machine;
    struct hal hal;
    struct controller controller;
    struct services services;
    struct nvs_store store;
    struct pin_map pins;
    struct step_engine_board step_pins;
    struct lines lines;
    struct channels channels;
    struct follow follow;        /* of a controller */
    struct io_module *io_module; /* when this board is one: it has a copy of all settings, from the heap */
    struct portal *portal;       /* first contact; NULL: there is none */
    struct update_trial wiring;  /* pins that were changed over the network */
    struct boot_guard *guard;    /* of crashes in a row */
    struct restart_note *note;   /* for the next start */
    const struct hal_restart *restart;
    char key[ACCESS_KEY_MAX + 1]; /* of network clients and updates */
    uint8_t access_open;
    bool safe_mode, is_module, has_network;
};

/** Pins are sorted out before there is anyone to be told: lines for later. */
struct complaints {
    char text[512];
};

/* start.c: before anything moves */

/** A stage that fails is reported on the serial ports; what needs it is left out. */
void firmware_tell(struct firmware *firmware, const char *text);
void firmware_tell_complaints(struct firmware *firmware, struct complaints *complaints);

/** What the storage decides: the device mode, and what happens to motion without a client. */
void firmware_read_choices(struct firmware *firmware);

/** Outputs are safe from here on. */
void firmware_start_pins(struct firmware *firmware, struct complaints *complaints);

/** Inputs, outputs and the step engine. */
void firmware_start_hal(struct firmware *firmware);

/** The machine and the motion task. @param kept  what became of the storage */
void firmware_start_machine(struct firmware *firmware, enum nvs_start kept);

/* ports.c */

/** Serial ports: clients, and a way to join a network (link/improv.h). */
void firmware_start_ports(struct firmware *firmware);

/* online.c: in the controller's task */

/** A network with Telnet, WMC3, the web page and updates: what cannot be started is reported. */
void firmware_start_network(struct firmware *firmware);

/** Store the addresses that are trusted for ever when that has changed; a write stops the other core, so it
 * waits until the machine is at rest. */
void firmware_keep_trust(struct firmware *firmware);

/** A network with WMC3 and updates. */
void firmware_start_io_module(struct firmware *firmware);

/** Pins that were changed over the network return if no one comes after the start with them.
 * @param reached, at_rest  as of services_poll() */
void firmware_poll_wiring(struct firmware *firmware, uint32_t now_us, bool reached, bool at_rest);

/** Report a new address, so that a user at a serial port knows where to connect. */
void firmware_tell_address(struct firmware *firmware);

/* run.c: the task, of one of two modes. @param firmware  struct firmware */
void firmware_run_controller(void *firmware);
void firmware_run_io_module(void *firmware);

#endif
