"""Feed hold at any instant: a ramp inside the limits, the same path, an exact resume."""

from __future__ import annotations

import numpy as np
import pytest
from motion_host import BASELINE, Host
from slow import slow_but
from test_motion_limits import ACCEL_MM_S2, GRAIN_MM_S2, STEPS_PER_MM, windowed

PARTS = [0.02, 0.2, 0.37, 0.5, 0.71, 0.9, 0.99]
PROGRAMS = {
    "line": "G1X60F5000\n",
    "diagonal": "G1X40Y33Z-7F4000\n",
    "chords": "G1F5000\n" + "".join(f"X{k * 0.8:.3f}Y{(k * 0.8) ** 2 / 60:.4f}\n" for k in range(45)),
    "corners": "G1F3000\nX8\nY8\nX0\nY0\nX3Y5\n",
}
# the longest way that a step already decided on can be from the pins: emission, prep and one slice
REACTION_S = 0.003 * 1.5 + 0.003 + 0.002 + 0.003


@pytest.mark.alike(8)
@pytest.mark.parametrize("name", PROGRAMS)
@pytest.mark.parametrize("part", slow_but((0.02, 0.5, 0.99).__contains__, PARTS, PARTS[::2].__contains__))
def test_a_hold_stops_within_its_ramp_and_resumes_exactly(host: Host, name: str, part: float) -> None:
    fresh = Host()
    fresh.settings(**BASELINE)
    plain = fresh.run(PROGRAMS[name])
    fresh.close()

    host.start(PROGRAMS[name])
    host.advance(int(plain.counters.timer_events * part))
    held_at = host.ticks()
    host.put("!")
    stopped = host.settle()
    t = stopped.seconds()
    moving_s = t[-1] - held_at / stopped.timer_hz
    speed = np.abs(windowed(stopped)[0]).max()
    assert moving_s <= REACTION_S + speed * np.sqrt(3) / ACCEL_MM_S2 * 1.02 + 0.005
    assert "Hold:0" in host.status()
    host.put("~")
    whole = host.settle()
    assert whole.position == plain.position
    path, wanted = whole.positions()[::20], plain.positions()
    away = [np.abs(wanted - point).sum(axis=1).min() for point in path]
    assert max(away) <= 2  # a step may come before or after its neighbour's


@pytest.mark.parametrize("part", [0.1, 0.35, 0.6, 0.85])
def test_a_hold_keeps_the_acceleration_limit_on_a_line(host: Host, part: float) -> None:
    host.start("G1X60Y20F5000\n")
    host.advance(int(15000 * part))
    host.put("!")
    host.settle()
    host.put("~")
    _, accel = windowed(host.settle())
    assert np.abs(accel).max() <= ACCEL_MM_S2 * 1.005 + GRAIN_MM_S2


def test_a_reset_in_hold_is_no_alarm_and_keeps_the_position(host: Host) -> None:
    host.start("G1X60F5000\n")
    host.advance(6000)
    host.put("!")
    held = host.settle()
    run = host.run("\x18")
    assert "ALARM" not in run.said
    assert run.position == held.position == held.counted()
    assert 0 < held.position[0] < 60 * STEPS_PER_MM
    assert host.run("G0X0\n").position[0] == 0
