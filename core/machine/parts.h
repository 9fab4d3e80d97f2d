/* SPDX-License-Identifier: MIT
 * struct machine: the list of its parts. Each part is described, and written, by its owner alone. For
 * core/machine, and for what looks into a machine to measure it. */
#ifndef WIFICNC_MACHINE_PARTS_H
#define WIFICNC_MACHINE_PARTS_H

#include "machine/aside.h"
#include "machine/auto_report.h"
#include "machine/drive.h"
#include "machine/faults.h"
#include "machine/homing.h"
#include "machine/host.h"
#include "machine/inputs.h"
#include "machine/interp.h"
#include "machine/jog.h"
#include "machine/lines.h"
#include "machine/machine.h"
#include "machine/motor_current.h"
#include "machine/motors.h"
#include "machine/notes.h"
#include "machine/outputs.h"
#include "machine/overrides.h"
#include "machine/park.h"
#include "machine/place.h"
#include "machine/probe.h"
#include "machine/report.h"
#include "machine/run_up.h"
#include "machine/sender.h"
#include "machine/spindle_sync.h"
#include "machine/state.h"
#include "machine/stored.h"
#include "machine/suspend.h"
#include "machine/task.h"
#include "machine/timer.h"
#include "machine/tool_change.h"
#include "settings/settings.h"

struct machine {
    struct machine_board board;
    struct hal *hal;
    struct text_out out;
    struct settings settings;
    struct machine_interp interp;
    struct machine_lines lines;
    struct machine_task task;
    union machine_aside aside;
    struct machine_drive drive;
    struct machine_life life;
    struct machine_trust trust;
    struct machine_suspend suspend;
    struct machine_park park;
    struct machine_jogs jogs;
    struct machine_tool_change tool_change;
    struct machine_clock clock;
    struct machine_overrides overrides;
    struct machine_outputs outputs;
    struct machine_run_up run_up;
    struct machine_ports ports;
    struct machine_motor_current motor_current;
    struct machine_motors motors;
    struct machine_edges edges;
    struct hal_inputs inputs;
    struct machine_faults faults;
    uint8_t idle_starts; /* guard_idle_starts() */
    struct homing homing;
    struct machine_probe probe;
    struct machine_spindle_sync spindle_sync;
    struct line_notes notes;
    struct machine_client client;
    struct machine_host host;
    struct machine_reports reports;
    struct machine_auto_report auto_report;
    struct machine_stored stored;
};

#endif
