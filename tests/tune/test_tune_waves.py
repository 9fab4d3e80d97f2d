"""Waves that were measured, and the pattern that draws them."""

from __future__ import annotations

import math
import re

import numpy as np
import pytest
from wificnc.errors import UserError
from wificnc.tune.choice import Mode
from wificnc.tune.mass import response_mm
from wificnc.tune.motion import read_trace
from wificnc.tune.pattern import PatternOptions, lines_of, pattern
from wificnc.tune.shapers import OFF, impulses
from wificnc.tune.waves import Waves, measured_mode


@pytest.mark.parametrize(("hz", "damping"), [(8.0, 0.01), (41.3, 0.02), (120.0, 0.15)])
def test_crests_of_a_free_vibration_return_it(hz, damping):
    """Crests of exp(-z w t) cos(wd t) are whole damped periods apart, and so are their heights."""
    omega, feed, count = 2 * math.pi * hz, 2400.0, 6
    damped = omega * math.sqrt(1 - damping**2)
    crests_s = [2 * math.pi * n / damped for n in range(count + 1)]
    heights = [math.exp(-damping * omega * t) for t in crests_s]
    found = measured_mode(Waves(feed, count, feed / 60 * crests_s[-1], heights[0], heights[-1]))
    assert found.hz == pytest.approx(hz) and found.damping == pytest.approx(damping)
    found = measured_mode(Waves(feed, count, feed / 60 * crests_s[-1], heights[1], heights[3], between=2))
    assert found.damping == pytest.approx(damping)


def test_eight_waves_in_7_75_mm_at_2400():
    """The numbers of docs/vibration.md and of the page's test."""
    mode = measured_mode(Waves(2400.0, 8.0, 7.75, 12.0, 4.0))
    assert mode.hz == pytest.approx(41.300183, abs=1e-6) and mode.damping == pytest.approx(0.02185098, abs=1e-8)


def test_without_heights_it_is_the_default_damping():
    assert measured_mode(Waves(2400.0, 8.0, 8.0)).damping == 0.05


@pytest.mark.parametrize(
    ("waves", "words"),
    [
        (Waves(0.0, 8.0, 8.0), "--feed 0: must be more than 0"),
        (Waves(2400.0, math.nan, 8.0), "--waves nan"),
        (Waves(2400.0, 8.0, -1.0), "--distance -1"),
        (Waves(2400.0, 8.0, 0.8), "399.* Hz|400.* Hz"),
        (Waves(60.0, 8.0, 8.0), "1.001 Hz: the shapers take 5 to 200 Hz"),
        (Waves(2400.0, 8.0, 8.0, 1.0), "two heights"),
        (Waves(2400.0, 8.0, 8.0, between=3.0), "--between has no heights"),
        (Waves(2400.0, 8.0, 8.0, 1.0, 2.0), "higher than the first"),
        (Waves(2400.0, 8.0, 8.0, 1.0, 0.0), "--last 0"),
        (Waves(2400.0, 1.0, 1.0, 100.0, 1.0), "damping ratio of 0.591: the shapers take 0 to 0.5"),
    ],
)
def test_what_cannot_be_is_refused(waves, words):
    with pytest.raises(UserError, match=words):
        measured_mode(waves)


# ---- the pattern ----

MACHINE = """
schema = 1
name = "Bench"
""" + "".join(
    f"[axis.{axis}]\nsteps_per_mm = 100\nmax_rate_mm_min = {rate}\nacceleration_mm_s2 = 500\ntravel_mm = 300\n"
    for axis, rate in (("x", 6000), ("y", 6000), ("z", 1200))
)
MACHINE += "[spindle]\nmax_rpm = 10000\n"


@pytest.fixture
def bench(tmp_path):
    path = tmp_path / "bench.toml"
    path.write_text(MACHINE)
    return path


