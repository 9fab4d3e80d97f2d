/* SPDX-License-Identifier: MIT */
#include "clearance.h"

#include <math.h>
#include <string.h>

void clearance_clear(struct clearance *clearance, unsigned joints) {
    *clearance = (struct clearance){.joints = joints};
}

void clearance_begin(struct clearance *clearance, const double *stands, const double *command) {
    for (unsigned joint = 0; joint < clearance->joints; joint++)
        clearance->offset[joint] = stands[joint] - command[joint];
    memcpy(clearance->command, command, clearance->joints * sizeof *command);
    clearance->follows = true;
}

static double size_of(const struct clearance *clearance) {
    double sum = 0.0;
    for (unsigned joint = 0; joint < clearance->joints; joint++)
        sum += clearance->offset[joint] * clearance->offset[joint];
    return sqrt(sum);
}

void clearance_shift(struct clearance *clearance, const double *believed, const double *stands) {
    if (size_of(clearance) == 0.0)
        return;
    for (unsigned joint = 0; joint < clearance->joints; joint++)
        clearance->offset[joint] += stands[joint] - believed[joint];
}

void clearance_follow(struct clearance *clearance, const double *command, double *wanted) {
    double size = size_of(clearance);
    if (clearance->follows && size > 0.0) {
        double back = 0.0;
        for (unsigned joint = 0; joint < clearance->joints; joint++)
            back += (command[joint] - clearance->command[joint]) * clearance->offset[joint] / size;
        double left = fmax(0.0, size - fmax(0.0, back)) / size;
        for (unsigned joint = 0; joint < clearance->joints; joint++)
            clearance->offset[joint] *= left;
    }
    memcpy(clearance->command, command, clearance->joints * sizeof *command);
    clearance->follows = true;
    for (unsigned joint = 0; joint < clearance->joints; joint++)
        wanted[joint] = command[joint] + clearance->offset[joint];
}
