/* SPDX-License-Identifier: MIT */
#pragma once

#include "emulated.h"

#define esp_cpu_get_cycle_count emulated_cycles
