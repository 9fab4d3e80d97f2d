"""Spindle and coolant with $32=0: what stays on when, from the recorded pins. The table is in docs/outputs.md."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

import numpy as np
import pytest
from grbl_host import HZ, Grbl

FAST = {f"s{base + ax}": value for base, value in ((110, 5000), (120, 500)) for ax in range(3)}
ON, OFF = (1, 65535, 2), (0, 0, 0)  # M3 S1000 M8
RUN_UP_S, COOLANT_S = 4.0, 1.0
PERIODS_US = [0, 1000, 5000, 20_000]


@pytest.fixture
def grbl() -> Iterator[Grbl]:
    controller = Grbl()
    controller.send("")
    controller.settings(**FAST)
    controller.fine("M3S1000M8F1200")
    controller.record()
    controller.record_outputs()
    yield controller
    controller.close()


def pins(grbl: Grbl) -> tuple[int, int, int]:
    outputs = grbl.outputs()
    return outputs.spindle_direction, outputs.spindle_duty, outputs.coolant


def changes(grbl: Grbl) -> list[tuple[float, int, int]]:
    """(s, spindle, coolant) for each change of one of the two since the record began."""
    at = {
        int(row["t"]): (float(row["t"]) / HZ, int(row["direction"]), int(row["coolant"]))
        for row in grbl.output_changes()
    }
    rows = list(at.values())  # of one moment: the last
    return rows[:1] + [row for before, row in pairwise(rows) if row[1:] != before[1:]]


def step_times(grbl: Grbl) -> np.ndarray:
    return np.asarray(grbl.step_events()["t"] / HZ)


EVENTS = {
    "rest": ("G1X-1\n", ON),
    "error": ("G1X-1\nG1X1X2\n", ON),
    "dwell": ("G4P0.2\n", ON),
    "hold": ("G1X-20\n!", ON),
    "stop in a hold": ("G1X-20\n!\x9e", (0, 0, 2)),
    "M0": ("G1X-1\nM0\n", ON),
    "M6": ("T1M6\n", OFF),
    "jog": ("$J=G91X-1F600\n", ON),
    "cancelled jog": ("$J=G91X-50F600\n\x85", ON),
    "probe": ("G38.3Z-1F100\n", ON),
    "missed probe": ("G38.2Z-1F100\n", ON),
    "check": ("$C\n", ON),
    "check and back": ("$C\n$C\n", OFF),
    "M5 in check": ("$C\nM5M9\n", ON),
    "door": ("G1X-20\n\x84", OFF),
    "M2": ("M2\n", OFF),
    "M30": ("M30\n", OFF),
    "sleep": ("$SLP\n", OFF),
    "reset": ("\x18", OFF),
    "reset in motion": ("G1X-20\n\x18", OFF),
    "M5": ("M5\n", (0, 0, 2)),
    "M9": ("M9\n", (1, 65535, 0)),
    "M4": ("M4\n", (-1, 65535, 2)),
    "override": ("\x9b", (1, 58981, 2)),
    "flood byte": ("\xa0", (1, 65535, 0)),
}


@pytest.mark.parametrize("name", EVENTS)
def test_what_stays_on(grbl: Grbl, name: str) -> None:
    data, after = EVENTS[name]
    line, stop = (data, "") if data[-1] == "\n" or len(data) == 1 else (data.rstrip("!\x84\x85\x9e\x18"), "")
    stop = data[len(line) :]
    grbl.after(0.3, line)
    for byte in stop:
        grbl.after(0.5, byte)
    grbl.after(1.0)
    direction, duty, coolant = pins(grbl)
    assert (direction, coolant) == (after[0], after[2])
    assert duty == pytest.approx(after[1], abs=660)  # 1 %


@pytest.mark.parametrize("input_", ["estop", "limit-x"])
def test_critical_alarms_switch_all_off(grbl: Grbl, input_: str) -> None:
    grbl.fine("$21=1")
    grbl.after(0.3, "G1X-20\n")
    grbl.input(input_, True)
    grbl.after(0.01)
    assert pins(grbl) == OFF


def test_soft_limit_switches_all_off(grbl: Grbl) -> None:
    grbl.fine("$22=1", "$20=1", "$130=100", "G1X-1", "X-2")
    assert "ALARM:2" in grbl.send("X-500\n")
    assert pins(grbl) == OFF


def test_homing_leaves_them_as_they_are(grbl: Grbl) -> None:
    """As Grbl; when it fails all is off."""
    for axis in range(3):
        grbl.travel(axis, -12_500, 1000)
    grbl.settings(s22=1, s24=100, s25=2000, s26=25, s27=2, s130=40, s131=40, s132=40)
    assert grbl.send("$H\n") == "ok\r\n" and pins(grbl) == ON
    grbl.travel(0, -(2**31), 2**31 - 1)
    assert "ALARM" in grbl.send("$H\n") and pins(grbl) == OFF


@pytest.mark.parametrize("period_us", PERIODS_US)
def test_the_door_and_back(grbl: Grbl, period_us: int) -> None:
    """Off when the motion rests; then spindle, 4 s, coolant, 1 s, motion. Grbl's order and its times."""
    grbl.output_period(period_us)
    late_s = period_us * 1e-6 + 0.001
    grbl.after(0.5, "G1X-20\n")
    grbl.after(1.0, "\x84")
    stood_s = step_times(grbl)[-1]
    resumed_s = grbl.time()
    grbl.after(10.0, "~")
    (_, *first), *rest = changes(grbl)
    assert first == [1, 2]
    assert [row[1:] for row in rest] == [(0, 0), (1, 0), (1, 2)]
    off_s, spindle_s, coolant_s = (row[0] for row in rest)
    times = step_times(grbl)
    moved_s = times[times > stood_s + 0.5][0]
    assert 0 <= off_s - stood_s <= 0.01 + late_s
    assert 0 <= spindle_s - resumed_s <= late_s
    assert -late_s <= coolant_s - spindle_s - RUN_UP_S <= late_s
    assert -late_s <= moved_s - coolant_s - COOLANT_S <= 0.01 + late_s


