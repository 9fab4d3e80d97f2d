/* SPDX-License-Identifier: MIT
 * What each line of a job asks for and gets: for `wificnc check`; where the tool has been, and what it burnt.
 *
 * Speeds come from the segments, which say where every motor is to 1/256 step when they begin and end.
 * Places are the programmed ones that the controller itself compares with the travel. */
#ifndef WIFICNC_SIM_SURVEY_H
#define WIFICNC_SIM_SURVEY_H

#include "engraving.h"
#include "host.h"
#include "sim_text.h"

/** A line of the file. Positions are machine coordinates; of a line that runs several times, all of them. */
struct survey_line {
    uint32_t line;    /* 1-based; 0: nothing is programmed here */
    uint32_t rapid;   /* 1: has a rapid */
    uint32_t at_rate; /* bit n: motor n ran at its maximum rate */
    float asked_mm_s; /* greatest feed asked for; degrees/s when only A B C move; 0: none, or inverse time */
    float reached_mm_s; /* greatest mean speed over 1.5 ms of it, or over all, counted as asked_mm_s is */
    float time_s;
    float min_mm[AXIS_COUNT], max_mm[AXIS_COUNT]; /* degrees of A B C */
};

/** An arc that was refused: error:33 or error:34. Lengths in mm. */
struct survey_arc {
    uint32_t line;
    uint32_t plane;      /* enum gcode_plane */
    uint32_t by_radius;  /* 1: R; 0: I J K */
    double unit_mm;      /* of the program's words */
    double way_mm[2];    /* from start to target, first and second axis of the plane */
    double center_mm[2]; /* I J K of these axes, from the start */
    double word_mm[2];   /* I J K of these axes, or R, as written */
};

struct survey;

/** The job begins: the next line that the controller takes is text->line_number[0]. text must live as long.
 * @param has_lines  a row for each line is wanted
 * @return NULL when memory is short */
struct survey *survey_create(struct host *host, const struct sim_text *text, bool has_lines);
void survey_destroy(struct survey *survey);

/** A line of the file was answered so, and the next one is not yet taken. */
void survey_answered(struct survey *survey, uint32_t line, int status);

/** Where the tool has been, machine coordinates, mm. */
void survey_box(const struct survey *survey, double min_mm[AXIS_COUNT], double max_mm[AXIS_COUNT]);

/** What a laser has burnt. */
const struct engraving *survey_engraving(const struct survey *survey);

/** Rows by line number: 0 .. count-1. */
size_t survey_lines(const struct survey *survey, const struct survey_line **out);
size_t survey_arcs(const struct survey *survey, const struct survey_arc **out);

#endif
