/* SPDX-License-Identifier: MIT
 * Answers to a line: Grbl 1.1h's numbers (the contract with senders) and our words for them; from 100 on our
 * own, for what Grbl has not. */
#ifndef WIFICNC_GCODE_STATUS_H
#define WIFICNC_GCODE_STATUS_H

/* X(number, name, text) */
#define STATUS_TABLE(X)                                                                                      \
    X(0, OK, "ok")                                                                                           \
    X(1, EXPECTED_LETTER, "a letter was expected here")                                                      \
    X(2, BAD_NUMBER, "a number is missing, malformed or out of range")                                       \
    X(3, UNKNOWN_COMMAND, "unknown $ command or setting")                                                    \
    X(4, NEGATIVE, "the value must not be negative")                                                         \
    X(5, HOMING_DISABLED, "homing is not enabled ($22)")                                                     \
    X(6, STEP_PULSE_SHORT, "a step pulse must be 3 us or longer, or the board's own")                        \
    X(7, STORE_DAMAGED, "stored data is damaged: check $$ $# $N, then acknowledge with $ACK")                \
    X(8, NOT_IDLE, "only possible while idle")                                                               \
    X(9, LOCKED, "locked by an alarm or a jog")                                                              \
    X(10, SOFT_LIMIT_NEEDS_HOMING, "soft limits need homing ($22)")                                          \
    X(11, LINE_TOO_LONG, "the line has more than 256 characters, or bytes of it were lost in transfer")      \
    X(12, STEP_RATE, "the step rate is higher than this board supports")                                     \
    X(13, DOOR_OPEN, "the safety door is open")                                                              \
    X(14, STORED_LINE_TOO_LONG, "the line is too long to be stored")                                         \
    X(15, JOG_TRAVEL, "the jog target is outside the travel")                                                \
    X(16, JOG_WORD, "invalid jog: a word that $J= does not allow, or the = is missing")                      \
    X(17, LASER_NEEDS_PWM, "laser mode needs a PWM spindle output")                                          \
    X(20, UNSUPPORTED, "unsupported code or word")                                                           \
    X(21, MODAL_GROUP, "two codes of one modal group in this line")                                          \
    X(22, NO_FEED, "the feed rate is missing (F)")                                                           \
    X(23, NOT_INTEGER, "a whole number was expected")                                                        \
    X(24, AXIS_COMMANDS, "two commands in this line use axis words")                                         \
    X(25, WORD_REPEATED, "a word occurs twice in this line")                                                 \
    X(26, NO_AXIS_WORDS, "axis words are missing")                                                           \
    X(27, LINE_NUMBER, "the line number is not between 0 and 10000000")                                      \
    X(28, VALUE_MISSING, "a word that this code needs is missing")                                           \
    X(29, WCS_NUMBER, "the work coordinate system does not exist")                                           \
    X(30, G53_MOTION, "G53 needs G0 or G1")                                                                  \
    X(31, AXIS_WORDS_UNUSED, "the line has axis words that no command uses")                                 \
    X(32, ARC_NO_PLANE_AXIS, "an arc needs an axis of its plane")                                            \
    X(33, BAD_TARGET, "the target of the motion is invalid")                                                 \
    X(34, ARC_RADIUS, "the arc's radius cannot reach the target")                                            \
    X(35, ARC_NO_OFFSET, "an arc needs I, J or K of its plane")                                              \
    X(36, WORDS_UNUSED, "the line has words that no command uses")                                           \
    X(37, TOOL_LENGTH_AXIS, "the tool length offset applies to Z only")                                      \
    X(38, TOOL_NUMBER, "the tool number is too large")                                                       \
    X(100, EXPRESSION_OPERATOR, "an expression has an operator or a function that does not exist")           \
    X(101, EXPRESSION_BRACKET, "a bracket of an expression is missing")                                      \
    X(102, EXPRESSION_DIVISION, "an expression divides by zero")                                             \
    X(103, EXPRESSION_RANGE, "a function of an expression is not defined for this number")                   \
    X(104, EXPRESSION_RESULT, "the result of an expression is too large")                                    \
    X(105, EXPRESSION_DEPTH, "an expression is nested deeper than 16")                                       \
    X(110, PARAMETER_NUMBER, "the parameter number does not exist")                                          \
    X(111, PARAMETER_NAME, "a parameter's name must have 1 to 31 characters and end with >")                 \
    X(112, PARAMETER_UNSET, "this named parameter has no value yet")                                         \
    X(113, PARAMETER_READ_ONLY, "this parameter is read-only")                                               \
    X(114, PARAMETER_ROOM, "no memory for another parameter")                                                \
    X(115, PARAMETER_ASSIGNMENT, "a parameter at the beginning of a word needs =value")                      \
    X(120, O_WORD, "O words cannot run in a stream: send or expand the file with wificnc")                   \
    X(121, O_WORD_SYNTAX, "an O line is malformed: one label, one keyword, its [values] and nothing else")   \
    X(122, O_WORD_UNMATCHED, "the matching O word is missing")                                               \
    X(123, SUB_UNKNOWN, "the file has no subroutine of this name")                                           \
    X(124, SUB_REPEATED, "a subroutine of this name is already defined in the file")                         \
    X(125, SUB_ROOM, "the file has more than 64 subroutines")                                                \
    X(126, PROGRAM_DEPTH, "calls are nested deeper than 10, or loops and ifs deeper than 32")                \
    X(127, PROGRAM_ENDLESS, "the program executed more lines than allowed: check for an endless loop")       \
    X(128, PROGRAM_READ, "the program could not be read")                                                    \
    X(129, MACHINE_ONLY,                                                                                     \
      "this position, offset, mode, input or probe result is available on the machine only")                 \
    X(130, NOTHING_SAVED, "no modes were saved by M70 since the reset or M71")                               \
    X(131, NO_PORT, "this machine has no input or output of this number")                                    \
    X(132, WAIT_WORDS, "M66 takes L0 to L4; with E only L0, and a wait needs Q above 0")                     \
    X(133, ANALOG_RANGE, "an analog output takes 0 to 100 percent (Q)")                                      \
    X(134, SAVED_OVER, "a later M70, M71 or M73 replaced the modes that M73 saved here: one set is stored")  \
    X(135, NO_OUTPUT, "the board has no output for this (wificnc boards show; $91=1 accepts M7 and M8)")     \
    X(136, NO_TOOLSETTER, "the board has no tool setter input (input.toolsetter): wificnc boards show")      \
    X(140, UNREACHABLE, "the machine's arms cannot reach this point, or not on a straight line from here")   \
    X(141, PULL_OFF, "a homing pull-off ($27, $200 ..) is longer than the travel of its axis ($130 ..)")     \
    X(142, GANTRY_RACKS,                                                                                     \
      "with one switch the pull-offs of both motors ($27, $200 ..) may differ by 5 % of the travel only")    \
    X(143, NO_SECOND_MOTOR, "$210 ..: this board has no such driver to spare (wificnc boards show)")         \
    X(144, SECOND_MOTOR_ORDER, "$210 ..: only the driver of a later axis can be a second motor")             \
    X(145, SECOND_MOTOR_TAKEN, "$210 ..: this driver is the second motor of another axis already")           \
    X(146, HAS_SECOND_MOTOR, "$210 ..: this axis has a second motor by its board file")                      \
    X(147, STEP_PULSE_LONG, "the shift registers of this board make step pulses of 32 us at most")           \
    X(150, NO_ENCODER, "this needs a spindle encoder: the board has none, or $88 is 0")                      \
    X(151, SPINDLE_OFF, "this needs a running spindle: M3 or M4, and S above 0")                             \
    X(152, THREAD_PLANE, "G76 needs the ZX plane (G18)")                                                     \
    X(153, SPINDLE_TOO_FAST, "the axes cannot follow this pitch at this S, or the tapers do not fit")        \
    X(154, THREAD_KINEMATICS, "only straight axes can follow the spindle ($80)")                             \
    X(160, PWM_RANGE, "$35 must be at least 1 below $36: change the other one of them first")                \
    X(161, LASER_LEAVES_ON, "a laser ($32=1) needs $34=0: any other PWM off value would leave the beam on")  \
    X(162, PWM_IN_USE, "$33 to $36, $94 to $98 change only while spindle and laser are off: send M5 first")  \
    X(163, LASER_CURVE, "$94 to $97 must ascend: change the one that is in the way first")                   \
    X(164, PUMP_FREQUENCY, "$73: the timer of this board's charge pump does not make this frequency")        \
    X(170, PARKED,                                                                                           \
      "a parked hold takes only $J=, G38, offsets, spindle, coolant and outputs; ~ resumes the job")         \
    X(171, PARKED_PROBE, "the probe was in contact before the move, or did not find it: nothing was set")    \
    X(172, PARKED_OFFSET, "the job's line sets offsets itself when it continues: change them after it")      \
    X(173, PARKED_KINEMATICS, "in a parked hold only straight axes can be moved ($80)")                      \
    X(174, TOOL_NOT_HOMED, "this tool change ($341) moves in machine coordinates: send $H first")            \
    X(175, NO_SETTER_PLACE, "this tool change ($341) needs the place of the tool setter: store it in G59.3") \
    X(180, NOT_LOGGED_IN, "this client is not logged in, and the line had no effect (wificnc login)")        \
    X(181, OBSERVER, "another client is in control, and the line had no effect: $TAKE takes control")        \
    X(182, REPORT_INTERVAL, "$RI= takes 0 (off) or 50 to 60000 ms")                                          \
    X(183, PENDANT, "a pendant and another client cannot command together, and the line had no effect")      \
    X(184, JOG_STOPPED,                                                                                      \
      "another client or a button stopped the jog: release the key for 0.5 s, then press it again")          \
    X(190, NO_SPINDLE_BUS,                                                                                   \
      "$395: the board has no RS-485 bus for a drive ([spindle_bus]): wificnc boards show")                  \
    X(191, UNKNOWN_VFD, "$395: no spindle has this number; docs/spindles.md lists the drives")               \
    X(192, VFD_LASER, "a laser ($32=1) needs the board's PWM ($395=0); for a drive set $32=0 first")         \
    X(193, VFD_IN_USE,                                                                                       \
      "$374, $375, $395, $460 to $471, $681 change only while the spindle is off: M5 first")                 \
    X(194, DRIVER_FAULT, "a motor driver or servo reports a fault (Pn:M): correct it first, or $744, $745")  \
    X(195, NO_DRIVER, "$140 ..: this axis has no driver with registers ([driver.x]): wificnc boards show")   \
    X(196, DRIVER_CURRENT, "$140 ..: more than the sense resistor of this driver allows: $DRIVERS shows it") \
    X(197, MICROSTEPS, "$150 ..: microsteps are 1, 2, 4, 8, 16, 32, 64, 128 or 256")                         \
    X(198, STALL_SLOW, "StallGuard homing ($250 ..) needs $24, $25 and $110 .. at $260 .. or faster")        \
    X(199, NO_STALL, "StallGuard homing needs a current ($140 ..), and DIAG wired to the limit input")       \
    /* end of the table */

enum status {
#define X(number, name, text) STATUS_##name = number,
    STATUS_TABLE(X)
#undef X
};

#endif
