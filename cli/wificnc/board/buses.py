"""What a board file says of buses, and of what is at them."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from wificnc.board.chip import Strict
from wificnc.board.wire import InputWire, OutputWire
from wificnc.files.values import WholeChoice
from wificnc.tables.tmc import load_tmcs


class Ethernet(Strict):
    """W5500 on SPI. The firmware asks it, so `int` is not needed."""

    chip: Literal["w5500"]
    spi_host: str
    mosi: OutputWire
    miso: InputWire
    sclk: OutputWire
    cs: OutputWire = Field(
        description="SCSn; not ground, as ESP-IDF's driver sends frames of any length, which end where it rises"
    )
    int: InputWire | None = None


class Serial(Strict):
    """The console where the chip does not fix its pins."""

    tx: OutputWire
    rx: InputWire


class SpindleBus(Strict):
    """RS-485 for a spindle drive: a UART and a transceiver, with the drive at the other end."""

    uart: str = Field(description="UART of the chip, such as UART2")
    tx: OutputWire = Field(description="data to the transceiver, DI")
    rx: InputWire = Field(description="data from the transceiver, RO")
    de: OutputWire | None = Field(
        default=None,
        description="driver enable, DE and RE tied together; left out for a transceiver that switches by itself",
    )


class Pendant(Strict):
    """A UART for a pendant at the machine: docs/pendant.md."""

    uart: str = Field(description="UART of the chip, such as UART1")
    tx: OutputWire = Field(description="to the pendant's RX")
    rx: InputWire = Field(description="from the pendant's TX")
    baud: int = Field(default=115_200, ge=9_600, le=1_000_000, description="115200; FluidDial has 1000000")
    kind: Literal["terminal", "mpg"] = Field(
        default="terminal",
        description="terminal: its lines are read whenever nothing runs; mpg: only after its byte 0x8B took control",
    )


class DialAxes(Strict):
    """Lines of an axis switch: one is on."""

    x: InputWire | None = None
    y: InputWire | None = None
    z: InputWire | None = None
    a: InputWire | None = None
    b: InputWire | None = None
    c: InputWire | None = None

    def named(self) -> dict[str, InputWire]:
        return {name: wire for name in "xyzabc" if (wire := getattr(self, name)) is not None}


class Dial(Strict):
    """A hand wheel that makes pulses on two lines: docs/dial.md."""

    a: InputWire = Field(description="line A")
    b: InputWire = Field(description="line B; exchanged with a, the dial turns the other way")
    counts_per_detent: Annotated[Literal[1, 2, 4], WholeChoice] = Field(
        default=4, description="edges of both lines from one detent to the next; a wheel of 100 pulses a turn has 4"
    )
    axis: DialAxes = Field(default=DialAxes(), description="its axis switch; without one $400 says which axis")
    x10: InputWire | None = Field(default=None, description="step switch: on, a detent is ten times $401")
    x100: InputWire | None = Field(default=None, description="step switch: on, a detent is a hundred times $401")

    @property
    def code(self) -> int:
        """host_board.dial of targets/pc/host.h."""
        return self.counts_per_detent | (8 if self.axis.named() else 0)


class DriverBus(Strict):
    """The bus of motor drivers with registers: a UART, or an SPI controller."""

    uart: str | None = Field(default=None, description="UART of the chip, such as UART2: TMC2209")
    tx: OutputWire | None = Field(default=None, description="UART: to PDN_UART of all drivers, through 1 kOhm")
    rx: InputWire | None = Field(default=None, description="UART: from PDN_UART of all drivers")
    spi: str | None = Field(default=None, description="SPI controller of the chip, such as SPI3: TMC5160, TMC2130")
    mosi: OutputWire | None = Field(default=None, description="SPI: to SDI of the drivers, of the first in a chain")
    miso: InputWire | None = Field(default=None, description="SPI: from SDO of the drivers, of the last in a chain")
    sclk: OutputWire | None = Field(default=None, description="SPI: to SCK of all drivers")
    cs: OutputWire | None = Field(default=None, description="SPI: to CSN of all drivers of a chain")


class Driver(Strict):
    """A motor driver with registers."""

    kind: Literal["tmc2209", "tmc5160", "tmc2130"]
    address: int | None = Field(default=None, ge=0, le=3, description="UART: as its pins MS1, MS2 have it")
    place: int | None = Field(default=None, ge=0, le=5, description="in a chain: 0 is next to mosi")
    cs: OutputWire | None = Field(default=None, description="SPI without a chain: to its CSN")
    sense_mohm: int | None = Field(
        default=None, ge=10, le=1000, description="sense resistor, mOhm; left out: 110, of a TMC5160 75"
    )
    diag: bool = Field(default=False, description="its DIAG (TMC2209) or DIAG1 is at the limit input of its axis")

    @property
    def code(self) -> int:
        """enum tmc_kind of core/drivers/tmc_chips_gen.h."""
        return load_tmcs().number(self.kind)

    @property
    def sense(self) -> int:
        return self.sense_mohm or load_tmcs().of(self.kind).sense_mohm

    @property
    def current_max_ma(self) -> int:
        """rms, that its sense resistor allows."""
        return load_tmcs().of(self.kind).current_max_ma(self.sense)


class Drivers(Strict):
    """Motor drivers with registers, by axis; y2: of the second motor of y."""

    x: Driver | None = None
    y: Driver | None = None
    z: Driver | None = None
    a: Driver | None = None
    b: Driver | None = None
    c: Driver | None = None
    x2: Driver | None = Field(default=None, description="of the second motor of x, [axis.x.second]")
    y2: Driver | None = Field(default=None, description="of the second motor of y, [axis.y.second]")
    z2: Driver | None = Field(default=None, description="of the second motor of z, [axis.z.second]")
    a2: Driver | None = Field(default=None, description="of the second motor of a, [axis.a.second]")
    b2: Driver | None = Field(default=None, description="of the second motor of b, [axis.b.second]")
    c2: Driver | None = Field(default=None, description="of the second motor of c, [axis.c.second]")

    def named(self) -> dict[str, Driver]:
        """First motors, then second ones."""
        names = [letter + motor for motor in ("", "2") for letter in "xyzabc"]
        return {name: driver for name in names if (driver := getattr(self, name)) is not None}
