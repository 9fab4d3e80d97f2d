"""What an alarm means to whoever stands at the machine. The numbers are Grbl 1.1's."""

from __future__ import annotations

ALARMS: dict[int, str] = {
    1: "a limit switch was hit; the position is lost, home again",
    2: "the move would leave the travel; the position is kept",
    3: "reset while moving; the position may be lost, home again",
    4: "the probe was not in its starting state",
    5: "the probe did not touch within its travel",
    6: "homing was ended by a reset",
    7: "homing was ended by the safety door",
    8: "homing: the switch stayed closed while pulling off; raise $27 or check the wiring",
    9: "homing: no switch was found; check $23, $130.. and the wiring",
    10: "homing: the two motors of an axis did not find their switches together",
    50: "emergency stop; release it, then `wificnc unlock --reset` and home again",
    51: "the spindle did not come to a steady speed or stood still; check it and its encoder ($88), reset to go on",
    52: "the axes could not keep up with the spindle; the thread is not finished, reset to go on",
    55: "stored data is damaged; check $$ $# $N, then send $ACK",
}


def alarm_words(code: int) -> str:
    return ALARMS.get(code, "an alarm that this program does not know")
