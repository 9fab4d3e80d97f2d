/* SPDX-License-Identifier: MIT
 * Lines with expressions and parameters, after the plain reading of them has failed: so they cost other lines
 * nothing. */
#include "machine/compute.h"

#include "machine/parts.h"
#include "machine/reach.h"

#include "gcode/formula.h"

enum status compute_line(struct machine *machine, const char *line, enum status refused) {
    const struct param_context context = {
        .gcode = &machine->interp.gcode, .params = &machine->interp.params, .line = machine->lines.count};
    struct formula formula;
    if (!formula_is(line))
        return refused;
    enum status status = formula_compute(&context, line, FORMULA_DECIMALS, &formula);
    if (status == STATUS_OK)
        status = gcode_line(&machine->interp.gcode, formula.text, &machine->task.command);
    if (status == STATUS_OK)
        /* Here, although begin_gcode() asks again: assignments of a line that is refused must not count. */
        status = reach_move(machine, &machine->task.command.move);
    if (status == STATUS_OK)
        status = params_set(&machine->interp.params, formula.sets, formula.set_count);
    return status;
}
