"""The store writes while the program runs: steps, e-stop, reset and answers are as if it did not."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from chip_controller import BANNER, Controller
from slow import deep_but
from store_pages import full_page, prepared
from test_pic32mz_motion import JITTER_NS, SETTINGS, chip_trace, host_trace
from wificnc.board.model import Board
from wificnc.build.image import Block
from wificnc_chips.pic32mz import CPU_HZ

__all__ = ["full_page"]

# Each kind of line that is stored, between moves that blend when nothing comes between.
STORING = (
    "G91",
    "G1X20F2000",
    "G10L2P2X9",
    "G1X10Y5",
    "G10L20P3X1Y2",
    "G1Y10",
    "G28.1",
    "G1X-10Z2",
    "G30.1",
    "G10L1P4Z1.5",
    "G1X-5Y-5",
    "G10L2P9X1",
    "G1Z-2",
)
OFF_S = 0.0005  # from e-stop or Ctrl-X to the last high of the spindle's output: a turn of the loop, a PWM period


@pytest.fixture
def full(board: Board, image: tuple[Block, ...], full_page: bytes):  # type: ignore[no-untyped-def]
    """The next value that is stored goes to the other page."""
    with prepared(board, image, full_page) as controller:
        yield controller


def operations_of(controller: Controller, line: str) -> int:
    before = controller.chip.flash_operations
    controller.fine(line)
    return controller.chip.flash_operations - before


@pytest.mark.slow
@pytest.mark.parametrize("reports", deep_but((4000).__eq__, [0, 4000]))
@pytest.mark.parametrize("times", deep_but((3).__eq__, [3, 6]))
def test_steps_are_in_time_while_lines_are_stored(full: Controller, tmp_path: Path, times: int, reports: int) -> None:
    """Every step of the plan, each within 1 us of it, with page changes between and the serial port at full rate."""
    full.fine(*SETTINGS, "$100=250", "$101=250")
    job = "\n".join(STORING * times)
    host = host_trace(tmp_path, job)
    before = full.chip.flash_operations
    full.chip.write(b"?" * reports)
    chip = chip_trace(full, job)
    assert full.chip.flash_operations - before > 80 * times
    assert len(chip) == len(host) > 1600 * times
    np.testing.assert_array_equal(chip[:, 1], host[:, 1])
    np.testing.assert_array_equal(chip[:, 2] & chip[:, 1], host[:, 2] & host[:, 1])
    rests = np.flatnonzero((np.diff(host[:, 0]) > 5_000_000) | (np.diff(chip[:, 0]) > 5_000_000))
    assert len(rests) == times * 5  # at what is stored, and no stop within a move
    for part in np.split(np.arange(len(host)), rests + 1):
        late = (chip[part, 0] - chip[part[0], 0]) - (host[part, 0] - host[part[0], 0])
        assert np.abs(np.diff(late)).max(initial=0) <= 2 * JITTER_NS


def begin_page_change(controller: Controller) -> None:
    """Spindle on, and the erase of the other page under way."""
    controller.fine("$30=1000", "M3S1000")
    for value in range(1000, 1100):
        before = controller.chip.flash_operations
        controller.chip.write(f"$102={value}\n".encode())
        for _ in range(20):
            controller.run(0.0005)
            if controller.chip.flash_operations != before:
                break
        controller.run(0.002)
        if controller.chip.flash_operations == before + 1:
            return  # words are written one after the other; only an erase takes 2 ms
        controller.run(0.1)
    raise AssertionError("no page change")


@pytest.mark.parametrize("stop", ["estop", "reset"])
def test_spindle_is_off_in_time_while_a_page_is_erased(full: Controller, stop: str) -> None:
    begin_page_change(full)
    spindle = full.pin("spindle_pwm")
    assert full.chip.level(spindle) == 1
    full.chip.record_edges(True)
    operations, begin = full.chip.flash_operations, full.chip.cycles
    if stop == "estop":
        full.at(0.0, "estop", 1)
    else:
        full.chip.write(b"\x18")
        begin += round(10 / 115200 * CPU_HZ)
    full.run(0.005)
    assert full.chip.flash_operations == operations, "the erase is over already"
    changes = [(cycle, level) for cycle, pin, level in full.chip.edges() if pin == spindle]
    assert changes and changes[-1][1] == 0
    assert changes[-1][0] - begin <= OFF_S * CPU_HZ


def test_the_line_is_answered_when_it_is_stored(full: Controller) -> None:
    """Also when a reset comes between: the banner follows the answer."""
    begin_page_change(full)
    full.heard = ""
    said = full.realtime("\x18", 0.004)
    assert "ok" not in said and BANNER not in said
    said += full.run(0.2)
    assert said == "ok\r\n" + BANNER
    stored = full.send("$$").split("$102=")[1].split("\r")[0]
    full.chip.power_on()
    full.boot()
    assert f"$102={stored}\r\n" in full.send("$$")


def test_status_is_reported_while_a_page_is_erased(full: Controller) -> None:
    begin_page_change(full)
    assert "<Idle|" in full.realtime("?", 0.008)


def test_a_line_behind_one_that_is_stored_waits_for_it(full: Controller) -> None:
    begin_page_change(full)
    full.chip.write(b"$102=55\n$102=56\n")
    assert full.run(1.0).count("ok\r\n") == 3
    full.chip.power_on()
    full.boot()
    assert "$102=56.000\r\n" in full.send("$$")
