"""The virtual ESP32 seen from Python: espsim/espsim.h by ctypes, with types."""

from __future__ import annotations

import ctypes
from ctypes import POINTER, Structure, c_bool, c_char_p, c_int, c_size_t, c_uint, c_uint8, c_uint32, c_uint64, c_void_p
from ctypes import c_void_p as _CHIP
from enum import IntEnum
from functools import cache
from typing import Any

from wificnc.errors import BuildError

from wificnc_chips.fault import ChipFault
from wificnc_chips.library import ensure_chip_library

CPU_HZ = 240_000_000
SHIFT_FIRST = 64  # ES_SHIFT_FIRST
FRAME_MAX = 2048
ROOM = 1 << 16  # edges taken out of the library in one call


class Chip(IntEnum):
    """enum es_chip"""

    ESP32 = 0
    ESP32S3 = 1


class Stop(IntEnum):
    """enum es_stop"""

    TIME = 0
    FAULT = 1
    PLACE = 2
    DARK = 3


class Cpu(Structure):
    """struct es_cpu"""

    _fields_ = (
        ("a", c_uint32 * 16),
        ("f", c_uint32 * 16),
        *((name, c_uint32) for name in ("pc", "ps", "sar", "br", "acclo", "acchi", "scompare1")),
        *((name, c_uint32) for name in ("lbeg", "lend", "lcount", "windowbase", "windowstart")),
        *((name, c_uint32) for name in ("epc1", "exccause", "excvaddr", "vecbase", "cpenable", "intenable")),
        ("interrupt", c_uint32),
    )


class Edge(Structure):
    """struct es_edge"""

    _fields_ = (("cycle", c_uint64), ("pin", c_uint8), ("level", c_uint8))


class Core(Structure):
    """struct es_core"""

    _fields_ = tuple((name, c_uint64) for name in ("cycles", "idle", "instructions", "misses", "missing"))


class Level(Structure):
    """struct es_level, cycles"""

    _fields_ = tuple((name, c_uint64) for name in ("count", "cycles", "most"))


PROTOTYPES: dict[str, tuple[Any, tuple[Any, ...]]] = {
    "es_create": (_CHIP, (c_int,)),
    "es_destroy": (None, (_CHIP,)),
    "es_load": (c_bool, (_CHIP, c_char_p, c_size_t)),
    "es_timing": (None, (_CHIP, c_bool)),
    "es_flash_configure": (c_bool, (_CHIP, c_uint, c_uint32)),
    "es_run": (c_int, (_CHIP, c_uint64)),
    "es_stop_at": (None, (_CHIP, c_uint32)),
    "es_cycles": (c_uint64, (_CHIP,)),
    "es_instructions": (c_uint64, (_CHIP,)),
    "es_fault": (c_char_p, (_CHIP,)),
    "es_notes": (c_char_p, (_CHIP,)),
    "es_resets": (c_uint, (_CHIP, POINTER(c_char_p))),
    "es_symbol": (c_uint32, (_CHIP, c_char_p)),
    "es_symbols": (c_bool, (_CHIP, c_char_p, c_size_t)),
    "es_answer": (c_bool, (_CHIP, c_uint32, c_uint32)),
    "es_write": (c_bool, (_CHIP, c_uint32, c_char_p, c_size_t)),
    "es_read": (c_bool, (_CHIP, c_uint32, c_char_p, c_size_t)),
    "es_cpu_get": (None, (_CHIP, c_uint, POINTER(Cpu))),
    "es_cpu_set": (None, (_CHIP, POINTER(Cpu))),
    "es_physical": (c_uint32, (_CHIP, c_uint)),
    "es_pin_drive": (None, (_CHIP, c_uint, c_int)),
    "es_pin_level": (c_int, (_CHIP, c_uint)),
    "es_record_edges": (None, (_CHIP, c_bool)),
    "es_shift_registers": (None, (_CHIP, c_uint, c_uint, c_uint)),
    "es_shift_outputs": (c_uint32, (_CHIP,)),
    "es_w5500": (c_bool, (_CHIP, c_uint, c_uint)),
    "es_w5500_link": (None, (_CHIP, c_bool)),
    "es_w5500_put": (c_bool, (_CHIP, c_char_p, c_size_t)),
    "es_w5500_get": (c_size_t, (_CHIP, c_char_p, c_size_t)),
    "es_edges": (c_size_t, (_CHIP, POINTER(Edge), c_size_t)),
    "es_uart_put": (None, (_CHIP, c_uint, c_char_p, c_size_t)),
    "es_uart_get": (c_size_t, (_CHIP, c_uint, c_char_p, c_size_t)),
    "es_usb_plug": (c_bool, (_CHIP, c_bool)),
    "es_usb_put": (None, (_CHIP, c_char_p, c_size_t)),
    "es_usb_get": (c_size_t, (_CHIP, c_char_p, c_size_t)),
    "es_flash_create": (c_bool, (_CHIP, c_size_t)),
    "es_flash_write": (c_bool, (_CHIP, c_uint32, c_char_p, c_size_t)),
    "es_flash": (c_size_t, (_CHIP, POINTER(c_void_p))),
    "es_flash_operations": (c_uint32, (_CHIP,)),
    "es_boot": (c_bool, (_CHIP,)),
    "es_run_bootloader": (None, (_CHIP, c_bool)),
    "es_cut_power": (None, (_CHIP, c_uint32, c_int)),
    "es_level": (None, (_CHIP, c_uint, POINTER(Level))),
    "es_core": (None, (_CHIP, c_uint, POINTER(Core))),
}


