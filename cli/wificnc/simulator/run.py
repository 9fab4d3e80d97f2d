"""From the options of `wificnc sim` to a result and its files. What can be refused is refused before the run."""

from __future__ import annotations

import importlib.util
import json
import re
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from wificnc.board.load import load_board
from wificnc.board.model import Board
from wificnc.board.rules import step_spread_ns
from wificnc.board.shift_registers import step_grid_ns
from wificnc.build.host import ensure_host_library
from wificnc.connection.settings import assignment
from wificnc.errors import JobError, UserError
from wificnc.job.program import read_program
from wificnc.output import Output, check_suffix
from wificnc.profile import load_machine
from wificnc.profile.fit import check_fit
from wificnc.profile.model import Machine
from wificnc.simulator.job import At, JobRequest, Progress, SimResult, Timing, read_job, run_job
from wificnc.simulator.library import AXES, Tasks, load_library
from wificnc.simulator.report import report_json
from wificnc.simulator.trace import TRACE_SUFFIXES, TraceFile, signal_names

AT = re.compile(r"(\d+\.?\d*|\.\d+)\s*(s|ms|min)\s+(\S.*)")
UNIT_S = {"s": 1.0, "ms": 0.001, "min": 60.0}
PLOT_SUFFIXES = (".png", ".svg")
VALUE = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)", re.ASCII)


@dataclass(frozen=True)
class SimOptions:
    """What the user asked for."""

    file: Path
    board: str = "host"
    machine: str | None = None
    settings: tuple[str, ...] = ()
    json: Path | None = None
    plot: Path | None = None
    laser_w: float | None = None  # optical power, for the picture
    trace: Path | None = None
    keep_going: bool = False
    at: tuple[str, ...] = ()
    lines_max: int | None = None  # of a program with O words; None = the simulator's own limit


def simulate(options: SimOptions, on_progress: Progress | None = None) -> SimResult:
    """Run the job and write what was asked for.

    Raises:
        UserError: an option, the board, the machine or an output cannot be; nothing was run or nothing is left over.
        JobError: the file cannot be read.
    """
    _check_options(options)
    settings = tuple(parse_setting(text) for text in options.settings)
    events = tuple(parse_at(text) for text in options.at)
    text = read_job(options.file)
    read_program(options.file.name, text)  # refuses what `wificnc send` refuses
    board = load_board(options.board)
    machine = load_machine(options.machine) if options.machine else None
    check_axes(board, machine)
    library = load_library(ensure_host_library())
    with _outputs(options) as outputs:
        trace = _trace_file(outputs.get("--trace"), board)
        request = JobRequest(
            file=str(options.file),
            text=text,
            timing=board_timing(board),
            settings=(*(machine.settings_lines() if machine else ()), *settings),
            keep_going=options.keep_going,
            lines_max=options.lines_max,
            trace=trace,
            samples=options.plot is not None,
            events=events,
            travel_mm=machine.travel_mm if machine else (None,) * len(AXES),
        )
        try:
            result = run_job(library, request, on_progress)
            _write(outputs, result, trace, options.laser_w)
        finally:
            if trace:
                trace.clean()
    return result


def parse_setting(text: str) -> str:
    """'max_rate_mm_min.x=5000' or '$110=5000' as the controller reads it. Raises UserError."""
    try:
        number, value = assignment(text)
    except UserError as err:
        raise UserError(f"--set {text!r}: {err.message}", err.hint) from err
    if not VALUE.fullmatch(value):
        raise UserError(f"--set {text!r}: {value!r} is not a number", hint="a setting looks like '$110=5000'")
    return f"${number}={value}"


def parse_at(text: str) -> At:
    """'2.5s limit x', '300 ms hold' or '1.5min estop' as an event. Raises UserError."""
    found = AT.fullmatch(text.strip())
    if not found:
        raise UserError(f"--at {text!r} has no time", hint="an event looks like '2.5s limit x' or '300ms hold'")
    return At(float(found[1]) * UNIT_S[found[2]], " ".join(found[3].lower().split()))


def _check_options(options: SimOptions) -> None:
    if options.trace:
        check_suffix("--trace", options.trace, TRACE_SUFFIXES)
    if options.laser_w is not None and options.plot is None:
        raise UserError("--laser-w is for the picture", hint="--plot P.png draws it")
    if options.plot:
        check_suffix("--plot", options.plot, PLOT_SUFFIXES)
        if importlib.util.find_spec("matplotlib") is None:
            raise UserError("--plot needs matplotlib", hint="pip install matplotlib")


def check_axes(board: Board, machine: Machine | None) -> None:
    """A machine fits a board that has its axes. Raises UserError."""
    if machine:
        check_fit(board, machine)


def board_timing(board: Board) -> Timing:
    """What this board fixes for a simulation."""
    timing = board.timing
    rates = (timing.timer_hz, timing.step_pulse_ns, timing.dir_setup_ns, timing.max_step_rate_hz)
    return Timing(
        *rates,
        len(board.axes),
        board.ganged_axes,
        board.missing_outputs,
        board.digital_inputs,
        board.has_analog,
        digital_outputs=board.digital_outputs,
        encoder=board.encoder is not None,
        home_axes=board.home_axes,
        tasks=Tasks.of(board.target),
        default_pulse_us=board.timing.default_pulse_us,
        step_spread_ns=step_spread_ns(board),
        step_grid_ns=step_grid_ns(board),
        look_ahead=board.look_ahead,
        laser_marks=board.laser_marks,
        toolsetter=board.input.toolsetter is not None,
        switchless=board.switchless,
        spindle_bus=board.spindle_bus is not None,
        dial=board.dial_code,
        driver=tuple(board.driver_codes),
    )


@contextmanager
def _outputs(options: SimOptions) -> Iterator[dict[str, Output]]:
    """All output files, staged; what is not published when the block ends vanishes."""
    wanted = {"--json": options.json, "--plot": options.plot, "--trace": options.trace}
    outputs: dict[str, Output] = {}
    try:
        for option, path in wanted.items():
            if path is not None:
                outputs[option] = Output(option, path)
        yield outputs
    finally:
        for output in outputs.values():
            output.discard()


def _trace_file(output: Output | None, board: Board) -> TraceFile | None:
    if output is None:
        return None
    return TraceFile(output.path, output.staged, signal_names(board.pin_names(), "".join(board.axes)))


def _complete(trace: TraceFile) -> None:
    try:
        trace.complete()
    except OSError as err:
        raise JobError(f"cannot write the trace {trace.path}: {err.strerror}") from err


def _write(outputs: dict[str, Output], result: SimResult, trace: TraceFile | None, laser_w: float | None) -> None:
    if trace:
        _complete(trace)
        outputs["--trace"].publish()
    if "--plot" in outputs:
        from wificnc.simulator.plot import draw_job  # matplotlib: half a second, and not everyone has it

        outputs["--plot"].write(draw_job(result, outputs["--plot"].path.suffix[1:].lower(), laser_w))
    if "--json" in outputs:
        document = json.dumps(report_json(result), indent=2, ensure_ascii=False) + "\n"
        outputs["--json"].write(document.encode())
