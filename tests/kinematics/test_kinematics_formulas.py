"""Each kind of machine against geometry: there and back, and the bounds that cutting rests on."""

from __future__ import annotations

from math import cos, hypot, radians, sin

import numpy as np
import pytest
from hypothesis import assume, example, given
from hypothesis import strategies as st
from kinematics_core import CARTESIAN, COREXY, POLAR, SCARA, Machine

REST = (0.0,) * 4
coordinate = st.floats(-100, 100, allow_subnormal=False)
angle = st.floats(-800, 800)
part = st.floats(0, 1)
CENTER_MM = 1e-9  # nearer to it a polar table keeps its angle, and the tool may be on the centre's other side


@given(kind=st.sampled_from([CARTESIAN, COREXY, POLAR]), x=coordinate, y=coordinate, near=angle)
@example(kind=POLAR, x=-CENTER_MM, y=0.0, near=0.0)
def test_there_and_back(kind, x, y, near):
    machine = Machine(kind)
    tool = (x, y, 3.0, 4.0, 5.0, 6.0)
    back = machine.forward(machine.inverse(tool, (0, near, *REST)))
    assert back == pytest.approx(tool, abs=2 * CENTER_MM + 1e-12 * hypot(x, y))


@given(first=st.floats(20, 90), second=st.floats(20, 90), x=coordinate, y=coordinate, near=st.tuples(angle, angle))
def test_two_arms_there_and_back(first, second, x, y, near):
    machine = Machine(SCARA, (np.float32(first), np.float32(second)))
    tool = (x, y, *REST)
    assume(abs(first - second) + 1e-3 < hypot(x, y) < first + second - 1e-3)
    joints = machine.inverse(tool, (*near, *REST))
    assert machine.forward(joints) == pytest.approx(tool, abs=1e-6)
    assert all(abs(joint - side) <= 180 + 1e-9 for joint, side in zip(joints, near, strict=False))


def test_the_arms_are_those_of_the_law_of_cosines():
    """L1 = L2 = D: all angles of the triangle are 60 degrees."""
    machine = Machine(SCARA, (50, 50))
    assert machine.inverse((50, 0, *REST))[:2] == pytest.approx([60, -60])
    assert machine.inverse((0, 50, *REST))[:2] == pytest.approx([150, 30])


def test_corexy_moves_both_belts_for_x_and_turns_one_round_for_y():
    machine = Machine(COREXY)
    assert machine.inverse((10, 0, *REST))[:2] == [10, 10]
    assert machine.inverse((0, 10, *REST))[:2] == [10, -10]
    assert machine.inverse((10, 10, *REST))[:2] == [20, 0]


@given(turns=st.integers(-3, 3), near=st.floats(-180, 180), change=st.floats(-179, 179))
def test_the_angle_goes_the_shortest_way_through_zero(turns, near, change):
    machine, here = Machine(POLAR), 360.0 * turns + near
    there = radians(here + change)
    joints = machine.inverse((80 * cos(there), 80 * sin(there), *REST), (80, here, *REST))
    assert joints[1] == pytest.approx(here + change, abs=1e-6)


def test_at_the_centre_the_table_stays():
    assert Machine(POLAR).inverse((0, 0, *REST), (7, 123, *REST))[:2] == [0, 123]


joints_of = {POLAR: st.tuples(st.floats(0, 150), angle), SCARA: st.tuples(angle, angle)}


@given(data=st.data(), kind=st.sampled_from([POLAR, SCARA]), change=st.tuples(st.floats(-9, 9), st.floats(-9, 9)))
def test_the_bend_is_a_bound(data, kind, change):
    """Joints go evenly from one place to the other: how far is the tool from the straight line at most?"""
    machine = Machine(kind, (60, 40))
    start = np.array(data.draw(joints_of[kind]))
    end = start + change
    assume(kind == SCARA or end[0] >= 0)
    steps = np.linspace(0, 1, 101)[:, None]
    way = machine.tool_mm(start + steps * (end - start))
    line = way[0] + steps * (way[-1] - way[0])
    farthest = np.hypot(*(way - line).T).max()
    assert farthest <= machine.bend_mm((*start, *REST), (*end, *REST)) + 1e-9


@given(data=st.data(), kind=st.sampled_from([POLAR, SCARA]), way=st.floats(0, 6.3))
def test_the_stretch_is_a_bound(data, kind, way):
    machine = Machine(kind, (60, 40))
    at = np.array(data.draw(joints_of[kind]))
    small = 1e-5 * np.array([cos(way), sin(way)])
    moved = np.hypot(*(machine.tool_mm(at + small) - machine.tool_mm(at)))
    assert moved <= 1e-5 * machine.stretch((*at, *REST), (*at, *REST)) * (1 + 1e-4)


@pytest.mark.parametrize(
    ("start", "end", "fits"),
    [
        ((30, 0), (0, 99.9), True),
        ((30, 0), (0, 100.1), False),  # beyond both arms
        ((30, 0), (-30, 0), False),  # through the hole of 60 - 40
        ((30, 0), (19.9, 0), False),
        ((30, 0), (20.1, 0), True),
        ((30, 21), (-30, 21), True),
    ],
)
def test_what_two_arms_reach(start, end, fits):
    machine = Machine(SCARA, (60, 40))
    assert machine.reaches((*start, *REST), (*end, *REST)) is fits


def test_what_a_radius_reaches():
    machine = Machine(POLAR, travel_mm=(150, 0))
    assert machine.reaches((10, 0, *REST), (-149, 0, *REST))
    assert not machine.reaches((10, 0, *REST), (-110, 110, *REST))
