"""A sender that gives moves one at a time, in time: the machine starts soon, and keeps moving."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator

import numpy as np
import pytest
from motion_host import Host, Run

LINE_S = 0.001

Point = Callable[[int], tuple[float, float]]


def straight(n: int) -> tuple[float, float]:
    return 0.05 * n, 0.0


def circle(n: int) -> tuple[float, float]:
    return 20 * math.cos(0.0025 * n), 20 * math.sin(0.0025 * n)


@pytest.fixture
def host() -> Iterator[Host]:
    host = Host(axes=3)
    host.settings(s110=6000, s111=6000, s120=500, s121=500)
    yield host
    host.close()


def stream(host: Host, point: Point, feed: int, count: int) -> Run:
    """A block a millisecond, not one earlier."""
    host.start(f"G1F{feed}\n")
    for n in range(1, count + 1):
        x, y = point(n)
        host.wait(LINE_S)
        host.put(f"X{x:.3f}Y{y:.3f}\n")
    return host.settle()


def speeds_mm_s(run: Run, begin_s: float, end_s: float) -> np.ndarray:
    """In windows of 20 ms."""
    t = run.seconds()
    path_mm = run.positions()[:, :2] / 250
    at = np.arange(begin_s, end_s, 0.02)
    index = np.searchsorted(t, at)
    return np.hypot(*np.diff(path_mm[index], axis=0).T) / 0.02


@pytest.mark.parametrize("point", [straight, circle])
def test_it_starts_soon_and_keeps_its_speed(host: Host, point: Point) -> None:
    """0.05 mm a millisecond is 3000 mm/min: the sender is no faster than the machine, so what is ahead stays as
    short as it was at the start. Collinear points are merged, and must not wait for the line's end."""
    host.run("G0X20Y0\n" if point is circle else "G0X0Y0\n")
    begin_s = host.ticks() / host.timer_hz
    run = stream(host, point, 3000, 2000)
    assert run.counters.lookahead_starved == 0
    assert run.seconds()[0] - begin_s < 0.08
    assert speeds_mm_s(run, begin_s + 0.4, begin_s + 1.9).min() > 45.0


@pytest.mark.parametrize("point", [straight, circle])
def test_a_slow_sender_means_a_slow_move_but_no_stops(host: Host, point: Point) -> None:
    """The same points at 6000 mm/min, which the sender cannot feed."""
    host.run("G0X20Y0\n" if point is circle else "G0X0Y0\n")
    begin_s = host.ticks() / host.timer_hz
    run = stream(host, point, 6000, 2000)
    assert speeds_mm_s(run, begin_s + 0.4, begin_s + 1.9).min() > 25.0


@pytest.mark.parametrize("turn", ["X40", "X40Y1", "Y20", "X0"])
@pytest.mark.parametrize("late_s", [0.2, 0.5, 1.0])
def test_a_move_that_comes_in_time_is_no_stop(host: Host, turn: str, late_s: float) -> None:
    """One move alone ends at rest; but what comes while it is under way continues from it as if it had been there."""
    host.start("G1F1000X20\n")
    host.wait(late_s)
    host.put(turn + "\n")
    run = host.settle()
    together = host_like(host).run(f"G1F1000X20\n{turn}\n")
    assert run.position == together.position
    assert duration_s(run) == pytest.approx(duration_s(together), abs=0.01)


def host_like(host: Host) -> Host:
    other = Host(axes=3)
    other.settings(s110=6000, s111=6000, s120=500, s121=500)
    return other


def duration_s(run: Run) -> float:
    return float(run.seconds()[-1] - run.seconds()[0])


def test_jobs_one_after_another(host: Host) -> None:
    """Each comes to rest where nothing followed in time; the next one begins there."""
    for n in range(1, 40):
        run = host.run("".join(f"G1F3000X{n + k / 10:.1f}Y{k % 2}\n" for k in range(8)))
        assert run.position[:2] == [round((n + 0.7) * 250), 250]


def test_an_end_a_nanosecond_late_is_rest(host: Host) -> None:
    """The last step of this program falls a rounding error before its stop, into a segment that is not the last one."""
    host.settings(s110=5000, s111=5000, s112=5000, s122=500, s11=0.01)
    lines = ["G1F40X0.6953Y0.03Z0.9", "X13.6022Y11.7787Z9.5518", "X14.7976Z4.1768", "Z4.1796", "G0X9.381Z8.7265"]
    assert host.run("G64P0\n" + "\n".join(lines) + "\n").counters.underruns == 0
