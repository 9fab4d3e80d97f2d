"""Jobs on each kind of machine, judged by the step trace alone: where the tool was, and how fast the joints went."""

from __future__ import annotations

from itertools import pairwise
from math import hypot

import numpy as np
import pytest
from kinematics_core import COREXY, POLAR, SCARA, Machine
from motion_host import Host

DEVIATION_MM = 0.02
SPM, RATE_MM_MIN, ACCEL = 100.0, 6000.0, 500.0


def host_of(kind: int, **more: float) -> Host:
    host = Host(rate_hz=200_000)
    values = {
        f"s{base + ax}": value for base, value in ((100, SPM), (110, RATE_MM_MIN), (120, ACCEL)) for ax in range(6)
    }
    host.settings(**values, s11=DEVIATION_MM, s12=0.002, s130=150, s81=60, s82=50, s80=kind, **more)
    return host


def start_of(kind: int) -> str:
    """A place that every machine reaches, on the way to the job."""
    return "G90 G21\nG0 X40 Y-10\nG4 P0.1\n" if kind != SCARA else "G90 G21\nG0 X60 Y-50\nG4 P0.1\n"


def distance_to_segments(points, corners):
    """Of each point from the nearest of the straight lines."""
    best = np.full(len(points), np.inf)
    for a, b in pairwise(corners):
        way = b - a
        part = np.clip(((points - a) @ way) / max(way @ way, 1e-12), 0, 1)
        best = np.minimum(best, np.linalg.norm(points - a - part[:, None] * way, axis=1))
    return best


def step_mm(kind: int, radius_mm: float) -> float:
    """How far the tool may be off because joints stand on whole steps: a step of each, at right angles at most."""
    if kind == COREXY:
        return 1 / SPM
    if kind == POLAR:
        return hypot(1, np.radians(radius_mm)) / SPM
    return (np.radians(60) + np.radians(50)) / SPM  # arms in line


@pytest.mark.parametrize("kind", [COREXY, POLAR, SCARA])
def test_the_tool_stays_on_the_programmed_path(kind):
    host, machine = host_of(kind), Machine(kind, (60, 50))
    corners = [(60, -50), (30, -40), (60, -50), (-20, 70), (30, 60), (60, 20), (60, -50)]
    lead_in = host.run(start_of(SCARA)).position[:2]
    run = host.run("G1 F3000\n" + "".join(f"X{x} Y{y}\n" for x, y in corners))
    host.close()
    assert set(run.answers) == {"ok"}
    joints = np.array(lead_in) / SPM + run.positions()[:, :2] / SPM
    offset = joints_now(run, lead_in, joints)
    off = distance_to_segments(machine.tool_mm(joints + offset), np.array(corners, dtype=float))
    assert off.max() <= DEVIATION_MM + step_mm(kind, 90)
    assert machine.tool_mm(joints + offset)[-1] == pytest.approx((60, -50), abs=step_mm(kind, 90))


def joints_now(run, lead_in, joints):
    """Positions of a run count from its own start; nothing else moved the counters."""
    return np.array(run.position[:2]) / SPM - joints[-1]


@pytest.mark.parametrize("kind", [COREXY, POLAR, SCARA])
def test_the_feed_is_the_tools(kind):
    """A long line at 20 mm/s: the tool, not the joints, keeps that speed where no joint is at its limit."""
    host, machine = host_of(kind), Machine(kind, (60, 50))
    host.run(start_of(SCARA))
    run = host.run("G1 X60 Y50 F1200\n")
    host.close()
    joints = run.positions()[:, :2] / SPM
    tool = machine.tool_mm(joints + np.array(run.position[:2]) / SPM - joints[-1])
    t = run.seconds()
    grid = np.arange(t[0] + 1.0, t[-1] - 1.0, 0.05)
    at = np.stack([np.interp(grid, t, tool[:, i]) for i in range(2)], axis=1)
    speeds = np.linalg.norm(np.diff(at, axis=0), axis=1) / 0.05
    assert speeds == pytest.approx(20, rel=0.03)
    assert t[-1] - t[0] == pytest.approx(100 / 20, rel=0.05)


