"""Design invariant 2: no axis exceeds its acceleration, nor in homing, jog cancel, probing, door and soft limits."""

from __future__ import annotations

import numpy as np
import pytest
from grbl_host import Grbl

ACCEL = 500 * 250  # steps/s^2
GRAIN = 4 / 0.01**2  # a step more or less, seen at both ends of two windows


def assert_kept(grbl: Grbl) -> None:
    assert np.abs(grbl.accelerations()).max() <= 1.005 * ACCEL + GRAIN


@pytest.mark.parametrize("stop", ["\x85", "!", "\x84"])
@pytest.mark.parametrize("moment", [0.05, 0.137, 0.24, 0.32])
def test_stops(grbl: Grbl, stop: str, moment: float) -> None:
    grbl.record()
    grbl.after(moment, "$J=X-30F5000\n")
    grbl.send(stop)
    assert_kept(grbl)
    assert -30 * 250 < grbl.position()[0] < 0


def test_probing(grbl: Grbl) -> None:
    grbl.record()
    grbl.surface(-3000)
    grbl.send("G38.2Z-40F5000\n")
    assert_kept(grbl)


def test_soft_limits(grbl: Grbl) -> None:
    grbl.fine("$22=1", "$20=1")
    grbl.record()
    grbl.after(0.4, "G1X-50F5000\n")
    assert "ALARM:2" in grbl.send("G1X5\n")
    assert_kept(grbl)


def test_homing(grbl: Grbl) -> None:
    for axis in range(3):
        grbl.travel(axis, -10000, 1000 + 100 * axis)
    grbl.settings(s22=1, s24=100, s25=5000, s26=25, s27=2)
    grbl.record()
    assert grbl.send("$H\n") == "ok\r\n"
    assert_kept(grbl)
