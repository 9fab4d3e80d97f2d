"""A controller in virtual time with motor drivers that have registers."""

from __future__ import annotations

import ctypes
import re
from collections.abc import Sequence
from typing import Any

from c_library import LIB
from grbl_host import HZ, Grbl
from wificnc.simulator.library import HostBoard, Tasks

TMC2209, TMC5160, TMC2130 = 1, 2, 3
SECOND = 6  # motor of an axis, the second one: this more
KINDS = (TMC2209, TMC5160, TMC2130)
NO_SUPPLY, UNWIRED, DEAF, NOISE, HOT, SHUT_DOWN, SHORT, OPEN, UNDERVOLTAGE, CROSSED, CUT, PARTLY, GLITCH = (
    1 << n for n in range(13)
)
STEPS_MM = 250.0  # $100 after a first start
ROW = re.compile(r"\[DRIVER:([^\]]*)\]")
GCONF, GSTAT, GLOBALSCALER, IHOLD_IRUN, TPWMTHRS, TCOOLTHRS = 0x00, 0x01, 0x0B, 0x10, 0x13, 0x14
SGTHRS, COOLCONF_2209, CHOPCONF, COOLCONF = 0x40, 0x42, 0x6C, 0x6D


class DriverGrbl(Grbl):
    """With a driver for each axis: TMC2209 on one wire, others in one chain, or each with its own select."""

    def __init__(
        self,
        kind: int,
        axes: int = 3,
        *,
        chained: bool = True,
        diag: bool = True,
        tasks: Tasks = Tasks.FREE,
        seconds: Sequence[int] = (),
        second_mohm: int = 0,
    ) -> None:
        """@param seconds  axes with a second motor, which has a driver, too"""
        board = HostBoard(HZ, 1000, 500, 500_000, axes, tasks=tasks)
        board.ganged = sum(1 << ax for ax in seconds)
        motors = [*range(axes), *(ax + SECOND for ax in seconds)]
        for place, motor in enumerate(motors):
            address, select, chain = (place, 0, len(motors)) if chained or kind == TMC2209 else (0, place, 1)
            mohm = second_mohm if motor >= SECOND else 0
            board.driver[motor] = kind | address << 4 | select << 8 | chain << 12 | diag << 16 | mohm << 17
        super().__init__(board=board)

    def status(self) -> str:
        """The answer to ?; a task of a chip takes its time."""
        return self.after(0.05, "?")

    def set_up(self, *more: str) -> None:
        """A current for all of them, and fast axes."""
        self.after(0.5)
        for line in (*(f"${base + ax}={value}" for base, value in SETUP for ax in range(3)), *more):
            said = self.after(0.05, line + "\n")
            assert said == "ok\r\n", (line, said)
        assert self.after(0.5) == ""
        assert all(row[3] in ("ok", "left alone") for row in self.rows())

    def faults(self, motor: int, faults: int) -> None:
        assert LIB.host_driver_set_faults(self._host, motor, faults)

    def reset_driver(self, motor: int) -> None:
        assert LIB.host_driver_reset(self._host, motor)

    def address(self, motor: int, address: int) -> None:
        assert LIB.host_driver_set_address(self._host, motor, address)

    def register(self, motor: int, number: int) -> int:
        return int(LIB.host_driver_register(self._host, motor, number))

    def datagrams(self) -> int:
        return int(LIB.host_driver_datagrams(self._host))

    def rows(self) -> list[list[str]]:
        """Rows of $DRIVERS."""
        said = self.after(0.02, "$DRIVERS\n")
        assert said.endswith("ok\r\n"), said
        return [row.split("|") for row in ROW.findall(said)]

    def until(self, text: str, limit_s: float, step_s: float = 0.002) -> tuple[str, float]:
        """Time passes until the controller prints this. @return all that it printed, and how long that took"""
        begin, said = self.time(), ""
        while text not in said:
            assert self.time() - begin < limit_s, said
            said += self.after(step_s)
        return said, self.time() - begin


SETUP = ((140, 800), (110, 5000), (120, 500), (130, 300))


def make(kind: int, *more: str, **how: Any) -> DriverGrbl:
    grbl = DriverGrbl(kind, **how)
    grbl.set_up(*more)
    return grbl


def signed7(value: int) -> int:
    return ctypes.c_int8(value << 1 & 0xFF).value >> 1
