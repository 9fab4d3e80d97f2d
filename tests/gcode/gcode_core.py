"""core/gcode, core/link/line_reader and core/base/trig seen through ctypes. No rule of G-code is repeated here."""

from __future__ import annotations

import ctypes
import re
from collections.abc import Iterator, Sequence
from ctypes import (
    c_bool,
    c_char,
    c_char_p,
    c_double,
    c_float,
    c_int,
    c_int8,
    c_int32,
    c_size_t,
    c_ssize_t,
    c_uint8,
    c_uint16,
    c_uint32,
)
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
AXES = "XYZABC"
Axes = c_double * 6
XYZ, XYZABC = 0b111, 0b111111

RAPID, LINEAR, ARC_CW, ARC_CCW, PROBE, NO_MOTION, CYCLE, CUBIC, QUADRATIC = range(9)
G73, G81, G82, G83, G85, G86, G89 = range(7)
ACTION_RAPID, ACTION_FEED, ACTION_DWELL, SPINDLE_STOP, SPINDLE_START = range(5)
XY, ZX, YZ = range(3)
BLEND, EXACT, EXACT_STOP = range(3)
PER_MIN, INVERSE_TIME = range(2)
SPINDLE_OFF, SPINDLE_CW, SPINDLE_CCW = range(3)
RUN, PAUSE, OPTIONAL_PAUSE, END = range(4)
MIST, FLOOD = 1, 2
STORE_NOTHING, STORE_WCS, STORE_G28, STORE_G30, STORE_G92, STORE_G92_ALONE, STORE_TOOL = range(7)
TOOL_COUNT, WCS_COUNT = 96, 9
LINE_NONE, LINE_READY, LINE_OVERFLOW, LINE_BROKEN = range(4)

STATUS_ROW = re.compile(r'X\((\d+), (\w+), "(.*?)"\)')


def status_table() -> dict[int, tuple[str, str]]:
    """Number -> (name, text), read from core/gcode/status.h."""
    text = (ROOT / "core/gcode/status.h").read_text().replace("\\\n", "")
    return {int(number): (name, words) for number, name, words in STATUS_ROW.findall(text)}


class Sticky(ctypes.Structure):
    """struct gcode_sticky."""

    _fields_ = (
        ("r_mm", c_double),
        ("z_mm", c_double),
        ("q_mm", c_double),
        ("initial_mm", c_double),
        ("p_s", c_float),
        ("known", c_uint8),
        ("spline_mm", c_double * 2),
        ("plane", c_int),
        ("incremental", c_bool),
    )


class Modal(ctypes.Structure):
    """struct gcode_modal."""

    _fields_ = (
        ("motion", c_int),
        ("plane", c_int),
        ("path", c_int),
        ("feed_mode", c_int),
        ("spindle", c_int),
        ("inches", c_bool),
        ("incremental", c_bool),
        ("arc_absolute", c_bool),
        ("diameter", c_bool),
        ("coolant", c_uint8),
        ("wcs", c_uint8),
        ("probe", c_uint8),
        ("cycle", c_uint8),
        ("retract_to_r", c_bool),
        ("overrides", c_uint8),
        ("tool", c_int32),
        ("tool_in_spindle", c_int32),
        ("feed_mm_s", c_float),
        ("spindle_rpm", c_float),
        ("path_tolerance_mm", c_float),
    )


class Offsets(ctypes.Structure):
    """struct gcode_offsets."""

    _fields_ = (
        ("wcs_mm", Axes * WCS_COUNT),
        ("g28_mm", Axes),
        ("g30_mm", Axes),
        ("g92_mm", Axes),
        ("g92_kept_mm", Axes),
        ("tool_length_mm", c_double),
        ("tool_mm", c_float * TOOL_COUNT),
    )


class State(ctypes.Structure):
    """struct gcode_state."""

    _fields_ = (
        ("modal", Modal),
        ("sticky", Sticky),
        ("saved", Modal),
        ("saved_tool_length_mm", c_double),
        ("is_saved", c_bool),
        ("offsets", Offsets),
        ("position_mm", Axes),
        ("axes", c_uint8),
        ("ports", c_uint8 * 9),
        ("arc_radius_tolerance_mm", c_float),
    )


class Drill(ctypes.Structure):
    """struct gcode_drill."""

    _fields_ = (
        ("cycle", c_int),
        ("r_mm", c_double),
        ("bottom_mm", c_double),
        ("clear_mm", c_double),
        ("step_mm", c_double * 2),
        ("repeats", c_uint32),
        ("peck_mm", c_double),
        ("pecks", c_uint32),
        ("dwell_s", c_float),
    )


class Thread(ctypes.Structure):
    """struct gcode_thread."""

    _fields_ = (
        ("kind", c_int),
        ("pitch_mm", c_float),
        ("return_speed", c_float),
        ("peak_mm", c_float),
        ("first_mm", c_float),
        ("depth_mm", c_float),
        ("degression", c_float),
        ("slide", c_float),
        ("taper_mm", c_float),
        ("springs", c_uint16),
        ("entry", c_bool),
        ("exit", c_bool),
    )


class Move(ctypes.Structure):
    """struct gcode_move."""

    _fields_ = (
        ("motion", c_int),
        ("target_mm", Axes),
        ("feed_mm_s", c_float),
        ("inverse_time_s", c_float),
        ("plane", c_int),
        ("center_mm", c_double * 2),
        ("turns", c_int32),
        ("control_mm", c_double * 2 * 2),
        ("via", c_bool),
        ("via_mm", Axes),
        ("probe", c_uint8),
        ("drill", Drill),
        ("thread", Thread),
    )


