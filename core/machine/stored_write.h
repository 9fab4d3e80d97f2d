/* SPDX-License-Identifier: MIT
 * Writes to the store, one at a time. All values of a write are one transaction: a power cut leaves all of
 * them old or all of them new.
 *
 *   stored_save() --> copy of damaged data --> batch --> "Not stored", if so --> what follows --> ok
 *
 * The store of a chip may take 50 ms and writes while the program runs: stored_poll() looks how far it is. As
 * long as it is busy no further line begins; real-time bytes, switches and motion are served as ever. [task]
 */
#ifndef WIFICNC_MACHINE_STORED_WRITE_H
#define WIFICNC_MACHINE_STORED_WRITE_H

#include "machine/machine.h"

/** A write is under way: no further line may begin, and nothing else may be stored. */
bool stored_is_busy(const struct machine *machine);

/** @return true when a write has come further */
bool stored_poll(struct machine *machine);

/** What is in force now. @param keys  STORED_BIT()s; they are stored together
 * @return false: not stored, and the text side got a message */
bool stored_save(struct machine *machine, unsigned keys);

struct tool_note_edit;

/** The same, and the note of a tool among them (tool_notes.h). */
void stored_save_note(struct machine *machine, unsigned keys, const struct tool_note_edit *edit);

/** The line of $Nx= that was just executed. */
void stored_startup(struct machine *machine);

/** The user has seen what is damaged: what is in force now is stored in place of it. */
void stored_acknowledge(struct machine *machine);

/** Also acknowledges damage; a reset follows. */
void stored_defaults(struct machine *machine, unsigned keys);

#endif
