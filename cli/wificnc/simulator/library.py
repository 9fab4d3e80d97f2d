"""The host library seen from Python: targets/sim/sim.h by ctypes, with types."""

from __future__ import annotations

import ctypes
import os
from collections.abc import Sequence
from ctypes import (
    POINTER,
    Structure,
    c_char,
    c_char_p,
    c_double,
    c_float,
    c_int,
    c_int32,
    c_int64,
    c_size_t,
    c_uint8,
    c_uint16,
    c_uint32,
    c_uint64,
    c_void_p,
)
from enum import IntEnum
from pathlib import Path
from typing import Any

from wificnc.errors import BuildError
from wificnc.job.rebuild import ProgramEnd

AXES = "XYZABC"
AXIS_COUNT = len(AXES)


DEVICE_PINS = 37  # core/device/device_gen.h


class DeviceWiring(Structure):
    """struct device_wiring"""

    _fields_ = (("pin", c_uint8 * DEVICE_PINS), ("estop_high", c_uint8))


class DeviceBoard(Structure):
    """struct device_board"""

    _fields_ = (
        ("wiring", DeviceWiring),
        ("legal", c_uint64 * DEVICE_PINS),
        ("encoder_filter_ns", c_uint16),
        ("ethernet_host", c_uint8),
    )


class HostBoard(Structure):
    """struct host_board"""

    _fields_ = (
        ("timer_hz", c_uint32),
        ("step_pulse_ns", c_uint32),
        ("dir_setup_ns", c_uint32),
        ("max_step_rate_hz", c_uint32),
        ("axis_count", c_uint8),
        ("ganged", c_uint8),
        ("missing_outputs", c_uint8),
        ("digital_inputs", c_uint8),
        ("analog", c_uint8),
        ("motors_wake_us", c_uint16),
        ("digital_outputs", c_uint8),
        ("encoder", c_uint8),
        ("home_axes", c_uint8),
        ("tasks", c_uint8),
        ("default_pulse_us", c_uint8),
        ("step_spread_ns", c_uint32),
        ("step_grid_ns", c_uint32),
        ("look_ahead", c_uint16),
        ("laser_marks", c_uint16),
        ("toolsetter", c_uint8),
        ("switchless", c_uint16),
        ("spindle_bus", c_uint8),
        ("device", POINTER(DeviceBoard)),
        ("pump_hz", c_uint16),
        ("pump_clock_hz", c_uint32),
        ("pump_ticks_min", c_uint32),
        ("pump_ticks_max", c_uint32),
        ("driver", c_uint32 * 12),
        ("dial", c_uint8),
        ("restart", c_uint8),
        ("restart_address", c_uint32),
    )


class Tasks(IntEnum):
    """enum host_tasks_of: in whose time the controller works"""

    FREE = 0
    ESP32 = 1
    PIC32MZ = 2

    @classmethod
    def of(cls, target: str) -> Tasks:
        """Those of a board's target."""
        return {"esp32": cls.ESP32, "pic32mz": cls.PIC32MZ}.get(target, cls.FREE)


class HostCounters(Structure):
    """struct host_counters"""

    _fields_ = tuple(
        (name, c_uint64)
        for name in (
            "step_events",
            "timer_events",
            "segments",
            "spans",
            "blocks",
            "lines",
            "lookahead_starved",
            "underruns",
            "plan_unmet",
        )
    )


class NativeError(Structure):
    """struct sim_error"""

    _fields_ = (("line", c_uint32), ("code", c_int32), ("kind", c_uint32))


class ErrorKind(IntEnum):
    """enum sim_error_kind"""

    ERROR = 0
    ALARM = 1
    NO_ANSWER = 2
    SURPLUS = 3
    HELD = 4
    RESET = 5


STATE_SIZE, HANDS_LINE_SIZE = 16, 160  # SCRIPT_STATE_SIZE, HANDS_LINE_SIZE


class NativeEvent(Structure):
    """struct script_event"""

    _fields_ = (
        ("t_s", c_double),
        ("done", c_int32),
        ("state", c_char * STATE_SIZE),
        ("line", c_char * HANDS_LINE_SIZE),
        ("position_steps", c_int32 * AXIS_COUNT),
    )


