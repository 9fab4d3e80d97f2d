/* SPDX-License-Identifier: MIT
 * One machine: owns every part, moves bytes to steps by polling, answers every line once. [task]
 *
 *   bytes -> rx -> line reader -> command ($) or G-code -> task (stages) ->
 *   motion -> segment ring -> prep -> step ISR
 *
 * Nothing here blocks. A line that must wait (look-ahead full, dwell, M0) stays the current task; each poll
 * carries it on as far as it goes, and the next line is not read before it is answered. */
#ifndef WIFICNC_MACHINE_MACHINE_H
#define WIFICNC_MACHINE_MACHINE_H

#include "input/text.h"
#include "machine/board.h"
#include "machine/states.h"

struct hal_step;
struct machine;
struct rx;
struct settings;
struct step;

/** Power-on: what was kept or defaults, position 0, banner. `out`, `hal` and the store must live as long as
 * the machine. */
void machine_init(struct machine *machine, const struct machine_board *board, struct hal *hal,
                  struct hal_step *hal_step, const struct text_out *out);

/** Carry everything on as far as it goes now. @return true when anything was done. */
bool machine_poll(struct machine *machine);

/** [motion side] Where board.motion_side is set: cut segments into spans and start the step timer. Call it
 * every ms. Everything else of the machine belongs to the task of machine_poll(). @return true when anything
 * was done. */
bool machine_poll_motion(struct machine *machine);

/** [isr or task] A limit, home or e-stop line has changed. Halts the step ISR when it must stop immediately,
 * and remembers the exact step. On the ISR's core, never nested into it. */
void machine_edge_isr(struct machine *machine);

/** [isr] The time of hal_switch_timer_start() is over. As machine_edge_isr(). */
void machine_switch_timer_isr(struct machine *machine);

/** Poll again after this many us at the latest, even if nothing happens. @return UINT32_MAX: no need */
uint32_t machine_wait_us(const struct machine *machine);

/** As machine_wait_us(), but without what never ends: looks at a spindle's drive that has confirmed all it
 * was commanded, and automatic reports. */
uint32_t machine_event_us(const struct machine *machine);

/** The connection of the sender that commands the text side has ended, in whatever way: a jog is cancelled, a
 * program is held, spindle and coolant stop. Lines of others are read as ever after `~` or a reset. To be
 * called by every target that can see the end of a connection.
 *  @param lines_wait  whole lines of it are still on their way to the machine */
void machine_sender_lost(struct machine *machine, bool lines_wait);

/** A stop or a reset, of which the machine hears next, is not of the one who jogs, but of another client or
 * host, or of a button. A key that is held sends one jog behind the other: they are refused until none has
 * come for 0.5 s. */
void machine_stopped_by_other(struct machine *machine);

/** Nothing more comes for now: planned moves start without waiting for look-ahead. */
void machine_input_pause(struct machine *machine);

/** Speed of the tool, of the motion that is on the pins now. */
float machine_speed_mm_s(const struct machine *machine);

/** No pulse is on its way to the pins; moves may be planned, as in a hold. While a motion side of its own is
 * at work, also false when it only looks around: ask again. */
bool machine_is_standing(const struct machine *machine);

/** No motion planned, queued or being stepped. */
bool machine_is_at_rest(const struct machine *machine);

/** For a client that connects, each the text of a [MSG:]: stored data that is damaged, which alarm has
 * locked the machine and what ends it, a job that is held because its sender was lost or that pauses, a
 * remote host that commands. @param number  0, 1, .. until it returns false: nothing more, and text is empty
 */
bool machine_notice(const struct machine *machine, unsigned number, char *text, size_t size);

/** What is printed at a start, and after a reset. */
#define MACHINE_BANNER "\r\nGrbl 1.1h ['$' for help]\r\n"

enum machine_state machine_state(const struct machine *machine);

/** The newest; ALARM_NONE after a reset. */
enum alarm machine_alarm(const struct machine *machine);

/** Axes that were homed, and not stopped without a ramp since. */
axis_mask_t machine_homed(const struct machine *machine);

/** Axes that home at this moment. */
axis_mask_t machine_homes(const struct machine *machine);

/** Times that motion was stopped without a ramp; wraps. */
uint8_t machine_position_losses(const struct machine *machine);

/** A line was taken and is not done yet. */
bool machine_has_line(const struct machine *machine);

/** S of the program, rpm. */
float machine_program_rpm(const struct machine *machine);

/** The spindle has an encoder, and $88 is set. */
bool machine_has_encoder(const struct machine *machine);

const struct machine_board *machine_board(const struct machine *machine);
const struct settings *machine_settings(const struct machine *machine);
struct hal *machine_hal(const struct machine *machine);

/** Where bytes of the text side go. */
struct rx *machine_rx(struct machine *machine);

/** For the target's step engine. */
struct step *machine_step(struct machine *machine);

/** State as reports show it, with its sub-state: "Idle", "Hold:1", "Door:0". */
const char *machine_state_text(const struct machine *machine);

/** Length of a step pulse in force: the board's, or $0. */
uint32_t machine_step_pulse_ns(const struct machine *machine);

/** Steps that have left the pins. */
void machine_position(const struct machine *machine, int32_t steps[AXIS_COUNT]);

#endif
