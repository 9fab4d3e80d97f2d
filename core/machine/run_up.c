/* SPDX-License-Identifier: MIT
 * A spindle needs time to come to speed and to stop: $394, $539, and with an encoder $340. */
#include "machine/run_up.h"

#include "machine/parts.h"
#include "machine/vfd_spindle.h"

#include <math.h>

#define LOOK_US  5000u
#define RPM_PART 0.1f /* a change of S by less needs no delay: settings.toml says so */

static uint32_t us_of(float seconds) {
    return (uint32_t)(seconds * 1e6f);
}

static uint32_t left_us(const struct machine *machine, const struct machine_timer *timer) {
    return timer_runs(machine, timer) ? timer_left_us(machine, timer) : 0;
}

/* Small changes add up to one that needs the delay. */
static bool needs_delay(const struct machine_run_up *run_up, float rpm) {
    return fabsf(rpm - run_up->waited_rpm) > RPM_PART * run_up->waited_rpm;
}

static void note_change(struct machine *machine, bool delays) {
    struct machine_run_up *run_up = &machine->run_up;
    run_up->due = true;
    run_up->near.on = false;
    if (!delays)
        return;
    run_up->waited_rpm = run_up->rpm;
    timer_start(machine, &run_up->turns, us_of(machine->settings.spindle_on_delay_s));
}

void run_up_note(struct machine *machine, int direction, float rpm) {
    struct machine_run_up *run_up = &machine->run_up;
    if (machine->settings.laser_mode)
        direction = 0;
    const bool switches = direction != run_up->direction, changes = rpm != run_up->rpm;
    if (switches && run_up->direction != 0) {
        run_up->coasting = run_up->direction;
        timer_start(machine, &run_up->stops, us_of(machine->settings.spindle_off_delay_s));
    }
    run_up->direction = (int8_t)direction;
    run_up->rpm = rpm;
    if (direction == 0)
        run_up->due = switches && vfd_spindle_is_chosen(machine); /* the drive confirms a stop, too */
    else if (switches || changes)
        note_change(machine, switches || needs_delay(run_up, rpm));
}

uint32_t run_up_stop_us(const struct machine *machine, enum gcode_spindle next) {
    const struct machine_run_up *run_up = &machine->run_up;
    const int same = next == SPINDLE_CW ? 1 : -1;
    if (machine->settings.laser_mode || (next != SPINDLE_OFF && run_up->coasting == same))
        return 0;
    return left_us(machine, &run_up->stops);
}

static float asked_rpm(const struct machine *machine) {
    return machine->outputs.shown_rpm * (float)machine->run_up.direction;
}

/* Of the encoder, because it is at the spindle; of the drive, where there is none. */
static float measured_rpm(const struct machine *machine) {
    float rpm;
    if (!machine->interp.gcode.ports.encoder && vfd_spindle_measured_rpm(machine, &rpm))
        return rpm;
    return spindle_rev_s(&machine->drive.motion.emit.spindle, hal_time_us(machine->hal)) * 60.0f;
}

bool run_up_measured_rpm(const struct machine *machine, float *rpm) {
    *rpm = measured_rpm(machine);
    return machine->interp.gcode.ports.encoder || vfd_spindle_measured_rpm(machine, rpm);
}

static bool checks_speed(const struct machine *machine) {
    return machine->settings.at_speed_pct > 0 && asked_rpm(machine) != 0.0f &&
           (machine->interp.gcode.ports.encoder || vfd_spindle_can_measure(machine));
}

static bool is_near(const struct machine *machine) {
    const float asked = asked_rpm(machine), part = (float)machine->settings.at_speed_pct * 0.01f;
    return fabsf(measured_rpm(machine) - asked) <= part * fabsf(asked);
}

uint32_t run_up_due_us(const struct machine *machine, bool *checks) {
    const struct machine_run_up *run_up = &machine->run_up;
    *checks = run_up->due && (checks_speed(machine) || vfd_spindle_is_chosen(machine));
    return run_up->due ? left_us(machine, &run_up->turns) : 0;
}

/* A drive has confirmed its command; and where the speed is measured, it is steady. */
static bool is_ready(const struct machine *machine) {
    const struct machine_run_up *run_up = &machine->run_up;
    if (vfd_spindle_is_chosen(machine) && !vfd_spindle_is_confirmed(machine))
        return false;
    return !checks_speed(machine) || (run_up->near.on && !timer_runs(machine, &run_up->near));
}

enum run_up_state run_up_look(const struct machine *machine, uint32_t left) {
    if (left <= RUN_UP_PATIENCE_US && is_ready(machine))
        return RUN_UP_DONE;
    return left > 0 ? RUN_UP_WAITS : RUN_UP_MISSED;
}

void run_up_report_miss(struct machine *machine) {
    text_string(&machine->out, "[MSG:Spindle not at speed: ");
    text_fixed(&machine->out, (double)measured_rpm(machine), 0);
    text_string(&machine->out, " rpm measured, ");
    text_fixed(&machine->out, (double)asked_rpm(machine), 0);
    text_string(&machine->out, " rpm commanded]\r\n");
}

void run_up_return(struct machine *machine, uint32_t least_us) {
    struct machine_run_up *run_up = &machine->run_up;
    uint32_t us = run_up_due_us(machine, &run_up->checks);
    if (run_up->due && !checks_speed(machine) && machine->settings.spindle_on_delay_s <= 0.0f)
        us = least_us;
    timer_start(machine, &run_up->wait, us + (run_up->checks ? RUN_UP_PATIENCE_US : 0));
}

enum run_up_state run_up_poll(struct machine *machine) {
    struct machine_run_up *run_up = &machine->run_up;
    const uint32_t left = left_us(machine, &run_up->wait);
    enum run_up_state state = left > 0 ? RUN_UP_WAITS : RUN_UP_DONE;
    if (run_up->checks)
        state = run_up_look(machine, left);
    if (state == RUN_UP_DONE) /* a wait that `!` ends early is due again after the next `~` */
        run_up_forget(run_up);
    return state;
}

void run_up_tend(struct machine *machine) {
    struct machine_run_up *run_up = &machine->run_up;
    if (!checks_speed(machine) || !is_near(machine))
        run_up->near.on = false;
    else if (!run_up->near.on)
        timer_start(machine, &run_up->near, SPINDLE_STEADY_US);
    run_up->turns.on = timer_runs(machine, &run_up->turns);
    run_up->stops.on = timer_runs(machine, &run_up->stops);
    run_up->wait.on = timer_runs(machine, &run_up->wait);
}

uint32_t run_up_wait_us(const struct machine *machine) {
    const uint32_t left = timer_left_us(machine, &machine->run_up.wait);
    return machine->run_up.checks && left > LOOK_US && left != UINT32_MAX ? LOOK_US : left;
}
