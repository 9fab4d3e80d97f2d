"""Inputs with structure (structured.py): acceleration, speed, path and ends, from the step edges."""

from __future__ import annotations

import math
import zlib
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st
from lawful import COARSE, FINE, Machine, accelerations, assert_ends_at, assert_lawful, assert_on_path, derivatives
from motion_host import Run
from structured import FIXED, Path, structured_paths

common = settings(max_examples=60, suppress_health_check=list(HealthCheck))

machines = st.builds(
    Machine,
    accel_mm_s2=st.sampled_from([(500.0,) * 3, (1000.0, 300.0, 200.0), (200.0, 2000.0, 500.0), (4000.0,) * 3]),
    rate_mm_min=st.sampled_from([(5000.0,) * 3, (9000.0, 2000.0, 500.0)]),
    jerk_mm_s3=st.sampled_from([0.0, 0.0, 5_000.0, 100_000.0]),
    shapers=st.sampled_from([(), (), ((1, 40.0, 0.02),), ((3, 60.0, 0.1), (2, 25.0, 0.0)), ((4, 90.0, 0.05),)]),
)
path_modes = st.sampled_from(["G64", "G64", "G64P0", "G64P0.02", "G64P0.3", "G61"])


def program(path: Path, *before: str) -> str:
    beam = ["M4S100"] if path.powers else []
    return "\n".join(["G21G90", *before, *beam, *path.moves()]) + "\n"


def performed(path: Path, machine: Machine, *before: str) -> Run:
    host = machine.host()
    text = program(path, *before)
    run = host.run(text)
    host.close()
    assert run.answers == ["ok"] * text.count("\n")
    return run


@pytest.mark.alike(30)
@pytest.mark.parametrize("name", FIXED)
def test_limits_path_and_end(name: str, record_property: pytest.RecordProperty) -> None:
    run = performed(FIXED[name], FINE)
    record_property("acceleration over 5, 10, 20 ms", assert_lawful(run, FINE))
    assert_ends_at(run, FIXED[name].vertices()[-1], FINE)
    assert_on_path(run, FIXED[name].vertices(), FINE, FINE.deviation_mm)


@pytest.mark.alike(30)
@pytest.mark.parametrize("name", FIXED)
def test_acceleration_with_the_steps_of_a_usual_machine(name: str) -> None:
    """Issue: at most 1.2 x in 10 ms, the grain of 250 steps/mm included."""
    run = performed(FIXED[name], COARSE)
    _, accel = derivatives(run.seconds(), run.positions(), COARSE, 0.010)
    assert np.abs(accel).max() <= 1.2 * COARSE.accel_mm_s2[0]


@pytest.mark.alike(30)
@pytest.mark.parametrize("name", FIXED)
def test_acceleration_with_stalls(name: str) -> None:
    """Whatever each side of the firmware fails to do for up to a second: 1.2 x in 10 ms, and the end is exact."""
    text = program(FIXED[name])
    for seed, longest_ms in enumerate((10, 50, 250, 1000), zlib.crc32(name.encode())):
        host = COARSE.host()
        host.stall_randomly(seed, gap_ms=2 * longest_ms, longest_ms=longest_ms)
        run = host.run(text)
        host.close()
        _, accel = derivatives(run.seconds(), run.positions(), COARSE, 0.010)
        assert np.abs(accel).max() <= 1.2 * COARSE.accel_mm_s2[0]
        assert run.answers == ["ok"] * text.count("\n") and run.counted() == run.position
        assert_ends_at(run, FIXED[name].vertices()[-1], COARSE)


@pytest.mark.parametrize("turn_deg", range(30, 180, 30))
@pytest.mark.parametrize("first_deg", [-20, 0, 20, 45, 70])
def test_a_slow_axis_keeps_its_rate_in_a_bend(first_deg: int, turn_deg: int) -> None:
    """At both ends of a bend the tool may be fast where the slow axis has no part in it; in between it has."""
    slow = replace(FINE, accel_mm_s2=(4000.0,) * 3, rate_mm_min=(9000.0, 9000.0, 500.0))
    at, points = np.zeros(2), []
    for angle in np.radians([first_deg, first_deg + turn_deg, first_deg]):
        at = at + 3 * np.array([np.cos(angle), np.sin(angle)])
        points.append((float(at[0]), 0.0, float(at[1])))
    run = performed(Path(tuple(points), feed=9000), slow, "G64P0.5")
    speed, _ = derivatives(run.seconds(), run.positions(), slow, 0.010)
    assert np.abs(speed[:, 2]).max() <= 500 / 60 * 1.001 + 2 / (slow.steps_per_mm[2] * 0.010)


@pytest.mark.slow
@common
@given(path=structured_paths(), machine=machines, mode=path_modes)
@example(  # a stop on a blend that turns far takes much longer than the speed along it says
    path=Path(((1, 0, 0), (-0.5, 0.866, 0), (-0.5, -0.866, 0), (1, 0, 0)), 600, 2),
    machine=Machine(accel_mm_s2=(200.0, 2000.0, 500.0), rate_mm_min=(5000.0,) * 3, jerk_mm_s3=5000, shapers=()),
    mode="G64P0.3",
)
def test_any_structure_on_any_machine(path: Path, machine: Machine, mode: str) -> None:
    run = performed(path, machine, mode)
    assert_lawful(run, machine)
    assert_ends_at(run, path.vertices()[-1], machine)
    apart = 0.5 * machine.deviation_mm if len(machine.shapers) > 1 else 0.0  # straight ways bend: docs/motion.md, 9
    tolerance_mm = apart if mode == "G61" else max(machine.deviation_mm, float(mode[4:] or 0))
    assert_on_path(run, path.vertices(), machine, tolerance_mm)


