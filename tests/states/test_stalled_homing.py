"""Homing while sides of the firmware stall: it ends at the switches, or says why not, and stays within the limits."""

from __future__ import annotations

import random

import pytest
import stalls
from grbl_host import Grbl
from stalled import SMOOTH, SPM, assert_accelerations, stop_steps, until_answered, ways

HIGH, LOW = (1000, 1007, 1014), (-10000, -10003, -10006)
TRAVEL_MM = 100
CYCLES = [(4, 3), (7,), (1, 2, 4)]


class Homing:
    """A machine with switches at the ends of three axes, and a place from which it homes."""

    def __init__(self, rng: random.Random, ganged: int = 0, **smooth: float) -> None:
        self.ganged, self.mask = ganged, rng.choice([0, 1, 2, 5, 7])
        self.pull_off_mm = rng.choice([1, 2, 5])
        self.rate_mm_min, feed_mm_min = rng.choice([(300, 25), (300, 200), (1500, 100), (4000, 25), (4000, 600)])
        self.accel = rng.choice([100, 500]) * SPM
        self.grbl = Grbl(ganged=ganged)
        self.grbl.send("")
        self.grbl.settings(**{f"s{base + ax}": v for base, v in ((100, SPM), (110, 5000)) for ax in range(3)})
        self.grbl.settings(**{f"s{120 + ax}": self.accel / SPM for ax in range(3)}, **smooth)
        self.grbl.settings(**{f"s{44 + n}": axes for n, axes in enumerate(rng.choice(CYCLES))})
        self.grbl.settings(**{f"s{130 + ax}": TRAVEL_MM for ax in range(3)}, s22=1, s23=self.mask, s26=25)
        self.grbl.settings(s24=feed_mm_min, s25=self.rate_mm_min, s27=self.pull_off_mm)
        for axis in range(3):
            self.grbl.travel(axis, LOW[axis], HIGH[axis])
        self.start = [rng.randrange(-9000, 900) for _ in range(3)]
        if rng.random() < 0.2:  # the switch is pressed
            self.start[0] = LOW[0] - 90 if self.mask & 1 else HIGH[0] + 90
        self.grbl.place([*self.start, 0, 0, 0])
        self.grbl.record()

    def found(self) -> list[int]:
        """True places a pull-off before the switches."""
        back = self.pull_off_mm * SPM
        return [LOW[ax] + back if self.mask >> ax & 1 else HIGH[ax] - back for ax in range(3)]

    def counted(self) -> list[int]:
        """What the counters then say."""
        back = self.pull_off_mm * SPM
        return [back - TRAVEL_MM * SPM if self.mask >> ax & 1 else -back for ax in range(3)]

    def assert_found(self, axes: list[int]) -> None:
        at, counted = self.grbl.stands(), self.grbl.position()
        for ax in range(3):
            found = self.found()[ax] if ax in axes else self.start[ax]
            assert (at[ax], counted[ax]) == (found, self.counted()[ax] if ax in axes else 0)
            assert not self.ganged >> ax & 1 or self.grbl.second_stands()[ax] == at[ax]

    def assert_near(self, axes: list[int]) -> None:
        """Beyond a switch only what is committed and the way to a stop."""
        _, way_of_all = ways(self.grbl)
        most = stop_steps(self.rate_mm_min / 60 * SPM, self.accel)
        for ax in axes:
            way = self.start[ax] + way_of_all[:, ax]
            beyond = LOW[ax] - way.min() if self.mask >> ax & 1 else way.max() - HIGH[ax]
            pressed = LOW[ax] - self.start[ax] if self.mask >> ax & 1 else self.start[ax] - HIGH[ax]
            assert beyond <= most + max(pressed, 0)


