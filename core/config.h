/* SPDX-License-Identifier: MIT
 * Sizes of the core's buffers, the same on every chip; the look-ahead follows the chip (hal/core_sizes.h).
 * Powers of two where a ring's index is masked. */
#ifndef WIFICNC_CONFIG_H
#define WIFICNC_CONFIG_H

#define LINE_SIZE          257 /* characters of a line and its NUL; one character more is error:11 */
#define LINE_COMMENT_SIZE  80  /* characters of a line's comment that messages show */
#define GRBL_LINE_SIZE     80  /* the same of Grbl's: what $N0= and $I= store, and lines for any controller */
#define RX_SIZE            2048 /* bytes a character-counting sender may keep in flight */
#define SEGMENT_QUEUE_SIZE 192  /* segments of a batch of motion with its stop */
#define SPAN_POOL_SIZE                                                                                       \
    448 /* spans of the motion before the step ISR, and of the batch that replaces its end */
#define HISTORY_SIZE       64  /* samples of the path that a shaper may look at, and some that it does not */
#define HOST_QUEUE_SIZE    128 /* segments of a network host that wait */
#define STARTUP_LINE_COUNT 2   /* $N0, $N1 */
/* Motion that follows the spindle's encoder, 10 KB of code: a target without an encoder builds with 0. */
#ifndef WITH_ENCODER
#define WITH_ENCODER 1
#endif
/* A network host that moves the machine, 8 KB of code: a target without a network builds with 0. */
#ifndef WITH_HOST
#define WITH_HOST 1
#endif
#define PARAMS_NUMBERED 256 /* parameters among #31..#5000 that may be set */
#define PARAMS_NAMED    32  /* named parameters, local and global */

_Static_assert(SPAN_POOL_SIZE < 65536, "an index is a half word of step.at");
_Static_assert((HOST_QUEUE_SIZE & (HOST_QUEUE_SIZE - 1)) == 0 && HOST_QUEUE_SIZE >= 32,
               "ring index is masked");
_Static_assert((HISTORY_SIZE & (HISTORY_SIZE - 1)) == 0, "ring index is masked");
_Static_assert((RX_SIZE & (RX_SIZE - 1)) == 0, "ring index is masked");

#endif
