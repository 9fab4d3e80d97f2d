/* SPDX-License-Identifier: MIT */
#include "gcode/status.h"

const char *status_text(enum status status) {
    switch (status) {
#define X(number, name, text)                                                                                \
    case STATUS_##name:                                                                                      \
        return text;
        STATUS_TABLE(X)
#undef X
    }
    return "unknown status";
}
