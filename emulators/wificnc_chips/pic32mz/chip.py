"""The virtual PIC32MZ seen from Python: mzsim/mzsim.h by ctypes, with types."""

from __future__ import annotations

import ctypes
from collections.abc import Iterable
from ctypes import POINTER, Structure, c_bool, c_char_p, c_int, c_int32, c_size_t, c_uint, c_uint8, c_uint32, c_uint64
from ctypes import c_void_p as _CHIP
from dataclasses import astuple, dataclass, fields
from enum import IntEnum
from functools import cache
from typing import Any

from wificnc.build.image import Block
from wificnc.errors import BuildError, UserError

from wificnc_chips.fault import ChipFault
from wificnc_chips.library import ensure_chip_library

_STATE = _CHIP  # both are addresses

CPU_HZ = 200_000_000
FLASH_BASE, FLASH_SIZE = 0x1D00_0000, 2 << 20
NO_PIN = 255
PORT_WIDTH = 16
NEVER = (1 << 64) - 1
TIMING_UNITS = 4  # MZ_TIMING_UNITS: parts of a cycle


class Stop(IntEnum):
    """enum mz_stop"""

    TIME = 0
    FAULT = 1
    DARK = 2


class Torn(IntEnum):
    """When in a flash operation the power goes."""

    BEFORE = 0
    AMID = 1
    BEHIND = 2


@dataclass(frozen=True)
class Timing:
    """What time costs, cycles of the CPU (struct mz_timing). The caches are the chip's; the costs are estimates."""

    instruction: float  # each; of these quarters count
    fetch_miss: int = 0  # a line of code that is not in the cache
    fetch_next: int = 0  # ... when it follows the one before: prefetched
    data_miss: int = 0
    uncached: int = 0
    sfr_load: int = 0
    sfr_store: int = 0
    interrupt: int = 0  # from request to vector


# 200 MHz, flash with two wait states of 16 bytes behind the prefetch, buses of peripherals at 50 MHz: a load waits for
# two to three of their clocks and the way there and back, a store for its place in the write buffer. 1.25: a load that
# is used immediately, a jump, a multiplication. Not measured on silicon.
ESTIMATE = Timing(
    instruction=1.25, fetch_miss=12, fetch_next=4, data_miss=12, uncached=20, sfr_load=20, sfr_store=8, interrupt=10
)


class _Timing(Structure):
    """struct mz_timing"""

    _fields_ = tuple((field.name, c_uint32) for field in fields(Timing))


class Edge(Structure):
    """struct mz_edge"""

    _fields_ = (("cycle", c_uint64), ("pin", c_uint8), ("level", c_uint8))


class AxisWire(Structure):
    """struct mz_axis"""

    _fields_ = (
        *((name, c_uint8) for name in ("step", "dir", "min_switch", "max_switch", "min_active", "max_active")),
        *((name, c_uint8) for name in ("has_low", "has_high")),
        ("low", c_int32),
        ("high", c_int32),
    )


class Step(Structure):
    """struct mz_step"""

    _fields_ = (("cycle", c_uint64), ("step", c_uint8), ("dir", c_uint8))


# The same record for numpy.frombuffer().
STEP_DTYPE = {"names": ["cycle", "step", "dir"], "formats": ["<u8", "u1", "u1"], "offsets": [0, 8, 9], "itemsize": 16}


class Pulses(Structure):
    """struct mz_pulses, cycles"""

    _fields_ = tuple((name, c_uint64) for name in ("high", "low", "setup", "hold"))


class Vector(Structure):
    """struct mz_vector"""

    _fields_ = tuple((name, c_uint64) for name in ("count", "instructions", "most"))


class Cpu(Structure):
    """struct mz_cpu"""

    _fields_ = (
        ("r", c_uint32 * 32),
        *((name, c_uint32) for name in ("hi", "lo", "pc", "next_pc", "fcsr")),
        ("f", c_uint64 * 32),
    )


