/* SPDX-License-Identifier: MIT
 * Power-on, and the order in which one poll visits the parts. */
#include "machine/machine.h"

#include "machine/auto_report.h"
#include "machine/configure.h"
#include "machine/dial.h"
#include "machine/drive.h"
#include "machine/driver_watch.h"
#include "machine/faults.h"
#include "machine/guard.h"
#include "machine/host.h"
#include "machine/inputs.h"
#include "machine/lines.h"
#include "machine/motor_current.h"
#include "machine/motor_drivers.h"
#include "machine/motors.h"
#include "machine/outputs.h"
#include "machine/overrides.h"
#include "machine/parking.h"
#include "machine/parts.h"
#include "machine/pump.h"
#include "machine/realtime.h"
#include "machine/report.h"
#include "machine/reset.h"
#include "machine/run_up.h"
#include "machine/sender.h"
#include "machine/servo.h"
#include "machine/spindle_sync.h"
#include "machine/state.h"
#include "machine/stored.h"
#include "machine/stored_write.h"
#include "machine/suspend.h"
#include "machine/timer.h"
#include "machine/vfd_spindle.h"
#include "machine/vfd_watch.h"
#include "machine/wiring.h"

#include <string.h>

#define LATE_QUIET_US 1000000u /* from one report of underruns to the next */

void machine_init(struct machine *machine, const struct machine_board *board, struct hal *hal,
                  struct hal_step *hal_step, const struct text_out *out) {
    static const struct prep_timing no_timing = {
        .timer_hz = 1, .min_interval_ticks = 1, .dir_setup_ticks = 1};
    static const struct motion_limits no_limits = {.steps_per_mm = {1, 1, 1, 1, 1, 1}};
    memset(machine, 0, sizeof *machine); /* not an assignment: clang makes a second machine on the stack */
    machine->board = *board;
    machine->hal = hal;
    machine->out = *out;
    settings_defaults(&machine->settings);
    configure_board_defaults(machine);
    interp_begin(&machine->interp, board);
    rx_init(&machine->lines.rx);
    line_reader_reset(&machine->lines.reader);
    machine->drive.joints.kinematics.ops = &kinematics_cartesian; /* until the settings are there */
    motion_init(&machine->drive.motion, &no_limits, board->look_ahead != 0 ? board->look_ahead : PLAN_SIZE,
                board->laser_marks != 0 ? board->laser_marks : POWER_MARKS);
    host_queue_init(&machine->host.queue, &machine->drive.motion.ahead);
    hosted_init(&machine->host.hosted, &machine->drive.motion.emit, &machine->host.queue);
    step_init(&machine->drive.step, hal_step);
    prep_init(&machine->drive.prep, &machine->drive.motion.queue, &machine->drive.step, &no_timing);
    overrides_begin(&machine->overrides);
    /* Stored settings first: the wiring changes them to what this board has, and whether the machine starts
     * locked depends on $22 and on damage that was found. configure_apply() comes last, when all parts that
     * derive something from a setting exist. */
    stored_load(machine);
    wiring_take_axes(machine);
    wiring_fit(machine);
    state_begin(machine, machine->settings.homing || stored_is_damaged(machine));
    inputs_begin(machine);
    dial_begin(machine);
    faults_begin(machine);
    configure_pwm(machine);
    outputs_off(machine);
    pump_apply(machine);
    motors_init(machine);
    motor_current_put_out(machine);
    reset_restart(machine);
    configure_apply(machine);
    drive_take_position(machine);
}

void machine_input_pause(struct machine *machine) {
    motion_flush(&machine->drive.motion);
}

uint32_t machine_event_us(const struct machine *machine) {
    uint32_t quiet = timer_left_us(machine, &machine->clock.quiet);
    uint32_t timer = timer_left_us(machine, &machine->clock.timer);
    uint32_t least = quiet < timer ? quiet : timer;
    uint32_t aim = timer_left_us(machine, &machine->outputs.aim_time);
    uint32_t motors = motors_wait_us(machine);
    uint32_t run_up = run_up_wait_us(machine);
    uint32_t vfd = vfd_spindle_event_us(machine);
    uint32_t faults = faults_wait_us(machine);
    uint32_t drivers = motor_drivers_event_us(machine);
    uint32_t dial = dial_wait_us(machine);
    if (dial < least)
        least = dial;
    if (drivers < least)
        least = drivers;
    if (faults < least)
        least = faults;
    if (run_up < least)
        least = run_up;
    if (aim < least)
        least = aim;
    if (vfd < least)
        least = vfd;
    if (motors > 0 && motors < least)
        least = motors;
    if (machine->drive.motion.waits && !machine->life.critical && least > MOTION_START_DELAY_US)
        least = MOTION_START_DELAY_US;
    return least;
}