class Command(ctypes.Structure):
    """struct gcode_command."""

    _fields_ = (
        ("next", Modal),
        ("sticky", Sticky),
        ("modes", c_int),
        ("spindle", c_int),
        ("coolant", c_uint8),
        ("coolant_passed", c_uint8),
        ("tool_change", c_bool),
        ("sync", c_bool),
        ("port_sync", c_bool),
        ("port", c_int8),
        ("port_kind", c_int),
        ("port_on", c_bool),
        ("port_pct", c_float),
        ("wait", c_int),
        ("wait_s", c_float),
        ("dwell_s", c_float),
        ("store", c_int),
        ("store_wcs", c_uint8),
        ("store_mm", Axes),
        ("store_tool", c_uint8),
        ("store_tool_mm", c_float),
        ("store_tool_length", c_bool),
        ("tool_table_used", c_bool),
        ("tool_length_mm", c_double),
        ("move", Move),
        ("flow", c_int),
        ("line_number", c_uint32),
    )


class Block(ctypes.Structure):
    """struct gcode_block."""

    _fields_ = (
        ("words", c_uint32),
        ("groups", c_uint32),
        ("axes", c_uint8),
        ("value", c_uint8 * 21),
        ("number", c_double * 26),
    )


class Arc(ctypes.Structure):
    """struct arc."""

    _fields_ = (
        ("center_mm", c_double * 2),
        ("start_mm", Axes),
        ("target_mm", Axes),
        ("radius_mm", c_double),
        ("radius_change_mm", c_double),
        ("start_rad", c_double),
        ("travel_rad", c_double),
        ("direction", c_double * 2),
        ("chord_cos", c_double),
        ("chord_sin", c_double),
        ("chord_part", c_double),
        ("chords", c_uint32),
        ("done", c_uint32),
        ("ax0", c_uint8),
        ("ax1", c_uint8),
        ("helical", c_bool),
    )


class Spline(ctypes.Structure):
    """struct spline."""

    _fields_ = (("point_mm", c_double * 2 * 4), ("target_mm", Axes), ("chords", c_uint32), ("done", c_uint32))


class Action(ctypes.Structure):
    """struct cycle_action."""

    _fields_ = (("kind", c_int), ("target_mm", Axes), ("dwell_s", c_float))


class Cycle(ctypes.Structure):
    """struct cycle."""

    _fields_ = (
        ("drill", Drill),
        ("at_mm", Axes),
        ("last_mm", c_double * 2),
        ("hole", c_uint32),
        ("peck", c_uint32),
        ("axes", c_uint8 * 2),
        ("normal", c_uint8),
        ("step", c_uint8),
    )


class LineReader(ctypes.Structure):
    """struct line_reader."""

    _fields_ = (("text", c_char * 80), ("length", c_uint8), ("flags", c_uint8))


STRUCTURES = {
    "arc": Arc,
    "cycle": Cycle,
    "cycle_action": Action,
    "gcode_block": Block,
    "gcode_command": Command,
    "gcode_modal": Modal,
    "gcode_move": Move,
    "gcode_state": State,
    "line_reader": LineReader,
    "spline": Spline,
}


def declare(lib: ctypes.CDLL) -> ctypes.CDLL:
    """Give the library its prototypes and check that the structures above have the right sizes."""
    for name, structure in STRUCTURES.items():
        assert c_size_t.in_dll(lib, f"size_of_{name}").value == ctypes.sizeof(structure), name
    pointer = ctypes.POINTER
    lib.status_text.restype = c_char_p
    lib.number_read.restype = c_ssize_t
    lib.number_read.argtypes = (ctypes.c_void_p, pointer(c_double))
    lib.gcode_line.argtypes = (pointer(State), c_char_p, pointer(Command))
    lib.gcode_plain_line.argtypes = (pointer(State), ctypes.c_void_p, pointer(Command))
    lib.gcode_plain_line.restype = ctypes.c_void_p
    lib.gcode_parse.argtypes = (c_char_p, pointer(Block))
    lib.gcode_work_offset_mm.argtypes = (pointer(State), Axes)
    lib.arc_begin.argtypes = (pointer(Arc), Axes, pointer(Move), c_double)
    lib.arc_length_mm.restype = c_double
    lib.arc_length_mm.argtypes = (pointer(Arc),)
    lib.arc_next.restype = c_bool
    lib.spline_begin.argtypes = (pointer(Spline), Axes, pointer(Move), c_double)
    lib.spline_next.restype = c_bool
    lib.spline_next.argtypes = (pointer(Spline), Axes)
    lib.cycle_begin.argtypes = (pointer(Cycle), Axes, pointer(Move))
    lib.cycle_next.restype = c_bool
    lib.cycle_next.argtypes = (pointer(Cycle), pointer(Action))
    lib.trig_sincos.argtypes = (c_double, pointer(c_double), pointer(c_double))
    lib.trig_atan2.restype = c_double
    lib.trig_atan2.argtypes = (c_double, c_double)
    lib.line_reader_whole.argtypes = (pointer(LineReader), ctypes.c_void_p, c_size_t)
    lib.line_reader_whole.restype = ctypes.c_void_p
    lib.line_reader_pass.argtypes = (pointer(LineReader), c_uint8)
    lib.line_reader_put.argtypes = (pointer(LineReader), c_uint8)
    lib.line_reader_take.restype = c_size_t
    lib.line_reader_take.argtypes = (pointer(LineReader), c_char_p, c_size_t, pointer(c_int))
    return lib


class Controller:
    """State and a machine that does at once whatever a command says."""

    def __init__(self, lib: ctypes.CDLL, axes: int = XYZ) -> None:
        self.lib = lib
        self.state = State(axes=axes, ports=(5, 4, 4, 4, 1))
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
        end = self.lib.gcode_plain_line(ctypes.byref(self.state), start, ctypes.byref(command))
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
