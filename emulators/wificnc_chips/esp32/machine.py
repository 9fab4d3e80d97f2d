"""An ESP32's image in the virtual chip, with its board's motors and inputs: wired.py requires of a chip."""

from __future__ import annotations

import struct
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from heapq import heappop, heappush
from pathlib import Path

from wificnc.board.model import Board, Role, Use
from wificnc.board.wire import InputWire
from wificnc.errors import UserError

from wificnc_chips.esp32.chip import CPU_HZ, SHIFT_FIRST, Chip, Stop, VirtualChip
from wificnc_chips.esp32.image import EspImage
from wificnc_chips.fault import ChipFault

CHIPS = {"esp32": Chip.ESP32, "esp32s3": Chip.ESP32S3}
STEP = struct.Struct("<QBB6x")  # as mz_step
SAME_EVENT = 100  # cycles in which edges belong to one step event: both halves of the pins
FAILED = 0xFFFFFFFF  # ESP_FAIL
RADIO = "esp_wifi_init"
SHIFT_PIN = "I2SO."
SWITCHES = (Role.LIMIT, Role.PROBE, Role.ESTOP, Role.MISC_IN)


class EspMachine:
    """Time is the chip's; nothing happens but in run() and run_until()."""

    cpu_hz = CPU_HZ

    def __init__(self, board: Board, image: EspImage) -> None:
        self._image = image
        self._chip = VirtualChip(CHIPS[board.chip])
        self._at: list[tuple[int, int, int]] = []  # cycle, pin, level: what is done to pins later
        self._records = False
        self._edges: list[tuple[int, int, int]] = []
        self._motors = _Motors(board)
        self._rest = [(gpio(use.pin), int(_is_low(use))) for use in board.uses() if _is_switch(use)]
        try:
            self._wire(board)
            self._load()
            self._chip.record_edges()
        except BaseException:
            self.close()
            raise

    def __enter__(self) -> EspMachine:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        self._chip.__exit__()

    def _wire(self, board: Board) -> None:
        """What is outside of the chip, but for its motors and switches."""
        if board.i2so is not None:
            clock, data, latch = (gpio(wire.pin) for wire in (board.i2so.bck, board.i2so.data, board.i2so.ws))
            self._chip.wire_shift_registers(clock, data, latch)
        if board.ethernet is not None:  # ESP-IDF's number of a host is one less; its first device has select line 0
            self._chip.wire_w5500(board.spi_host_number + 1, 0)

    def _load(self) -> None:
        image = self._image
        with self._named():
            if image.has_bootloader:
                self._chip.load(image.flash)
            else:
                self._chip.create_flash(image.flash_size)
                self._chip.write_flash(0, image.flash)
        self._answer_radio()
        self.power_on()

    def _answer_radio(self) -> None:
        """There is none: its library is not started, and the firmware hears so."""
        address = self._image.wifi_init
        if self._image.elf is not None:
            self._chip.load_symbols(self._image.elf)
            with suppress(KeyError):  # a board without WiFi
                address = self._chip.symbol(RADIO)
        if address:
            self._chip.answer(address, FAILED)

    @contextmanager
    def _named(self) -> Iterator[None]:
        """A fault says of which file, and what to do."""
        try:
            yield
        except ChipFault as err:
            raise ChipFault(f"{self._image.path}: {err.message}", hint=self._advice(err.message)) from err

    def _advice(self, fault: str) -> str | None:
        if "damaged" in fault or "this image is for" in fault or "signed" in fault or "encrypted" in fault:
            return "`wificnc build` makes one that the virtual chip runs"
        if self._image.elf is None and self._image.wifi_init is None:
            return "its ELF file is not next to it, so that the radio cannot be answered: docs/espsim.md"
        return None

    # ---- power and time ----

    def power_on(self) -> None:
        """From the flash chip as it is now. Raises ChipFault."""
        with self._named():
            self._chip.boot()
        for pin, level in self._rest:
            self._chip.drive(pin, level)

    @property
    def cycles(self) -> int:
        return self._chip.cycles

    @property
    def resets(self) -> tuple[int, str]:
        """Those of its own, and what caused the last one."""
        return self._chip.resets

    def run_until(self, cycle: int) -> Stop:
        """Let it work. Raises ChipFault."""
        with self._named():
            while self._at and self._at[0][0] <= cycle:
                at, pin, level = heappop(self._at)
                self._chip.run_until(max(at, self._chip.cycles))
                self._chip.drive(pin, level)
            stop = self._chip.run_until(cycle)
        edges = self._chip.edges()
        self._motors.take(edges)
        if self._records:
            self._edges += edges
        return stop

    def run(self, seconds: float) -> Stop:
        """Raises ChipFault."""
        return self.run_until(self.cycles + round(seconds * CPU_HZ))

    # ---- serial port ----

    def write(self, data: bytes) -> None:
        self._chip.write_serial(data)

    def read(self) -> bytes:
        return self._chip.read_serial()

    # ---- pins ----

    def record_edges(self, on: bool) -> None:
        self._records = on
        self._edges = []

    def edges(self) -> list[tuple[int, int, int]]:
        edges, self._edges = self._edges, []
        return edges

    def level(self, pin: int) -> int:
        if pin >= SHIFT_FIRST:
            return self._chip.shift_outputs() >> (pin - SHIFT_FIRST) & 1
        return self._chip.level(pin)

    def drive(self, pin: int, level: int | None) -> None:
        """From outside; None: no one does."""
        self._chip.drive(pin, -1 if level is None else level)

    def drive_at(self, cycle: int, pin: int, level: int | None) -> None:
        heappush(self._at, (cycle, pin, -1 if level is None else level))

    def steps(self) -> bytes:
        """Records of step events since the last call: cycle, motors, directions."""
        return self._motors.records(self.cycles)

    def position(self, motor: int) -> int:
        """Where it really is, steps."""
        return self._motors.position[motor]

    # ---- Ethernet ----

    def set_link(self, up: bool) -> None:
        """The cable is in, or out."""
        self._chip.set_link(up)

    def put_frame(self, frame: bytes) -> bool:
        """@return whether the W5500 has taken it"""
        return self._chip.put_frame(frame)

    def take_frames(self) -> list[bytes]:
        """What it has sent since the last call."""
        return list(iter(self._chip.take_frame, b""))

    # ---- flash ----

    def settings(self) -> bytes:
        """The partition with the settings."""
        offset, size = self._image.nvs
        return self._chip.flash()[offset : offset + size]

    def set_settings(self, data: bytes, path: Path) -> None:
        """As kept from an earlier run; the next power_on() sees them. Raises UserError."""
        offset, size = self._image.nvs
        if len(data) != size:
            raise UserError(
                f"{path} has {len(data)} bytes, not the {size} of the settings' partition",
                hint="name another file: this one is of another board",
            )
        self._chip.write_flash(offset, data)

    @property
    def flash_operations(self) -> int:
        return self._chip.flash_operations

    def cut_power(self, nth: int, torn: int) -> None:
        """At the n-th write or erase from now: run() returns Stop.DARK. @param torn  0: before, 1: amid, 2: after it"""
        self._chip.cut_power(nth, torn)


