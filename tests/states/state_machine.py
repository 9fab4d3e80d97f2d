"""A real controller next to the model: the same inputs, and what can be seen compared after each."""

from __future__ import annotations

import re
from collections.abc import Sequence

from c_library import LIB
from generate.states_table import Table
from grbl_host import Grbl
from remote_host import RemoteHosts
from state_model import Model

SETTLED_S = 7.0  # quiet after an alarm 0.5 s, a door's restoring 5 s
REACHED_S = 1.0  # the same on the way to a situation
PENDANT = ("error:183", "later", "read", "operator's")  # enum machine_reads
LASTING = {"host_motion"}  # inputs whose situation comes later
PULSE_S = 0.02
PER_AXIS = tuple(
    f"${base + axis}={value}" for base, value in ((100, 10), (110, 5000), (120, 500), (130, 9000)) for axis in range(3)
)
LINES = (*PER_AXIS, "$22=1", "$21=1", "$24=600", "$25=600", "$75=0.01", "$401=1")

# How each state is reached from an idle machine with spindle and coolant on, with what may be under way in it.
SITUATIONS: dict[str, list[str]] = {
    "idle": [],
    "idle, outputs off": ["spindle_off"],
    "run": ["move"],
    "run, dwell": ["dwell"],
    "run, probe": ["probe"],
    "run, line open": ["move", "spindle_off"],
    "hold, nothing": ["hold_byte"],
    "hold, move": ["move", "hold_byte"],
    "hold, dwell": ["dwell", "hold_byte"],
    "hold, probe": ["probe", "hold_byte"],
    "hold, M0": ["pause"],
    "hold, M6": ["tool_change"],
    "lost, nothing": ["sender_lost"],
    "lost, move": ["move", "sender_lost"],
    "lost, M0": ["pause", "sender_lost"],
    "parked": ["hold_byte", "park_byte"],
    "parked, move": ["move", "hold_byte", "park_byte"],
    "parked, M6": ["tool_change", "park_byte"],
    "parked, from the door": ["move", "door_byte", "park_byte"],
    "parked, lost": ["move", "hold_byte", "park_byte", "sender_lost", "park_byte"],
    "parked_moves": ["move", "hold_byte", "park_byte", "jog_line"],
    "parked_moves, probe": ["pause", "park_byte", "probe"],
    "parked_moves, resumes": ["move", "hold_byte", "park_byte", "probe", "resume_byte"],
    "door_closed, parked": ["move", "hold_byte", "park_byte", "door_byte"],
    "parked_moves, operator waits": ["move", "hold_byte", "park_byte", "jog_line", "spindle_line"],
    "door_closed, operator probes": ["move", "hold_byte", "park_byte", "probe", "door_byte"],
    "door_open, nothing": ["door_opens"],
    "door_open, move": ["move", "door_opens"],
    "door_open, M0": ["pause", "door_opens"],
    "door_closed, nothing": ["door_byte"],
    "door_closed, move": ["move", "door_byte"],
    "door_closed, dwell": ["dwell", "door_byte"],
    "door_closed, probe": ["probe", "door_byte"],
    "jog": ["jog_line"],
    "jog, outputs off": ["spindle_off", "jog_line"],
    "check": ["check_line"],
    "home": ["home_line"],
    "alarm": ["sleep_line", "reset_byte"],
    "alarm, door open": ["sleep_line", "door_opens", "reset_byte"],
    "idle, stream": ["host_opens"],
    "idle, host's outputs": ["spindle_off", "host_outputs"],
    "run, stream": ["move", "host_opens"],
    "hold, stream": ["hold_byte", "host_opens"],
    "host_run": ["host_opens", "host_segments"],
    "host_run, host's outputs": ["host_outputs", "host_opens", "host_segments"],
    "host_run, job waits": ["move", "host_opens", "host_segments"],
    "host_hold": ["host_opens", "host_segments", "hold_byte"],
    "host_hold, job waits": ["move", "host_opens", "host_segments", "host_hold"],
    "host_door_open": ["host_opens", "host_segments", "door_opens"],
    "host_door_closed": ["host_opens", "host_segments", "door_byte"],
    "host_door_closed, job waits": ["move", "host_opens", "host_segments", "door_byte"],
    "host_jog": ["host_jog"],
    "host_home": ["host_home"],
    "returned": ["move", "host_motion"],
    "critical": ["limit"],
    "estop": ["estop_pressed"],
    "sleep": ["sleep_line"],
}


