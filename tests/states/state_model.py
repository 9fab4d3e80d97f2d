"""A controller as protocol/states.toml says that it is. What is not of one cell is here: lines that wait, what is under
way across holds and doors, and which outputs the program wants."""

from __future__ import annotations

from dataclasses import dataclass, field

from wificnc.protocol.states import Input, Rule, Table

BANNER = "Grbl 1.1h"
MOVING = {"move", "probe", "jog", "home"}
PAUSES = {"pause", "tool_change"}
DOOR_ACTS = {"idle", "run", "hold", "lost", "jog"}
LOST = "[MSG:Sender lost: feed hold]"


@dataclass
class Said:
    """What an input must bring: answers exactly, messages in this order."""

    answers: list[str] = field(default_factory=list)
    says: list[str] = field(default_factory=list)
    reports: int = 0


@dataclass
class Model:
    """State, and what the table's conditions ask for."""

    table: Table
    state: str = "idle"
    activity: str = ""  # what moves, dwells, or is kept
    open_line: bool = False  # a line is not answered yet
    spindle: bool = False
    coolant: int = 0
    spindle_stopped: bool = False
    sender_held: bool = False
    pins: dict[str, bool] = field(default_factory=lambda: {"door": False, "estop": False})
    waiting: list[str] = field(default_factory=list)

    # ---- what can be seen ----

    @property
    def report(self) -> str:
        return self.table.states[self.state].report

    @property
    def moves(self) -> bool:
        return self.state in ("run", "jog", "home") and self.activity in MOVING

    @property
    def spindle_turns(self) -> bool:
        return self.spindle and not self.spindle_stopped and not self._is_suspended

    @property
    def coolant_flows(self) -> int:
        return 0 if self._is_suspended else self.coolant

    @property
    def _is_suspended(self) -> bool:
        return self.table.states[self.state].outputs == "stopped"

    # ---- what happens ----

    def apply(self, name: str) -> Said:
        """An input comes, and all that follows from it."""
        said = Said()
        entry = self.table.inputs[name]
        if entry.level is not None:
            if self.pins[entry.pin] == entry.level:
                return said
            self.pins[entry.pin] = entry.level
        self._take(entry, said)
        self._follow(said)
        return said

    def _conditions(self, name: str) -> frozenset[str]:
        found = {self.activity} & {"dwell", "probe"}
        found |= {"line open"} if self.open_line else set()
        found |= {"door open"} if self.pins["door"] else set()
        same = name in ("spindle_line", "spindle_off") and self._programmed(name) == (self.spindle, self.coolant)
        found |= {"no change"} if same else set()
        return frozenset(found | ({"outputs on"} if self.spindle or self.coolant else set()))

    def _take(self, entry: Input, said: Said) -> None:
        if entry.name == "sender_lost" and self.sender_held:
            return
        rule = self.table.cell(self.state, entry.name, self._conditions(entry.name))
        if rule.answer == "waits":
            self.waiting.append(entry.name)
            return
        said.says += [text for text in rule.says if text != "ok"]
        said.reports += rule.answer == "report"
        self._end_open_line(rule, said)
        self._answer(entry, rule, said)
        self._switch(entry, rule)
        self._go(entry, rule, said)

    def _end_open_line(self, rule: Rule, said: Said) -> None:
        """A reset and a critical alarm end the line under way; so does the end of a probe."""
        ends = BANNER in rule.says or rule.next in ("critical", "estop") or "ok" in rule.says
        if ends and self.open_line:
            said.answers.append("error:9" if rule.next in ("critical", "estop") else "ok")
            self.open_line = False
        if BANNER in rule.says:
            self.waiting.clear()

    def _answer(self, entry: Input, rule: Rule, said: Said) -> None:
        if entry.line is None or not rule.answer:
            return
        if rule.answer == "later":
            self.open_line = True
        else:
            said.answers.append("ok" if rule.answer == "list" else rule.answer)

    def _switch(self, entry: Input, rule: Rule) -> None:
        if rule.outputs == "off":
            self.spindle, self.coolant, self.spindle_stopped = False, 0, False
        elif rule.outputs == "as programmed":
            self.spindle, self.coolant = self._programmed(entry.name)
        elif rule.outputs == "toggled":
            self.coolant ^= {"flood_byte": 2, "mist_byte": 1}.get(entry.name, 0)
            if entry.name == "spindle_stop_byte" and self.spindle:
                self.spindle_stopped = not self.spindle_stopped

    def _programmed(self, name: str) -> tuple[bool, int]:
        """M3 M8 leaves the mist as it is; M5 M9 ends all."""
        return (True, self.coolant | 2) if name == "spindle_line" else (False, 0)

    def _go(self, entry: Input, rule: Rule, said: Said) -> None:
        if rule.motion in ("dropped", "halted"):
            self.activity = ""
        if entry.starts and rule.next != "unchanged" and not self.activity:
            self.activity = entry.starts
        self.sender_held |= LOST in rule.says
        if rule.next == "resume":
            self._resume(said)
        elif rule.next != "unchanged":
            self.state = rule.next
        if self.state not in ("hold", "lost", "door_open", "door_closed"):
            self.sender_held = False

    def _resume(self, said: Said) -> None:
        self.spindle_stopped = False
        if self.activity in PAUSES:
            self.activity, self.open_line = "", False
            said.answers.append("ok")
        self.state = "run" if self.activity else "idle"

    def _follow(self, said: Said) -> None:
        """Pins that still say the same, then lines that have waited."""
        if self.pins["estop"] and self.state not in ("estop", "critical"):
            self._take(self.table.inputs["estop_pressed"], said)
        if self.pins["door"] and self.state in DOOR_ACTS:
            self._take(self.table.inputs["door_opens"], said)
        while self.waiting:
            rule = self.table.cell(self.state, self.waiting[0], self._conditions(self.waiting[0]))
            if rule.answer == "waits":
                return
            self._take(self.table.inputs[self.waiting.pop(0)], said)
            self._follow(said)