PROTOTYPES: dict[str, tuple[Any, tuple[Any, ...]]] = {
    "mz_create": (_CHIP, ()),
    "mz_destroy": (None, (_CHIP,)),
    "mz_program": (c_bool, (_CHIP, c_uint32, c_char_p, c_size_t)),
    "mz_flash": (POINTER(c_uint8), (_CHIP,)),
    "mz_reset": (None, (_CHIP,)),
    "mz_reset_by": (None, (_CHIP, c_uint32)),
    "mz_oscillator": (None, (_CHIP, c_bool)),
    "mz_cycles": (c_uint64, (_CHIP,)),
    "mz_instructions": (c_uint64, (_CHIP,)),
    "mz_run": (c_int, (_CHIP, c_uint64)),
    "mz_fault": (c_char_p, (_CHIP,)),
    "mz_resets": (c_uint32, (_CHIP,)),
    "mz_cpu_speed": (None, (_CHIP, c_uint32)),
    "mz_set_timing": (None, (_CHIP, POINTER(_Timing))),
    "mz_uart_put": (c_size_t, (_CHIP, c_char_p, c_size_t)),
    "mz_uart_put_unframed": (c_size_t, (_CHIP, c_char_p, c_size_t)),
    "mz_uart_speed": (None, (_CHIP, c_uint32)),
    "mz_uart_waiting": (c_size_t, (_CHIP,)),
    "mz_bus_put": (c_size_t, (_CHIP, c_char_p, c_size_t)),
    "mz_bus_get": (c_size_t, (_CHIP, c_char_p, c_size_t)),
    "mz_bus_byte_cycles": (c_uint32, (_CHIP,)),
    "mz_bus_driver": (None, (_CHIP, c_uint)),
    "mz_uart_get": (c_size_t, (_CHIP, c_char_p, c_size_t)),
    "mz_pin_drive": (None, (_CHIP, c_uint, c_int)),
    "mz_pin_drive_at": (c_bool, (_CHIP, c_uint64, c_uint, c_int)),
    "mz_pin_level": (c_int, (_CHIP, c_uint)),
    "mz_record_edges": (None, (_CHIP, c_bool)),
    "mz_edges": (c_size_t, (_CHIP, POINTER(Edge), c_size_t)),
    "mz_axis_set": (None, (_CHIP, c_uint, POINTER(AxisWire))),
    "mz_axis_position": (c_int32, (_CHIP, c_uint)),
    "mz_axis_place": (None, (_CHIP, c_uint, c_int32)),
    "mz_surface": (None, (_CHIP, c_uint, c_int32)),
    "mz_toolsetter": (None, (_CHIP, c_uint, POINTER(c_int32), c_int32)),
    "mz_steps": (c_size_t, (_CHIP, POINTER(Step), c_size_t)),
    "mz_pulses": (None, (_CHIP, POINTER(Pulses))),
    "mz_cut_power": (None, (_CHIP, c_uint32, c_int)),
    "mz_flash_operations": (c_uint32, (_CHIP,)),
    "mz_save": (_STATE, (_CHIP,)),
    "mz_restore": (None, (_CHIP, _STATE)),
    "mz_forget": (None, (_STATE,)),
    "mz_vector": (None, (_CHIP, c_uint, POINTER(Vector))),
    "mz_cpu_get": (None, (_CHIP, POINTER(Cpu))),
    "mz_cpu_set": (None, (_CHIP, POINTER(Cpu))),
    "mz_ram_write": (c_bool, (_CHIP, c_uint32, c_char_p, c_size_t)),
    "mz_ram_read": (c_bool, (_CHIP, c_uint32, c_char_p, c_size_t)),
    "mz_step": (c_int, (_CHIP,)),
    "mz_sfr_read": (c_uint32, (_CHIP, c_uint32)),
    "mz_sfr_write": (None, (_CHIP, c_uint32, c_uint32)),
}

ROOM = 1 << 16  # records taken out of the library in one call


@cache
def load_mzsim() -> ctypes.CDLL:
    """The library, built when stale, with its types. Raises BuildError."""
    path = ensure_chip_library("mzsim")
    try:
        library = ctypes.CDLL(str(path))
        for name, (result, arguments) in PROTOTYPES.items():
            function = getattr(library, name)
            function.restype = result
            function.argtypes = arguments
    except (OSError, AttributeError) as err:
        raise BuildError(f"{path.name} cannot be used: {err}") from err
    return library


def pin_number(name: str) -> int:
    """'RD4' is 16 * 3 + 4."""
    return (ord(name[1]) - ord("A")) * PORT_WIDTH + int(name[2:])