class _Motors:
    """Steps out of edges: a motor steps at the rising edge, the way that its direction says then."""

    def __init__(self, board: Board) -> None:
        motors = list(board.axis.motors().values())
        self.position = [0] * len(motors)
        self._step = {gpio(motor.step.pin): number for number, motor in enumerate(motors)}
        self._dir = {gpio(motor.dir.pin): number for number, motor in enumerate(motors)}
        # shift registers come up with all outputs high (es_shift_registers()), and changes alone are edges
        self._directions = sum(1 << motor for pin, motor in self._dir.items() if pin >= SHIFT_FIRST)
        self._events: list[list[int]] = []  # cycle, motors, directions

    def take(self, edges: list[tuple[int, int, int]]) -> None:
        for cycle, pin, level in edges:
            motor = self._dir.get(pin)
            if motor is not None:
                self._directions = self._directions & ~(1 << motor) | level << motor
                continue
            motor = self._step.get(pin)
            if level and motor is not None:
                self._step_at(cycle, motor)

    def _step_at(self, cycle: int, motor: int) -> None:
        bit = 1 << motor
        back = self._directions & bit
        self.position[motor] += -1 if back else 1
        last = self._events[-1] if self._events else None
        if last is not None and cycle - last[0] <= SAME_EVENT and not last[1] & bit:
            last[1] |= bit
            last[2] |= back
        else:
            self._events.append([cycle, bit, back])

    def records(self, now: int) -> bytes:
        """Events that are complete."""
        events = self._events
        pending = 1 if events and now - events[-1][0] <= SAME_EVENT else 0
        done = events[: len(events) - pending]
        self._events = events[len(done) :]
        return b"".join(STEP.pack(*event) for event in done)


def gpio(name: str) -> int:
    """'GPIO25' is 25; outputs of shift registers follow the chip's pins: 'I2SO.1' is SHIFT_FIRST + 1."""
    if name.startswith(SHIFT_PIN):
        return SHIFT_FIRST + int(name.removeprefix(SHIFT_PIN))
    return int(name.removeprefix("GPIO"))


def _is_switch(use: Use) -> bool:
    return use.role in SWITCHES


def _is_low(use: Use) -> bool:
    """Low is what switches it on."""
    return isinstance(use.wire, InputWire) and use.wire.active == "low"
