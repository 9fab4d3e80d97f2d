"""The real image of an ESP32 in the virtual chip, with the methods of grbl_host.Grbl.

Where: WIFICNC_ESP_IMAGE is what `--on-chip` takes, WIFICNC_ESP_BOARD its board. Images are made with ESP-IDF, so
these tests run where someone has one. As chip_grbl.py, but:

- Axes A, B and C must be at 0 and are left out of what was answered.
- The wire has 115200 baud.
- The PWM is what its pin shows.

What a row needs of a board and this one lacks is in the row's own marks: needs.py.
"""

from __future__ import annotations

import os
import re
from itertools import pairwise
from pathlib import Path
from types import SimpleNamespace

from chip_grbl import NUMBERS, RPM_MAX, RX_SIZE, START_ID, ChipGrbl, NotOnThisBoard
from wificnc.board import paths
from wificnc.board.load import load_board
from wificnc_chips.esp32 import EspMachine, Stop, gpio, load_image

IMAGE = os.environ.get("WIFICNC_ESP_IMAGE", "")
BOARD = os.environ.get("WIFICNC_ESP_BOARD", "esp32-wroom32")
BYTE_S = 10 / 115200
LOOK_S = 5e-5  # between two looks at where the motors are
PWM_HZ = 5000  # $33
PWM_LOOK_S = 0.0025  # some periods, and a round of the task that sets its duty
CW, FLOOD, MIST = 1, 2, 1  # struct virtual_outputs
OTHERS = re.compile(rf"((?:[MW]Pos|WCO|\[G\d\d(?:\.\d)?|\[PRB):{NUMBERS})((?:,-?[\d.]+)+)")
OTHER_SETTINGS = re.compile(r"\$1[0-3][345]=[\d.]+\r\n")


def number_in(source: str, pattern: str) -> int:
    """A number of the firmware's own."""
    found = re.search(pattern, (paths.TARGETS / "esp32" / source).read_text(encoding="utf-8"))
    assert found, f"{source}: {pattern}"
    return int(found[1])


class SwitchedEsp(EspMachine):
    """With switches at places of the axes."""

    travels: dict[int, tuple[int, int]]
    stuck: set[int]  # axes whose switch is always on
    touches: tuple[int, int] | None  # the probe's pin, and Z where it touches
    free_at = 0  # when the wire has carried all that was written

    def write(self, data: bytes) -> None:
        super().write(data)
        self.free_at = max(self.free_at, self.cycles) + round(len(data) * BYTE_S * self.cpu_hz)

    @property
    def unread(self) -> int:
        return max(0, self.free_at - self.cycles)

    def serial_speed(self, factor: int) -> None:
        """It has one."""

    def run_until(self, cycle: int) -> Stop:
        stop, slice_cycles = Stop.TIME, round(LOOK_S * self.cpu_hz)
        while stop == Stop.TIME and (self.travels or self.touches) and self.cycles < cycle - slice_cycles:
            stop = super().run_until(self.cycles + slice_cycles)
            self._look()
        return super().run_until(cycle)

    def _look(self) -> None:
        for pin, axis in self.limits.items():
            if axis in self.travels:
                low, high = self.travels[axis]
                self.drive(pin, int(low < self.position(axis) < high and axis not in self.stuck))
        if self.touches:
            self.drive(self.touches[0], int(self.position(2) > self.touches[1]))


