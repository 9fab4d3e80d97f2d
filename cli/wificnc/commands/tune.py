"""`wificnc tune pattern | measure | log | predict`: choose an input shaper."""

from __future__ import annotations

import functools
import importlib.util
import math
import re
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import rich_click as click
from rich.table import Table

from wificnc import ui
from wificnc.commands._finite import FINITE, FiniteRange
from wificnc.commands._output import OutputFile
from wificnc.commands._program import max_lines_option, progress_bar
from wificnc.commands._target import json_option
from wificnc.commands.settings import apply, ready, show_changes
from wificnc.connection.client import Target
from wificnc.connection.settings import Change, differences, name_of
from wificnc.errors import UserError
from wificnc.output import STDOUT, check_suffix, write_output
from wificnc.tables import load_settings
from wificnc.tune.choice import (
    ACCELERATION_MM_S2,
    SPREAD,
    Mode,
    Row,
    assignments,
    check_mode,
    recommended,
    rows,
    settings_line,
)
from wificnc.tune.pattern import PatternOptions, lines_of, pattern
from wificnc.tune.shapers import OFF
from wificnc.tune.waves import Waves, measured_mode

if TYPE_CHECKING:
    from wificnc.tune.predict import AxisPrediction

PLOT_SUFFIXES = (".png", ".svg")
AXIS_VALUE = re.compile(r"(?:([xyzabc])=)?(\d+\.?\d*|\.\d+)", re.IGNORECASE)
PLACE = re.compile(r"\s*X\s*([-+]?(?:\d+\.?\d*|\.\d+))[\s,]*Y\s*([-+]?(?:\d+\.?\d*|\.\d+))\s*", re.IGNORECASE)
DEFAULTS = PatternOptions()

spread_option = click.option(
    "--spread", type=FiniteRange(0.0, 50.0), default=100.0 * SPREAD, show_default=True, metavar="PERCENT",
    help="How much the frequency may differ, over the table and with the load.",
)  # fmt: skip
acceleration_option = click.option(
    "--acceleration", type=FiniteRange(0.0, min_open=True), default=ACCELERATION_MM_S2, show_default=True,
    metavar="MM/S2", help="Of the axis, for the rounding of corners.",
)  # fmt: skip
axis_option = click.option(
    "--axis", type=click.Choice(list("xyzabc"), case_sensitive=False), default="x", show_default=True,
    help="The axis that vibrates.",
)  # fmt: skip


def send_options(function: Callable[..., None]) -> Callable[..., None]:
    """--send, --to and --take: target is a Target, or None when nothing is to be sent."""

    @click.option("--send", is_flag=True, help="Send the settings to the controller of --to.")
    @click.option("--to", envvar="WIFICNC_TO", show_envvar=True, metavar="TARGET", help="Which controller.")
    @click.option("--take", is_flag=True, help="Take control from the client that is in control now.")
    @functools.wraps(function)
    def with_target(*arguments: Any, send: bool, to: str | None, take: bool, **options: Any) -> None:
        if send and to is None:
            raise UserError("--send needs a controller", hint="--to TARGET, or set WIFICNC_TO")
        function(*arguments, target=Target(to, take) if send and to else None, **options)

    return with_target


@click.group()
def command() -> None:
    """Choose an input shaper against the vibration of the frame.

    Draw the pattern and measure its waves, or log an accelerometer; then predict what a shaper does to a job.
    """


@command.command(name="pattern")
@click.option("-o", "--output", type=OutputFile(), required=True, metavar="OUT",
              help="Write the G-code here; - is stdout.")  # fmt: skip
@click.option("--axis", type=click.Choice(["x", "y"], case_sensitive=False), default=DEFAULTS.axis, show_default=True,
              help="The axis to test.")  # fmt: skip
@click.option("--tool", type=click.Choice(["pen", "cut", "laser"]), default=DEFAULTS.tool, show_default=True,
              help="What draws.")  # fmt: skip
@click.option("--feed", type=FINITE, default=DEFAULTS.feed_mm_min, show_default=True, help="mm/min.")
@click.option("--length", type=FINITE, default=DEFAULTS.length_mm, show_default=True,
              help="Of a line after its corner, mm.")  # fmt: skip
@click.option("--lines", type=click.IntRange(1, 50), default=DEFAULTS.lines, show_default=True, help="How many.")
@click.option("--spacing", type=FINITE, default=DEFAULTS.spacing_mm, show_default=True, help="Of the lines, mm.")
@click.option("--from-hz", "low", type=FINITE, default=DEFAULTS.low_hz, show_default=True,
              help="Frequency that the first line shows best, Hz.")  # fmt: skip
