"""The same program makes the same steps, however fast it is read and however rarely the tasks look: what a piece of the
path may do is decided by the pieces behind it, not by the time when they came."""

from __future__ import annotations

import math
from functools import cache

import numpy as np
import pytest
from motion_host import BASELINE, Host, Run
from numpy.typing import NDArray
from structured import FIXED
from wificnc.simulator.library import Tasks

END = "M2\n"
REST_S = 0.005  # from the last step before a stop to the first one after it


def surface(rows: int = 3, points: int = 200) -> str:
    """Every axis bends, nothing can be left out, and no piece is ever settled by those next to it."""
    lines = ["G90G1F5000"]
    for row in range(rows):
        for n in range(points + 1):
            x, y = 0.2 * (n if row % 2 == 0 else points - n), 0.5 * row
            z = 1.5 * math.sin(0.9 * x) * math.cos(0.7 * y) + 0.4 * math.sin(2.3 * x + y)
            lines.append(f"X{x:.3f}Y{y:.3f}Z{z:.3f}")
    return "\n".join(lines) + "\n"


def chopped_circle(count: int = 3000) -> str:
    angles = [math.tau * n / count for n in range(1, count + 1)]
    return "G90G1F5000\n" + "".join(f"X{20 * math.sin(a):.4f}Y{20 - 20 * math.cos(a):.4f}\n" for a in angles)


def stops() -> str:
    """Moves that end at rest, by themselves and for a spindle."""
    corners = "".join(f"X{n % 7}Y{n % 5}\n" for n in range(60))
    return f"G90G61G1F4000\n{corners}G64\n{corners}M3S100\n{corners}G4P0.05\n{corners}"


PROGRAMS = {"surface": surface(), "circle": chopped_circle(), "stops": stops(), "wave": FIXED["wave"].program()}


def controller(tasks: Tasks = Tasks.FREE, jerk_mm_s3: float = 0.0) -> Host:
    host = Host(axes=3, tasks=tasks)
    host.settings(
        **{name: value for name, value in BASELINE.items() if int(name[1:]) % 10 < 3},
        s11=0.01,
        s12=0.002,
        s40=jerk_mm_s3,
    )
    return host


@cache
def at_once(name: str, jerk_mm_s3: float = 0.0) -> Run:
    host = controller(jerk_mm_s3=jerk_mm_s3)
    run = host.run(PROGRAMS[name] + END)
    host.close()
    return run


def assert_same_steps(run: Run, name: str, jerk_mm_s3: float = 0.0) -> None:
    same_steps(run, at_once(name, jerk_mm_s3))


def same_steps(run: Run, wanted: Run) -> None:
    assert run.counters.underruns == 0 and run.counters.lookahead_starved == 0
    assert len(run.events) == len(wanted.events)
    for field in ("step", "dir"):
        assert (run.events[field] == wanted.events[field]).all()
    ticks, right = between_steps(run), between_steps(wanted)
    assert (ticks == right).all(), f"from {wanted.seconds()[np.argmax(ticks != right)]:.3f} s on"


def between_steps(run: Run) -> NDArray[np.int64]:
    """Ticks from each step to the next one. How long a rest takes for a spindle or a dwell depends on the tasks."""
    ticks = np.diff(run.events["t"].astype(np.int64))
    return np.where(ticks > REST_S * run.timer_hz, 0, ticks)


@pytest.mark.parametrize("jerk_mm_s3", [0.0, 50_000.0])
@pytest.mark.parametrize("tasks", [Tasks.ESP32, Tasks.PIC32MZ])
@pytest.mark.parametrize("name", PROGRAMS)
def test_the_tasks_of_a_board_make_the_same_steps(name: str, tasks: Tasks, jerk_mm_s3: float) -> None:
    host = controller(tasks, jerk_mm_s3)
    run = host.run(PROGRAMS[name] + END)
    host.close()
    assert_same_steps(run, name, jerk_mm_s3)


@pytest.mark.parametrize("poll_ms", [0.1, 0.7, 4.0, 11.0, 20.0])
@pytest.mark.parametrize("name", PROGRAMS)
def test_it_does_not_matter_how_often_the_controller_looks(name: str, poll_ms: float) -> None:
    """It looks for an instant, and then not for a while."""
    host = controller()
    host.look_each(poll_ms / 1000)
    run = host.run(PROGRAMS[name] + END)
    host.close()
    assert_same_steps(run, name)


@pytest.mark.parametrize(("name", "bytes_per_ms"), [("surface", 40), ("surface", 150), ("circle", 600), ("stops", 12)])
def test_it_does_not_matter_how_fast_the_sender_is(name: str, bytes_per_ms: int) -> None:
    """As long as it is faster than the machine, and fills the look-ahead before that starts."""
    host = controller()
    run = host.paced(PROGRAMS[name] + END, bytes_per_ms)
    host.close()
    assert_same_steps(run, name)


CORNERS = "G21G90\nG1X10F3000\nX12Y7\nX0Y3\nG2X5Y8I5J0\nG0X0Y0\nG1X-3Y1Z2F1200\nX0Y0Z0F600\n"
# All of it has come within the 50 ms that a machine at rest waits for more.
SHORT = {"corners": CORNERS, "surface": surface(1, 20), "circle": chopped_circle(25), "line": "G90G1X7Y5F2000\n"}


@pytest.mark.parametrize("jerk_mm_s3", [0.0, 20_000.0, 50_000.0])
@pytest.mark.parametrize("name", SHORT)
def test_the_steps_of_a_short_program_do_not_depend_on_when_its_end_is_found(name: str, jerk_mm_s3: float) -> None:
    """By a line that waits for rest, by a sender that says it, or because no more has come."""
    host = controller(jerk_mm_s3=jerk_mm_s3)
    wanted = host.run(SHORT[name] + END)
    host.close()
    for tasks in (Tasks.FREE, Tasks.ESP32, Tasks.PIC32MZ):
        for bytes_per_ms in (None, 11, 1000):
            host = controller(tasks, jerk_mm_s3)
            run = host.paced_like_a_chip(SHORT[name], bytes_per_ms) if bytes_per_ms else host.run(SHORT[name])
            host.close()
            same_steps(run, wanted)