class EspGrbl(ChipGrbl):
    """A controller fresh from its power-on, with the settings that the first one was given by keep()."""

    receive_room = RX_SIZE + number_in("link/serial_stream.h", r"SERIAL_UART_RX_SIZE = (\d+)")  # the driver's, too
    rpm_step = RPM_MAX * PWM_HZ / number_in("hal/spindle_pwm.h", r"SPINDLE_PWM_CLOCK_HZ (\d+)u")
    look_s = 0.0025  # a receiver's pause, a task's ms, the other core's
    report_s = 1e-6 * number_in("app/controller.c", r"ASK_EVERY_US +(\d+)u?") + 0.005  # ? is answered this often
    kept = b""  # the flash chip's partition

    def __init__(self) -> None:
        board = load_board(BOARD)
        self.board = board
        self._motors = range(len(board.axes))
        self._pins = board.pin_names()
        self._wires = {use.signal: use.wire for use in board.uses()}
        self._active_high = set()
        self._typed = {"30": 1000.0, **{f"10{axis}": 250.0 for axis in range(3)}}
        self._waited = 0
        self._recorded = []
        self._travel = {}
        chip = SwitchedEsp.__new__(SwitchedEsp)
        chip.travels, chip.stuck, chip.touches = {}, set(), None
        chip.limits = {gpio(self._pins[f"limit_{axis}"]): "xyz".index(axis) for axis in "xyz"}
        chip.__init__(board, load_image(Path(IMAGE), board))
        self.chip = chip
        if EspGrbl.kept:
            chip.set_settings(EspGrbl.kept, Path(IMAGE))
            chip.power_on()

    def keep(self, **values: float) -> None:
        """Settings, for later controllers, too: writing them takes longer than most tests."""
        if not EspGrbl.kept:
            self.settings(**values)
            EspGrbl.kept = self.chip.settings()

    def status(self) -> str:
        said, end = self.after(0, "?"), self.chip.cycles + round(self.report_s * self.chip.cpu_hz)
        while ">" not in said and self.chip.cycles < end:
            said += self.heard()
        return said

    def travel(self, axis: int, low: int, high: int) -> None:
        self.chip.travels[axis] = (low, high)

    def surface(self, steps: int) -> None:
        self.chip.touches = (self._pin("probe"), steps)

    def toolsetter(self, x: int, y: int, z: int, radius: int = 1250) -> None:
        raise NotOnThisBoard("toolsetter")

    def place(self, steps) -> None:
        for axis, position in enumerate(steps[:3]):
            self.chip._motors.position[axis] = position

    def stands(self) -> list[int]:
        places = self._raw_stands()
        assert not any(places[3:])
        return [*places, 0, 0, 0][:6]

    def outputs(self) -> SimpleNamespace:
        """What the pins show; fields of struct virtual_outputs."""
        duty = self._duty("spindle_pwm")
        direction = CW if self._is_on("spindle_enable") else 0
        return SimpleNamespace(
            spindle_direction=-direction if self._is_on("spindle_dir") else direction,
            spindle_rpm=self._typed["30"] * duty * direction,
            spindle_duty=round(duty * 65535),
            coolant=FLOOD * self._is_on("coolant_flood") + MIST * self._is_on("coolant_mist"),
            motors=self._is_on("enable"),
            enable_high=bool(self.chip.level(self._pin("enable"))),
        )

    def _is_on(self, signal: str) -> bool:
        """An output that the board lacks is off."""
        if signal not in self._pins:
            return False
        return self.chip.level(self._pin(signal)) == (self._wires[signal].active == "high")

    def _duty(self, signal: str) -> float:
        """Of whole periods."""
        pin = self._pin(signal)
        self.chip.record_edges(True)
        self.chip.run(PWM_LOOK_S)
        edges = [(cycle, level) for cycle, at, level in self.chip.edges() if at == pin]
        self.chip.record_edges(False)
        rises = [cycle for cycle, level in edges if level]
        if len(rises) < 2:
            return float(self.chip.level(pin))
        high = sum(end - begin for (begin, level), (end, _) in pairwise(edges) if level and begin < rises[-1])
        return high / (rises[-1] - rises[0])

    def input(self, name: str, active: bool) -> None:
        if (found := re.fullmatch(r"limit-max-([xyz])", name)) and "xyz".index(found[1]) in self.chip.travels:
            axis = "xyz".index(found[1])
            (self.chip.stuck.add if active else self.chip.stuck.discard)(axis)
        else:
            pin, level = self._line(name, active)
            self.chip.drive(pin, level)
        self.chip.run(0.02)

    def _pin(self, signal: str) -> int:
        if signal not in self._pins:
            raise NotOnThisBoard(signal)
        return gpio(self._pins[signal])

    def _line(self, name: str, active: bool) -> tuple[int, int]:
        found = re.fullmatch(r"limit(?:-(min|max))?-(\w)", name)
        signal = f"limit_{found[2]}" if found else name
        pin = self._pin(signal)
        return pin, int(active == (self._wires[signal].active == "high"))

    def _plain(self, said: str) -> str:
        for others in OTHERS.finditer(said):
            assert not any(map(float, others[2].split(",")[1:])), said
        return OTHER_SETTINGS.sub("", OTHERS.sub(r"\1", START_ID.sub("", said)))
