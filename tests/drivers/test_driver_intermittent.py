"""Faults that come and go, answers that are partly sound, and moments that are no faults."""

from __future__ import annotations

import pytest
from driver_grbl import (
    GLITCH,
    HOT,
    KINDS,
    NO_SUPPLY,
    OPEN,
    PARTLY,
    SHORT,
    STEPS_MM,
    TMC2130,
    TMC2209,
    TMC5160,
    UNDERVOLTAGE,
    DriverGrbl,
    make,
)
from wificnc.simulator.library import Tasks

ALARM = "ALARM:54"
LOOK_S = 0.1  # a driver of three is looked at every 36 ms, one by SPI twice


@pytest.fixture(params=KINDS)
def kind(request: pytest.FixtureRequest) -> int:
    return int(request.param)


def messages(said: str) -> list[str]:
    return [line for line in said.splitlines() if line.startswith("[MSG:Driver")]


def moving(grbl: DriverGrbl) -> DriverGrbl:
    assert grbl.after(0.6, "G91\nG1X200Y200F1200\n") == "ok\r\n" * 2
    assert grbl.state() == "Run"
    return grbl


def test_answers_that_are_sound_in_part_are_reported_and_do_not_block_in_silence() -> None:
    """Its version can be read; its other registers cannot."""
    grbl = moving(make(TMC2209))
    grbl.faults(1, PARTLY)
    said = grbl.until(ALARM, 1.5)[0]
    assert [line.split(".")[0] for line in messages(said)] == ["[MSG:Driver Y: garbled answers"]
    assert messages(grbl.after(3.0)) == [], "and not again and again"


def test_answers_that_are_sound_in_part_from_the_start_do_not_hold_motion_for_ever() -> None:
    grbl = DriverGrbl(TMC2209)
    grbl.faults(1, PARTLY)
    said = grbl.after(1.0)
    for ax in range(3):
        said += grbl.after(0.05, f"${140 + ax}=700\n")
    said += grbl.after(2.0)
    assert [line.split(".")[0] for line in messages(said)] == ["[MSG:Driver Y: garbled answers"]
    assert grbl.rows()[1][3] == "garbled"
    grbl.faults(1, 0)
    assert "[MSG:Driver Y: it answers again]" in grbl.after(1.5)
    assert [row[3] for row in grbl.rows()] == ["ok"] * 3


@pytest.mark.parametrize("tasks", [Tasks.FREE, Tasks.ESP32, Tasks.PIC32MZ])
def test_a_fault_that_is_over_when_the_alarm_comes_is_named_all_the_same(kind: int, tasks: Tasks) -> None:
    grbl = moving(make(kind, tasks=tasks))
    grbl.faults(1, SHORT)
    said = grbl.after(LOOK_S)
    grbl.faults(1, 0)
    said += grbl.until(ALARM, 1.0)[0]
    assert [line.split(".")[0].split(",")[0] for line in messages(said)] == ["[MSG:Driver Y: short circuit"]


def test_a_warning_that_is_over_soon_says_why_the_job_is_held(kind: int) -> None:
    grbl = moving(make(kind))
    grbl.faults(1, HOT)
    said = grbl.after(LOOK_S)
    grbl.faults(1, 0)
    said += grbl.after(1.0)
    assert grbl.state() == "Hold:0"
    assert [line.split(".")[0] for line in messages(said)] == ["[MSG:Driver Y: it becomes too hot"]


def test_undervoltage_that_is_over_can_be_unlocked(kind: int) -> None:
    """A TMC5160 keeps the flag until it is cleared by a write."""
    grbl = moving(make(kind))
    grbl.faults(1, UNDERVOLTAGE)
    said = grbl.until(ALARM, 1.0)[0]
    grbl.faults(1, 0)
    said += grbl.after(1.0)
    assert len(messages(said)) == 1
    grbl.after(0.5, "\x18")
    assert grbl.after(0.05, "$X\n").endswith("ok\r\n")
    assert grbl.rows()[1][3] == "ok"
    assert grbl.rows()[1][-1] == "0"


def test_undervoltage_that_lasts_cannot_be_unlocked(kind: int) -> None:
    grbl = moving(make(kind))
    grbl.faults(1, UNDERVOLTAGE)
    grbl.until(ALARM, 1.0)
    grbl.after(1.0)
    said = grbl.after(0.5, "\x18")
    for _ in range(20):
        assert grbl.after(0.037, "$X\n") == "error:194\r\n", said


@pytest.mark.parametrize("gap_ms", [108, 144])
def test_single_steps_in_step_with_the_looks_are_seen(gap_ms: int) -> None:
    """A look that is under way when a step comes says that the motor is at rest, and is right."""
    grbl = make(TMC2209)
    feed = f"F{60_000 / gap_ms / STEPS_MM:.5f}\n"
    for n in range(36):
        said = grbl.after(0.3 + 6 * gap_ms / 1000 + n / 1000, f"G91\nG1X{6 / STEPS_MM:.4f}{feed}")
        assert messages(said) == [], n
        assert grbl.rows()[0][3] == "ok"


@pytest.mark.parametrize("kind", [TMC5160, TMC2130])
def test_motion_is_no_reason_to_find_a_driver_again(kind: int) -> None:
    """In motion GSTAT and the status of a sound driver are all zeros."""
    grbl = moving(make(kind))
    irun = grbl.register(1, 0x10)
    for _ in range(40):
        grbl.after(0.01)
        assert grbl.rows()[1][3] == "ok"
    assert grbl.register(1, 0x10) == irun


def test_a_supply_that_fails_in_an_alarm_takes_the_trust_in_the_position(kind: int) -> None:
    """An emergency stop often switches the motor supply off, and axes are pushed by hand."""
    grbl = make(kind, "$22=1", "$23=0", "$24=600", "$25=2400", "$27=2", "$44=7")
    for ax in range(3):
        grbl.travel(ax, -50_000, 5_000)
    assert "ok\r\n" in grbl.after(60.0, "$H\n")
    assert grbl.after(0.2, "$20=1\n") == "ok\r\n"
    grbl.after(1.0, "G90G53G1X-5000F600\n")  # beyond the travel: an alarm
    assert grbl.state() == "Alarm"
    for ax in range(3):
        grbl.faults(ax, NO_SUPPLY)
    grbl.after(2.0)
    for ax in range(3):
        grbl.faults(ax, 0)
    grbl.after(2.0)
    grbl.after(1.0, "\x18")
    said = grbl.after(0.2, "$X\n")
    assert "error:194" not in said
    homed = grbl.after(0.1, "$#\n") + grbl.status()
    assert "|H:" not in homed or "|H:0" in homed


def test_fast_motion_is_not_taken_for_an_open_coil(kind: int) -> None:
    """The flag is only sure in slow motion, the data sheets say."""
    grbl = make(kind, "$110=30000", "$111=30000", "$120=2000", "$121=2000")
    grbl.after(0.5, "G91\nG0X400\nG0X-400\nG0X400\n")
    grbl.faults(0, OPEN)
    grbl.after(0.7)
    said = grbl.after(1.0)
    assert messages(said) == []
    assert grbl.state() == "Run"


@pytest.mark.parametrize("kind", [TMC5160, TMC2130])
def test_one_wrong_bit_on_a_bus_without_a_checksum_is_no_fault(kind: int) -> None:
    grbl = moving(make(kind))
    said = ""
    for n in range(60):
        grbl.faults(n % 3, GLITCH)
        said += grbl.after(0.137)
    assert said == ""
    assert grbl.state() == "Run"
    assert [row[-1] for row in grbl.rows()] == ["0"] * 3
