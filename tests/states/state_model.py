"""A controller as protocol/states.toml says that it is. What is not of one cell is here: lines that wait, what is under
way across holds and doors, and which outputs the program wants."""

from __future__ import annotations

from dataclasses import dataclass, field

from generate.states_table import Input, Rule, Table

BANNER = "Grbl 1.1h"
MOVING = {"move", "probe", "jog", "home"}
PAUSES = {"pause", "tool_change"}
STOPS = ("hold_byte", "hold_button", "cancel_byte", "host_hold", "other_host_hold")
PARKED = ("parked", "parked_moves")
DOOR_ACTS = {"idle", "run", "hold", "lost", "jog", "returned", "host_run", "host_hold", "host_jog", *PARKED}
STOPPED = "[MSG:Stopped: the sender's lines wait for ~]"
JOG_STOPS = ("hold_byte", "hold_button", "cancel_byte", "host_hold", "other_host_hold")
LOST = "[MSG:Sender lost: feed hold]"
HOST_RPM, TEXT_RPM = 900, 500
HELD_BACK = (
    *("hold", "lost", "door_open", "door_closed", "returned", "host_hold", "host_door_open", "host_door_closed"),
    *PARKED,
)


@dataclass
class Said:
    """What an input must bring: answers exactly, messages in this order."""

    answers: list[str] = field(default_factory=list)
    says: list[str] = field(default_factory=list)
    reports: int = 0
    reply: str = ""  # to a packet


def ordered(entry: Input, rule: Rule) -> list[str]:
    """The messages in their order, with the answer of a line at its place."""
    if entry.line is None or not rule.says:
        return [text for text in rule.says if text != "ok"]
    return ["ok\r" if text == "ok" else text for text in rule.order if text != "later"]


