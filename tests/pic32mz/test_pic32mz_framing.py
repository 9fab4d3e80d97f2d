"""Bytes without their stop bit (noise, a break, another baud rate): none is accepted, the sender gets an error."""

from __future__ import annotations

import re

import pytest
from chip_controller import Controller

DAMAGED = re.compile(
    r"\[MSG:Framing errors on the serial port: (\d+)\. Check the baud rate and the cable\]\r\nerror:11\r\n"
)
REAL_TIME = [b"!", b"~", b"?", b"\x18", b"\x84", b"\x85", b"\x91", b"\x9e"]


def count(said: str) -> int:
    found = DAMAGED.search(said)
    assert found, said
    return int(found[1])


def test_a_line_with_a_damaged_byte_is_refused(controller: Controller) -> None:
    """Whatever the byte reads as: a digit, a line's end, nothing."""
    controller.fine("G91", "G21")
    for n, byte in enumerate([b"5", b"\n", b"\0", b" ", b";"]):
        controller.chip.write(b"G0X1")
        controller.chip.write_unframed(byte)
        assert count(controller.send("0")) == n + 1
    assert controller.stands() == [0, 0, 0, 0] and controller.state() == "Idle"
    assert "[MSG:Framing errors on the serial port: 5. " in controller.send("$I")
    controller.fine("G0X1")
    controller.rest()
    assert controller.stands() == [250, 0, 0, 0]


@pytest.mark.parametrize("byte", REAL_TIME)
def test_a_damaged_byte_is_no_real_time_command(controller: Controller, byte: bytes) -> None:
    controller.fine("G91", "G21", "G1X20F1000")
    controller.run(0.2)
    controller.heard = ""
    controller.chip.write_unframed(byte)
    controller.run(0.3)
    assert controller.heard == ""
    reports = [controller.status() for _ in range(12)]
    overrides = {report.split("Ov:")[1][:11] for report in reports if "Ov:" in report}
    assert all(report.startswith("<Run|") for report in reports) and overrides == {"100,100,100"}
    assert count(controller.send("")) == 1


def test_a_storm_is_one_refused_line(controller: Controller) -> None:
    """A cable that is pulled, a sender at another rate: thousands of bytes fill no buffer and hide no line."""
    controller.heard = ""
    controller.chip.write_unframed(bytes(range(256)) * 12)
    controller.run(1.0)
    assert controller.heard == ""
    assert count(controller.send("G0X1")) == 256 * 12
    assert controller.heard.count("error:") == 1
    controller.fine("G0X0")


def test_a_reset_ends_it(controller: Controller) -> None:
    """What came before it belongs to no line; what comes after it does."""
    controller.chip.write_unframed(b"\0\0")
    controller.chip.write(b"\x18")
    controller.run(0.1)
    controller.fine("G91")
    controller.chip.write_unframed(b"\0")
    controller.chip.write(b"\x18")
    controller.chip.write_unframed(b"\0")
    controller.run(0.1)
    assert count(controller.send("G0X1")) == 4
    controller.fine("G0X0")
