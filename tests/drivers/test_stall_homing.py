"""Homing by StallGuard: the end is found by the driver, and only at speeds at which that can be trusted."""

from __future__ import annotations

import pytest
from driver_grbl import (
    COOLCONF,
    COOLCONF_2209,
    GCONF,
    HOT,
    KINDS,
    SGTHRS,
    SHORT,
    STEPS_MM,
    TCOOLTHRS,
    TMC2209,
    UNWIRED,
    DriverGrbl,
    make,
)
from slow import cases_but
from wificnc.simulator.library import Tasks

HOMING = ("$22=1", "$23=0", "$24=1500", "$25=2400", "$26=10", "$27=2", "$44=7", "$45=0")
STALL = tuple(f"$25{ax}=80" for ax in range(3))
LOW, HIGH = -100_000, 20_000
OWN_SLOWEST = 60 * 100 * 16 / STEPS_MM  # half a turn: 100 full steps in a second


def ready(kind: int, *more: str, tasks: Tasks = Tasks.FREE) -> DriverGrbl:
    grbl = make(kind, *HOMING, *STALL, *more, tasks=tasks)
    for ax in range(3):
        grbl.travel(ax, LOW, HIGH)
    return grbl


@pytest.mark.parametrize("kind", KINDS)
def test_it_finds_the_end_and_is_a_pull_off_away_from_it(kind: int) -> None:
    grbl = ready(kind)
    said = grbl.after(40.0, "$H\n")
    assert "ok\r\n" in said, said
    assert [round(steps / STEPS_MM, 1) for steps in grbl.stands()[:3]] == [HIGH / STEPS_MM - 2] * 3
    assert grbl.state() == "Idle"
    assert grbl.register(0, TCOOLTHRS) == 0, "a stall in a job is no limit switch"
    if kind == TMC2209:
        assert grbl.register(0, SGTHRS) == 0
    else:
        assert grbl.register(0, GCONF) & 0x100 == 0


@pytest.mark.parametrize(("setting", "value"), [("$24", 300), ("$25", 383), ("$110", 383)])
def test_a_speed_below_the_slowest_is_refused_with_the_reason(setting: str, value: int) -> None:
    grbl = ready(TMC2209)
    assert OWN_SLOWEST == 384
    assert grbl.after(0.1, f"{setting}={value}\n") == "ok\r\n"
    said = grbl.after(0.5, "$H\n")
    assert said == (
        "[MSG:StallGuard of axis X: below 384 mm/min it cannot be trusted. Raise $24 and $25, or lower $260 ..]\r\n"
        "error:198\r\n"
    )
    assert grbl.position()[:3] == [0, 0, 0]


def test_the_slowest_speed_is_a_setting() -> None:
    grbl = ready(TMC2209, "$260=1600")
    assert grbl.after(0.5, "$H\n").endswith("error:198\r\n")
    assert grbl.after(0.1, "$260=1400\n") == "ok\r\n"
    assert "ok\r\n" in grbl.after(40.0, "$H\n")


def test_it_needs_diag_and_a_current() -> None:
    grbl = make(TMC2209, *HOMING, *STALL, diag=False)
    assert grbl.after(0.5, "$H\n") == "error:199\r\n"
    grbl = make(TMC2209, *HOMING, *STALL, "$140=0")
    assert grbl.after(0.5, "$H\n") == "error:199\r\n"


ACTIONS, FAULTS, TASKS = [0, 1, 2], [UNWIRED, SHORT], [Tasks.FREE, Tasks.ESP32, Tasks.PIC32MZ]


def is_kept(tasks: Tasks, fault: int, action: int) -> bool:
    """Both faults with each computer's tasks, and each action with both."""
    return action == (TASKS.index(tasks) + FAULTS.index(fault)) % 3


@pytest.mark.alike(6)
@pytest.mark.parametrize(("tasks", "fault", "action"), cases_but(is_kept, TASKS, FAULTS, ACTIONS))
def test_a_fault_while_it_homes_is_an_alarm_whatever_the_setting_is(tasks: Tasks, fault: int, action: int) -> None:
    """Its end is not found, or found where the motor was left."""
    grbl = ready(TMC2209, f"$746={action}", tasks=tasks)
    grbl.after(0.5, "$H\n")
    grbl.faults(0, fault)
    said = grbl.until("ALARM:54", 1.0)[0]
    assert said.count("[MSG:Driver X: ") == 1
    grbl.after(1.0)
    before = grbl.stands()
    grbl.faults(0, 0)
    said = grbl.after(2.0, "\x18")
    assert "|H:0,0>" in grbl.status()
    assert grbl.stands() == before


