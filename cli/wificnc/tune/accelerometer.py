"""Accelerometer logs (CSV): one column of time, one to three of acceleration. Needs numpy.

Klipper's raw files, Sensor Logger, phyphox, Physics Toolbox and hand-made tables: a column is found by its name. The
scale does not matter, only the shape of the vibration in time.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from wificnc.errors import UserError
from wificnc.files.bounded import JOB_MAX, read_text
from wificnc.tune.motion import Floats

UNIT_S = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}
# Names of a column of time; a unit may follow in brackets or after _.
TIME = re.compile(r"#?\s*(?:time|timestamp|t|seconds|elapsed|seconds_elapsed)(?:[\s_(\[]+(\w+)[)\]]?)?", re.IGNORECASE)
UNITS = {
    "s": "s", "sec": "s", "secs": "s", "seconds": "s", "second": "s", "elapsed": "s", "ms": "ms", "msec": "ms",
    "millis": "ms", "us": "us", "micros": "us", "ns": "ns", "nanos": "ns",
}  # fmt: skip
# accel_x, ax, acc-x, x, gFx, "Linear Acceleration x (m/s^2)"
AXIS = re.compile(
    r"(?:linear[\s_]+)?(?:accel(?:eration|erometer)?|acc|gf|a)?[\s_.-]*([xyz])(?:[\s_]*[(\[].*|[\s_](?:g|m/?s\W?2|mm/?s\W?2))?",
    re.IGNORECASE,
)
DELIMITERS = (";", "\t", ",")
SAMPLES_MIN = 256
DURATION_MIN_S = 0.5
GAP_STEPS = 20.0  # a pause in the log of more than so many samples is reported


@dataclass(frozen=True)
class Log:
    """One axis, evenly sampled."""

    column: str
    rate_hz: float
    values: Floats
    gaps: int  # pauses that were filled with straight lines

    @property
    def duration_s(self) -> float:
        return len(self.values) / self.rate_hz


def read_log(path: Path, axis: str, time_unit: str | None = None) -> Log:
    """The acceleration of an axis: of its column, or of the only one.

    Raises:
        UserError: the file is missing, not a log, too short, or without this axis.
    """
    rows = _rows(path)
    names = [name.strip() for name in rows[0][1]]
    time_index, unit = _time_column(path, names, time_unit)
    index = _axis_column(path, names, axis, time_index)
    t_s = _numbers(path, rows, time_index) * UNIT_S[unit]
    values = _numbers(path, rows, index)
    return _even(path, names[index], t_s - t_s[0], values)


def _rows(path: Path) -> list[tuple[int, list[str]]]:
    """(line number, cells) of the header and all rows."""
    try:
        text = read_text(path, JOB_MAX, errors="replace")
    except OSError as err:
        raise UserError(f"cannot read {path}: {err.strerror}") from err
    lines = [(number, line) for number, line in enumerate(text.splitlines(), 1) if line.strip()]
    if not lines:
        raise UserError(f"{path} is empty")
    delimiter = next((character for character in DELIMITERS if character in lines[0][1]), ",")
    cells = csv.reader((line for _, line in lines), delimiter=delimiter)
    numbered = zip((number for number, _ in lines), cells, strict=False)
    try:
        rows = [
            (number, row) for number, row in numbered if number == lines[0][0] or not row[0].lstrip().startswith("#")
        ]
    except csv.Error as err:  # of NUL, until Python 3.11, and of a cell of 131,073 characters
        raise UserError(
            f"{path} is not a table: {err}", hint="a log is text with a row of numbers in each line"
        ) from err
    if delimiter == ";":  # of a country that writes 0,5
        rows = [rows[0], *((number, [cell.replace(",", ".") for cell in row]) for number, row in rows[1:])]
    return rows


def _time_column(path: Path, names: Sequence[str], time_unit: str | None) -> tuple[int, str]:
    """Its index and its unit."""
    found = [(index, match) for index, name in enumerate(names) if (match := TIME.fullmatch(name))]
    if not found:
        raise UserError(
            f"{path}:1: no column of time among {', '.join(repr(name) for name in names[:8])}",
            hint="the first line names the columns, like time,accel_x,accel_y,accel_z",
        )
    # Sensor Logger has nanoseconds since 1970 in `time`, and what is needed in `seconds_elapsed`.
    index, match = next((entry for entry in found if "elapsed" in entry[1][0].lower()), found[0])
    word = (match[1] or "s").lower().replace("µ", "u").replace("μ", "u")
    if time_unit is None and word not in UNITS:
        raise UserError(f"{path}:1: unknown unit of time in {names[index]!r}", hint="--time-unit s, ms, us or ns")
    return index, time_unit or UNITS[word]


def _axis_column(path: Path, names: Sequence[str], axis: str, time_index: int) -> int:
    axes = {match[1].lower(): i for i, name in enumerate(names) if i != time_index and (match := AXIS.fullmatch(name))}
    others = [index for index in range(len(names)) if index != time_index]
    if axis in axes:
        return axes[axis]
    if len(others) == 1 and not axes:
        return others[0]
    raise UserError(
        f"{path}:1: no column of acceleration in {axis.upper()} among {', '.join(repr(name) for name in names[:8])}",
        hint="--axis names the column; if the sensor's axes are not the machine's, rename the columns in line 1",
    )


def _numbers(path: Path, rows: Sequence[tuple[int, list[str]]], index: int) -> Floats:
    values = np.empty(len(rows) - 1)
    for row, (number, cells) in enumerate(rows[1:]):
        try:
            values[row] = float(cells[index])
        except IndexError:
            raise UserError(f"{path}:{number}: only {len(cells)} columns") from None
        except ValueError:
            raise UserError(f"{path}:{number}: {cells[index].strip()!r} is not a number") from None
        if not np.isfinite(values[row]):
            raise UserError(f"{path}:{number}: {cells[index].strip()} is not a finite number")
    if len(values) < SAMPLES_MIN:
        raise UserError(
            f"{path} is too short: {len(values)} samples, at least {SAMPLES_MIN} are needed",
            hint="log a second or more",
        )
    return values


def _even(path: Path, column: str, t_s: Floats, values: Floats) -> Log:
    """Samples at even times: straight lines between what was logged."""
    if np.any(np.diff(t_s) < 0.0):
        row = int(np.argmax(np.diff(t_s) < 0.0)) + 3
        raise UserError(f"{path}: the time goes back near line {row}", hint="give a log of one recording")
    t_s, first = np.unique(t_s, return_index=True)
    values = values[first]
    if len(t_s) < SAMPLES_MIN or t_s[-1] < DURATION_MIN_S:
        raise UserError(
            f"{path} is too short: {len(t_s)} different times in {t_s[-1]:.3g} s; "
            f"at least {SAMPLES_MIN} in {DURATION_MIN_S:g} s are needed",
            hint="if the unit of time is wrong, give --time-unit s, ms, us or ns",
        )
    step_s = float(np.median(np.diff(t_s)))
    # A logger with a few wrong times must not set the rate: the mean of the steps that are usual.
    steps = np.diff(t_s)
    step_s = float(np.mean(steps[steps < 2.0 * step_s]))
    even = np.arange(0.0, t_s[-1], step_s)
    gaps = int(np.count_nonzero(steps > GAP_STEPS * step_s))
    return Log(column, 1.0 / step_s, np.interp(even, t_s, values), gaps)
