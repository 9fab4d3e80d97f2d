"""The real image with a spindle drive on its bus: frames, DE to the bit, a job, and a cable that is cut."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from chip_grbl import ChipGrbl
from drives import Drive, crc16, make_drive
from wificnc.board.model import Board
from wificnc.build.image import Block
from wificnc_chips.pic32mz import pin_number

SLICE_S = 0.0005
FULL_RPM = 24000


class ChipBus:
    """Hands requests to the drive when their last bit has left, and its answers back when they begin."""

    def __init__(self, grbl: ChipGrbl, drive: Drive) -> None:
        self.grbl, self.drive = grbl, drive
        self._data = b""
        self._answers: list[tuple[float, bytes]] = []
        grbl.chip.bus_driver(pin_number(grbl.board.pin_names()["bus_de"]))

    def after(self, seconds: float, data: str = "") -> str:
        end, said = self.grbl.time() + seconds, ""
        self.grbl.put(data)
        while self.grbl.time() < end:
            said += self.grbl.after(SLICE_S)
            self._exchange()
        return said

    def _exchange(self) -> None:
        now, chip = self.grbl.time(), self.grbl.chip
        self._data += chip.bus_read()
        if len(self._data) >= 4 and self._data[-2:] == crc16(self._data[:-2]):
            baud = round((10 if self.drive.parity == 0 else 11) / chip.bus_byte_s())
            assert baud == pytest.approx(self.drive.baud, rel=0.01)
            self._answers += self.drive.hear(now, self._data, self.drive.baud, self.drive.parity)
            self._data = b""
        for begin, answer in [row for row in self._answers if row[0] <= now]:
            chip.bus_write(answer)
            self._answers.remove((begin, answer))


@pytest.fixture(params=[2, 3, 6, 8])
def number(request: pytest.FixtureRequest) -> int:
    return int(request.param)


@pytest.fixture
def bus(board: Board, image: tuple[Block, ...], number: int) -> Iterator[ChipBus]:
    drive, settings = make_drive(number)
    grbl = ChipGrbl(board, image)
    grbl.after(0.02)
    made = ChipBus(grbl, drive)
    for line in (f"$30={FULL_RPM}", "$110=5000", "$120=500", *settings):
        assert "ok" in made.after(0.15, line + "\n")
    assert made.after(0.4) == ""
    yield made
    grbl.close()


def test_a_job_and_a_cable_that_is_cut(bus: ChipBus) -> None:
    drive, grbl = bus.drive, bus.grbl
    assert drive.direction == 0 and drive.commands()
    assert bus.after(0.3, "M3S12000\nG91G1X50F1200\n").count("ok") == 2
    assert drive.direction == 1
    assert drive.motor.rpm(grbl.time()) == pytest.approx(12000, rel=0.001, abs=8)
    assert grbl.stands()[0] != 0
    drive.silent = True
    said = bus.after(0.6)
    assert "no answer" in said and "ALARM:53" in said
    position = grbl.stands()
    drive.silent = False
    bus.after(1.2)
    assert drive.direction == 0 and grbl.stands() == position
