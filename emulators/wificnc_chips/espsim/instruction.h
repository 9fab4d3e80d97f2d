/* SPDX-License-Identifier: MIT
 * What the decoder and the loop share: the kinds of instructions. */
#ifndef WIFICNC_ESPSIM_INSTRUCTION_H
#define WIFICNC_ESPSIM_INSTRUCTION_H

#include "esp.h"

/* The first three are none: not decoded yet, es_stop_at(), a function of the boot ROM. */
enum kind {
    OP_NONE,
    OP_PLACE,
    OP_ROM,
#define OP(name, registers, ...) OP_##name,
#include "instructions.def"
#undef OP
    KINDS
};

/* Fields that name address registers. */
enum { IR = 1, IS = 2, IT = 4 };

/* Fields of an instruction of 24 bits; the first three are those of 16 bits, too. */
#define FIELD_OP0 (word & 15)
#define FIELD_T   (word >> 4 & 15)
#define FIELD_S   (word >> 8 & 15)
#define FIELD_R   (word >> 12 & 15)
#define FIELD_OP1 (word >> 16 & 15)
#define FIELD_OP2 (word >> 20 & 15)

#endif