uint32_t machine_wait_us(const struct machine *machine) {
    const uint32_t event_us = machine_event_us(machine), vfd_us = vfd_spindle_wait_us(machine);
    const uint32_t report_us = auto_report_wait_us(machine), drivers_us = motor_drivers_wait_us(machine);
    const uint32_t bus_us = vfd_us < drivers_us ? vfd_us : drivers_us;
    const uint32_t least_us = event_us < bus_us ? event_us : bus_us;
    return report_us < least_us ? report_us : least_us;
}

/* From rest to motion within prep_poll(): the moment of the start and the count of starts are published for
 * the task side, the count last (release). */
bool machine_poll_motion(struct machine *machine) {
    bool rested = !machine->drive.step.active;
    if (!machine->edges.estop)
        prep_tend_beam(&machine->drive.prep);
    bool any = motors_poll(machine) && prep_poll(&machine->drive.prep);
    if (rested && machine->drive.step.active) {
        machine->drive.started_us = hal_time_us(machine->hal);
        __atomic_store_n(&machine->drive.starts, machine->drive.starts + 1, __ATOMIC_RELEASE);
    }
    return any;
}

/* Underruns, not more often than once in LATE_QUIET_US. What the dial moves grows while its end is published:
 * that it has begun to brake for that end is none. */
static void tell_late(struct machine *machine) {
    machine->drive.late_quiet.on =
        timer_runs(machine, &machine->drive.late_quiet); /* before the clock wraps */
    const uint32_t fresh = machine->drive.motion.ahead.late - machine->drive.late_seen;
    machine->drive.late_seen += fresh;
    if (dial_moves(machine))
        machine->drive.late_dial += fresh;
    const uint32_t underruns = machine->drive.late_seen - machine->drive.late_dial;
    if (machine->drive.late_told == underruns || machine->drive.late_quiet.on)
        return;
    machine->drive.late_told = underruns;
    report_underruns(machine);
    timer_start(machine, &machine->drive.late_quiet, LATE_QUIET_US);
}

/* What stops comes before what starts. The motion side's answer first, because whether the machine is
 * standing depends on it. Then switches and buttons (guard_poll() only notes buttons), then the real-time
 * requests that senders and buttons have made: they act before another line is read. In the quiet time after
 * an alarm nothing else is done; guard_poll() and realtime_poll() may have begun it, hence two looks. Lines
 * come before motion, so that a move that was just read is published in the same poll. A spindle drive is
 * talked to before the first look at the quiet time, because it must be commanded to stop in it. */
bool machine_poll(struct machine *machine) {
    bool any = ahead_take_answer(&machine->drive.motion.ahead);
    dial_read(machine);
    any |= guard_poll(machine);
    any |= vfd_spindle_poll(machine);
    any |= motor_drivers_talk(machine);
    if (timer_poll(machine))
        return any;
    reset_tell_way_out(machine);
    auto_report_poll(machine);
    any |= realtime_poll(machine);
    if (timer_poll(machine))
        return any;
    any |= stored_poll(machine);
    if (machine->life.restart && !stored_is_busy(machine)) {
        reset_restart(machine);
        any = true;
    }
    any |= suspend_poll(machine);
    any |= parking_poll(machine);
    any |= sender_lost_poll(machine);
    spindle_sync_watch(machine);
    any |= lines_poll(machine);
    any |= dial_poll(machine);
    outputs_poll(machine);
    any |= vfd_watch_poll(machine);
    any |= driver_watch_poll(machine);
    if (machine->life.critical)
        return any;
    any |= host_poll(machine);
    if (!motor_drivers_holds(machine))
        any |= motion_poll(&machine->drive.motion, hal_time_us(machine->hal));
    tell_late(machine);
    motor_current_poll(machine);
    servo_poll(machine);
    if (machine->board.motion_side == NULL)
        any |= machine_poll_motion(machine);
    any |= state_update(machine);
    return any;
}
