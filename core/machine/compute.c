/* SPDX-License-Identifier: MIT
 * Lines with expressions and parameters, after the plain reading of them has failed: so they cost other lines
 * nothing. */
#include "machine/inner.h"

#include "gcode/formula.h"

enum status compute_line(struct machine *machine, const char *line, enum status refused) {
    const struct param_context context = {
        .gcode = &machine->gcode, .params = &machine->params, .line = machine->lines};
    struct formula formula;
    if (!formula_is(line))
        return refused;
    enum status status = formula_compute(&context, line, FORMULA_DECIMALS, &formula);
    if (status == STATUS_OK)
        status = gcode_line(&machine->gcode, formula.text, &machine->command);
    if (status == STATUS_OK)
        status = reach_move(machine, &machine->command.move);
    if (status == STATUS_OK)
        status = params_set(&machine->params, formula.sets, formula.set_count);
    return status;
}
