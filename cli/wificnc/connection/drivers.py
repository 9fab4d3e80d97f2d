"""Motor drivers with registers: what `$DRIVERS` reports, and the settings of each. Pure."""

from __future__ import annotations

import re
from dataclasses import dataclass

from wificnc.connection.settings import Values, find
from wificnc.errors import UserError
from wificnc.files.shape import closest
from wificnc.tables import AXES, load_settings

_ROW = re.compile(r"([XYZABC]2?)\|(\w+)\|(\d+)\|([a-z ,]+)" + r"\|(\d+)" * 7)
_PREFIX = "driver_"
_QUIET = {"ok": "verified", "left alone": "not written", "wait": "being written"}
WARNINGS = ("hot", "open")  # the motor still has its place


@dataclass(frozen=True)
class Driver:
    """One driver, as it is now."""

    name: str  # X .. C, or Y2: of the second motor
    chip: str
    place: int  # address, or place on the bus
    state: str  # verified: it has proved that it has its registers; not written; being written; fault
    problems: tuple[str, ...]
    current_ma: int
    most_ma: int  # that its sense resistor allows
    hold_pct: int
    microsteps: int
    scale: int  # current in use, 0 to 31
    load: int  # StallGuard's result: small is a heavy load
    resets: int


def parse_driver(body: str) -> Driver | None:
    """What is in the brackets of [DRIVER:…]; None: another form."""
    match = _ROW.fullmatch(body)
    if match is None:
        return None
    name, chip, place, words, *numbers = match.groups()
    state = _QUIET.get(words, "fault")
    problems = tuple(words.split(",")) if state == "fault" else ()
    return Driver(name, chip, int(place), state, problems, *map(int, numbers))


def settings_axis(name: str, settings: Values) -> int:
    """The axis whose settings a driver has: its own, or that which it is the second motor of ($210 ..)."""
    own, second = AXES.index(name[0]), load_settings()["second_motor"].number
    others = [axis for axis in range(len(AXES)) if settings.get(second + axis, "0") == str(own + 1)]
    return others[0] if others and len(name) == 1 else own


def names() -> list[str]:
    """Of a driver's settings: current_ma, microsteps .."""
    rows = load_settings().setting
    return [row.name.removeprefix(_PREFIX) for row in rows if row.name.startswith(_PREFIX) and row.per_axis]


def number_of(name: str, axis: int) -> int:
    """The setting of an axis by its name here. Raises UserError."""
    if name.lower() not in names():
        meant = closest(name.lower(), names())
        hint = f"did you mean {meant}?" if meant else f"one of: {', '.join(names())}"
        raise UserError(f"unknown setting of a driver: {name}", hint=hint)
    return find(f"{_PREFIX}{name.lower()}.{AXES[axis].lower()}")


def scaled_steps(steps: str, before: int, after: int) -> str:
    """Steps/mm that go with other microsteps: a mm stays a mm."""
    return f"{float(steps) * after / before:.3f}"
