"""$92: glitches on the lines of limit and home switches stop nothing, a real closing does in time, and homing measures
the same place with and without it."""

from __future__ import annotations

import random

import pytest
from grbl_host import Grbl

FILTER_S = 5e-6  # the default
TIMER_TICK_S = 1e-6


@pytest.fixture
def cutting(grbl: Grbl) -> Grbl:
    """In the middle of a long move, hard limits on."""
    grbl.settings(_21=1, _110=5000, _120=500)
    grbl.after(0.5, "G1X-100F5000\n")
    assert grbl.state() == "Run"
    return grbl


def test_the_default(grbl: Grbl) -> None:
    assert "\r\n$92=5\r\n" in grbl.send("$$\n")
    assert grbl.send("$92=1001\n") == "error:2\r\n" and grbl.send("$92=1000\n") == "ok\r\n"


@pytest.mark.parametrize("line", ["limit-min-x", "limit-max-y", "limit-min-z"])
@pytest.mark.parametrize("length_us", [0.1, 1, 4.9])
def test_a_glitch_stops_nothing(cutting: Grbl, line: str, length_us: float) -> None:
    cutting.input_in(1e-3, line, True)
    cutting.input_in(1e-3 + length_us * 1e-6, line, False)
    assert cutting.after(0.1) == "" and cutting.state() == "Run"
    assert "Pn:" not in cutting.status()


@pytest.mark.parametrize("filter_us", [0, 1, 5, 100, 1000])
@pytest.mark.parametrize("line", ["limit-min-x", "limit-max-y"])
def test_a_switch_that_closes_stops_in_time(grbl: Grbl, line: str, filter_us: int) -> None:
    """Not before the time is over, and then within a tick of the timer: by the steps made, at a known speed."""
    grbl.settings(_21=1, _110=5000, _120=500, _92=filter_us)
    grbl.after(0.5, "G1X-100F5000\n")
    steps_s = 5000 / 60 * 250
    grbl.input_in(1e-3, line, True)
    grbl.after(1e-3 - 0.1e-6)
    before = grbl.stands()[0]
    assert grbl.after(filter_us * 1e-6) == "" and grbl.state() == "Run"
    assert grbl.after(2 * TIMER_TICK_S).startswith("ALARM:1\r\n")
    made = before - grbl.stands()[0]
    assert filter_us * 1e-6 * steps_s - 1 <= made <= (filter_us * 1e-6 + TIMER_TICK_S) * steps_s + 1
    assert grbl.position() == grbl.stands()


def test_the_e_stop_does_not_wait(cutting: Grbl) -> None:
    cutting.input("estop", True)
    at = cutting.stands()
    cutting.input("estop", False)
    assert cutting.send("").startswith("ALARM:50\r\n") and cutting.stands() == at == cutting.position()


@pytest.mark.parametrize("seed", range(20))
def test_bursts_of_noise(cutting: Grbl, seed: int) -> None:
    """Glitches shorter than the filter, close together and on several lines at the same time."""
    chance, t = random.Random(seed), 1e-3
    for _ in range(100):
        line = chance.choice(["limit-min-x", "limit-max-x", "limit-max-y", "limit-min-z"])
        cutting.input_in(t, line, True)
        t += chance.uniform(0.05e-6, FILTER_S - 0.1e-6)
        cutting.input_in(t, line, False)
        t += max(chance.choice([0.1e-6, 1e-6, 20e-6]), cutting.edge_gap_s)
    assert cutting.after(t + 1e-3) == "" and cutting.state() == "Run"


@pytest.mark.parametrize("seed", range(10))
def test_a_switch_closes_in_the_midst_of_noise(cutting: Grbl, seed: int) -> None:
    """Noise on another line delays it by one more time at most."""
    chance, t = random.Random(seed), 1e-3
    closing = 1e-3 + chance.uniform(0, 100e-6)
    events = [(closing, "limit-min-x", True)]
    for _ in range(100):
        length = chance.uniform(0.05e-6, FILTER_S - 0.1e-6)
        events += [(t, "limit-max-y", True), (t + length, "limit-max-y", False)]
        t += length + chance.choice([0.1e-6, 1e-6])
    for at, line, active in sorted(events):
        cutting.input_in(at, line, active)
    cutting.after(closing + FILTER_S - 0.1e-6)
    assert cutting.state() == "Run"
    assert cutting.after(FILTER_S + 2 * TIMER_TICK_S).startswith("ALARM:1\r\n")


def test_a_contact_that_bounces(cutting: Grbl) -> None:
    """It counts when it has stayed closed once for long enough; then its bouncing changes nothing."""
    for at_us, active in ((0, True), (2, False), (4, True), (7, False), (9, True), (30, False), (32, True)):
        cutting.input_in(1e-3 + at_us * 1e-6, "limit-min-x", active)
    cutting.after(1e-3 + 13e-6)
    assert cutting.state() == "Run"
    assert cutting.after(3e-6).startswith("ALARM:1\r\n")


@pytest.mark.parametrize("home", [0, 7])
def test_homing_finds_the_same_place(home: int) -> None:
    """The step at which the switch closes, not the one at which the time is over: 0.05 mm later at 1 ms."""
    found = []
    for filter_us in (0, 5, 1000):
        grbl = Grbl(home=home)
        grbl.send("")
        grbl.settings(_22=1, _23=7, _24=3000, _25=5000, _26=5, _110=5000, _111=5000, _112=5000)
        grbl.settings(_120=500, _121=500, _122=500, _92=filter_us)
        for axis in range(3):
            switch = grbl.homing if home else grbl.travel
            switch(axis, -1234 - axis, 100_000)
        assert grbl.send("$X\n$H\n").endswith("ok\r\n")
        assert grbl.state() == "Idle"
        found.append(grbl.stands())
        grbl.close()
    assert found[0] == found[1] == found[2]


def test_glitches_while_it_homes(grbl: Grbl) -> None:
    """On the line that it looks for: it continues to the switch."""
    grbl.settings(_22=1, _23=7, _26=5, _24=100, _25=2000, _110=5000, _111=5000, _112=5000)
    grbl.settings(_120=500, _121=500, _122=500)
    for axis in range(3):
        grbl.travel(axis, -2500, 100_000)
    for n in range(100):
        grbl.input_in(0.01 * n, f"limit-min-{'xyz'[n % 3]}", True)
        grbl.input_in(0.01 * n + 3e-6, f"limit-min-{'xyz'[n % 3]}", False)
    assert grbl.send("$X\n$H\n").endswith("ok\r\n")
    assert grbl.stands() == [-2500 + 250] * 3 + [0] * 3
