/* SPDX-License-Identifier: MIT
 * How often the tasks of each firmware look, and how late they may be: the firmware's own numbers, and those
 * of the PC when it runs in the times of that board (targets/pc/tasks.h).
 *
 * Lateness is what tasks and interrupts of higher priority take at a time; where a data sheet does not say so
 * it is an estimate on the safe side. */
#ifndef WIFICNC_CHIP_TASK_PERIODS_H
#define WIFICNC_CHIP_TASK_PERIODS_H

/* ESP32, -S3: two FreeRTOS tasks that sleep to the next tick when there is nothing to do (sdkconfig.defaults:
 * CONFIG_FREERTOS_HZ). The motion task has a core of its own, and is also woken when the controller has done
 * something. The controller shares its core with the network, whose tasks go first. */
enum { ESP32_MOTION_PERIOD_US = 1000, ESP32_MOTION_LATE_US = 50 };
enum { ESP32_CONTROLLER_PERIOD_US = 1000, ESP32_CONTROLLER_LATE_US = 3000 };

/* How long each of them may work without a pause (task_rest.h): it costs at most a tick in nine. A round with
 * work takes at least ESP32_ROUND_US, so the PC, where it takes no time, counts rounds. */
enum { ESP32_WORK_MAX_US = 8000, ESP32_ROUND_US = 100 };

/* PIC32MZ: one loop does all. It sleeps until the next interrupt, the tick's at the latest. */
enum { PIC32MZ_LOOP_PERIOD_US = 1000, PIC32MZ_LOOP_LATE_US = 500 };

#endif