class Pair:
    """Controller and model, side by side."""

    settled_s = SETTLED_S

    def __init__(self, table: Table) -> None:
        self.table = table
        self.grbl = self.start()
        self.grbl.fine(*LINES, "M3S500M8")
        self.model = Model(table, spindle=True, coolant=2)
        self.path: list[str] = []
        self.replied = ""  # to a packet of a remote host

    def start(self) -> Grbl:
        """A controller that has said its banner."""
        grbl = RemoteHosts()
        grbl.send("")
        grbl.fine("$747=1")  # M1's switch: no cell of it does anything
        return grbl

    @property
    def hosts(self) -> RemoteHosts:
        assert isinstance(self.grbl, RemoteHosts)
        return self.grbl

    def shown(self) -> str:
        """Its state, without asking it."""
        return self.grbl.state()

    def outputs(self) -> tuple[bool, int]:
        """Spindle and coolant, as the pins are."""
        outputs = self.grbl.outputs()
        return outputs.spindle_direction != 0, outputs.coolant

    def close(self) -> None:
        self.grbl.close()

    def reach(self, situation: str) -> None:
        for name in SITUATIONS[situation]:
            self.step(name, self.settled_s if name in LASTING else min(self.settled_s, REACHED_S))

    def step(self, name: str, settled_s: float | None = None) -> None:
        """One input, and everything compared when it has settled. Raises AssertionError."""
        self.path.append(name)
        state = self.model.state
        expected = self.model.apply(name)
        self.replied = ""
        said = self.drive(name) + self.grbl.after(self.settled_s if settled_s is None else settled_s)
        where = f"{' > '.join(self.path)} (from {state}): said {said!r}"
        assert self.replied == expected.reply, f"{where} and replied {self.replied!r}, not {expected.reply!r}"
        assert answers(said) == expected.answers, f"{where}, not {expected.answers}"
        assert in_order(said, expected.says), f"{where}, not {expected.says}"
        assert len(re.findall("^<", said, re.M)) >= expected.reports, where
        self.compare(where)

    def drive(self, name: str) -> str:
        """Make it happen. Returns what was answered meanwhile."""
        entry, grbl = self.table.inputs[name], self.grbl
        if entry.line is not None:
            grbl.put(entry.line + "\n")
        elif entry.bytes:
            grbl.put(chr(next(entry.all_bytes())))
        elif entry.packets:
            self.replied = self.hosts.packet(entry)
        elif entry.event == "host_lost":
            self.hosts.lose_host()
        elif entry.event == "dial":
            LIB.virtual_dial(grbl._host, 2, 20.0)
        elif entry.event == "pendant_line":
            self.replied = PENDANT[LIB.host_reads(grbl._host)]
        elif entry.event:
            grbl.lose_sender()
        elif entry.level is not None:
            grbl.input(entry.pin, entry.level)
        else:
            grbl.input(entry.pin, True)
            said = grbl.after(PULSE_S)
            grbl.input(entry.pin, False)
            return said
        return ""

    def compare(self, where: str) -> None:
        """State, motion and outputs, as they can be seen from outside."""
        grbl, model = self.grbl, self.model
        shown = self.shown()
        assert shown == model.report, f"{where}: {shown}, not {model.report}"
        before = grbl.stands()
        unasked = grbl.after(0.15)
        assert unasked == "", f"{where}, and then {unasked!r}"
        assert (grbl.stands() != before) == model.moves, f"{where}: motion is not {model.activity!r} in {model.state}"
        if not model.moves:
            assert grbl.position() == grbl.stands(), where
        outputs = self.outputs()
        assert outputs == (model.spindle_turns, model.coolant_flows), f"{where}: spindle and coolant {outputs}"


def answers(said: str) -> list[str]:
    return re.findall(r"^(ok|error:\d+)\r$", said, re.M)


def in_order(said: str, texts: Sequence[str]) -> bool:
    at = 0
    for text in texts:
        text = text.removesuffix("…")
        at = said.find(text, at)
        if at < 0:
            return False
        at += len(text)
    return True