@click.option(
    "--to-hz", "high", type=FINITE, default=DEFAULTS.high_hz, show_default=True, help="That of the last line."
)
@click.option("--acceleration", type=FINITE, default=DEFAULTS.acceleration_mm_s2, show_default=True, metavar="MM/S2",
              help="Of the axis: $120 for X, $121 for Y.")  # fmt: skip
@click.option("--depth", type=FiniteRange(0.0), default=DEFAULTS.depth_mm, show_default=True,
              help="Of the drawing tool below Z0, mm.")  # fmt: skip
@click.option("--clear", type=FINITE, default=DEFAULTS.clear_mm, show_default=True, help="Height of rapids, mm.")
@click.option("--plunge", type=FINITE, default=DEFAULTS.plunge_mm_min, show_default=True, help="mm/min.")
@click.option("--speed", type=FiniteRange(0.0), default=DEFAULTS.speed, show_default=True,
              help="S word: rpm of a cut, power of a laser.")  # fmt: skip
@click.option("--start", default="X0Y0", show_default=True, metavar="X..Y..", help="Corner of the pattern with the "
              "lowest X and Y, mm.")  # fmt: skip
def pattern_(output: Path, axis: str, start: str, low: float, high: float, **numbers: Any) -> None:
    """Write a test pattern: lines with corners, next to which the vibration draws waves.

    Plain Grbl G-code. The comments in the file explain what to measure.
    """
    place = PLACE.fullmatch(start)
    if not place:
        raise UserError(f"--start {start!r}: must be like X10Y20")
    names = {"feed": "feed_mm_min", "length": "length_mm", "spacing": "spacing_mm", "depth": "depth_mm",
             "acceleration": "acceleration_mm_s2", "clear": "clear_mm", "plunge": "plunge_mm_min"}  # fmt: skip
    values = {names.get(name, name): value for name, value in numbers.items()}
    options = PatternOptions(
        axis=axis.lower(), low_hz=low, high_hz=high, start_x_mm=float(place[1]), start_y_mm=float(place[2]), **values
    )
    write_output("--output", output, pattern(options).encode())
    if output != STDOUT:
        ui.note(f"wrote {output}: {len(lines_of(options))} lines; check it with `wificnc check {output} --machine M`")
    ui.talk.print("before the test, switch the shaper off:")
    ui.talk.print(settings_line(assignments(axis, OFF, None)), markup=False)


@command.command()
@axis_option
@click.option("--feed", type=FINITE, required=True, help="Feed along the waves, mm/min.")
@click.option("--waves", type=FINITE, required=True, metavar="N", help="How many waves were measured.")
@click.option("--distance", type=FINITE, required=True, metavar="D", help="From the first to the last crest, mm.")
@click.option("--first", type=FINITE, metavar="A1", help="Height of a wave, in any unit.")
@click.option("--last", type=FINITE, metavar="A2", help="Height of a later wave, in the same unit.")
@click.option("--between", type=FINITE, metavar="N", help="Waves between these two; default: --waves.")
@spread_option
@acceleration_option
@send_options
@json_option
def measure(
    axis: str, feed: float, waves: float, distance: float, first: float | None, last: float | None,
    between: float | None, spread: float, acceleration: float, target: Target | None, as_json: bool,
) -> None:  # fmt: skip
    """Frequency and damping from the waves next to a line: N waves in D mm at feed F are N F / D.

    Damping is the logarithmic decrement of two heights; without them it is that of most machines.
    """
    mode = measured_mode(Waves(feed, waves, distance, first, last, between))
    if first is None and not as_json:
        ui.note(f"damping: {mode.damping:g}, as no heights were given (--first, --last)")
    _report(axis, mode, spread, acceleration, target, as_json, {})


