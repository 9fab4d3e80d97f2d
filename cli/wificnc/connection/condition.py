"""Why a machine does not work now, and what leads on: a status report and the controller's notices, in words. Pure.

The notices are those of core/machine/notice.c: a client gets them when it connects, and with `$I`.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass

from wificnc.connection.alarms import alarm_words
from wificnc.connection.grbl import Status
from wificnc.connection.words import NEEDS_RESET

BY_ALARM = re.compile(r"Locked by ALARM:(\d+): (.*)")
TOOL_CHANGE = re.compile(r"Tool change: T(\d+)(?: .*)?")
DAMAGED = "Stored data is damaged"
RESTARTED = re.compile(r"Restarted by (.*)")
SENDER_LOST = "Sender lost: feed hold"
PRESSED = "release the emergency stop"

UNLOCK_RESET = "check that the machine is safe, then `wificnc unlock --reset`"
HOME_OR_UNLOCK = "`wificnc home`, or `wificnc unlock` if you do not need the position"
RESUME_OR_END = (
    "`wificnc monitor` and ~ resume the program (keep the monitor open until its end);"
    " `wificnc unlock --reset` ends the program and keeps the position"
)
ACKNOWLEDGE = (
    "compare $$, $# and $N with your notes (`wificnc monitor`), send $ACK there,"
    " then `wificnc home` or `wificnc unlock`"
)

# Reported state, with its sub-state where that changes the answer: (why, what next)
STATES: dict[str, tuple[str, str]] = {
    "Hold:1": ("a feed hold: the axes slow down", "wait until they stop"),
    "Hold": ("a feed hold, or a pause of the program (M0)", RESUME_OR_END),
    "Tool": (
        "a tool change ($341): change the tool, jog and touch off",
        "`$TPW` in `wificnc monitor` measures it; " + RESUME_OR_END,
    ),
    "Door:0": ("the safety door was open; it is closed now", RESUME_OR_END),
    "Door:1": ("the safety door is open", f"close it; then {RESUME_OR_END}"),
    "Door:2": ("the safety door is open: the axes slow down", "wait until they stop, and close the door"),
    "Door:3": ("the safety door was closed: spindle and coolant start again", "wait: the program resumes then"),
    "Door": ("the safety door was opened", f"close it; then {RESUME_OR_END}"),
    "Sleep": ("the controller sleeps ($SLP)", f"`wificnc unlock --reset` wakes it; then {HOME_OR_UNLOCK}"),
    "Check": ("check mode ($C): lines are checked and nothing moves", "$C in `wificnc monitor` ends it with a reset"),
    "Alarm": ("locked; the controller does not report the cause", "check the machine, then " + HOME_OR_UNLOCK),
    "Run": ("a program is running", "wait until it ends"),
    "Jog": ("a jog is running", "wait until it ends"),
    "Home": ("homing is running", "wait until it ends"),
}
# What a notice adds to states that begin so.
HOLDS: dict[str, str] = {
    SENDER_LOST: "the connection of the sender was lost; spindle and coolant are stopped",
    "Program pause": "the program pauses (M0)",
    "Remote host released motion: ~ resumes the job": "a remote host interrupted the job and has released motion",
}
LOCKS: dict[str, tuple[str, str]] = {
    "Locked since start or reset": (
        "the machine was started or reset, and has not been homed or unlocked since",
        HOME_OR_UNLOCK,
    ),
    "Locked, check limits": (
        "a limit switch was closed when the controller started",
        "`wificnc unlock`, then `wificnc jog` away from the switch",
    ),
}
HOST_COMMANDS = "Remote host controls motion"


@dataclass(frozen=True)
class Condition:
    """Empty for a machine that is idle."""

    why: str = ""
    next: str = ""


def condition(status: Status, notices: Iterable[str] = ()) -> Condition:
    """What keeps the machine from taking commands. notices: the bodies of the controller's messages."""
    notices = list(notices)
    state = status.state if status.substate is None else f"{status.state}:{status.substate}"
    if status.state == "Idle":
        return Condition()
    if status.state == "Alarm":
        return _locked(notices)
    if HOST_COMMANDS in notices:
        return Condition("a remote host (WMC3) controls motion", "wait until it releases motion, or end it there")
    why, lead = STATES.get(state) or STATES.get(status.state) or ("", "")
    if state in ("Hold:0", "Tool"):
        why = next((words for notice in notices if (words := _held(notice))), why)
    return Condition(why, lead)


def of_alarm(code: int, way_out: str = "") -> Condition:
    """An alarm by its number. way_out: as the controller reports it, if it does."""
    why = f"ALARM:{code}: {alarm_words(code)}"
    if PRESSED in way_out:
        return Condition(why, f"{PRESSED}, then `wificnc unlock --reset` and `wificnc home`")
    if code in NEEDS_RESET:
        return Condition(why, f"{UNLOCK_RESET} and `wificnc home`")
    return Condition(why, f"check the machine, then {HOME_OR_UNLOCK}")


def _locked(notices: list[str]) -> Condition:
    for notice in notices:
        if notice.startswith(DAMAGED):
            return Condition(notice.partition(". Check")[0].replace("Stored", "stored", 1), ACKNOWLEDGE)
        if restarted := RESTARTED.fullmatch(notice):
            why = f"the controller restarted by itself ({restarted[1]}): its position is lost"
            return Condition(why, f"check the machine, then {HOME_OR_UNLOCK}")
        if by_alarm := BY_ALARM.fullmatch(notice):
            return of_alarm(int(by_alarm[1]), by_alarm[2])
        if found := LOCKS.get(notice.partition(":")[0]):
            return Condition(*found)
    return Condition(*STATES["Alarm"])


def _held(notice: str) -> str:
    if tool := TOOL_CHANGE.fullmatch(notice):
        return f"the program waits for tool T{tool[1]} (M6)"
    return HOLDS.get(notice, "")
