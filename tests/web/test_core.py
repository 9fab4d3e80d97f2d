"""The core in WebAssembly is the core: whole jobs give the simulator's figures, resumes are those of `wificnc send`.

This computer's library says what is right; web/test/core.test.ts compares.
"""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path

import numpy as np
import pytest
from wificnc.board.load import load_board
from wificnc.build.host import ensure_host_library
from wificnc.errors import JobError
from wificnc.job.program import Program, read_program
from wificnc.job.rebuild import load_rebuild
from wificnc.job.resume import MachineFacts, plan_resume
from wificnc.profile import load_machine
from wificnc.simulator.engraving import pieces_from
from wificnc.simulator.job import JobRequest, SimResult, Timing, run_job
from wificnc.simulator.library import load_library
from wificnc.simulator.look import ACCURACY_PARTS, SPEED_LEVELS
from wificnc.simulator.path import path_from_samples, simplify
from wificnc.simulator.report import laser_warning
from wificnc.simulator.serve.options import board_numbers

from web.build import install_packages, missing_tools, run_npm
from web.wasm import build_wasm

pytestmark = pytest.mark.slow  # compiles the core for browsers

ROOT = Path(__file__).resolve().parents[2]
EXAMPLES = ("pcb_outline.nc", "plot.nc")
RESUME_LINES = 12  # of each program, spread over it
HERE_MM = (3.25, -4.5, -1.0)
OFFSETS = {
    "G54": (5.0, 6.0, -7.0), **{f"G{n}": (0.0, 0.0, 0.0) for n in (55, 56, 57, 58, 59)},
    "G28": (1.0, 2.0, 3.0), "G30": (0.0, 0.0, 0.0), "G92": (0.0, 0.0, 0.0), "TLO": (0.0,),
}  # fmt: skip
WORK_MM = tuple(mm - off for mm, off in zip(HERE_MM, OFFSETS["G54"], strict=True))
FACTS = MachineFacts(3, WORK_MM, HERE_MM, OFFSETS, modes=("G55", "F750"))
MODES = """G21 G90 G17 G54
T3
S12000 M3
G0 Z5
G0 X10 Y10
M8
G1 Z-1 F150
G1 X20 F800
G2 X30 Y10 I0 J-10
G91
G1 X-5
G90
G20
G1 X1 Y0.5 F20
G21
G18
G3 X20.4 Z-2 R5
G17
G93
G1 X10 Y10 F2
G94
G64 P0.05
G1 X0 F500
M9
G61
G0 Z5
G92 X0
G0 X0 Y0
"""
CAM = "%\nO1000 (BRACKET)\nT1 M6\nG21G90G1X5F300\nM0\nT2\nM6\nG1X9\nM30\n%\n"
LASER = """M3 S0 F3000
G0 X2 Y2
G1 X32 S700
Y32 S300
G2 X12 Y12 I-20
M4
G1 X40 S1000
M5
"""
BROKEN = "G21G90\nG1X5F300\nG1X6Q\nG99\nG1X300F6000\n"


def test_it_is_the_same_core(tmp_path: Path) -> None:
    if why := missing_tools():
        pytest.skip(why)
    install_packages(ROOT)
    build_wasm(ROOT)
    sources = {name: (ROOT / "examples" / name).read_text() for name in EXAMPLES} | {
        "broken.nc": BROKEN,
        "cam.nc": CAM,
        "laser.nc": LASER,
    }
    resumes = [
        case
        for name, text in {"modes.nc": MODES, EXAMPLES[0]: sources[EXAMPLES[0]]}.items()
        for case in resume_cases(name, text)
    ]
    assert any(case["preamble"] for case in resumes) and any(not case["preamble"] for case in resumes)
    cases = tmp_path / "cases.json"
    cases.write_text(json.dumps({"jobs": [job_case(name, text) for name, text in sources.items()], "resumes": resumes}))
    said = run_npm(ROOT, "test", "--", "test/core.test.ts", "--reporter=json", WIFICNC_CORE_CASES=str(cases))
    result = json.loads(said[said.index("{") :])
    assert result["success"] and result["numPassedTests"] == 2 * len(sources) + len(resumes)


def job_case(name: str, text: str) -> dict[str, object]:
    board, settings = load_board("host"), tuple(load_machine("shapeoko3").settings_lines())
    settings = (*settings, "$32=1", "$30=1000") if text == LASER else settings
    numbers = board_numbers(board)
    timing = Timing(
        *(numbers[key] for key in ("timer_hz", "step_pulse_ns", "dir_setup_ns", "max_step_rate_hz", "axes"))
    )
    request = JobRequest(file=name, text=text.encode(), timing=timing, settings=settings, keep_going=True, samples=True)
    result = run_job(load_library(ensure_host_library()), request)
    return {
        "name": name,
        "source": text,
        "board": {**numbers, "ganged": 0, "missing_outputs": 0, "digital_inputs": 0, "analog": 0, "home_axes": 0},
        "settings": settings,
        "seconds": result.job_time_s,
        "min_mm": result.box_min_mm,
        "max_mm": result.box_max_mm,
        "errors": [[error.line, error.code] for error in result.errors],
        "tool_changes": [{"line": change.line, "tool": change.tool} for change in result.tool_changes],
        "drawn": drawn(result),
        "burnt": burnt(result),
    }


def burnt(result: SimResult) -> dict[str, object] | None:
    """What it says and draws of a laser."""
    if result.engraving is None:
        return None
    pieces, _ = pieces_from(result.engraving.pieces, None)
    message, hint = laser_warning(result) or ("", "")
    return {
        "black": pieces.black,
        "energies": pieces.energy_by_mm.tolist(),
        "slow_mm": result.engraving.slow_mm,
        "worst": result.engraving.worst,
        "worst_line": result.engraving.worst_line,
        "said": f"{message}. {hint}.",
    }


def drawn(result: SimResult) -> dict[str, object]:
    """What `wificnc sim --plot` draws of it."""
    low, high = (np.array(box[:3]) for box in (result.box_min_mm, result.box_max_mm))
    path = path_from_samples(result.samples)
    kept = simplify(path, max(float((high - low).max()), 1e-3) / ACCURACY_PARTS)
    levels = np.minimum((kept.speed_mm_min / path.top_speed_mm_min * SPEED_LEVELS).astype(int), SPEED_LEVELS)
    return {
        "top_mm_min": path.top_speed_mm_min,
        "seconds": kept.t_s.tolist(),
        "levels": np.where(kept.rapid, -1, levels).tolist(),
    }


def resume_cases(name: str, text: str) -> list[dict[str, object]]:
    program = read_program(name, text.encode())
    step = max(1, len(program.lines) // RESUME_LINES)
    return [_resume(program, name, text, line.number) for line in program.lines[1::step]]


def _resume(program: Program, name: str, text: str, line: int) -> dict[str, object]:
    """With what the page is to say; preamble None: it must refuse."""
    try:
        plan = plan_resume(load_rebuild(ensure_host_library()), program, line, FACTS)
        preamble = [job_line.code for job_line in plan.preamble]
        first = plan.rest[0].code
    except JobError:
        preamble, first = None, None
    facts = {**asdict(FACTS), "axisCount": FACTS.axis_count, "modes": " ".join(FACTS.modes)}
    return {"name": name, "source": text, "line": line, "facts": facts, "preamble": preamble, "first": first}