def homes(homing: Homing, rng: random.Random, kind: str, letters: str = "") -> None:
    """While sides stall: every axis that was asked for is a pull-off before its switch."""
    homing.grbl.stall_often(rng, stalls.LATE[kind], 200)
    assert ended_well(until_answered(homing.grbl, f"$H{letters}\n"))
    homing.assert_found(["XYZ".index(letter) for letter in letters or "XYZ"])
    assert_accelerations(homing.grbl, homing.accel)


def ended_well(said: str) -> bool:
    return [line for line in said.split("\r\n") if line and not line.startswith("[MSG:Motion slowed")] == ["ok"]


@pytest.mark.alike(8)
@pytest.mark.parametrize("letters", ["", "X", "XZ"])
@pytest.mark.parametrize("kind", stalls.LATE)
@pytest.mark.parametrize("seed", stalls.seeds(6))
def test_every_axis_finds_its_switch(seed: int, kind: str, letters: str) -> None:
    rng = random.Random(f"{seed} {kind} {letters}")
    homing = Homing(rng)
    homes(homing, rng, kind, letters)
    homing.assert_near(["XYZ".index(letter) for letter in letters or "XYZ"])
    homing.grbl.close()


@pytest.mark.parametrize("ganged", [2, 7])
@pytest.mark.parametrize("kind", stalls.LATE)
@pytest.mark.parametrize("seed", stalls.seeds(3))
def test_both_motors_find_their_switches(seed: int, kind: str, ganged: int) -> None:
    rng = random.Random(f"{seed} {kind} {ganged}")
    homing = Homing(rng, ganged)
    homing.grbl.skew(1, rng.choice([0, 100, -250]))
    homes(homing, rng, kind)
    homing.grbl.close()


@pytest.mark.parametrize("kind", stalls.LATE)
@pytest.mark.parametrize("seed", stalls.seeds(4))
def test_limited_jerk_and_shapers(seed: int, kind: str) -> None:
    rng = random.Random(f"{seed} {kind}")
    homing = Homing(rng, **SMOOTH[1 + seed % 3])
    homes(homing, rng, kind)
    homing.grbl.close()


@pytest.mark.parametrize("kind", stalls.LATE)
@pytest.mark.parametrize("seed", stalls.seeds(6))
def test_a_sender_that_vanishes_ends_it_untrusted(seed: int, kind: str) -> None:
    """No one sees the axes any more: alarm 6, no step after it, no axis that was asked for is trusted."""
    rng = random.Random(f"{seed} {kind}")
    homing = Homing(rng)
    homing.grbl.stall_often(rng, stalls.LATE[kind], 8)
    said = homing.grbl.after(rng.uniform(0.1, 0.7), "$H\n")
    assert "ok" not in said
    homing.grbl.lose_sender()
    said += homing.grbl.after(3)  # the longest stall is over
    assert said.count("ALARM:6") == 1
    at = homing.grbl.stands()
    homing.grbl.after(12)
    assert homing.grbl.stands() == at and homing.grbl.state() == "Alarm"
    assert homing.grbl.send("$X\n").endswith("ok\r\n")
    reports = "".join(homing.grbl.status() for _ in range(40))
    assert "|H:0,0>" in reports and "|H:1" not in reports
    homing.grbl.close()


@pytest.mark.parametrize("kind", stalls.LATE)
@pytest.mark.parametrize("event", ["\x18", "door", "estop"])
@pytest.mark.parametrize("seed", stalls.seeds(2))
def test_what_ends_it_leaves_no_step_behind(seed: int, event: str, kind: str) -> None:
    rng = random.Random(f"{seed} {kind} {event}")
    homing = Homing(rng)
    homing.grbl.stall_often(rng, stalls.LATE[kind], 8)
    homing.grbl.after(rng.uniform(0.1, 0.7), "$H\n")
    if len(event) > 1:
        homing.grbl.input(event, True)
    else:
        homing.grbl.put(event)
    homing.grbl.after(3)
    at = homing.grbl.stands()
    homing.grbl.after(12)
    assert homing.grbl.stands() == at and homing.grbl.state() == "Alarm"
    homing.grbl.close()
