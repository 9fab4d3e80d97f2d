/* SPDX-License-Identifier: MIT */
#include "status_text.h"

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
