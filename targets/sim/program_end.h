/* SPDX-License-Identifier: MIT
 * Where a program ends in its file: at M2 or M30, or at the % that closes it (RS274/NGC 3.6.1), which is any
 * lone % after the first line with code. What follows is not run: it is counted, and looked at for the
 * beginning of another program. cli/wificnc/job/ending.py and web/src/job/ending.ts are the same in their
 * languages; protocol/vectors/program_end.json binds the three. M[1+1] is an end, too; M#1 and M[SQRT[4]] are
 * for the controller to compute, which ends the program there and executes the lines after it. Pure. */
#ifndef WIFICNC_SIM_PROGRAM_END_H
#define WIFICNC_SIM_PROGRAM_END_H

#include <stdbool.h>
#include <stdint.h>

/** All zero at the beginning of a file. Lines are 1-based in the file; 0 = none. */
struct program_end {
    uint32_t line;   /* the M2, M30 or % that ends the program */
    uint32_t unrun;  /* lines with code after it, from `first` on */
    uint32_t first;  /* the first line after it that is more than an M2 or M30 */
    uint32_t second; /* where another program begins */
    /* private */
    uint32_t mark; /* the first % or program number after the end, before `first` */
    uint8_t has_code, is_open;
};

/** The next line of the file. @param line  filtered: no blanks and comments, upper case
 *  @return whether it belongs to the program; its end does */
bool program_end_take(struct program_end *end, const char *line, uint32_t number);

/** The line is a lone %, with or without an N word. */
bool program_end_is_percent(const char *line);

#endif