@cache
def load_espsim() -> ctypes.CDLL:
    """The library, built when stale, with its types. Raises BuildError."""
    path = ensure_chip_library("espsim")
    try:
        library = ctypes.CDLL(str(path))
        for name, (result, arguments) in PROTOTYPES.items():
            function = getattr(library, name)
            function.restype = result
            function.argtypes = arguments
    except (OSError, AttributeError) as err:
        raise BuildError(f"{path.name} cannot be used: {err}") from err
    return library


class VirtualChip:
    """One struct esp. Times are cycles of 1/240 us."""

    def __init__(self, chip: Chip = Chip.ESP32) -> None:
        self._library = load_espsim()
        self._chip = self._library.es_create(chip)
        if not self._chip:
            raise MemoryError("es_create")

    def __enter__(self) -> VirtualChip:
        return self

    def __exit__(self, *_: object) -> None:
        self._library.es_destroy(self._chip)
        self._chip = None

    def load(self, program: bytes) -> None:
        """An ELF file, or an image of ESP-IDF. Raises ChipFault."""
        if not self._library.es_load(self._chip, program, len(program)):
            raise ChipFault(self.fault)

    def timing(self, on: bool) -> None:
        """Whether instructions cost what the model says, as at first, or each a cycle. Before anything runs."""
        self._library.es_timing(self._chip, on)

    def configure_flash(self, mhz: int, code_cache: int) -> None:
        """As a bootloader does, for a program without one; bytes. Before anything runs. Raises ValueError."""
        if not self._library.es_flash_configure(self._chip, mhz, code_cache):
            raise ValueError(f"no chip reads flash at {mhz} MHz with a cache of {code_cache} bytes for code")

    @property
    def cycles(self) -> int:
        return int(self._library.es_cycles(self._chip))

    @property
    def instructions(self) -> int:
        return int(self._library.es_instructions(self._chip))

    @property
    def fault(self) -> str:
        return str(self._library.es_fault(self._chip).decode())

    @property
    def notes(self) -> list[str]:
        """What the program has set up that has no effect here."""
        return str(self._library.es_notes(self._chip).decode()).splitlines()

    @property
    def resets(self) -> tuple[int, str]:
        """Those that were no power-on, and what caused the last one."""
        by = c_char_p()
        count = int(self._library.es_resets(self._chip, ctypes.byref(by)))
        return count, (by.value or b"").decode()

    def run_until(self, cycle: int) -> Stop:
        """Let it work. Raises ChipFault."""
        stop = Stop(self._library.es_run(self._chip, cycle))
        if stop == Stop.FAULT:
            raise ChipFault(self.fault)
        return stop

    def run(self, cycles: int) -> Stop:
        """Let it work for so many cycles. Raises ChipFault."""
        return self.run_until(self.cycles + cycles)

    def stop_at(self, address: int) -> None:
        """Stop before this instruction: run() returns Stop.PLACE."""
        self._library.es_stop_at(self._chip, address)

    def symbol(self, name: str) -> int:
        """Address of a symbol of the ELF file. Raises KeyError."""
        address = int(self._library.es_symbol(self._chip, name.encode()))
        if address == 0:
            raise KeyError(name)
        return address

    def load_symbols(self, elf: bytes) -> None:
        """Names of functions for an image without them. Raises ValueError."""
        if not self._library.es_symbols(self._chip, elf, len(elf)):
            raise ValueError("not an ELF file for Xtensa")

    def answer(self, address: int, value: int) -> None:
        """The function there is not executed: a call returns this. Raises ValueError when there are too many."""
        if not self._library.es_answer(self._chip, address, value & 0xFFFFFFFF):
            raise ValueError("too many functions with an answer")

    # ---- memory and processor ----

    def write(self, address: int, data: bytes) -> None:
        """Raises ValueError where there is no memory."""
        if not self._library.es_write(self._chip, address, data, len(data)):
            raise ValueError(f"no memory for {len(data)} bytes at {address:#010x}")

    def read(self, address: int, count: int) -> bytes:
        """Raises ValueError where there is no memory."""
        data = ctypes.create_string_buffer(count)
        if not self._library.es_read(self._chip, address, data, count):
            raise ValueError(f"no memory with {count} bytes at {address:#010x}")
        return data.raw

    def cpu(self, core: int = 0) -> Cpu:
        cpu = Cpu()
        self._library.es_cpu_get(self._chip, core, ctypes.byref(cpu))
        return cpu

    def set_cpu(self, cpu: Cpu) -> None:
        self._library.es_cpu_set(self._chip, ctypes.byref(cpu))

    def physical(self, number: int) -> int:
        """A physical address register, 0 .. 63."""
        return int(self._library.es_physical(self._chip, number))

    # ---- pins ----

    def drive(self, pin: int, level: int) -> None:
        """From outside. @param level  0, 1, or -1: nothing drives it"""
        self._library.es_pin_drive(self._chip, pin, level)

    def level(self, pin: int) -> int:
        return int(self._library.es_pin_level(self._chip, pin))

    def record_edges(self) -> None:
        self._library.es_record_edges(self._chip, True)

    def edges(self) -> list[tuple[int, int, int]]:
        """Cycle, pin, level of each change of an output since the last call."""
        found: list[tuple[int, int, int]] = []
        buffer = (Edge * ROOM)()
        while count := self._library.es_edges(self._chip, buffer, ROOM):
            found += [(edge.cycle, edge.pin, edge.level) for edge in buffer[:count]]
        return found

    def wire_shift_registers(self, clock: int, data: int, latch: int) -> None:
        """A chain of 32 outputs, seen as pins SHIFT_FIRST to SHIFT_FIRST + 31."""
        self._library.es_shift_registers(self._chip, clock, data, latch)

    def shift_outputs(self) -> int:
        """Bit 0 was shifted in last."""
        return int(self._library.es_shift_outputs(self._chip))

    # ---- Ethernet ----

    def wire_w5500(self, host: int, select: int) -> None:
        """Raises ValueError where there is no such host or select line."""
        if not self._library.es_w5500(self._chip, host, select):
            raise ValueError(f"no select line {select} of SPI{host}")

    def set_link(self, up: bool) -> None:
        self._library.es_w5500_link(self._chip, up)

    def put_frame(self, frame: bytes) -> bool:
        """@return whether the W5500 has taken it"""
        return bool(self._library.es_w5500_put(self._chip, frame, len(frame)))

    def take_frame(self) -> bytes:
        """The oldest that was sent; b"": none."""
        buffer = ctypes.create_string_buffer(FRAME_MAX)
        count = int(self._library.es_w5500_get(self._chip, buffer, FRAME_MAX))
        return buffer.raw[:count]

    # ---- UARTs ----

    def write_serial(self, data: bytes, uart: int = 0) -> None:
        """For the receiver, at the speed of its divider."""
        self._library.es_uart_put(self._chip, uart, data, len(data))

    def read_serial(self, uart: int = 0) -> bytes:
        """What the transmitter has sent since the last call."""
        data, buffer = b"", ctypes.create_string_buffer(ROOM)
        while count := self._library.es_uart_get(self._chip, uart, buffer, ROOM):
            data += buffer.raw[:count]
        return data

    # ---- USB-Serial-JTAG ----

    def plug_usb(self, on: bool = True) -> None:
        """A computer at the port. Raises ValueError where the chip has none."""
        if not self._library.es_usb_plug(self._chip, on):
            raise ValueError("this chip has no USB-Serial-JTAG")

    def write_usb(self, data: bytes) -> None:
        self._library.es_usb_put(self._chip, data, len(data))

    def read_usb(self) -> bytes:
        """What the computer has received since the last call."""
        data, buffer = b"", ctypes.create_string_buffer(ROOM)
        while count := self._library.es_usb_get(self._chip, buffer, ROOM):
            data += buffer.raw[:count]
        return data

    # ---- flash ----

    def create_flash(self, size: int) -> None:
        """Blank. Raises ChipFault."""
        if not self._library.es_flash_create(self._chip, size):
            raise ChipFault(self.fault)

    def flash(self) -> bytes:
        """All of it, as it is now."""
        place = c_void_p()
        size = self._library.es_flash(self._chip, ctypes.byref(place))
        return ctypes.string_at(place, size)

    def write_flash(self, address: int, data: bytes) -> None:
        """As a programmer does. Raises ValueError where there is no flash."""
        if not self._library.es_flash_write(self._chip, address, data, len(data)):
            raise ValueError(f"no flash for {len(data)} bytes at {address:#x}")

    @property
    def flash_operations(self) -> int:
        """Writes and erases so far."""
        return int(self._library.es_flash_operations(self._chip))

    def cut_power(self, nth: int, torn: int) -> None:
        """At the n-th write or erase from now: run() returns Stop.DARK.
        @param torn  0: before it, 1: in the middle, 2: after it"""
        self._library.es_cut_power(self._chip, nth, torn)

    def boot(self, *, bootloader: bool = False) -> None:
        """A power-on. Raises ChipFault. @param bootloader  run the one in flash, in resets, too"""
        self._library.es_run_bootloader(self._chip, bootloader)
        if not self._library.es_boot(self._chip):
            raise ChipFault(self.fault)

    def core(self, number: int) -> Core:
        """What a core has done so far."""
        measured = Core()
        self._library.es_core(self._chip, number, ctypes.byref(measured))
        return measured

    def interrupts(self, level: int) -> Level:
        """What the interrupts of a level have taken, from their vector to RFI."""
        measured = Level()
        self._library.es_level(self._chip, level, ctypes.byref(measured))
        return measured