@command.command()
@click.argument("file", type=click.Path(path_type=Path))
@axis_option
@click.option("--time-unit", type=click.Choice(["s", "ms", "us", "ns"]), help="Of the log, if its header lacks it.")
@click.option("--from-hz", "low", type=FINITE, help="Search from this frequency, Hz.")
@click.option("--to-hz", "high", type=FINITE, help="Search up to this frequency, Hz.")
@spread_option
@acceleration_option
@send_options
@json_option
def log(
    file: Path, axis: str, time_unit: str | None, low: float | None, high: float | None, spread: float,
    acceleration: float, target: Target | None, as_json: bool,
) -> None:  # fmt: skip
    """Frequency and damping from the log of an accelerometer: a CSV FILE with time and acceleration.

    Take it while the machine is tapped, or makes hard stops. Klipper's raw data and the logs of phones work.
    """
    _need("numpy", "tune log")
    from wificnc.tune.accelerometer import read_log
    from wificnc.tune.spectrum import analyse, search_band

    data = read_log(file, axis.lower(), time_unit)
    band = search_band(data, low, high)
    found = analyse(data, *band)
    if high is None and band[1] < load_settings()["shaper_hz"].max:
        ui.warn(f"{data.rate_hz:.0f} samples/s show vibrations up to {band[1]:.0f} Hz only")
    if data.gaps:
        ui.warn(f"{data.gaps} pauses in the log were bridged")
    if not as_json:
        taken = f"{data.duration_s:.1f} s, {data.rate_hz:.0f} samples/s"
        ui.data.print(f"{data.column}: {taken}; peak at {found.peak_hz:.1f} Hz", markup=False)
        for other in found.other_peaks_hz:
            ui.data.print(f"another peak at {other:.1f} Hz")
    extra = {"column": data.column, "rate_hz": data.rate_hz, "duration_s": data.duration_s, "peak_hz": found.peak_hz,
             "other_peaks_hz": list(found.other_peaks_hz)}  # fmt: skip
    _report(axis, found.mode, spread, acceleration, target, as_json, extra)


@command.command()
@click.argument("file", type=click.Path(path_type=Path))
@click.option("--hz", "frequencies", multiple=True, required=True, metavar="[AXIS=]F",
              help="Frequency of all axes, or of one: x=41.3; repeatable.")  # fmt: skip
@click.option("--damping", "dampings", multiple=True, metavar="[AXIS=]Z",
              help=f"Damping ratio, likewise. Default: {load_settings()['shaper_damping'].default:g}.")  # fmt: skip
@click.option("--board", default="host", show_default=True, help="Board id or TOML file, as for `wificnc sim`.")
@click.option("--machine", help="Machine profile, name or TOML file: steps/mm, rates, accelerations.")
@click.option("--set", "settings", multiple=True, metavar="NAME=VALUE",
              help="A setting on top of that, such as max_rate_mm_min.x=5000 or '$110=5000'; repeatable.")  # fmt: skip
@click.option("--plot", type=OutputFile(stdout=False), help="Draw the vibration before and after: .png or .svg.")
@spread_option
@max_lines_option
@send_options
@json_option
def predict(
    file: Path, frequencies: tuple[str, ...], dampings: tuple[str, ...], board: str, machine: str | None,
    settings: tuple[str, ...], plot: Path | None, spread: float, max_lines: int, target: Target | None, as_json: bool,
) -> None:  # fmt: skip
    """What each shaper leaves of the vibration in a job: FILE is G-code, or a trace of `wificnc sim --trace`.

    The step edges, shaped, drive a simulated mass on a spring.
    """
    _need("numpy", "tune predict")
    if plot:
        check_suffix("--plot", plot, PLOT_SUFFIXES)
        _need("matplotlib", "--plot")
    from wificnc.tune.predict import PredictOptions
    from wificnc.tune.predict import predict as run

    modes = parse_modes(frequencies, dampings)
    options = PredictOptions(file, modes, board, machine, settings, spread / 100.0, max_lines)
    with progress_bar(file.name) as on_progress:
        found = run(options, on_progress)
    if plot:
        from wificnc.tune.plot import draw  # matplotlib: half a second, and not everyone has it

        write_output("--plot", plot, draw(file.name, found, plot.suffix[1:].lower()))
    values = {n: text for axis in found for n, text in assignments(axis.axis, axis.best, axis.mode).items()}
    if as_json:
        ui.emit_json({"file": str(file), "axes": {axis.axis: _axis_json(axis) for axis in found},
                      "settings": _settings_json(values)})  # fmt: skip
    else:
        for axis in found:
            _print_prediction(axis, spread)
        ui.note("µm; moving: at constant speed; ±: the largest when the frequency is off by so much")
    if plot:
        ui.note(f"wrote {plot}")
    _finish(values, target, as_json)


# ---- words ----


def parse_modes(frequencies: Sequence[str], dampings: Sequence[str]) -> dict[str, Mode]:
    """("41.3",) or ("x=41.3", "y=36") and dampings likewise -> modes by letter; "" = all others. Raises UserError."""
    by_axis, damped = (_by_axis(option, texts) for option, texts in (("--hz", frequencies), ("--damping", dampings)))
    if strange := sorted(set(damped) - set(by_axis) - {""}):
        raise UserError(f"--damping {strange[0]}=...: this axis has no --hz")
    default = damped.get("", float(load_settings()["shaper_damping"].default))
    return {letter: check_mode(hz, damped.get(letter, default)) for letter, hz in by_axis.items()}


