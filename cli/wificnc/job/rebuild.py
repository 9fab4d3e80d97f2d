"""targets/sim/rebuild.h seen from Python: modal state after the lines of a program, by the core's own parser."""

from __future__ import annotations

import ctypes
from collections.abc import Sequence
from ctypes import c_char_p, c_double, c_int, c_int16, c_int32, c_size_t, c_uint8, c_uint32, c_void_p
from dataclasses import dataclass
from pathlib import Path

from wificnc.errors import BuildError
from wificnc.job.ending import Ending

AXES = "XYZABC"
_Axes = c_double * len(AXES)


class _State(ctypes.Structure):
    """struct rebuild_state"""

    _fields_ = (
        ("work_mm", _Axes),
        ("machine_mm", _Axes),
        ("g92_mm", _Axes),
        ("top_z_mm", c_double),
        ("tool_length_mm", c_double),
        ("feed_mm_min", c_double),
        ("spindle_rpm", c_double),
        ("path_tolerance_mm", c_double),
        ("tool", c_int32),
        ("motion_g10", c_int16),
        ("path_g10", c_int16),
        ("wcs_g10", c_int16),
        ("plane_g", c_uint8),
        ("units_g", c_uint8),
        ("distance_g", c_uint8),
        ("feed_mode_g", c_uint8),
        ("spindle_m", c_uint8),
        ("coolant", c_uint8),
        ("arc_absolute", c_uint8),
        ("moved", c_uint8),
        ("stored", c_uint8),
    )


class ProgramEnd(ctypes.Structure):
    """struct program_end"""

    _fields_ = (
        *((name, c_uint32) for name in ("line", "unrun", "first", "second", "mark")),
        ("has_code", c_uint8),
        ("is_open", c_uint8),
    )

    @property
    def ending(self) -> Ending:
        return Ending(self.line, self.unrun, self.first, self.second)


def g_word(times_ten: int) -> str:
    """382 -> G38.2"""
    whole, tenth = divmod(times_ten, 10)
    return f"G{whole}.{tenth}" if tenth else f"G{whole}"


@dataclass(frozen=True)
class ModalState:
    """What a program has set. Positions in mm or degrees, of all six axes."""

    work_mm: tuple[float, ...]
    machine_mm: tuple[float, ...]
    g92_mm: tuple[float, ...]
    top_z_mm: float  # machine coordinates; NaN = Z was not moved
    tool_length_mm: float
    feed_mm_min: float
    spindle_rpm: float
    path_tolerance_mm: float
    tool: int
    motion: str  # G0 G1 G2 G3 G38.2 … G80
    path: str  # G64 G61 G61.1
    wcs: str  # G54 …
    plane: str  # G17 G18 G19
    units: str  # G20 G21
    distance: str  # G90 G91
    feed_mode: str  # G93 G94
    spindle: str  # M3 M4 M5
    coolant: tuple[str, ...]  # M7 M8
    arc_absolute: bool
    moved: tuple[bool, ...]
    stored: bool


class Rebuild:
    """One struct rebuild."""

    def __init__(self, library: ctypes.CDLL, axis_count: int) -> None:
        self._library = library
        self._handle = library.rebuild_create(axis_count)
        if not self._handle:
            raise MemoryError("rebuild_create")

    def __enter__(self) -> Rebuild:
        return self

    def __exit__(self, *_: object) -> None:
        self._library.rebuild_destroy(self._handle)
        self._handle = None

    def set_position(self, machine_mm: Sequence[float]) -> None:
        self._library.rebuild_set_position(self._handle, _six(machine_mm))

    def set_offset(self, row: str, mm: Sequence[float]) -> None:
        """row: as `$#` names it. Rows that this core does not have are left out."""
        numbers = {"G28": -28, "G30": -30, "G92": -92, "TLO": -43}
        number = numbers[row] if row in numbers else _wcs_row(row)
        values = (0.0, 0.0, mm[0]) if row == "TLO" else mm
        self._library.rebuild_set_offset(self._handle, number, _six(values))

    def line(self, code: bytes) -> int:
        """Take a line. @return 0 or the number of its error"""
        return int(self._library.rebuild_line(self._handle, code, len(code)))

    def state(self) -> ModalState:
        raw = _State()
        self._library.rebuild_state(self._handle, ctypes.byref(raw))
        return ModalState(
            work_mm=tuple(raw.work_mm),
            machine_mm=tuple(raw.machine_mm),
            g92_mm=tuple(raw.g92_mm),
            top_z_mm=raw.top_z_mm,
            tool_length_mm=raw.tool_length_mm,
            feed_mm_min=raw.feed_mm_min,
            spindle_rpm=raw.spindle_rpm,
            path_tolerance_mm=raw.path_tolerance_mm,
            tool=raw.tool,
            motion=g_word(raw.motion_g10),
            path=g_word(raw.path_g10),
            wcs=g_word(raw.wcs_g10),
            plane=f"G{raw.plane_g}",
            units=f"G{raw.units_g}",
            distance=f"G{raw.distance_g}",
            feed_mode=f"G{raw.feed_mode_g}",
            spindle=f"M{raw.spindle_m}",
            coolant=tuple(word for bit, word in ((1, "M7"), (2, "M8")) if raw.coolant & bit),
            arc_absolute=bool(raw.arc_absolute),
            moved=tuple(bool(raw.moved >> axis & 1) for axis in range(len(AXES))),
            stored=bool(raw.stored),
        )


def _wcs_row(row: str) -> int:
    """G54 -> 0, G59 -> 5, G59.1 -> 6"""
    whole, _, tenth = row[1:].partition(".")
    return int(whole) - 54 + int(tenth or 0)


def _six(values: Sequence[float]) -> ctypes.Array[c_double]:
    return _Axes(*values[: len(AXES)])


def load_rebuild(path: Path) -> ctypes.CDLL:
    """Load the host library and tell ctypes the types of rebuild.h. Raises BuildError."""
    types: dict[str, tuple[object, tuple[object, ...]]] = {
        "rebuild_create": (c_void_p, (c_uint8,)),
        "rebuild_destroy": (None, (c_void_p,)),
        "rebuild_set_position": (None, (c_void_p, _Axes)),
        "rebuild_set_offset": (c_int, (c_void_p, c_int, _Axes)),
        "rebuild_line": (c_int, (c_void_p, c_char_p, c_size_t)),
        "rebuild_state": (None, (c_void_p, ctypes.POINTER(_State))),
    }
    try:
        library = ctypes.CDLL(str(path))
        for name, (result, arguments) in types.items():
            function = getattr(library, name)
            function.restype, function.argtypes = result, arguments
    except (OSError, AttributeError) as err:
        raise BuildError(f"{path.name} cannot be used: {err}", hint="`wificnc build host` builds it again") from err
    return library
