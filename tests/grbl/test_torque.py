"""Torque lines: full current from before the first step of an axis until $84 after its last one. And the RC servo."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from grbl_host import Grbl

DELAY_MS = 300


@pytest.fixture
def grbl() -> Iterator[Grbl]:
    grbl = Grbl()
    grbl.send("")
    grbl.settings(**{f"s{base + ax}": value for base, value in ((110, 5000), (120, 500)) for ax in range(3)})
    yield grbl
    grbl.close()


@pytest.fixture
def torque(grbl: Grbl) -> Grbl:
    grbl.settings(s83=3, s84=DELAY_MS)
    return grbl


def test_idle_motors_have_little_current(torque: Grbl) -> None:
    assert torque.outputs().digital == 0


def test_each_axis_has_full_current_while_it_moves_and_a_while_after(torque: Grbl) -> None:
    torque.put("G1X5F600\n")
    torque.after(0.1)
    assert torque.outputs().digital == 1  # 10 mm/s: 0.5 s, and Y rests
    torque.fine("G4P0")  # X is at rest
    assert torque.outputs().digital == 1
    torque.after(DELAY_MS / 1000 - 0.05)
    assert torque.outputs().digital == 1
    torque.after(0.1)
    assert torque.outputs().digital == 0


def test_current_comes_before_the_first_step(torque: Grbl) -> None:
    torque.put("G1X5Y5F600\n")
    while torque.position()[0] == 0:
        torque.after(0.0002)
        if torque.position()[0] != 0:
            break
        rising = torque.outputs().digital
    assert torque.outputs().digital == 3
    assert rising in (0, 3)


def test_a_pause_within_the_delay_changes_nothing(torque: Grbl) -> None:
    torque.fine("G1X1F600", "G4P0.2")
    assert torque.outputs().digital == 1
    torque.fine("X2", "G4P0.2")
    assert torque.outputs().digital == 1


def test_other_outputs_stay_the_programs(torque: Grbl) -> None:
    torque.fine("M64P2")
    assert torque.outputs().digital == 4
    assert torque.send("M64P0\n") == "error:131\r\n" and torque.send("M62P1\n") == "error:131\r\n"
    torque.put("G1X5F600\n")
    torque.after(0.1)
    assert torque.outputs().digital == 5
    torque.fine("G4P0", "M65P2")
    assert torque.outputs().digital == 1


def test_without_a_mask_there_are_no_torque_lines(grbl: Grbl) -> None:
    grbl.put("G1X5F600\n")
    grbl.after(0.1)
    assert grbl.outputs().digital == 0
    grbl.fine("M64P0")
    assert grbl.outputs().digital == 1


@pytest.mark.parametrize(
    ("z_mm", "pulse_us"),
    [(0, 2000), (-5, 1500), (-10, 1000), (-2.5, 1750), (-15, 1000), (5, 2000)],
)
def test_a_servo_follows_its_axis(grbl: Grbl, z_mm: float, pulse_us: int) -> None:
    grbl.settings(s132=10, s85=3)
    assert grbl.outputs().servo_us == 2000
    grbl.fine(f"G0Z{z_mm}", "G4P0")
    assert grbl.outputs().servo_us == pytest.approx(pulse_us, abs=1)


def test_a_servo_moves_with_the_axis_and_not_at_once(grbl: Grbl) -> None:
    grbl.settings(s132=10, s85=3)
    grbl.put("G1Z-10F600\n")
    seen = []
    for _ in range(20):
        grbl.after(0.05)
        seen.append(grbl.outputs().servo_us)
    assert seen == sorted(seen, reverse=True) and len(set(seen)) > 15


def test_the_ends_of_a_servo_are_tuned(grbl: Grbl) -> None:
    grbl.settings(s132=10, s85=3, s86=2300, s87=800)
    assert grbl.outputs().servo_us == 800
    grbl.fine("G0Z-10", "G4P0")
    assert grbl.outputs().servo_us == 2300
    grbl.settings(s85=0)
    assert grbl.outputs().servo_us == 0