def _by_axis(option: str, texts: Sequence[str]) -> dict[str, float]:
    found: dict[str, float] = {}
    for text in texts:
        match = AXIS_VALUE.fullmatch(text.strip())
        if not match:
            raise UserError(f"{option} {text!r}: must be a number, or like x=41.3")
        letter = (match[1] or "").lower()
        if letter in found:
            raise UserError(f"{option}: {letter or 'all axes'} given twice")
        found[letter] = float(match[2])
    return found


def _need(module: str, what: str) -> None:
    if importlib.util.find_spec(module) is None:
        raise UserError(f"{what} needs {module}", hint=f"pip install {module}")


def _report(
    axis: str, mode: Mode, spread: float, acceleration: float, target: Target | None, as_json: bool,
    extra: dict[str, Any],
) -> None:  # fmt: skip
    """A vibration, all shapers, the recommended one."""
    table = rows(mode, spread / 100.0, acceleration)
    best = recommended(table)
    values = assignments(axis, best, mode)
    if as_json:
        ui.emit_json({"axis": axis, "hz": mode.hz, "damping": mode.damping, **extra, "recommended": best.name,
                      "shapers": [row.json() for row in table], "settings": _settings_json(values)})  # fmt: skip
    else:
        ui.data.print(f"[bold]{axis.upper()}: {mode.hz:.2f} Hz, damping {mode.damping:.3f}[/]")
        ui.data.print(_shaper_table(table, spread))
        ui.note(f"rounding: in a curve at {acceleration:g} mm/s²; longer: until the axis rests")
        ui.data.print(f"recommended: {best.name} ({best.words})")
    _finish(values, target, as_json)


def _table(*columns: str) -> Table:
    table = Table(box=None, pad_edge=False, padding=(0, 2, 0, 0), header_style="dim")
    for index, column in enumerate(columns):
        table.add_column(column, justify="right" if index else "left", no_wrap=True)
    return table


def _shaper_table(found: Sequence[Row], spread: float) -> Table:
    table = _table("shaper", "leaves", f"-{spread:g} %", f"+{spread:g} %", "delay", "longer", "rounding")
    for row in found:
        parts = (f"{100.0 * left:.1f} %" for left in (row.residual, row.residual_low, row.residual_high))
        costs = (f"{1e3 * row.delay_s:.1f} ms", f"{1e3 * row.duration_s:.1f} ms", f"{1e3 * row.rounding_mm:.1f} µm")
        table.add_row(row.shaper.name, *parts, *costs)
    return table


def _print_prediction(axis: AxisPrediction, spread: float) -> None:
    ui.data.print(f"[bold]{axis.axis.upper()}: {axis.mode.hz:.2f} Hz, damping {axis.mode.damping:.3f}[/]; "
                  f"a step is {axis.step_um:.3g} µm")  # fmt: skip
    table = _table("shaper", "rest rms", "max", "moving rms", "max", f"±{spread:g} %", "delay", "rounding")
    for row in axis.rows:
        seen = row.vibration
        numbers = (seen.rest_rms_um, seen.rest_max_um, seen.moving_rms_um, seen.moving_max_um, row.spread_um)
        costs = (f"{1e3 * row.delay_s:.1f} ms", f"{1e3 * row.rounding_mm:.1f}")
        table.add_row(row.shaper.name, *("-" if math.isnan(number) else f"{number:.2f}" for number in numbers), *costs)
    ui.data.print(table)
    if axis.best is OFF:
        ui.data.print("recommended: off (the vibration is smaller than half a step)")
    else:
        before, after = (row.worst_um for row in axis.rows if row.shaper in (OFF, axis.best))
        ui.data.print(f"recommended: {axis.best.name} (at most {after:.1f} µm instead of {before:.1f} µm)")


def _axis_json(axis: AxisPrediction) -> dict[str, Any]:
    return {
        "hz": axis.mode.hz, "damping": axis.mode.damping, "step_um": axis.step_um,
        "acceleration_mm_s2": axis.acceleration_mm_s2, "recommended": axis.best.name,
        "shapers": [row.json() for row in axis.rows],
    }  # fmt: skip


def _settings_json(values: dict[int, str]) -> dict[str, float]:
    return {name_of(number): float(text) for number, text in values.items()}


def _finish(values: dict[int, str], target: Target | None, as_json: bool) -> None:
    """The settings, printed or sent."""
    if not as_json:
        ui.data.print(settings_line(values), markup=False)
    if target is None:
        return
    with ready(target) as client:
        before = client.settings()
        apply(
            client, [Change(number, name_of(number), "", before.get(number), text) for number, text in values.items()]
        )
        changes = differences(before, client.settings())
    show_changes(changes)
    ui.note(f"{len(changes)} changed" if changes else "no setting was changed")