@pytest.mark.parametrize("action", [0, 1])
def test_it_does_not_begin_with_a_driver_that_does_not_show_a_stall(action: int) -> None:
    grbl = ready(TMC2209, f"$746={action}")
    grbl.faults(0, UNWIRED)
    grbl.after(1.0)
    grbl.after(1.0, "~")
    before = grbl.stands()
    assert "ALARM:54" in grbl.after(2.0, "$H\n")
    assert grbl.stands() == before


def test_a_fault_of_an_axis_that_does_not_home_leaves_that_to_the_setting() -> None:
    grbl = ready(TMC2209, "$746=0", "$45=2", "$44=1", "$46=4")
    grbl.faults(1, SHORT)
    grbl.after(1.0)
    assert "ok\r\n" in grbl.after(40.0, "$HX\n")


def test_a_warning_does_not_end_homing() -> None:
    grbl = ready(TMC2209)
    grbl.after(0.5, "$H\n")
    grbl.faults(0, HOT)
    assert "ok\r\n" in grbl.after(40.0)


def test_diag_that_never_comes_ends_at_one_and_a_half_travels() -> None:
    grbl = make(TMC2209, *HOMING, *STALL, "$130=100", "$131=100", "$132=100")
    for ax in range(3):
        grbl.travel(ax, -10_000_000, 10_000_000)
    assert "ALARM:9\r\n" in grbl.after(40.0, "$H\n")
    assert max(abs(steps) for steps in grbl.position()) <= 151 * STEPS_MM
    assert "|H:0,0>" in grbl.status()


def test_diag_that_is_always_there_ends_after_a_pull_off() -> None:
    grbl = make(TMC2209, *HOMING, *STALL, "$44=1", "$45=2", "$46=4")
    for ax in range(3):
        grbl.travel(ax, -10_000_000, 10_000_000)
    grbl.input("limit-max-x", True)
    assert "ALARM:8\r\n" in grbl.after(40.0, "$HX\n")
    assert abs(grbl.position()[0]) <= 3 * STEPS_MM
    assert "|H:0,0>" in grbl.status()


@pytest.mark.parametrize("kind", KINDS)
def test_with_hard_limits_a_stall_is_the_end_while_it_homes_and_nothing_in_a_job(kind: int) -> None:
    """$21=1: DIAG is a limit input, and on for a stall. The place is as without, and a job leaves it and returns."""
    grbl = ready(kind, "$21=1")
    said = grbl.after(40.0, "$H\n")
    assert "ok\r\n" in said and "ALARM" not in said, said
    home = grbl.stands()[:3]
    assert [round(steps / STEPS_MM, 1) for steps in home] == [HIGH / STEPS_MM - 2] * 3
    assert grbl.after(20.0, "G91\nG1X-30Y-30F3000\nG1X30Y30F3000\n") == "ok\r\n" * 3
    assert grbl.state() == "Idle"
    assert grbl.stands()[:3] == home
    grbl.close()


@pytest.mark.parametrize("kind", KINDS)
def test_cool_step_is_on_in_a_job_and_a_job_does_not_change_it(kind: int) -> None:
    coolconf = COOLCONF_2209 if kind == TMC2209 else COOLCONF
    grbl = make(kind, "$240=5", "$21=1")
    assert grbl.after(0.5, "G91\nG1X50F3000\n") == "ok\r\n" * 2
    assert grbl.state() == "Run"
    assert grbl.register(0, coolconf) & 15 == 5
    assert grbl.register(0, TCOOLTHRS) != 0, "coolStep needs a slowest speed"
    assert grbl.register(1, coolconf) & 15 == 0
    assert grbl.after(0.1, "$240=3\n") == "error:8\r\n"
    assert grbl.register(0, coolconf) & 15 == 5
    grbl.after(3.0)
    assert grbl.state() == "Idle"
    assert grbl.position()[0] == grbl.stands()[0] == 50 * STEPS_MM
    assert grbl.after(0.5, "$240=3\n") == "ok\r\n"
    assert grbl.register(0, coolconf) & 15 == 3
    grbl.close()
