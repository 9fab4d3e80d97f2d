"""A controller in virtual time with drives on its bus."""

from __future__ import annotations

import ctypes
import re
from typing import Any

from c_library import LIB
from drives import Drive
from grbl_host import HZ, Grbl
from layouts import HOST
from wificnc.simulator.library import HostBoard, Tasks

DEVICE = HOST.prototype("host_bus_attach")[1][1]
STATUS = re.compile(r"\|FS:(\d+),(\d+)(?:,(\d+))?(?:\|Amp:([\d.]+))?")
FULL_RPM = 24000


class BusGrbl(Grbl):
    """With these drives, of which only one should answer."""

    def __init__(self, *drives: Drive, tasks: Tasks = Tasks.FREE, **parts: Any) -> None:
        board = HostBoard(HZ, 1000, 500, 500_000, 3, tasks=tasks, spindle_bus=1, digital_outputs=5, **parts)
        self.drives = drives
        super().__init__(board=board)
        self._device = DEVICE(self._hear)
        LIB.host_bus_attach(self._host, self._device, None)

    def _hear(self, _ctx: Any, end: int, frame: Any, count: int, baud: int, parity: int) -> None:
        request = ctypes.string_at(frame, count)
        for drive in self.drives:
            for begin_s, answer in drive.hear(end / HZ, request, baud, parity):
                self.put_on_bus(begin_s, answer)

    def detach(self) -> None:
        """The drive of the virtual machine instead."""
        LIB.host_bus_attach(self._host, DEVICE(), None)

    def fine_soon(self, *lines: str) -> None:
        """As fine(), while the drive is polled, so that the controller never sleeps."""
        for line in lines:
            assert self.after(0.05, line + "\n") == "ok\r\n", line

    def put_on_bus(self, begin_s: float, data: bytes) -> None:
        """Bytes for the controller from this time on."""
        LIB.host_bus_answer(self._host, round(begin_s * HZ), data, len(data))

    def speeds(self) -> tuple[int, int | None, float | None]:
        """S put out, measured speed, current, as the status report has them."""
        found = STATUS.search(self.status())
        assert found
        return int(found[2]), found[3] and int(found[3]), found[4] and float(found[4])  # type: ignore[return-value]

    def until(self, text: str, limit_s: float, step_s: float = 0.005) -> tuple[str, float]:
        """Time passes until the controller prints this. @return all that it printed, and how long that took"""
        begin, said = self.time(), ""
        while text not in said:
            assert self.time() - begin < limit_s, said
            said += self.after(step_s)
        return said, self.time() - begin


def make_grbl(drive: Drive, *settings: str, **parts: Any) -> BusGrbl:
    """A controller that has found its drive."""
    grbl = BusGrbl(drive, **parts)
    grbl.after(0.01)
    fast = [f"${base + ax}={value}" for base, value in ((110, 5000), (120, 500)) for ax in range(3)]
    grbl.fine_soon(f"$30={FULL_RPM}", *fast, *settings)
    assert grbl.after(0.3) == ""
    return grbl
