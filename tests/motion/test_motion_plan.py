"""The plan itself, and what the forward pass does with one that it cannot follow (plan_law.c)."""

from __future__ import annotations

import functools
import json
import subprocess
from dataclasses import dataclass
from pathlib import Path as File

import numpy as np
import pytest
from c_library import EVENT
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from lawful import FINE, assert_accelerations
from motion_host import AXES
from numpy.typing import NDArray
from patience import HANG_S
from structured import FIXED, Path, structured_paths
from wificnc.build.checkout import checkout_root
from wificnc.build.host import build_program

TIMER_HZ = 20_000_000
common = settings(max_examples=40, suppress_health_check=list(HealthCheck))


@functools.cache
def driver() -> File:
    here = File(__file__).parent
    return build_program([here / "plan_law.c"], checkout_root() / "build" / "tests" / "plan_law")


@dataclass(frozen=True)
class Outcome:
    checked: int
    wrong: int
    lowered: int
    unmet: int
    position: list[int]
    t_s: NDArray[np.float64]
    at_steps: NDArray[np.int64]


def run(program: str, least_part: float, trace: File) -> Outcome:
    words = [f"${name[1:]}={value}" for name, value in FINE.settings().items()]
    argv = [driver(), trace, str(least_part), *words]
    done = subprocess.run(argv, input=program, capture_output=True, text=True, timeout=HANG_S, check=True)
    events = np.fromfile(trace, EVENT)
    bit = np.arange(AXES)
    sense = 1 - 2 * (events["dir"][:, None] >> bit & 1).astype(np.int64)
    at = np.cumsum((events["step"][:, None] >> bit & 1) * sense, axis=0)
    outcome = Outcome(**json.loads(done.stdout), t_s=events["t"] / TIMER_HZ, at_steps=at)
    assert outcome.wrong == 0, done.stderr
    return outcome


def ends_at(path: Path) -> list[int]:
    return [round(value) for value in path.vertices()[-1][:3] * FINE.steps_per_mm]


@pytest.mark.alike(30)
@pytest.mark.parametrize("name", FIXED)
def test_every_speed_of_the_plan_can_be_kept(name: str, tmp_path: File) -> None:
    outcome = run(FIXED[name].program(), 1.0, tmp_path / "trace")
    assert outcome.checked > 3 or "gon" not in name
    assert outcome.unmet == 0


@pytest.mark.slow
@common
@given(path=structured_paths())
def test_every_speed_of_any_plan_can_be_kept(tmp_path_factory: pytest.TempPathFactory, path: Path) -> None:
    outcome = run(path.program(), 1.0, tmp_path_factory.mktemp("plan") / "trace")
    assert outcome.unmet == 0


@pytest.mark.parametrize("part", [0.05, 0.5, 0.9])
@pytest.mark.parametrize(
    "name", ["wave", "24-gon, edge first", "spiral", "compass of 8", "power every 0.1 mm of a circle"]
)
def test_a_plan_that_asks_for_too_much_braking_is_not_obeyed(name: str, part: float, tmp_path: File) -> None:
    """The limits are kept, the end is exact, and what could not be followed is counted."""
    path = FIXED[name]
    outcome = run(path.program(), part, tmp_path / "trace")
    assert outcome.lowered > 10
    assert outcome.unmet > 0
    assert outcome.position == ends_at(path)
    assert_accelerations(outcome.t_s, outcome.at_steps, FINE)


@common
@given(path=structured_paths(), part=st.sampled_from([0.01, 0.3, 0.8, 0.97]))
def test_any_plan_that_asks_for_too_much_is_not_obeyed(
    tmp_path_factory: pytest.TempPathFactory, path: Path, part: float
) -> None:
    outcome = run(path.program(), part, tmp_path_factory.mktemp("plan") / "trace")
    assert_accelerations(outcome.t_s, outcome.at_steps, FINE)