class VirtualChip:
    """One struct chip. Times are cycles of the CPU, 5 ns unless cpu_speed() makes it faster."""

    def __init__(self, image: Iterable[Block] = ()) -> None:
        """Raises BuildError: there is no library, or the image has bytes where this chip has no flash."""
        self._library = library = load_mzsim()
        self._chip = library.mz_create()
        if not self._chip:
            raise MemoryError("mz_create")
        self._saved: int | None = None
        self.cpu_hz = CPU_HZ
        self._heard = ctypes.create_string_buffer(ROOM)
        for block in image:
            if not library.mz_program(self._chip, block.address, block.data, len(block.data)):
                self.close()
                raise BuildError(f"the image has bytes at {block.address:#010x}, where this chip has no flash")
        self.power_on()

    def __enter__(self) -> VirtualChip:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        self._forget()
        self._library.mz_destroy(self._chip)
        self._chip = None

    # ---- power and time ----

    def power_on(self) -> None:
        """A reset from outside; RAM and flash are as they were."""
        self._library.mz_reset(self._chip)

    def reset_by(self, causes: int) -> None:
        """A reset by the reset pin, a brown-out, the deadman timer: bits of RCON."""
        self._library.mz_reset_by(self._chip, causes)

    def oscillator(self, works: bool) -> None:
        """It stops, and the clock monitor raises an NMI; or it works again from the next reset on."""
        self._library.mz_oscillator(self._chip, works)

    @property
    def cycles(self) -> int:
        return int(self._library.mz_cycles(self._chip))

    @property
    def instructions(self) -> int:
        return int(self._library.mz_instructions(self._chip))

    @property
    def resets(self) -> int:
        """How often it has reset itself."""
        return int(self._library.mz_resets(self._chip))

    def run_until(self, cycle: int) -> Stop:
        """Let it work. Raises ChipFault."""
        stop = Stop(self._library.mz_run(self._chip, cycle))
        if stop == Stop.FAULT:
            raise ChipFault(self.fault)
        return stop

    def run(self, seconds: float) -> Stop:
        """Let it work for this long. Raises ChipFault."""
        return self.run_until(self.cycles + round(seconds * self.cpu_hz))

    def cpu_speed(self, factor: int) -> None:
        """The CPU alone so many times faster, 1 .. 100, before the first run(): no chip can, and it shows what of a
        trace is the program's and what its processor's."""
        self._library.mz_cpu_speed(self._chip, factor)
        self.cpu_hz = CPU_HZ * factor

    def timing(self, timing: Timing) -> None:
        """Count time like this, before the first run(); not with cpu_speed(). A cycle is a quarter then."""
        instruction, *others = astuple(timing)
        cost = _Timing(round(instruction * TIMING_UNITS), *others)
        self._library.mz_set_timing(self._chip, ctypes.byref(cost))
        self.cpu_hz = CPU_HZ * TIMING_UNITS

    def step(self) -> Stop:
        """One instruction; a fault is returned, not raised."""
        return Stop(self._library.mz_step(self._chip))

    @property
    def fault(self) -> str:
        return str(self._library.mz_fault(self._chip).decode())

    # ---- serial port ----

    def write(self, data: bytes) -> None:
        """Bytes for the receiver, as fast as its baud rate allows."""
        self._library.mz_uart_put(self._chip, data, len(data))

    def write_unframed(self, data: bytes) -> None:
        """Bytes without their stop bit: noise, a break (a 0), another baud rate."""
        self._library.mz_uart_put_unframed(self._chip, data, len(data))

    @property
    def unread(self) -> int:
        """Bytes written that the receiver has not seen yet."""
        return int(self._library.mz_uart_waiting(self._chip))

    def read(self) -> bytes:
        """What was sent since the last call."""
        said = b""
        while count := self._library.mz_uart_get(self._chip, self._heard, ROOM):
            said += ctypes.string_at(self._heard, count)
        return said

    # ---- the bus of a spindle drive ----

    def bus_driver(self, pin: int) -> None:
        """This pin is DE: a byte that is sent while it is low, or arrives while it is high, is a fault."""
        self._library.mz_bus_driver(self._chip, pin)

    def bus_write(self, data: bytes) -> None:
        """Bytes of the drive."""
        self._library.mz_bus_put(self._chip, data, len(data))

    def bus_read(self) -> bytes:
        """What was sent to the drive since the last call."""
        count = self._library.mz_bus_get(self._chip, self._heard, ROOM)
        return ctypes.string_at(self._heard, count)

    def bus_byte_s(self) -> float:
        """How long a byte takes at the format that is set."""
        return float(self._library.mz_bus_byte_cycles(self._chip)) / CPU_HZ

    def serial_speed(self, factor: int) -> None:
        """Both ways so many times faster than the baud rate: no chip can, and some tests want it."""
        self._library.mz_uart_speed(self._chip, factor)

    # ---- pins and the machine at them ----

    def drive(self, pin: int, level: int | None) -> None:
        """From outside; None: no one does."""
        self._library.mz_pin_drive(self._chip, pin, -1 if level is None else level)

    def drive_at(self, cycle: int, pin: int, level: int | None) -> None:
        if not self._library.mz_pin_drive_at(self._chip, cycle, pin, -1 if level is None else level):
            raise UserError(f"pin {pin} cannot be driven at {cycle}: too many changes wait, or there is no such pin")

    def level(self, pin: int) -> int:
        return int(self._library.mz_pin_level(self._chip, pin))

    def record_edges(self, on: bool) -> None:
        self._library.mz_record_edges(self._chip, on)

    def edges(self) -> list[tuple[int, int, int]]:
        """(cycle, pin, level) of output pins since the last call."""
        found, buffer = [], (Edge * ROOM)()
        while count := self._library.mz_edges(self._chip, buffer, ROOM):
            found += [(edge.cycle, edge.pin, edge.level) for edge in buffer[:count]]
        return found

    def set_axis(self, axis: int, wire: AxisWire) -> None:
        self._library.mz_axis_set(self._chip, axis, ctypes.byref(wire))

    def position(self, axis: int) -> int:
        """Where the motor really is, steps."""
        return int(self._library.mz_axis_position(self._chip, axis))

    def place(self, axis: int, steps: int) -> None:
        self._library.mz_axis_place(self._chip, axis, steps)

    def surface(self, pin: int, z_steps: int) -> None:
        """The probe's pin goes low while Z is at or below this."""
        self._library.mz_surface(self._chip, pin, z_steps)

    def toolsetter(self, pin: int, at: tuple[int, int, int], radius: int) -> None:
        """The tool setter's pin goes low while Z is at or below at[2], no farther than this from at[0] and at[1]."""
        self._library.mz_toolsetter(self._chip, pin, (ctypes.c_int32 * 3)(*at), radius)

    def steps(self) -> bytes:
        """Records of STEP_DTYPE since the last call."""
        found, buffer = b"", (Step * ROOM)()
        while count := self._library.mz_steps(self._chip, buffer, ROOM):
            found += ctypes.string_at(buffer, count * ctypes.sizeof(Step))
        return found

    def pulses(self) -> Pulses:
        """The shortest ones so far."""
        pulses = Pulses()
        self._library.mz_pulses(self._chip, ctypes.byref(pulses))
        return pulses

    # ---- flash, interrupts, CPU ----

    def flash(self) -> bytes:
        """Program flash as it is now."""
        return ctypes.string_at(self._library.mz_flash(self._chip), FLASH_SIZE)

    def set_flash(self, offset: int, data: bytes) -> None:
        """Overwrite flash, as kept from an earlier run."""
        if not self._library.mz_program(self._chip, FLASH_BASE + offset, data, len(data)):
            raise ValueError(f"{len(data)} bytes at {offset:#x} do not lie in the flash")

    def cut_power(self, nth: int, torn: Torn = Torn.BEFORE) -> None:
        """At the nth flash operation from now, 1 = the next; 0: never."""
        self._library.mz_cut_power(self._chip, nth, torn)

    @property
    def flash_operations(self) -> int:
        return int(self._library.mz_flash_operations(self._chip))

    def save(self) -> None:
        """Keep all of it, machine and clock too, for restore(). Bytes on their way to the receiver are lost."""
        self._forget()
        self._saved = self._library.mz_save(self._chip)
        if not self._saved:
            raise MemoryError("mz_save")

    def restore(self) -> None:
        """As it was at save(). Bytes and records that were not taken are gone."""
        assert self._saved, "save() comes first"
        self._library.mz_restore(self._chip, self._saved)

    def _forget(self) -> None:
        self._library.mz_forget(self._saved)
        self._saved = None

    def vector(self, irq: int) -> Vector:
        """Instructions of an interrupt, vector to eret."""
        vector = Vector()
        self._library.mz_vector(self._chip, irq, ctypes.byref(vector))
        return vector

    def cpu(self) -> Cpu:
        cpu = Cpu()
        self._library.mz_cpu_get(self._chip, ctypes.byref(cpu))
        return cpu

    def set_cpu(self, cpu: Cpu) -> None:
        self._library.mz_cpu_set(self._chip, ctypes.byref(cpu))

    def write_ram(self, physical: int, data: bytes) -> None:
        assert self._library.mz_ram_write(self._chip, physical, data, len(data))

    def read_ram(self, physical: int, count: int) -> bytes:
        buffer = ctypes.create_string_buffer(count)
        assert self._library.mz_ram_read(self._chip, physical, buffer, count)
        return buffer.raw

    def read_register(self, address: int) -> int:
        return int(self._library.mz_sfr_read(self._chip, address))

    def write_register(self, address: int, value: int) -> None:
        self._library.mz_sfr_write(self._chip, address, value)