@pytest.mark.parametrize(
    "words",
    [
        (),
        ("--axis", "y", "--tool", "cut", "--depth", "0.2", "--speed", "8000", "--start", "X10 Y20"),
        ("--tool", "laser", "--speed", "300", "--lines", "1", "--feed", "1800"),
        ("--lines", "9", "--from-hz", "10", "--to-hz", "150", "--feed", "600"),
    ],
)
def test_the_pattern_passes_the_check(words, tune, bench, tmp_path):
    path = tmp_path / "ring.nc"
    code, _, err = tune("pattern", "-o", path, *words)
    assert code == 0 and re.search(r"\$17[01]=0$", err.strip())
    code, out, err = tune.main("check", path, "--machine", bench, "--strict")
    assert code == 0 and "0 errors, 0 warnings" in out, out + err
    start = (10, 20) if "--start" in words else (0, 0)
    for axis, low in zip("XY", start, strict=True):
        places = [float(value) for value in re.findall(rf"^G[01] .*?{axis}(-?[\d.]+)", path.read_text(), re.MULTILINE)]
        assert min(places) == pytest.approx(low)


def test_lines_are_plain_grbl():
    """Words of Grbl 1.1, lines that fit its buffer, comments that end where they should."""
    for line in pattern(PatternOptions()).splitlines():
        if line.startswith("("):
            assert line.count("(") == line.count(")") == 1 and line.endswith(")") and line.isascii()
        else:
            assert len(line) < 70 and re.fullmatch(r"(?:[GXYZFSM]-?\d+(?:\.\d+)? ?)*", line)


@pytest.mark.parametrize("axis", ["x", "y"])
@pytest.mark.parametrize("hz", [18.0, 41.3, 66.0])
def test_the_waves_are_at_the_places_that_the_formula_expects(axis, hz, tune, bench, tmp_path):
    """The pattern in the simulator, with a mass on the axis: its crests along the line return its frequency."""
    job, trace = tmp_path / "ring.nc", tmp_path / "trace.npz"
    options = PatternOptions(axis=axis)
    job.write_text(pattern(options))
    assert tune.main("sim", job, "--machine", bench, "--trace", trace)[0] == 0
    across, along = (read_trace(trace).axis("xy".index(name), 100.0) for name in (axis, "y" if axis == "x" else "x"))
    mode = Mode(hz, 0.01)
    off = impulses(OFF, hz, 0.01)
    t_s = np.arange(0.0, along.t_s[-1], 1e-4)
    vibration, way = response_mm(across, off, mode, t_s), along.at(t_s, off)
    best = min(lines_of(options), key=lambda line: abs(math.log(line.hz / hz)))
    on_line = np.abs(across.at(t_s, off) - best.across_mm) < 0.006  # half a step of 100 per mm, and more
    on_line &= (way > options.ramp_mm + 0.2) & (way < options.ramp_mm + 30.0)
    crests = np.flatnonzero((np.diff(np.sign(np.diff(vibration))) < 0) & on_line[1:-1]) + 1
    count = len(crests) - 1
    distance = float(way[crests[-1]] - way[crests[0]])
    heights = vibration[crests[[0, -1]]]
    found = measured_mode(Waves(options.feed_mm_min, count, distance, *heights))
    assert count >= 5 and found.hz == pytest.approx(hz, rel=0.01) and found.damping == pytest.approx(0.01, rel=0.2)
    assert heights[0] > 0.5 * 2 * 500.0 / (2 * math.pi * hz) ** 2  # half of what a stop can do, at least


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"feed_mm_min": 0.0}, "--feed 0"),
        ({"length_mm": 5.0}, "--length 5 is too short: a wave of 15 Hz has 2.00 mm"),
        ({"low_hz": 80.0, "high_hz": 15.0}, "the lower one first"),
        ({"low_hz": 1.0}, "must be 5 to 200 Hz"),
        ({"tool": "cut", "speed": 1000.0}, "needs a depth"),
        ({"tool": "laser"}, "needs --speed"),
        ({"spacing_mm": 1.0}, "--spacing 1"),
        ({"acceleration_mm_s2": math.inf}, "--acceleration inf"),
    ],
)
def test_a_pattern_that_shows_nothing_is_refused(change, words):
    with pytest.raises(UserError, match=words):
        pattern(PatternOptions(**change))
