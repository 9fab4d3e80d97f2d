"""Rows of docs/grbl-compatibility.md that no line of the checklist has."""

from __future__ import annotations

import pytest
from grbl_host import Grbl


@pytest.fixture
def six() -> Grbl:
    controller = Grbl(axes=6)
    controller.send("")
    return controller


def test_a_boards_own_pulse(grbl: Grbl) -> None:
    """The board's pulse is 1 us: `$0=1` is taken back, 2 is error:6."""
    assert grbl.send("$0=2\n") == "error:6\r\n"
    grbl.fine("$0=10", "$0=1")
    assert grbl.send("$$\n").startswith("$0=1\r\n")


def test_a_rate_above_the_boards(grbl: Grbl) -> None:
    """Pulses of 1 us leave 500 000 events/s, of which diagonals may need 500: at 250 steps/mm 119 880 mm/min."""
    assert grbl.send("$110=200000\n") == "[MSG:$110 is limited to 119880 mm/min by the step pulse: $0=1]\r\nok\r\n"
    assert "$110=200000.000\r\n" in grbl.send("$$\n")


def test_a_dwell_is_a_run(grbl: Grbl) -> None:
    grbl.after(0.2, "G4P1\n")
    assert grbl.state() == "Run"
    grbl.send("")
    assert grbl.state() == "Idle"


def test_degrees_have_no_inches(six: Grbl) -> None:
    six.fine("$13=1", "G0X25.4A25.4")
    assert "MPos:1.0000,0.0000,0.0000,25.400,0.000,0.000|" in six.status()


def test_six_axes(six: Grbl) -> None:
    """Reports, settings and lists have six values, with the unit conversions of each axis's own $10x."""
    six.fine("$103=10", "$105=0.5", "G0A3C4")
    assert six.position() == [0, 0, 0, 30, 0, 2]
    assert "MPos:0.000,0.000,0.000,3.000,0.000,4.000|" in six.status()
    said = six.send("$$\n$#\n")
    assert all(f"${base + axis}=" in said for base in (100, 110, 120, 130) for axis in range(6))
    assert "[G54:0.000,0.000,0.000,0.000,0.000,0.000]" in said
