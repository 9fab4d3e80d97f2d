/* SPDX-License-Identifier: MIT
 * A program that can be read at any place: O words (sub, call, if, while, repeat ...) -> the lines to
 * execute, one after the other. [task] No allocation; a call reads until the next line that is not an O word.
 *
 *   program_begin()   reads the file once and notes its subroutines
 *   program_next()    the next line, with its expressions; the caller computes it (formula.h), takes its
 *                     assignments and carries it out, then asks for the next one
 *   program_note()    what the line was about, as far as the program must know
 *
 * So conditions see what the lines before them have done. M2 and M30 end a program: the caller stops asking.
 * So does the % that closes it (program_end.h): what follows is no part of it. Lines end with LF, CR or CR
 * LF. Comments, blanks, and lines with % are left out, as in input/line_reader.h; a
 * line may be longer than one of a stream.
 *
 * Subroutines may come before or after their calls, not inside each other. A loop or an if and its end
 * stand in the same subroutine (or both in none). */
#ifndef WIFICNC_SIM_PROGRAM_H
#define WIFICNC_SIM_PROGRAM_H

#include "config.h"
#include "gcode/params.h"
#include "gcode/readings.h"
#include "program_end.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum {
    PROGRAM_LINE_SIZE = LINE_SIZE, /* characters of a line, without blanks and comments, and its NUL */
    PROGRAM_LABEL_SIZE = 32,       /* of the name or number behind O, and its NUL */
    PROGRAM_SUBS_MAX = 64,         /* subroutines of a file */
    PROGRAM_CALLS_MAX = 10,        /* calls inside each other */
    PROGRAM_BLOCKS_MAX = 32,       /* loops and ifs inside each other, over all calls */
    PROGRAM_CHUNK_SIZE = 128,      /* bytes that are asked for at the same time */
};

/** Where the text is. */
struct program_source {
    const void *ctx;
    /** Put up to `size` bytes from `offset` on into `bytes`.
     *  @return how many, 0 at the end of the text, < 0 when it cannot be read */
    int32_t (*read)(const void *ctx, uint32_t offset, char *bytes, uint32_t size);
};

enum program_result {
    PROGRAM_LINE,   /* program->text is the next line, program->line its number */
    PROGRAM_DONE,   /* the text has ended */
    PROGRAM_FAILED, /* program->status says why, in line program->line; only program_begin() helps */
};

/** A place in the text. */
struct program_at {
    uint32_t offset; /* bytes */
    uint32_t line;   /* of the line that begins there, 1-based */
};

struct program_label {
    char text[PROGRAM_LABEL_SIZE]; /* 100, or A NAME in upper case without its < > */
};

struct program_sub {
    struct program_label label;
    struct program_at body, after; /* behind its SUB line, behind its ENDSUB line */
};

struct program_block {
    struct program_label label;
    uint8_t kind;
    uint32_t left;          /* REPEAT: how often after this time */
    struct program_at from; /* WHILE: the line itself; DO, REPEAT: the one behind it */
    uint32_t line;          /* where it was opened */
};

struct program_call {
    const struct program_sub *sub;
    struct program_at back;
    uint8_t blocks;             /* open ones of the caller */
    uint32_t saved;             /* M73 in it: program.saves then; 0: none */
    double local[PARAMS_LOCAL]; /* #1..#30 of the caller */
};

struct program {
    /* for the caller */
    char text[PROGRAM_LINE_SIZE];
    uint32_t line;
    enum status status;
    bool has_message; /* the line has a comment for the operator; text may be empty then */
    bool has_values;  /* ... with parameters in it */
    /* private */
    struct program_source source;
    struct program_at at, next; /* the line that was read last, the one behind it */
    uint32_t end;               /* offset of the % that closes the program; UINT32_MAX: none */
    uint32_t lines_left;
    char chunk[PROGRAM_CHUNK_SIZE];
    uint32_t chunk_offset, chunk_count;
    uint8_t sub_count, block_count, call_count;
    uint32_t saves; /* M70, M71 and M73 so far */
    bool restores;  /* a line M72 comes next */
    struct program_sub subs[PROGRAM_SUBS_MAX];
    struct program_block blocks[PROGRAM_BLOCKS_MAX];
    struct program_call calls[PROGRAM_CALLS_MAX];
};

/** Read the text once and stand at its beginning.
 *  @param lines_max  so many lines may be executed, O words included, against endless loops
 *  @return STATUS_OK, or program->status with the number of the line in program->line */
enum status program_begin(struct program *program, const struct program_source *source, uint32_t lines_max);

/** Continue to the next line to execute. Calls and returns exchange #1..#30 and the local names in `params`;
 *  `gcode` is what conditions read (#5420, #<_metric> ...), but for what is `unknown` (NEEDS_ bits). */
enum program_result program_next(struct program *program, struct params *params,
                                 const struct gcode_state *gcode, uint32_t unknown);

/** The line was carried out: M73 in a subroutine makes it end with a line M72. @param modes  of its command
 */
void program_note(struct program *program, enum gcode_modes modes);

/** After the last line: note what of the file is not run. Lines of subroutines count only after a closing %.
 *  @param ends  the line that was read last is M2 or M30; of one in a loop, an if or a subroutine nothing is
 *               noted, as what follows it may have run */
void program_note_end(struct program *program, bool ends, struct program_end *out);

/** The filtered line is an O line, well formed: a stream cannot carry it out, a program can. */
bool program_is_jump(const char *line);

#endif