@dataclass
class Model:
    """State, and what the table's conditions ask for."""

    table: Table
    state: str = "idle"
    activity: str = ""  # what moves, dwells, or is kept
    open_line: bool = False  # a line is not answered yet
    opened: str = ""  # the newest such line
    spindle: bool = False
    coolant: int = 0
    spindle_stopped: bool = False
    sender_held: bool = False
    pins: dict[str, bool] = field(default_factory=lambda: {"door": False, "estop": False})
    waiting: list[str] = field(default_factory=list)
    rpm: int = TEXT_RPM
    segments: bool = False  # of a remote host are queued
    job: bool = False  # it has interrupted what `activity` says
    stream_open: bool = False
    stream_known: bool = False
    taken: bool = False  # it commands as long as it is there
    host_on: bool = False  # what it asked for last: spindle and flood on
    locked_before: bool = False
    sender_gone: bool = False  # while a host commanded
    parked: bool = False  # the job waits for the operator, also behind a door or without a sender
    probes: bool = False  # the operator, whose line is open
    lines_ended: bool = False  # a ~ has ended the operator's lines, or the sender was lost
    resumes: bool = False  # ~ waits for the end of the operator's motion
    suspended: bool = False  # parked with spindle and coolant still stopped by what was before
    refused: bool = False  # ... and are, as the sender was lost
    aside: list[str] = field(default_factory=list)  # lines of the operator that wait
    stopped: int = 0  # the first of these came before a stop, which begins none of them
    jobs: tuple[bool, int, int] = (False, 0, TEXT_RPM)  # spindle, coolant and rpm that it gets back

    # ---- what can be seen ----

    @property
    def report(self) -> str:
        return self.table.states[self.state].report

    @property
    def moves(self) -> bool:
        if self.state == "host_run":
            return self.segments
        if self.state == "parked_moves":
            return True
        return self.state in ("run", "jog", "home", "host_jog", "host_home") and self.activity in MOVING

    @property
    def spindle_turns(self) -> bool:
        return self.spindle and not self.spindle_stopped and not self._is_suspended

    @property
    def coolant_flows(self) -> int:
        return 0 if self._is_suspended else self.coolant

    @property
    def _is_suspended(self) -> bool:
        return self.table.states[self.state].outputs == "stopped" or (self.state in PARKED and self.suspended)

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

    def rule(self, name: str) -> Rule:
        """What the table says of an input now."""
        return self.table.cell(self.state, name, self._conditions(name))

    def _conditions(self, name: str) -> frozenset[str]:
        found = {self.activity} & {"dwell", "probe"}
        found |= {"line open"} if self.open_line else set()
        found |= {"probe line open"} if self.open_line and self.opened == "probe" else set()
        found |= {"door open"} if self.pins["door"] else set()
        same = name in ("spindle_line", "spindle_off") and self._programmed(name) == (self.spindle, self.coolant)
        same |= name in ("host_outputs", "host_outputs_off") and (name == "host_outputs") == self.host_on
        found |= {"no change"} if same else set()
        found |= {"outputs on"} if self.spindle or self.coolant else set()
        return frozenset(found | self._host_conditions() | self._park_conditions())

    def _park_conditions(self) -> set[str]:
        found = {"parked"} if self.parked else set()
        found |= {"operator probes"} if self.probes else set()
        found |= {"operator waits"} if self.aside else set()
        found |= {"lines ended"} if self.lines_ended else set()
        left = self.lines_ended and (self.resumes or self.aside or self.probes)
        return found | ({"lines left"} if left else set())

    def _host_conditions(self) -> set[str]:
        found = {"stream known"} if self.stream_known else set()
        found |= {"stream open"} if self.stream_open else set()
        found |= {"something kept"} if self.activity or self.open_line else set()
        found |= {"job waits"} if self.job else set()
        found |= {"locked before"} if self.locked_before else set()
        found |= {"host's outputs on"} if self._drives else set()
        return found | ({"host commands"} if self._commands else set())

    @property
    def _owned(self) -> bool:
        return self.table.states[self.state].owned

    @property
    def _drives(self) -> bool:
        """Spindle or flood are on because the host has said so, and are not a job's."""
        own = self.host_on and ((self.spindle and self.rpm == HOST_RPM) or bool(self.coolant & 2))
        return own and (self._owned or not (self.activity or self.open_line))

    @property
    def _commands(self) -> bool:
        return self._owned or self.stream_open or self._drives or self.taken

    def _take(self, entry: Input, said: Said) -> None:
        if entry.name == "sender_lost" and self.sender_held:
            return
        if entry.name == "sender_lost" and self._owned:
            self.sender_gone = True
            return
        rule = self.rule(entry.name)
        behind = bool(self.aside) and entry.line is not None and self.state in PARKED and not self.lines_ended
        if rule.answer == "waits" or behind:
            (self.aside if self.parked and not self.lines_ended else self.waiting).append(entry.name)
            return
        said.says += ordered(entry, rule)
        said.reports += rule.answer == "report"
        said.reply = rule.answer if entry.packets or entry.event == "pendant_line" else said.reply
        locked = self.state == "alarm" or (self.state in ("critical", "estop") and self.locked_before)
        self._end_open_line(entry, rule, said)
        self._answer(entry, rule, said)
        self._park(entry, rule)
        if entry.name in STOPS and self.parked:
            self.stopped = len(self.aside)
        self._switch(entry, rule)
        self._go(entry, rule, said)
        self._follow_host(entry, rule)
        if rule.next in ("critical", "estop"):
            self.locked_before = locked

    def _follow_host(self, entry: Input, rule: Rule) -> None:
        """Streams, and what is queued of them."""
        done = entry.packets and rule.answer == "done"
        if rule.motion in ("dropped", "halted"):
            self.segments = False
        if entry.name == "host_segments":
            self.segments |= bool(done)
            self.stream_open &= bool(done)
        elif done and entry.name == "host_opens":
            self.stream_open = self.stream_known = True
        elif (
            rule.motion == "halted"
            or entry.name == "host_lost"
            or (done and entry.name in ("host_closes", "host_drops"))
        ):
            self.stream_open = False
        self.taken = entry.name != "host_lost" and (self.taken or entry.name == "host_takes")
        if entry.name == "host_lost" and rule.outputs == "host's off":
            self.host_on = False
        elif done and entry.name in ("host_outputs", "host_outputs_off"):
            self.host_on = entry.name == "host_outputs"

    def _end_open_line(self, entry: Input, rule: Rule, said: Said) -> None:
        """A reset and a critical alarm end the line under way; so does the end of a probe."""
        if self.probes and entry.line is None:
            self._end_probe(rule, said)
            if "[PRB:" in rule.says:
                return
        ends = BANNER in rule.says or rule.next in ("critical", "estop") or (entry.line is None and "ok" in rule.says)
        if ends and self.open_line:
            said.answers.append("error:9" if rule.next in ("critical", "estop") else "ok")
            self.open_line = False
        if BANNER in rule.says:
            self.waiting.clear()
            self.sender_gone = False

    def _end_probe(self, rule: Rule, said: Said) -> None:
        """That of the operator: found, missed, or ended with the job."""
        answers = [text for text in rule.says if text in ("ok", "error:171")]
        if BANNER in rule.says or rule.next in ("critical", "estop"):
            answers = ["error:9"]
        said.answers += answers
        self.probes = not answers

    def _park(self, entry: Input, rule: Rule) -> None:
        """The operator's hold begins, changes hands and ends."""
        if rule.next == "parked" and not self.parked:
            self.jobs = self.spindle, self.coolant, self.rpm
            self.parked, self.suspended, self.lines_ended = True, False, False
        if not self.parked:
            return
        if rule.next == "parked" and entry.name == "park_byte":
            self.suspended |= self.table.states[self.state].outputs == "stopped"
            self.sender_held = False
        if entry.name == "park_byte" and "[MSG:Parked" in " ".join(rule.says):
            self.lines_ended = False
        self.suspended &= rule.outputs != "restored"
        resumes = entry.name in ("resume_byte", "start_button") or (
            entry.name == "host_resume" and rule.answer == "done"
        )
        self.lines_ended |= resumes or entry.name == "sender_lost"
        self.resumes = (self.resumes or (resumes and self.state == "parked_moves")) and rule.motion != "dropped"
        self.refused |= entry.name == "sender_lost"
        if rule.next in ("critical", "estop"):
            self.waiting += self.aside
        if rule.motion == "halted":
            self._unpark()

    def _unpark(self) -> None:
        self.parked = self.probes = self.lines_ended = self.resumes = self.suspended = self.refused = False
        self.aside.clear()

    def _answer(self, entry: Input, rule: Rule, said: Said) -> None:
        if entry.line is None or not rule.answer:
            return
        if rule.answer == "later" and self.parked:
            self.probes = True
        elif rule.answer == "later":
            self.open_line, self.opened = True, entry.name
        else:
            said.answers.append("ok" if rule.answer == "list" else rule.answer)

    def _switch(self, entry: Input, rule: Rule) -> None:
        if rule.outputs == "off":
            self.spindle, self.coolant, self.spindle_stopped = False, 0, False
        elif rule.outputs == "as commanded":
            self._switch_for_host(entry.name == "host_outputs")
        elif rule.outputs == "host's off":
            self.spindle &= self.rpm != HOST_RPM
            self.coolant &= ~2
        elif rule.outputs == "as programmed":
            self.spindle, self.coolant = self._programmed(entry.name)
            self.rpm = TEXT_RPM if self.spindle else self.rpm
        elif rule.outputs == "toggled":
            self.coolant ^= {"flood_byte": 2, "mist_byte": 1}.get(entry.name, 0)
            self._keep_coolant({"flood_byte": 2, "mist_byte": 1}.get(entry.name, 0))
            if entry.name == "spindle_stop_byte" and self.spindle and not self._is_suspended:
                self.spindle_stopped = not self.spindle_stopped

    def _keep_coolant(self, bit: int) -> None:
        """A key counts for the job that waits."""
        spindle, coolant, rpm = self.jobs
        self.jobs = spindle, coolant & ~bit | self.coolant & bit, rpm

    def _switch_for_host(self, on: bool) -> None:
        """With motion of its own it commands all, else what has changed."""
        self.spindle, self.rpm = on, HOST_RPM if on else 0
        kept = 0 if self._owned else self.coolant & 1
        self.coolant = kept | (2 if on else 0)
        if not on:
            self.jobs = False, self.jobs[1] & 1, self.jobs[2]

    def _programmed(self, name: str) -> tuple[bool, int]:
        """M3 M8 leaves the mist as it is; M5 M9 ends all."""
        return (True, self.coolant | 2) if name == "spindle_line" else (False, 0)

    def _go(self, entry: Input, rule: Rule, said: Said) -> None:
        if rule.motion == "halted" or (rule.motion == "dropped" and not self.job and not self.parked):
            self.activity, self.job = "", False
        if rule.next in ("host_run", "returned") and self.state == "run":
            self.job = True
        if entry.starts and rule.next != "unchanged" and not self.activity and not self.parked:
            self.activity = entry.starts
        self.sender_held |= LOST in rule.says
        if rule.next == "resume":
            self._resume(said)
        elif rule.next == "release":
            self.state = self._released(held=entry.name == "host_lost")
            if entry.name in JOG_STOPS and self.state == "idle" and self.waiting:
                self.state = "hold"
                said.says.append(STOPPED)
        elif rule.next != "unchanged":
            self.state = rule.next
        if self.state not in HELD_BACK:
            self.sender_held = False
        if self.state not in HELD_BACK:
            self.spindle_stopped = False

    def _released(self, held: bool) -> str:
        """The state after the host has given motion back."""
        if self.state == "host_jog" or (self.state == "host_run" and not held):
            return "returned" if self.job else "idle"
        held_state = "returned" if self.job else "hold"
        behind = {"host_hold": held_state, "host_run": held_state}
        return behind.get(self.state, self.state.removeprefix("host_"))

    def _resume(self, said: Said) -> None:
        self.spindle_stopped = self.job = False
        if self.parked:
            self.spindle, self.coolant, self.rpm = self.jobs
            self._unpark()
        if self.activity in PAUSES:
            self.activity, self.open_line = "", False
            said.answers.append("ok")
        self.state = "run" if self.activity else "idle"

    def _lose_late(self, said: Said) -> None:
        """The host has given motion back, and the sender was lost meanwhile: what would continue is held."""
        self.sender_gone = False
        if self.state == "idle" and self.waiting and not (self.spindle or self.coolant):
            self.state, self.sender_held = "lost", True
            said.says.append(LOST)
        else:
            self._take(self.table.inputs["sender_lost"], said)

    def _refuse_stopped(self, said: Said) -> bool:
        """G-code that waited for the end of a motion does not begin by its stop."""
        is_stopped, line = self.stopped > 0, self.table.inputs[self.aside[0]].line
        self.stopped -= is_stopped
        if not is_stopped or not line or line.startswith("$"):
            return False
        self.aside.pop(0)
        said.answers.append("error:9")
        return True

    def _follow(self, said: Said) -> None:
        """Pins that still say the same, then lines that have waited."""
        if self.pins["estop"] and self.state not in ("estop", "critical"):
            self._take(self.table.inputs["estop_pressed"], said)
        if self.pins["door"] and self.state in DOOR_ACTS:
            self._take(self.table.inputs["door_opens"], said)
        if self.sender_gone and not self._owned:
            self._lose_late(said)
        if self.refused and self.state in (*PARKED, "lost"):
            said.answers += ["error:9"] * len(self.aside)
            self.refused = False
            self.aside.clear()
        while self.aside and self.state in PARKED:
            if self._refuse_stopped(said):
                continue
            ended, self.lines_ended = self.lines_ended, False  # they came before the ~
            rule = self.rule(self.aside[0])
            if rule.answer != "waits":
                name, *behind = self.aside
                self.aside = []
                self._take(self.table.inputs[name], said)
                self.aside = behind
            self.lines_ended = ended
            if rule.answer == "waits":
                return
        if self.parked:
            return
        while self.waiting:
            rule = self.rule(self.waiting[0])
            if rule.answer == "waits":
                return
            self._take(self.table.inputs[self.waiting.pop(0)], said)
            self._follow(said)
