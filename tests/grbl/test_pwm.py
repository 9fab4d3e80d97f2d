"""The spindle's PWM: $33 to $36, on the host and on the virtual PIC32MZ. Duty is a share of 65535."""

from __future__ import annotations

import pytest
from grbl_host import Grbl

FULL = 65535
COUNTS = 2 / 1000  # of the coarsest PWM: 50 kHz of 50 MHz


def share(grbl: Grbl) -> float:
    return grbl.outputs().spindle_duty / FULL


def test_defaults_use_the_whole_range(grbl: Grbl) -> None:
    assert share(grbl) == 0
    grbl.fine("M3S1000")
    assert share(grbl) == 1
    grbl.fine("S250")
    assert share(grbl) == pytest.approx(0.25, abs=1e-3)


@pytest.mark.parametrize(("off", "least", "full"), [(5, 20, 80), (30, 10, 60), (0, 5, 10), (100, 0, 100)])
def test_off_least_and_full_duty(grbl: Grbl, off: float, least: float, full: float) -> None:
    """$34 while off, $35 at $31, $36 at $30, linear between the two; S above and below stay inside."""
    grbl.fine("$30=1000", "$31=200", f"$34={off}", f"$36={full}", f"$35={least}")
    assert share(grbl) == pytest.approx(off / 100, abs=COUNTS)
    for s, part in ((200, 0), (600, 0.5), (1000, 1), (50, 0), (2000, 1)):
        grbl.fine(f"M3S{s}")
        assert share(grbl) == pytest.approx((least + part * (full - least)) / 100, abs=COUNTS), s
    for line in ("S0", "S500", "M5"):
        grbl.fine(line)
    assert share(grbl) == pytest.approx(off / 100, abs=COUNTS)


def test_a_reset_leaves_the_duty_of_off(grbl: Grbl) -> None:
    """And $RST=$ the one of power-on."""
    grbl.fine("$34=10", "M3S1000")
    grbl.send("\x18")
    assert share(grbl) == pytest.approx(0.1, abs=COUNTS)
    grbl.send("$RST=$\n")
    assert share(grbl) == 0


@pytest.mark.parametrize("hz", [50, 1000, 5000, 20_000, 50_000])
def test_duty_is_the_same_at_every_frequency(grbl: Grbl, hz: int) -> None:
    grbl.fine(f"$33={hz}", "$35=10")
    assert share(grbl) == 0
    for s, duty in ((1000, 1), (500, 0.55)):
        grbl.fine(f"M3S{s}")
        assert share(grbl) == pytest.approx(duty, abs=COUNTS)
    grbl.fine("M5")
    assert share(grbl) == 0


@pytest.mark.parametrize("line", ["$33=0", "$33=49", "$33=50001", "$34=100.1", "$35=99.5", "$36=0"])
def test_out_of_range(grbl: Grbl, line: str) -> None:
    before = grbl.send("$$\n")
    assert grbl.send(line + "\n") == "error:2\r\n"
    assert grbl.send("$$\n") == before


@pytest.mark.parametrize(
    ("first", "then", "error"),
    [
        ("$32=1", "$34=5", 161),
        ("$34=5", "$32=1", 161),
        ("$36=50", "$35=50", 160),
        ("$35=50", "$36=50", 160),
    ],
)
def test_what_cannot_be_together(grbl: Grbl, first: str, then: str, error: int) -> None:
    """In either order; nothing changes."""
    grbl.fine(first)
    before = grbl.send("$$\n"), share(grbl)
    assert grbl.send(then + "\n") == f"error:{error}\r\n"
    assert (grbl.send("$$\n"), share(grbl)) == before


@pytest.mark.parametrize("line", ["$33=1000", "$34=5", "$35=5", "$36=95"])
def test_only_while_the_spindle_is_off(grbl: Grbl, line: str) -> None:
    """A running spindle, a laser in force, and motion refuse it, and nothing changes."""
    before = grbl.send("$$\n")
    grbl.fine("M3S500")
    duty = share(grbl)
    assert grbl.send(line + "\n") == "error:162\r\n"
    assert (grbl.send("$$\n"), share(grbl)) == (before, duty)
    grbl.fine("M5")
    assert "error:8\r\n" in grbl.after(0.1, "G1X-5F600\n" + line + "\n")
    grbl.send("")
    assert grbl.send("$$\n") == before
    grbl.fine(line)
    assert grbl.send("$$\n") != before


def test_a_laser_uses_least_and_full_power(grbl: Grbl) -> None:
    """$35 and $36 with M3 in a cut; dark at rest, in a rapid and after a reset."""
    grbl.fine("$110=5000", "$32=1", "$33=1000", "$35=10", "$36=60", "M3S500F1200")
    assert share(grbl) == 0
    grbl.after(0.3, "G1X-20\n")
    assert share(grbl) == pytest.approx(0.35, abs=COUNTS)
    assert grbl.status().split("FS:")[1].split("|")[0].split(",")[1].startswith("500")
    grbl.send("")
    assert share(grbl) == 0
    grbl.after(0.1, "G0X-5\n")
    assert share(grbl) == 0
    grbl.send("")
    grbl.after(0.2, "G1X-25\n")
    assert share(grbl) > 0.3
    grbl.after(0.1, "\x18")
    assert share(grbl) == 0