class NativeResult(Structure):
    """struct sim_result"""

    _fields_ = (
        ("counters", HostCounters),
        ("job_ticks", c_uint64),
        ("cutting_ticks", c_uint64),
        ("rapid_ticks", c_uint64),
        ("lines", c_uint64),
        ("percent_lines", c_uint64),
        ("program_end", ProgramEnd),
        ("pauses", c_uint64),
        ("steps_total", c_int64 * AXIS_COUNT),
        ("position_steps", c_int32 * AXIS_COUNT),
        ("measured_steps", c_int32 * AXIS_COUNT),
        ("min_steps", c_int32 * AXIS_COUNT),
        ("max_steps", c_int32 * AXIS_COUNT),
        ("max_speed_mm_s", c_double * AXIS_COUNT),
        ("max_accel_mm_s2", c_double * AXIS_COUNT),
        ("accel_window_s", c_double * AXIS_COUNT),
        ("max_step_rate_hz", c_double),
        ("steps_per_mm", c_double * AXIS_COUNT),
        ("position_mm", c_double * AXIS_COUNT),
        ("min_mm", c_double * AXIS_COUNT),
        ("max_mm", c_double * AXIS_COUNT),
    )


class PathSample(Structure):
    """struct path_sample"""

    _fields_ = (
        ("t_s", c_float),
        ("position_mm", c_float * AXIS_COUNT),
        ("speed_mm_s", c_float),
        ("rapid", c_uint32),
    )


class NativeToolChange(Structure):
    """struct sim_tool_change"""

    _fields_ = (("t_s", c_double), ("line", c_uint32), ("tool", c_int32))


class SurveyLine(Structure):
    """struct survey_line"""

    _fields_ = (
        ("line", c_uint32),
        ("rapid", c_uint32),
        ("at_rate", c_uint32),
        ("asked_mm_s", c_float),
        ("reached_mm_s", c_float),
        ("time_s", c_float),
        ("min_mm", c_float * AXIS_COUNT),
        ("max_mm", c_float * AXIS_COUNT),
    )


class SurveyArc(Structure):
    """struct survey_arc"""

    _fields_ = (
        ("line", c_uint32),
        ("plane", c_uint32),
        ("by_radius", c_uint32),
        ("unit_mm", c_double),
        ("way_mm", c_double * 2),
        ("center_mm", c_double * 2),
        ("word_mm", c_double * 2),
    )


class EngravingPiece(Structure):
    """struct engraving_piece"""

    _fields_ = (
        ("t_s", c_float),
        ("from_mm", c_float * 3),
        ("to_mm", c_float * 3),
        ("length_mm", c_float),
        ("energy_s", c_float),
    )


class NativeEngraving(Structure):
    """struct engraving_result"""

    _fields_ = (
        ("length_mm", c_double),
        ("constant_mm", c_double),
        ("slow_mm", c_double),
        ("limit", c_double),
        ("worst", c_double),
        ("worst_line", c_uint32),
        ("worst_mm", c_double * 3),
    )


# The same records for numpy.frombuffer().
PIECE_DTYPE = [
    ("t_s", "<f4"),
    ("from_mm", "<f4", (3,)),
    ("to_mm", "<f4", (3,)),
    ("length_mm", "<f4"),
    ("energy_s", "<f4"),
]
SAMPLE_DTYPE = [
    ("t_s", "<f4"),
    ("position_mm", "<f4", (AXIS_COUNT,)),
    ("speed_mm_s", "<f4"),
    ("rapid", "<u4"),
]

