/* SPDX-License-Identifier: MIT
 * A spindle that is a drive on a bus. */
#include "machine/vfd_spindle.h"

#include "machine/parts.h"

#include <string.h>

bool vfd_spindle_is_chosen(const struct machine *machine) {
    return machine->settings.spindle_type != 0 && machine->board.vfd != NULL;
}

static struct vfd_config config_of(const struct machine *machine) {
    const struct settings *settings = &machine->settings;
    const struct vfd_model *model = vfd_model(settings->spindle_type);
    struct vfd_config config;
    memset(&config, 0, sizeof config); /* padding, too: configurations are compared */
    if (model == NULL)
        return config;
    config.model = settings->spindle_type;
    config.address = settings->vfd_address;
    config.format.baud = vfd_baud(model, settings->vfd_baud);
    config.format.parity = vfd_parity(model, settings->vfd_parity);
    config.timeout_ms = settings->vfd_timeout_ms;
    config.rpm_per_hz = (float)settings->vfd_rpm_per_hz;
    config.own.run_register = settings->vfd_run_register;
    config.own.set_register = settings->vfd_set_register;
    config.own.read_register = settings->vfd_read_register;
    config.own.clockwise = settings->vfd_clockwise;
    config.own.counter_clockwise = settings->vfd_counter_clockwise;
    config.own.stop = settings->vfd_stop;
    config.own.set_multiplier = settings->vfd_set_multiplier;
    config.own.set_divider = settings->vfd_set_divider;
    config.own.read_multiplier = settings->vfd_read_multiplier;
    config.own.read_divider = settings->vfd_read_divider;
    return config;
}

void vfd_spindle_configure(struct machine *machine) {
    struct machine_vfd *vfd = machine->board.vfd;
    if (vfd == NULL)
        return;
    const struct vfd_config config = config_of(machine);
    if (memcmp(&config, &vfd->drive.config, sizeof config) == 0)
        return;
    vfd->lost_told = vfd->trip.on = false;
    if (!vfd_configure(&vfd->drive, machine->hal, machine->board.bus, &config, hal_time_us(machine->hal)))
        text_string(&machine->out,
                    "[MSG:The RS-485 bus of this board does not have this format: $374, $681]\r\n");
}

bool vfd_spindle_has_setting(uint16_t number) {
    return number == SETTING_VFD_BAUD || number == SETTING_VFD_TIMEOUT_MS || number == SETTING_SPINDLE_TYPE ||
           number == SETTING_VFD_PARITY ||
           (number >= SETTING_VFD_ADDRESS && number <= SETTING_VFD_READ_DIVIDER);
}

/* As with PWM, S0 is a spindle at rest. */
void vfd_spindle_command(struct machine *machine, int direction, float rpm) {
    if (vfd_spindle_is_chosen(machine))
        vfd_command(&machine->board.vfd->drive, rpm > 0.0f ? direction : 0, rpm,
                    machine->settings.spindle_max_rpm, hal_time_us(machine->hal));
}

bool vfd_spindle_poll(struct machine *machine) {
    return vfd_spindle_is_chosen(machine) &&
           vfd_poll(&machine->board.vfd->drive, machine->hal, machine->board.bus, hal_time_us(machine->hal));
}

bool vfd_spindle_is_confirmed(const struct machine *machine) {
    return vfd_is_confirmed(&machine->board.vfd->drive);
}

bool vfd_spindle_can_measure(const struct machine *machine) {
    return vfd_spindle_is_chosen(machine) && vfd_can_measure(&machine->board.vfd->drive);
}

bool vfd_spindle_measured_rpm(const struct machine *machine, float *rpm) {
    *rpm = 0.0f;
    return vfd_spindle_is_chosen(machine) && vfd_measured_rpm(&machine->board.vfd->drive, rpm);
}

bool vfd_spindle_ampere(const struct machine *machine, float *ampere) {
    const struct machine_vfd *vfd = machine->board.vfd;
    if (!vfd_spindle_is_chosen(machine) || !vfd->drive.has_load)
        return false;
    *ampere = vfd->drive.ampere;
    return true;
}

uint32_t vfd_spindle_event_us(const struct machine *machine) {
    if (!vfd_spindle_is_chosen(machine))
        return UINT32_MAX;
    const struct vfd *drive = &machine->board.vfd->drive;
    return drive->link == VFD_LOST || vfd_is_confirmed(drive) ? UINT32_MAX : vfd_spindle_wait_us(machine);
}

uint32_t vfd_spindle_wait_us(const struct machine *machine) {
    if (!vfd_spindle_is_chosen(machine))
        return UINT32_MAX;
    return vfd_wait_us(&machine->board.vfd->drive, hal_time_us(machine->hal));
}
