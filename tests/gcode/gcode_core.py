"""core/gcode, core/input/line_reader and core/base/trig seen through ctypes. No rule of G-code is repeated here."""

from __future__ import annotations

import ctypes
import re
from collections.abc import Iterator, Sequence
from pathlib import Path

from layouts import HOST

ROOT = Path(__file__).resolve().parents[2]
AXES = "XYZABC"
Axes = ctypes.c_double * 6
XYZ, XYZABC = 0b111, 0b111111

RAPID, LINEAR, ARC_CW, ARC_CCW, PROBE, NO_MOTION, CYCLE, CUBIC, QUADRATIC, _ = HOST.enum("gcode_motion")
G73, G81, G82, G83, G85, G86, G89 = HOST.enum("gcode_cycle")
ACTION_RAPID, ACTION_FEED, ACTION_DWELL, SPINDLE_STOP, SPINDLE_START = HOST.enum("cycle_kind")
XY, ZX, YZ = HOST.enum("gcode_plane")
BLEND, EXACT, EXACT_STOP = HOST.enum("gcode_path")
PER_MIN, INVERSE_TIME, _ = HOST.enum("gcode_feed_mode")
SPINDLE_OFF, SPINDLE_CW, SPINDLE_CCW = HOST.enum("gcode_spindle")
RUN, PAUSE, OPTIONAL_PAUSE, END = HOST.enum("gcode_flow")
MIST, FLOOD = 1, 2
STORE_NOTHING, STORE_WCS, STORE_G28, STORE_G30, STORE_G92, STORE_G92_ALONE, STORE_TOOL = HOST.enum("gcode_store")
LINE_NONE, LINE_READY, LINE_OVERFLOW, LINE_BROKEN = HOST.enum("line_result")

STATUS_ROW = re.compile(r'X\((\d+), (\w+), "(.*?)"\)')


def status_table() -> dict[int, tuple[str, str]]:
    """Number -> (name, text), read from core/gcode/status.h."""
    text = (ROOT / "core/gcode/status.h").read_text().replace("\\\n", "")
    return {int(number): (name, words) for number, name, words in STATUS_ROW.findall(text)}


Arc = HOST.struct("arc")
Block = HOST.struct("gcode_block")
Command = HOST.struct("gcode_command")
Cycle = HOST.struct("cycle")
Action = HOST.struct("cycle_action")
LineReader = HOST.struct("line_reader")
Move = HOST.struct("gcode_move")
Spline = HOST.struct("spline")
State = HOST.struct("gcode_state")


class Controller:
    """State and a machine that does immediately whatever a command says."""

    def __init__(self, lib: ctypes.CDLL, axes: int = XYZ) -> None:
        self.lib = lib
        self.state = State(axes=axes, ports=(5, 4, 4, 4, True))
        lib.gcode_modal_init(ctypes.byref(self.state.modal))

    def resolve(self, line: str | bytes) -> tuple[int, Command]:
        """The answer to one line and its command; nothing is executed."""
        command = Command()
        text = line.encode() if isinstance(line, str) else line
        return self.lib.gcode_line(ctypes.byref(self.state), text, ctypes.byref(command)), command

    def plain(self, text: bytes) -> tuple[int | None, Command]:
        """gcode_plain_line() on text that holds an LF: characters before the line's end, or None; and the command."""
        command = Command()
        buffer = ctypes.create_string_buffer(text)
        start = ctypes.addressof(buffer)
        end = self.lib.gcode_plain_line(ctypes.byref(self.state), buffer, ctypes.byref(command))
        return (None if end is None else end - start), command

    def answer(self, *lines: str) -> int:
        """Execute lines; the answer to the last one. The others must be fine."""
        status = 0
        for line in lines:
            assert status == 0, f"the line before {line} was answered with {status}"
            status, command = self.resolve(line)
            if status == 0:
                self._execute(command)
        return status

    def run(self, *lines: str) -> Command:
        """Execute lines, all of which must be fine; the command of the last one."""
        for line in lines:
            status, command = self.resolve(line)
            assert status == 0, f"{line} was answered with {status}"
            self._execute(command)
        return command

    def position(self) -> list[float]:
        """Machine position, mm, of the axes that the machine has."""
        return list(self.state.position_mm)[: self.state.axes.bit_count()]

    def _execute(self, command: Command) -> None:
        self.lib.gcode_offsets_apply(ctypes.byref(self.state.offsets), ctypes.byref(command))
        if command.move.motion != NO_MOTION:
            self.state.position_mm = command.move.target_mm
        if command.modes:
            self.lib.gcode_modes_keep(ctypes.byref(self.state), ctypes.byref(command))
        self.state.modal = command.next
        if command.move.motion in (CYCLE, CUBIC, QUADRATIC):
            self.state.sticky = command.sticky


def begin_arc(lib: ctypes.CDLL, start: Sequence[float], move: Move, tolerance_mm: float) -> Arc:
    """arc_begin()."""
    arc = Arc()
    lib.arc_begin(ctypes.byref(arc), Axes(*start), ctypes.byref(move), tolerance_mm)
    return arc


def arc_points(lib: ctypes.CDLL, arc: Arc) -> Iterator[list[float]]:
    """All points that are left."""
    point = Axes()
    while lib.arc_next(ctypes.byref(arc), point):
        yield list(point)
