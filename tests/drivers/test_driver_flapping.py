"""A fault that comes and goes many times a second: said, but not so often that a sender can read nothing else."""

from __future__ import annotations

import pytest
from driver_grbl import HOT, TMC2209, TMC5160, UNDERVOLTAGE, UNWIRED, DriverGrbl, make

PERIOD_S, FOR_S = 0.01, 20.0
MOST = 1.0  # messages a second that a sender is given at most, whatever the fault does


def flap(grbl: DriverGrbl, fault: int) -> str:
    said = ""
    for _ in range(round(FOR_S / PERIOD_S)):
        grbl.faults(1, fault)
        said += grbl.after(PERIOD_S / 2)
        grbl.faults(1, 0)
        said += grbl.after(PERIOD_S / 2)
    return said


@pytest.mark.parametrize("kind", [TMC2209, TMC5160])
@pytest.mark.parametrize("fault", [HOT, UNDERVOLTAGE, UNWIRED])
@pytest.mark.parametrize("moves", [False, True])
def test_a_flapping_fault_does_not_flood_the_sender(kind: int, fault: int, moves: bool) -> None:
    grbl = make(kind, "$746=0")
    if moves:
        assert grbl.after(0.1, "G91\nG1X400F1200\n") == "ok\r\n" * 2
    said = flap(grbl, fault)
    assert said.count("[MSG:") <= MOST * FOR_S
    # What it is in the end is reported all the same, also if it changed between messages.
    grbl.after(6.0)
    assert grbl.rows()[1][3] == "ok"
    grbl.faults(1, fault)
    assert "[MSG:Driver Y: " in grbl.after(6.0)
    grbl.faults(1, 0)
    said = grbl.after(6.0)
    assert ("[MSG:Driver Y: it answers again]" in said) == (fault == UNWIRED)
    grbl.close()


def test_another_fault_is_said_while_one_flaps() -> None:
    grbl = make(TMC5160, "$746=0")
    flap(grbl, HOT)
    grbl.faults(2, UNDERVOLTAGE)
    assert "[MSG:Driver Z: undervoltage" in grbl.after(0.5)
    grbl.close()
