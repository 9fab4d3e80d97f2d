"""Bytes too fast for the receive interrupt: the sender gets an error, and no half line is executed."""

from __future__ import annotations

import re

import numpy as np
import pytest
from chip_controller import Controller
from wificnc_chips.pic32mz import CPU_HZ

LOST = re.compile(r"\[MSG:Bytes lost on the serial port: (\d+) times?\]\r\nerror:11\r\n")
TOO_FAST = 2000  # times the baud rate: nine bytes come within an interrupt


def test_a_line_that_lost_bytes_is_refused(controller: Controller) -> None:
    """A coordinate of which digits are missing is no coordinate."""
    controller.fine("G91", "G21")
    controller.chip.serial_speed(TOO_FAST)
    controller.chip.write(b"G0X10.000000000000000000000000000001\n")
    controller.run(0.001)
    controller.chip.serial_speed(1)
    controller.chip.write(b"\n")
    said = controller.run(0.5)
    assert LOST.search(said), said
    assert controller.stands() == [0, 0, 0, 0] and controller.state() == "Idle"
    assert "[MSG:Bytes lost on the serial port: " in controller.send("$I")
    controller.fine("G0X1")
    controller.rest()
    assert controller.stands() == [250, 0, 0, 0]


def test_lines_before_and_after_a_loss_are_executed_whole(controller: Controller) -> None:
    """Every line that moves is one that was sent; the refused ones are answered."""
    controller.fine("G91", "G21")
    job = "".join(f"G1X{n}.2Y{n}F5000\n" for n in range(1, 4))
    controller.chip.write(job.encode())
    controller.run(0.01)
    controller.chip.serial_speed(TOO_FAST)
    controller.chip.write(b"G1X100Y100F5000\n" * 20)
    controller.run(0.01)
    controller.chip.serial_speed(1)
    controller.chip.write(b"\n")
    controller.rest()
    x, y = controller.stands()[:2]
    refused = controller.heard.count("error:11")
    whole = controller.heard.count("ok\r\n")
    assert refused > 0 and LOST.search(controller.heard)
    assert (x - 250 * 6.6, y - 250 * 6) == (25_000 * round((y - 1500) / 25_000),) * 2, (x, y, refused, whole)


@pytest.mark.slow
def test_nothing_is_lost_at_the_ports_own_speed(controller: Controller) -> None:
    """Four axes at full rate, reports and lines at 115200 baud without a pause."""
    for axis in range(4):
        controller.fine(f"$11{axis}=4500", f"$10{axis}=4000", f"$12{axis}=8000")
    controller.fine("G91G1X400Y399Z398A397F20000")
    controller.run(1.0)
    controller.chip.write(b"?\n" * 5000)
    controller.run(1.2)
    assert "error" not in controller.heard and "lost bytes" not in controller.heard


def test_a_thousand_lines_too_many_do_not_slow_the_motion_down(controller: Controller) -> None:
    """Their answers are longer than the transmit buffer: they wait for room, and nothing else waits for them."""
    controller.fine("G91G1X60F2400")
    controller.run(0.3)
    controller.steps()
    controller.chip.write(b"\n" * 1000 + b"G1X0.001\n" * 600 + b"\n" * 6000)
    controller.run(1.0)
    gaps = [int(gap) for gap in np.diff(controller.steps()["cycle"].astype(np.int64))]
    assert max(gaps) - min(gaps) <= 0.4e-6 * CPU_HZ
    controller.run(2.0)
    assert controller.heard.count("[MSG:Receive buffer overflow]") >= 1
    assert "slowed down" not in controller.heard