@pytest.mark.parametrize("kind", [COREXY, POLAR, SCARA])
def test_joints_keep_their_limits(kind):
    """Speed and acceleration of every joint, 20 ms windows, also on rapids past the centre."""
    host = host_of(kind)
    host.run(start_of(SCARA))
    run = host.run("G0 X30 Y-20\nX80 Y5\nX20 Y30\nG1 X80 Y-20 F20000\nG2 X80 Y20 R60 F20000\n")
    host.close()
    assert set(run.answers) == {"ok"}
    t, joints = run.seconds(), run.positions()[:, :2] / SPM
    grid = np.arange(t[0], t[-1], 0.001)
    for joint in range(2):
        at = np.interp(grid, t, joints[:, joint])
        window = 20
        v = (at[window:] - at[:-window]) / (window * 0.001)
        a = (v[window:] - v[:-window]) / (window * 0.001)
        assert np.abs(v).max() <= RATE_MM_MIN / 60 * 1.005 + 1 / SPM / 0.02
        assert np.abs(a).max() <= ACCEL * 1.05 + 2 / SPM / 0.02**2


def test_polar_goes_through_zero_the_short_way():
    host = host_of(POLAR)
    host.run("G0 X50 Y-5\n")
    before = host.run("G4 P0.01\n").position[1]
    after = host.run("G1 X50 Y5 F1200\n").position[1]
    host.close()
    assert (after - before) / SPM == pytest.approx(2 * np.degrees(np.arctan2(5, 50)), abs=0.03)


@pytest.mark.parametrize("beside", [0.0, 1e-6, 0.001, 0.01, 0.3])
def test_polar_through_and_past_the_centre(beside):
    """The singular point: the tool stays on its line however fast the table had to turn."""
    host, machine = host_of(POLAR), Machine(POLAR)
    host.run(f"G0 X40 Y{beside:.6f}\n")
    run = host.run(f"G1 X-40 Y{beside:.6f} F1800\n")
    host.close()
    assert run.answers == ["ok"]
    joints = run.positions()[:, :2] / SPM
    joints += np.array(run.position[:2]) / SPM - joints[-1]
    tool = machine.tool_mm(joints)
    assert np.abs(tool[:, 1] - beside).max() <= DEVIATION_MM + step_mm(POLAR, 40)
    assert np.abs(joints[:, 0]).max() <= 40.01 and joints[:, 0].min() >= -1 / SPM


@pytest.mark.parametrize(
    ("kind", "line"),
    [
        (POLAR, "G0 X151 Y0"),
        (POLAR, "G0 X-110 Y-110"),
        (POLAR, "G2 X60 Y-50 I90 J0 F600"),  # the far side of the circle is at 240
        (SCARA, "G0 X111 Y0"),
        (SCARA, "G0 X5 Y0"),
        (SCARA, "G1 X-60 Y50 F600"),  # both ends can be reached, the hub between them cannot
        (SCARA, "G3 X60 Y-50 I-30 J25 F600"),  # a circle through the hub
        (SCARA, "$J=G90 X120 Y0 F600"),
    ],
)
def test_what_cannot_be_reached_is_refused_before_anything_moves(kind, line):
    host = host_of(kind)
    host.run(start_of(SCARA))
    run = host.run(line + "\n")
    host.close()
    assert run.answers == ["error:140"] and len(run.events) == 0


def test_after_a_refused_line_the_machine_goes_on():
    host = host_of(POLAR)
    assert host.run("G0 X40\nG0 X400\nG1 X50 F600\n").answers == ["ok", "error:140", "ok"]
    assert host.run("G4 P0\n").position[0] == round(50 * SPM)
    host.close()