def test_a_door_that_opens_again_while_it_is_restored(grbl: Grbl) -> None:
    """All is off again, and the whole order comes again."""
    grbl.after(0.5, "G1X-20\n")
    grbl.after(1.0, "\x84")
    grbl.after(2.0, "~")
    assert pins(grbl) == (1, 65535, 0)
    grbl.input("door", True)
    grbl.after(0.5)
    assert pins(grbl) == OFF
    grbl.input("door", False)
    grbl.after(3.9, "~")
    assert pins(grbl) == (1, 65535, 0)
    grbl.after(0.2)
    assert pins(grbl) == ON
    grbl.send("")
    assert grbl.stands()[0] == -5000


def test_without_coolant_there_is_no_wait_for_it(grbl: Grbl) -> None:
    grbl.fine("M9")
    grbl.after(0.5, "G1X-20\n")
    grbl.after(1.0, "\x84")
    resumed_s = grbl.time()
    grbl.after(6.0, "~")
    times = step_times(grbl)
    assert times[times > resumed_s][0] - resumed_s == pytest.approx(RUN_UP_S, abs=0.02)


def test_without_a_spindle_there_is_no_run_up(grbl: Grbl) -> None:
    grbl.fine("M5")
    grbl.after(0.5, "G1X-20\n")
    grbl.after(1.0, "\x84")
    resumed_s = grbl.time()
    grbl.after(6.0, "~")
    times = step_times(grbl)
    assert times[times > resumed_s][0] - resumed_s == pytest.approx(COOLANT_S, abs=0.02)


def test_a_stopped_spindle_comes_back_at_the_latest_with_the_motion(grbl: Grbl) -> None:
    """0x9E in a hold, and once more, and ~: restored, with Grbl's message each time."""
    restored = "[MSG:Restoring spindle]\r\n"
    grbl.after(0.3, "G1X-20\n")
    grbl.after(0.5, "!")
    assert grbl.after(0.1, "\x9e") == "" and pins(grbl) == (0, 0, 2)
    assert grbl.after(0.1, "\x9e") == restored and pins(grbl) == ON
    assert grbl.after(0.1, "\x9e") == "" and pins(grbl) == (0, 0, 2)
    assert grbl.after(0.1, "~") == restored and pins(grbl) == ON
    grbl.after(0.1, "\x9e")  # not in Run
    assert pins(grbl) == ON


@pytest.mark.parametrize(
    ("low", "high", "s", "rpm", "duty"),
    [
        (0, 1000, 500, 500, 0.5),
        (0, 1000, 2000, 1000, 1.0),
        (200, 1000, 100, 200, 1 / 65535),
        (200, 1000, 600, 600, 0.5),
        (200, 1000, 0, 0, 0.0),
        (1000, 1000, 5, 1000, 1.0),
    ],
)
def test_duty_is_s_between_its_limits(grbl: Grbl, low: int, high: int, s: int, rpm: int, duty: float) -> None:
    """Duty 0 only for S0; $31 is the least that turns; $30 not above $31 is on or off."""
    grbl.fine("M5", f"$30={high}", f"$31={low}", f"M3S{s}")
    outputs = grbl.outputs()
    assert outputs.spindle_rpm == rpm
    assert outputs.spindle_duty == pytest.approx(duty * 65535, abs=1)
    assert f"FS:0,{rpm}" in grbl.status()


def test_m51_switches_the_spindle_override_off(grbl: Grbl) -> None:
    grbl.after(0.1, "\x9b")
    assert grbl.outputs().spindle_rpm == pytest.approx(900)
    grbl.fine("M51P0")
    assert grbl.outputs().spindle_rpm == 1000
    grbl.fine("M51")
    assert grbl.outputs().spindle_rpm == pytest.approx(900)


@pytest.mark.parametrize(("delay_s", "laser"), [(0.5, 0), (3.0, 0), (3.0, 1)])
def test_coolant_needs_its_time_behind_a_door(delay_s: float, laser: int) -> None:
    """$93, and Grbl's second at least; a laser does not run up."""
    controller = Grbl()
    controller.send("")
    controller.settings(**FAST)
    controller.fine(f"$32={laser}", f"$93={delay_s}", "M3S1000M8F1200")
    controller.after(0.5, "G1X-20\n")
    controller.after(1.0, "\x84")
    stands = controller.stands()
    wait_s = (0 if laser else RUN_UP_S) + max(COOLANT_S, delay_s)
    controller.after(wait_s - 0.1, "~")
    assert controller.stands() == stands
    controller.after(0.2)
    assert controller.stands() != stands
    controller.close()