@st.composite
def arc_chains(draw: st.DrawFn) -> str:
    """Full circles, half circles and quarters of round numbers, begun on an axis or at 45 degrees, joined by lines."""
    lines = ["G21G91"]
    for _ in range(draw(st.integers(1, 8))):
        r = draw(st.sampled_from([0.1, 0.5, 1.0, 2.5, 10.0]))
        i, j = draw(st.sampled_from([(r, 0.0), (0.0, r), (-r, 0.0), (0.0, -r), (r, r), (-r, r)]))
        code = draw(st.sampled_from(["G2", "G3"]))
        part = draw(st.sampled_from(["full", "half", "quarter"]))
        sign = 1 if code == "G3" else -1
        end = {"full": (0.0, 0.0), "half": (2 * i, 2 * j), "quarter": (i + sign * j, j - sign * i)}[part]
        feed = draw(st.sampled_from([300, 1800, 5000, 20000]))
        lines.append(f"{code}X{end[0]:.4f}Y{end[1]:.4f}I{i:.4f}J{j:.4f}F{feed}")
        if draw(st.booleans()):
            lines.append(draw(st.sampled_from(["G1X1", "G1Y-0.1", "G1X0.5Y0.5", "G0X2", "G1X0.01"])))
    return "\n".join(lines) + "\n"


@pytest.mark.slow  # some of each family are quick
@common
@given(text=arc_chains(), machine=machines)
def test_arcs_of_round_numbers(text: str, machine: Machine) -> None:
    host = machine.host()
    run = host.run(text)
    host.close()
    assert run.answers == ["ok"] * text.count("\n")
    assert_lawful(run, machine)


@pytest.mark.slow
@common
@given(path=structured_paths())
def test_corexy(path: Path) -> None:
    """The limits are the motors': what X and Y of the trace are."""
    machine = replace(FINE, steps_per_mm=(1000.0,) * 3)
    host = machine.host()
    host.settings(s80=1)
    run = host.run(program(path))
    host.close()
    assert_lawful(run, machine)


INTERFERENCES = ("!", "~", "\x91", "\x91" * 5, "\x92", "\x92" * 9, "\x90", "\x96", "\x97", "\x95", "\x91" * 10)
interferences = st.lists(
    st.tuples(st.sampled_from([1, 5, 20, 60, 150]), st.sampled_from(INTERFERENCES)), min_size=1, max_size=15
)


def beginning(text: str, most: int = 1000) -> str:
    """So many whole lines as the controller's input takes in one piece."""
    return text if len(text) <= most else text[: text.rindex("\n", 0, most) + 1]


@pytest.mark.slow
@common
@given(path=structured_paths(), machine=machines, what=interferences, mode=path_modes)
@example(  # a hold while limited jerk brakes gently, of a plan that needs hard braking next
    path=Path(((0, 0, 0), (0.5, 0, 0), (0.5, 0.004, 0), (0, 0.004, 0)), 100, 2, (), ()),
    machine=Machine(jerk_mm_s3=5000, shapers=((1, 40, 0.02),)),
    what=[(1, "!"), (1, "\x91" * 5), (1, "\x91" * 5), (1, "~"), (150, "!")],
    mode="G64",
)
@example(  # braking hard for a lower override, too late for the next blend
    path=Path(((0, 0, 0), (0.5, 0, 0), (0.5, 0.01, 0), (1, 0.01, 0), (1, 0.02, 0)), 600, 2),
    machine=Machine(rate_mm_min=(5000.0,) * 3, jerk_mm_s3=5000, shapers=((1, 40, 0.02),)),
    what=[(60, "!"), (5, "~"), (150, "\x92" * 9)],
    mode="G64",
)
@example(  # the stop on a blend speeds up first: past its middle the path is faster
    path=Path(tuple((n / 100, math.sin(n * math.pi / 6), n / 100) for n in range(35)), 600, 2),
    machine=Machine(
        accel_mm_s2=(1000.0, 300.0, 200.0),
        rate_mm_min=(9000.0, 2000.0, 500.0),
        jerk_mm_s3=5000,
        shapers=((1, 40, 0.02),),
    ),
    what=[(1, "~")],
    mode="G64P0.3",
)
@example(  # long stops of a laser that follows the speed need many spans, and two must fit
    path=Path(tuple((n / 100, math.sin(n * math.pi / 6), n / 100) for n in range(7)), 600, 2, (), (10, 900)),
    machine=Machine(rate_mm_min=(9000.0, 2000.0, 500.0), jerk_mm_s3=5000, shapers=((1, 40, 0.02),)),
    what=[(1, "!")],
    mode="G64P0.3",
)
def test_holds_and_overrides_at_any_time(path: Path, machine: Machine, what: list[tuple[int, str]], mode: str) -> None:
    host = machine.host()
    host.start(beginning(program(path, mode)))
    for ms, byte in what:
        host.until(host.ticks() + ms * host.timer_hz // 1000)
        host.put(byte)
    host.settle()
    host.put("~\x90")
    run = host.settle()
    host.close()
    assert_lawful(run, machine)


def test_the_oracle_sees_what_it_should() -> None:
    """A stop within 10 ms from 50 mm/s is 10 x the limit of 500 mm/s2; a step trace can say so."""
    t = np.arange(1, 20001) / (50 * FINE.steps_per_mm[0])
    at = np.zeros((len(t), 3), np.int64)
    at[:, 0] = np.arange(1, len(t) + 1)
    assert accelerations(t, at, FINE)[1] > 9.5
