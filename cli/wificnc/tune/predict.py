"""What each shaper would do to a job: the step edges of the simulator, shaped, drive a simulated mass. Needs numpy."""

from __future__ import annotations

import math
import tempfile
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from wificnc.board.load import load_board
from wificnc.errors import JobError, UserError
from wificnc.profile import load_machine
from wificnc.simulator.job import Progress
from wificnc.simulator.report import error_line
from wificnc.simulator.run import SimOptions, parse_setting, simulate
from wificnc.tables import AXES, load_settings
from wificnc.tune.choice import GOOD, SPREAD, Mode
from wificnc.tune.mass import Vibration, vibrations
from wificnc.tune.motion import AxisMotion, Trace, read_trace
from wificnc.tune.shapers import OFF, SHAPERS, TWO_HUMP_EI, Shaper, impulses

TRACES = (".npz", ".csv")
STEPS_NOTICED = 0.5  # of a step: less vibration than this cannot be told from the steps


@dataclass(frozen=True)
class PredictOptions:
    """What the user asked for."""

    file: Path
    modes: Mapping[str, Mode]  # by letter; "" = all axes that are not named
    board: str = "host"
    machine: str | None = None
    settings: tuple[str, ...] = ()
    spread: float = SPREAD
    lines_max: int | None = None


@dataclass(frozen=True)
class Prediction:
    """One shaper on one axis."""

    shaper: Shaper
    vibration: Vibration
    spread_um: float  # the most, at rest or at constant speed, of a frequency that is off by the spread
    delay_s: float
    duration_s: float
    rounding_mm: float

    @property
    def worst_um(self) -> float:
        """At the frequency and off it, at rest and at constant speed."""
        return max(self.spread_um, _most(self.vibration))

    def json(self) -> dict[str, Any]:
        named = {"shaper": self.shaper.name, "value": self.shaper.value}
        numbers = {**asdict(self.vibration), **{key: getattr(self, key) for key in
                   ("spread_um", "delay_s", "duration_s", "rounding_mm")}}  # fmt: skip
        return {**named, **{key: None if math.isnan(value) else value for key, value in numbers.items()}}


@dataclass(frozen=True)
class AxisPrediction:
    """All shapers on one axis."""

    axis: str
    mode: Mode
    step_um: float
    acceleration_mm_s2: float
    rows: tuple[Prediction, ...]
    motion: AxisMotion

    @property
    def best(self) -> Shaper:
        """The shortest shaper that leaves GOOD of the vibration, or less than can be seen; off if that holds for it."""
        unseen = STEPS_NOTICED * self.step_um
        off = next(row for row in self.rows if row.shaper is OFF)
        if off.worst_um <= unseen:
            return OFF
        shaped = (row for row in self.rows if row.shaper is not OFF)
        return next((row.shaper for row in shaped if row.worst_um <= max(GOOD * off.worst_um, unseen)), TWO_HUMP_EI)


def predict(options: PredictOptions, on_progress: Progress | None = None) -> tuple[AxisPrediction, ...]:
    """Every axis that moves and has a frequency.

    Raises:
        UserError: an option, the board or the machine cannot be.
        JobError: the file cannot be read, or a line of the job is refused.
    """
    values = _machine_values(options)
    trace = _trace(options, on_progress)
    found = []
    for index, letter in enumerate(AXES.lower()):
        mode = options.modes.get(letter) or (options.modes.get("") if letter in "xyz" else None)
        motion = trace.axis(index, values["steps_per_mm"][index]) if mode else None
        if mode and motion:
            found.append(_axis(options, letter, mode, motion, values, index))
    if not found:
        raise JobError("no axis with a frequency moves in this job", hint="--hz x=41.3 gives an axis its frequency")
    return tuple(found)


def _axis(
    options: PredictOptions, letter: str, mode: Mode, motion: AxisMotion, values: dict[str, list[float]], index: int
) -> AxisPrediction:
    acceleration = values["acceleration_mm_s2"][index]
    rows = []
    masses = [Mode(mode.hz * factor, mode.damping) for factor in (1.0, 1.0 - options.spread, 1.0 + options.spread)]
    for shaper in SHAPERS:
        shape = impulses(shaper, mode.hz, mode.damping)
        here, *off = vibrations(motion, shape, masses, acceleration)
        costs = (shape.delay_s, shape.duration_s, shape.rounding_mm(acceleration))
        rows.append(Prediction(shaper, here, max(map(_most, off)), *costs))
    step_um = 1000.0 / values["steps_per_mm"][index]
    return AxisPrediction(letter, mode, step_um, acceleration, tuple(rows), motion)


def _most(vibration: Vibration) -> float:
    """The larger one of rest and motion, of which one may not occur."""
    return max(0.0, *(most for most in (vibration.rest_max_um, vibration.moving_max_um) if not math.isnan(most)))


# ---- the machine and the trace ----


def _machine_values(options: PredictOptions) -> dict[str, list[float]]:
    """Steps per mm and acceleration of each axis: of the machine, of --set, or the controller's defaults."""
    table = load_settings()
    given = dict(load_machine(options.machine).settings()) if options.machine else {}
    given |= {int(number[1:]): float(value) for number, _, value in
              (parse_setting(text).partition("=") for text in options.settings)}  # fmt: skip
    steps = table["steps_per_mm"]
    if options.file.suffix.lower() in TRACES and not any(steps.number + i in given for i in range(steps.count)):
        raise UserError(
            "a trace does not say its steps per mm", hint=f"--machine, or --set '${steps.number}=80', as it was made"
        )
    if int(given.get(table["kinematics"].number, 0)):
        raise UserError("predict needs a machine whose motors are its axes", hint="log the frame: `wificnc tune log`")
    rows = {name: table[name] for name in ("steps_per_mm", "acceleration_mm_s2")}
    return {
        name: [float(given.get(row.number + index, row.default)) for index in range(row.count)]
        for name, row in rows.items()
    }


def _trace(options: PredictOptions, on_progress: Progress | None) -> Trace:
    """The step edges without any shaper: of the file, or of the job."""
    if options.file.suffix.lower() in TRACES:
        return read_trace(options.file)
    shaper = load_settings()["shaper"].number
    off = (f"${shaper + index}=0" for index in range(len(load_board(options.board).axes)))
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "trace.npz")
        result = simulate(
            SimOptions(
                options.file, options.board, options.machine, (*options.settings, *off), trace=path,
                lines_max=options.lines_max,
            ),
            on_progress,
        )  # fmt: skip
        if result.errors:
            raise JobError(error_line(result.file, result.errors[0]), hint="`wificnc check` lists all errors")
        if not result.step_events:
            raise JobError(f"{options.file} moves no axis")
        return read_trace(path)