_SIM = c_void_p
_PROTOTYPES: dict[str, tuple[Any, tuple[Any, ...]]] = {
    "sim_create": (_SIM, (POINTER(HostBoard),)),
    "sim_destroy": (None, (_SIM,)),
    "sim_command": (c_int, (_SIM, c_char_p)),
    "sim_load": (c_int, (_SIM, c_char_p, c_size_t, c_int)),
    "sim_limit_lines": (None, (_SIM, c_uint32)),
    "sim_run": (c_int, (_SIM, c_uint64)),
    "sim_progress": (None, (_SIM, POINTER(c_uint64), POINTER(c_uint64))),
    "sim_at": (c_char_p, (_SIM, c_double, c_char_p)),
    "sim_event_count": (c_size_t, (_SIM,)),
    "sim_event_at": (NativeEvent, (_SIM, c_size_t)),
    "sim_error_count": (c_size_t, (_SIM,)),
    "sim_error_at": (NativeError, (_SIM, c_size_t)),
    "sim_tool_changes": (c_size_t, (_SIM, POINTER(POINTER(NativeToolChange)))),
    "sim_message_count": (c_size_t, (_SIM,)),
    "sim_message_at": (c_char_p, (_SIM, c_size_t)),
    "sim_result": (None, (_SIM, POINTER(NativeResult))),
    "sim_trace_csv": (c_int, (_SIM, c_char_p)),
    "sim_trace_vcd": (c_int, (_SIM, c_char_p, POINTER(c_char_p))),
    "sim_trace_raw": (c_int, (_SIM, c_char_p)),
    "sim_sample_every": (c_int, (_SIM, c_double)),
    "sim_samples": (c_size_t, (_SIM, POINTER(POINTER(PathSample)))),
    "sim_survey": (None, (_SIM,)),
    "sim_surveyed": (c_void_p, (_SIM,)),
    "survey_lines": (c_size_t, (c_void_p, POINTER(POINTER(SurveyLine)))),
    "survey_arcs": (c_size_t, (c_void_p, POINTER(POINTER(SurveyArc)))),
    "survey_engraving": (c_void_p, (c_void_p,)),
    "engraving_pieces": (c_size_t, (c_void_p, POINTER(POINTER(EngravingPiece)))),
    "engraving_result": (None, (c_void_p, POINTER(NativeEngraving))),
    "sim_close": (c_int, (_SIM,)),
    "status_text": (c_char_p, (c_int,)),
}


def load_library(path: Path) -> ctypes.CDLL:
    """Load the host library and tell ctypes its types.

    Raises:
        BuildError: it cannot be loaded, or lacks a function.
    """
    try:
        library = ctypes.CDLL(str(path))
        for name, (result, arguments) in _PROTOTYPES.items():
            function = getattr(library, name)
            function.restype = result
            function.argtypes = arguments
    except (OSError, AttributeError) as err:
        raise BuildError(f"{path.name} cannot be used: {err}", hint="`wificnc build host` builds it again") from err
    return library


