"""What the pins of a chip can do: the model of targets/*/pins*.toml."""

from __future__ import annotations

import hashlib
from functools import cache
from pathlib import Path
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

from wificnc.board import paths
from wificnc.files.shape import validate
from wificnc.files.tomlfile import read_toml

Level = Literal["low", "high"]
Pull = Literal["none", "up", "down"]
LooseTuple = Field(strict=False)

SHIFTED = "I2SO."  # FluidNC's name of a shift register's output


def is_shifted(pin: str) -> bool:
    """An output of a shift register, and no pin of the chip itself."""
    return pin.startswith(SHIFTED)


class Strict(BaseModel):
    """Frozen, no unknown keys, no conversions."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)


class Strap(Strict):
    """A pin the chip reads at reset."""

    at_boot: Literal["low", "high", "any"]
    otherwise: str
    ref: str


class Taken(Strict):
    """Who owns the pin; `memory` empty = in every memory variant."""

    by: str
    memory: Annotated[tuple[str, ...], LooseTuple] = ()


class ChipPin(Strict):
    """One pin: what it can do, and what it does before the firmware runs."""

    number: int
    package_pin: int | None = None
    pad: str | None = None
    output: bool = True
    input: bool = True
    pull_up: bool = True
    pull_down: bool = True
    fast: bool = True
    reset: Literal["floating", "pull-up", "pull-down", "undefined"]
    glitch: Annotated[tuple[Level, ...], LooseTuple] = ()
    adc: str | None = None
    strap: Strap | None = None
    taken: Taken | None = None
    usb: str | None = None
    console: str | None = None
    debug: str | None = None
    note: str | None = None

    def level_at_reset(self) -> Level | None:
        """The level a weak pull gives the pin, None when it floats."""
        levels: dict[str, Level] = {"pull-up": "high", "pull-down": "low"}
        return levels.get(self.reset)

    def taken_in(self, memory: str) -> str | None:
        """Who owns the pin in this memory variant."""
        if self.taken and (not self.taken.memory or memory in self.taken.memory):
            return self.taken.by
        return None

    def can_pull(self, pull: Pull) -> bool:
        return {"none": True, "up": self.pull_up, "down": self.pull_down}[pull]


class MemorySizes(Strict):
    """That a memory variant is sold with; the flash has room for the firmware."""

    flash_mb: Annotated[tuple[int, ...], LooseTuple]
    psram_mb: Annotated[tuple[int, ...], LooseTuple]


class FastPath(Strict):
    """The registers the step interrupt writes: pin n is bit n % bank_width of bank n / bank_width."""

    bank_width: Literal[16, 32]
    banks: Annotated[tuple[str, ...], LooseTuple]


class StepTimer(Strict):
    """The clock of the step timer and what it can be divided by."""

    clock_hz: int
    divider_min: int = 1
    divider_max: int = 1
    dividers: Annotated[tuple[int, ...], LooseTuple] = ()

    def makes(self, timer_hz: int) -> bool:
        if self.clock_hz % timer_hz:
            return False
        divider = self.clock_hz // timer_hz
        return divider in self.dividers if self.dividers else self.divider_min <= divider <= self.divider_max


class Rmt(Strict):
    """The remote control peripheral, which can make step pulses."""

    tx_channels: int = Field(ge=1)


class I2s(Strict):
    """The I2S peripheral, which can clock words into a chain of shift registers."""

    fifo_words: int = Field(ge=64)


class SpiWords(Strict):
    """The SPI of a chip whose I2S peripheral takes no words of the processor: it can send one after the other."""

    host: str  # of spi_hosts
    word_ns: int = Field(gt=0)  # from one word to the next, at least


class CoreSizes(Strict):
    """How much the core may hold on this chip."""

    look_ahead: Literal[64, 128, 256, 512, 1024]  # pieces of path
    laser_marks: Literal[256, 512, 1024, 2048, 4096]  # changes of S in it


class Firmware(Strict):
    """What readers of the board lists learn about the firmware of this chip."""

    state: str
    page: str | None = None  # in docs/
    network: str | None = None  # without a chip of its own, as Ethernet needs


class PlatformIo(Strict):
    """The PlatformIO board that a board file of this chip is built as; a smaller flash is set by the environment."""

    board: str
    flash_mb: int


class PumpTimer(Strict):
    """What makes the charge pump's square wave: a wave is a whole number of ticks of this clock."""

    clock_hz: int
    ticks_min: int
    ticks_max: int

    def makes(self, hz: int) -> bool:
        """Within 1 %, as pump_ticks() of core/machine/pump.c."""
        ticks = round(self.clock_hz / hz)
        return self.ticks_min <= ticks <= self.ticks_max and abs(self.clock_hz / ticks - hz) <= 0.01 * hz


class ChipFile(Strict):
    """The shape of targets/*/pins*.toml."""

    schema_version: Literal[1] = Field(alias="schema")
    target: str
    chip: str
    name: str
    datasheet: str
    url: str | None = None
    source: dict[str, str]
    memory: dict[str, str]
    memory_sizes: dict[str, MemorySizes]  # of the same variants
    fast: FastPath
    timer: StepTimer
    spi_hosts: dict[str, int] = {}
    rmt: Rmt | None = None
    i2s: I2s | None = None
    spi_words: SpiWords | None = None
    pump: PumpTimer | None = None  # of the charge pump
    pendant_uarts: dict[str, int] = {}  # that a pendant can have, as below
    spindle_uarts: dict[str, int] = {}  # that a spindle's drive can have, and the numbers the firmware gives them
    spindle_pins: dict[str, Annotated[tuple[str, ...], LooseTuple]] = {}  # of that bus, where the firmware fixes them
    driver_uarts: dict[str, int] = {}  # that motor drivers can have, and the numbers the firmware gives them
    core: CoreSizes | None = None  # None: a PC
    firmware: Firmware | None = None
    platformio: PlatformIo | None = None
    pin: dict[str, ChipPin]


class Chip(ChipFile):
    """A chip and the hash of the file that describes it."""

    sha256: str

    def bank(self, pin: str) -> int:
        return self.pin[pin].number // self.fast.bank_width

    def is_fast(self, pin: str) -> bool:
        return self.pin[pin].fast and self.bank(pin) < len(self.fast.banks)

    def with_shift_registers(self, outputs: int) -> Chip:
        """The same chip with I2SO.0, I2SO.1 ... on a board that wires shift registers to it: a bank of their own."""
        first = len(self.fast.banks) * self.fast.bank_width
        pins = {
            f"{SHIFTED}{output}": ChipPin(
                number=first + output, input=False, pull_up=False, pull_down=False, reset="undefined"
            )
            for output in range(outputs)
        }
        fast = self.fast.model_copy(update={"banks": (*self.fast.banks, "shift registers")})
        return self.model_copy(update={"pin": {**self.pin, **pins}, "fast": fast})


def text_sha256(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()


@cache
def load_chips() -> dict[tuple[str, str], Chip]:
    """Every chip by (target, chip).

    Raises:
        FileProblems: a pin table is broken.
    """
    paths.require_repository()
    chips = (_load_chip(path) for path in sorted(paths.TARGETS.glob("*/pins*.toml")))
    return {(chip.target, chip.chip): chip for chip in chips}


def _load_chip(path: Path) -> Chip:
    source = read_toml(path)
    file = validate(ChipFile, source)
    fields = {name: getattr(file, name) for name in ChipFile.model_fields if name != "schema_version"}
    return Chip(schema=1, sha256=text_sha256(source.text), **fields)
