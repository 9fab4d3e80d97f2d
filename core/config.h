/* SPDX-License-Identifier: MIT
 * Sizes of the core's buffers. Powers of two where a ring's index is masked. */
#ifndef WIFICNC_CONFIG_H
#define WIFICNC_CONFIG_H

#define LINE_SIZE 80   /* characters of a stored line and its NUL; the 80th stored character is error:11 */
#define RX_SIZE   1024 /* bytes a character-counting sender may keep in flight */
#define PLAN_SIZE 128  /* pieces of path: look-ahead, and what may have to be planned again */
#define SEGMENT_QUEUE_SIZE 192 /* segments of a batch of motion with its stop */
#define SPAN_POOL_SIZE                                                                                       \
    448 /* spans of the motion before the step ISR, and of the batch that replaces its end */
#define FEED_SIZE          128 /* segments of a network host that wait */
#define STARTUP_LINE_COUNT 2   /* $N0, $N1 */
/* Motion that follows the spindle's encoder, 10 KB of code: a target without an encoder builds with 0. */
#ifndef WITH_ENCODER
#define WITH_ENCODER 1
#endif
/* A network host that moves the machine, 8 KB of code: a target without a network builds with 0. */
#ifndef WITH_HOST
#define WITH_HOST 1
#endif
#define PARAMS_NUMBERED 64 /* parameters among #31..#5000 that may be set */
#define PARAMS_NAMED    32 /* named parameters, local and global */

_Static_assert((PLAN_SIZE & (PLAN_SIZE - 1)) == 0, "ring index is masked");
_Static_assert(SPAN_POOL_SIZE < 65536, "an index is a half word of step.at");
_Static_assert((FEED_SIZE & (FEED_SIZE - 1)) == 0 && FEED_SIZE >= 32, "ring index is masked");
_Static_assert((RX_SIZE & (RX_SIZE - 1)) == 0, "ring index is masked");

#endif
