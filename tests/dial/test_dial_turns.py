"""The dial turned back and forth, from any place, and what its motion must not be taken for."""

from __future__ import annotations

import pytest
from dial_grbl import STEPS_MM, make
from wificnc.simulator.library import Tasks

FEED_MM_S, STEP_MM = 30.0, 0.1
BUSY = "controller was busy"


@pytest.mark.parametrize("accel_mm_s2", [20, 100, 500])
@pytest.mark.parametrize("per_s", [100.0, 400.0, 3000.0])
def test_a_dial_that_turns_back_while_the_axis_brakes_keeps_the_bound(accel_mm_s2: int, per_s: float) -> None:
    """What comes while it brakes is not more way than a dial that did not turn back may have."""
    grbl = make(f"$120={accel_mm_s2}")
    grbl.after(grbl.turn(300, per_s))
    said = grbl.after(grbl.turn(-round(per_s / 2), per_s))
    stopped_s = grbl.time()
    said += grbl.after(12.0)
    bound_mm = FEED_MM_S**2 / (2 * accel_mm_s2)
    left_mm = abs(grbl.position()[0] - grbl.x_at(stopped_s)) / STEPS_MM
    assert left_mm <= max(bound_mm, STEP_MM) + 1 / STEPS_MM
    assert grbl.state() == "Idle"
    assert "error" not in said and "travel ends" not in said
    grbl.close()


@pytest.mark.parametrize("tasks", [Tasks.FREE, Tasks.ESP32, Tasks.PIC32MZ])
@pytest.mark.parametrize("detents", [1, 2, 5])
def test_back_and_forth_while_the_axis_brakes_ends_on_a_detent(tasks: Tasks, detents: int) -> None:
    grbl = make("$120=100", tasks=tasks)
    grbl.after(grbl.turn(100, 200.0))
    grbl.after(grbl.turn(-detents, 200.0))
    grbl.after(grbl.turn(detents, 200.0) + 4.0)
    at = grbl.position()[0]
    assert at > 0 and at % 25 == 0
    grbl.turned(1)
    assert grbl.position()[0] == at + 25
    grbl.close()


@pytest.mark.parametrize("place_mm", ["0.1234567", "0.333333", "-0.777777", "1.37"])
def test_from_any_place_it_says_nothing_of_an_end(place_mm: str) -> None:
    """Where the axis is is no whole number of detents, nor one of binary digits."""
    grbl = make()
    grbl.after(0.5, f"G1X{place_mm}F6000\n")
    said, begin = "", grbl.position()[0]
    for detents in (3, 7, -5, 1, 1, 9):
        said += grbl.turned(detents)
    assert said + grbl.after(6.0) == ""
    assert abs(grbl.position()[0] - begin - 16 * 25) <= 1
    grbl.close()


def test_the_end_of_its_travel_with_thousands_of_detents_to_go() -> None:
    """All that fit are made, the last one whole."""
    grbl = make("$401=0.001", "$402=6000", "$120=50", "$130=20.0005", "$22=1", "$20=1")
    said = ""
    for _ in range(40):
        said += grbl.after(grbl.turn(-3000, 6000.0))
    said += grbl.after(8.0)
    assert "travel ends here" in said
    assert grbl.position()[0] == -20 * STEPS_MM
    grbl.close()


def test_what_the_dial_has_made_slow_is_no_underrun() -> None:
    """$I reports what a job has had."""
    grbl = make("$120=20")
    assert grbl.after(grbl.turn(200, 100.0) + 4.0) == ""
    assert BUSY not in grbl.after(0.2, "$I\n")
    grbl.close()