class Simulation:
    """One struct sim. Errors of files are OSError; everything else is a number, as in sim.h."""

    def __init__(self, library: ctypes.CDLL, board: HostBoard) -> None:
        self._library = library
        self._sim = library.sim_create(ctypes.byref(board))
        if not self._sim:
            raise MemoryError("sim_create")

    def __enter__(self) -> Simulation:
        return self

    def __exit__(self, *_: object) -> None:
        self._library.sim_destroy(self._sim)
        self._sim = None

    def command(self, line: str) -> int:
        """Send one line and wait for its answer: 0, an error number, or -1."""
        return int(self._library.sim_command(self._sim, line.encode()))

    def at(self, t_s: float, line: str) -> str | None:
        """Let something happen at the machine. Returns what is wrong with the line."""
        wrong: bytes | None = self._library.sim_at(self._sim, t_s, line.encode())
        return wrong.decode() if wrong is not None else None

    def events(self) -> list[NativeEvent]:
        count = self._library.sim_event_count(self._sim)
        return [self._library.sim_event_at(self._sim, i) for i in range(count)]

    def limit_lines(self, lines_max: int) -> None:
        """How many lines a program with O words may execute."""
        self._library.sim_limit_lines(self._sim, lines_max)

    def load(self, text: bytes, keep_going: bool) -> None:
        if self._library.sim_load(self._sim, text, len(text), keep_going) != 0:
            raise MemoryError("sim_load")

    def run(self, max_events: int) -> bool:
        """Work for about so many step events. Returns whether there is more."""
        return bool(self._library.sim_run(self._sim, max_events))

    def progress(self) -> tuple[int, int]:
        """Lines done, lines in all."""
        done, total = c_uint64(), c_uint64()
        self._library.sim_progress(self._sim, ctypes.byref(done), ctypes.byref(total))
        return done.value, total.value

    def errors(self) -> list[NativeError]:
        return [self._library.sim_error_at(self._sim, i) for i in range(self._library.sim_error_count(self._sim))]

    def tool_changes(self) -> list[NativeToolChange]:
        """Copies."""
        first = POINTER(NativeToolChange)()
        count = self._library.sim_tool_changes(self._sim, ctypes.byref(first))
        return [NativeToolChange.from_buffer_copy(first[i]) for i in range(count)]

    def messages(self) -> list[str]:
        """The controller's [MSG:...] lines."""
        count = self._library.sim_message_count(self._sim)
        return [self._library.sim_message_at(self._sim, i).decode("ascii", "replace") for i in range(count)]

    def result(self) -> NativeResult:
        result = NativeResult()
        self._library.sim_result(self._sim, ctypes.byref(result))
        return result

    def trace_csv(self, path: Path) -> None:
        _check(self._library.sim_trace_csv(self._sim, str(path).encode()), path)

    def trace_raw(self, path: Path) -> None:
        _check(self._library.sim_trace_raw(self._sim, str(path).encode()), path)

    def trace_vcd(self, path: Path, names: Sequence[str | None]) -> None:
        """names: step lines X..C, then direction lines X..C; None = not drawn."""
        array = (c_char_p * len(names))(*(name.encode() if name else None for name in names))
        _check(self._library.sim_trace_vcd(self._sim, str(path).encode(), array), path)

    def sample_every(self, interval_ms: float) -> None:
        self._library.sim_sample_every(self._sim, interval_ms)

    def samples(self) -> bytes:
        """All path samples, as records of SAMPLE_DTYPE."""
        first = POINTER(PathSample)()
        count = self._library.sim_samples(self._sim, ctypes.byref(first))
        return ctypes.string_at(first, count * ctypes.sizeof(PathSample)) if count else b""

    def survey(self) -> None:
        """Note what each line asks for and gets. Call before load()."""
        self._library.sim_survey(self._sim)

    def survey_lines(self) -> list[SurveyLine]:
        """The lines that move something; copies."""
        first = POINTER(SurveyLine)()
        count = self._library.survey_lines(self._surveyed(), ctypes.byref(first))
        return [SurveyLine.from_buffer_copy(first[i]) for i in range(count) if first[i].line]

    def survey_arcs(self) -> list[SurveyArc]:
        """The arcs that were refused; copies."""
        first = POINTER(SurveyArc)()
        count = self._library.survey_arcs(self._surveyed(), ctypes.byref(first))
        return [SurveyArc.from_buffer_copy(first[i]) for i in range(count)]

    def engraving(self) -> NativeEngraving:
        """What the laser burnt."""
        result = NativeEngraving()
        self._library.engraving_result(self._library.survey_engraving(self._surveyed()), ctypes.byref(result))
        return result

    def engraving_pieces(self) -> bytes:
        """Its pieces, as records of PIECE_DTYPE."""
        first = POINTER(EngravingPiece)()
        count = self._library.engraving_pieces(self._library.survey_engraving(self._surveyed()), ctypes.byref(first))
        return ctypes.string_at(first, count * ctypes.sizeof(EngravingPiece)) if count else b""

    def _surveyed(self) -> int:
        return int(self._library.sim_surveyed(self._sim))

    def close(self, path: Path | None) -> None:
        """Finish the trace file."""
        _check(self._library.sim_close(self._sim), path)

    def status_text(self, code: int) -> str:
        text: bytes = self._library.status_text(code)
        return text.decode()


def _check(error: int, path: Path | None) -> None:
    """Raise the OSError of an errno."""
    if error != 0:
        raise OSError(error, os.strerror(error), str(path))
