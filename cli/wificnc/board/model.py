"""What a board wires: the shape of boards/*.toml, and the Board the rest of the program sees."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from enum import Enum
from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field

from wificnc.board.buses import Dial, DriverBus, Drivers, Ethernet, Pendant, Serial, SpindleBus
from wificnc.board.chip import Chip, Level, LooseTuple, Pull, Strict
from wificnc.board.wire import InputWire, OutputWire, Reason, Wire
from wificnc.files.problem import KeyPath, key_text
from wificnc.files.values import Text, WholeChoice, distinct, not_empty

AXIS_LETTERS = "XYZABC"
AXES_MAX = len(AXIS_LETTERS)
MISC_OUT_MAX = 5
MISC_IN_MAX = 8
DIAL_FILTER_NS = {"esp32": 12_000}  # the longest of its pulse counter, whose filter has ten bits at 80 MHz
ENCODER_FILTER_NS = {"esp32": 500}  # a pulse counter at 1 MHz of counts


class Memory(Strict):
    """Flash and PSRAM; the mode decides which pins they take."""

    mode: str = Field(description="memory variant of the chip, a key of [memory] in its pin table")
    flash_mb: Annotated[tuple[int, ...], LooseTuple, distinct()] = Field(
        default=(), description="flash sizes the board is sold with, MB"
    )
    psram_mb: Annotated[tuple[int, ...], LooseTuple, distinct()] = Field(
        default=(), description="PSRAM sizes, MB; 0 = sold without"
    )


class Timing(Strict):
    """The step timer and the defaults of the step pulses."""

    timer_hz: int = Field(ge=1_000_000, le=100_000_000, description="step timer, ticks per second")
    step_pulse_ns: int = Field(ge=100, le=50_000, description="shortest step high time, and at least the same low")
    default_pulse_us: int = Field(
        default=0, ge=1, le=255, description="what $0 starts at, for drivers that want more; left out: step_pulse_ns"
    )
    dir_setup_ns: int = Field(ge=0, le=50_000, description="direction stable before a step")
    max_step_rate_hz: int = Field(ge=1_000, le=2_000_000, description="fastest steps of one axis")


class Step(Strict):
    """What makes the step pulses."""

    engine: Literal["gpio", "rmt", "i2s"] = Field(
        default="gpio",
        description="gpio: the step interrupt; rmt: that peripheral of an ESP32, started by the interrupt; "
        "i2s: that peripheral of an ESP32, through shift registers ([i2so])",
    )


class Motor(Strict):
    """One motor and its switches: one `limit`, or `limit_min` and `limit_max`."""

    step: OutputWire
    dir: OutputWire
    enable: OutputWire | None = None
    limit: InputWire | None = None
    limit_min: InputWire | None = None
    limit_max: InputWire | None = None
    home: InputWire | None = Field(default=None, description="switch for homing; without it homing looks at a limit")

    @property
    def limit_ends(self) -> set[str]:
        """Where its limits are: "min", "max"."""
        ends = {"min": self.limit or self.limit_min, "max": self.limit or self.limit_max}
        return {end for end, wire in ends.items() if wire}

    def has_switch(self, *, at_home: bool) -> bool:
        """Something that homing can look at. @param at_home  the axis homes to a home switch"""
        wires = (self.home,) if at_home else (self.limit, self.limit_min, self.limit_max)
        return any(wire is not None for wire in wires)


class Axis(Motor):
    """An axis: its motor, and at the other side of a gantry perhaps a second one that makes the same steps."""

    second: Motor | None = Field(default=None, description="second motor; homing squares the gantry if it has a switch")


class AxisSet(Strict):
    """The axes in their order; every axis before a wired one must be wired."""

    x: Axis
    y: Axis | None = None
    z: Axis | None = None
    a: Axis | None = None
    b: Axis | None = None
    c: Axis | None = None

    def motors(self) -> dict[str, Motor]:
        """As wired(), then the second motors as "y2"."""
        seconds = {f"{letter}2": axis.second for letter, axis in self.wired().items() if axis.second is not None}
        return {**self.wired(), **seconds}

    def wired(self) -> dict[str, Axis]:
        """Letter in lower case to axis, wired ones only."""
        axes = {letter.lower(): getattr(self, letter.lower()) for letter in AXIS_LETTERS}
        return {letter: axis for letter, axis in axes.items() if axis is not None}


class Outputs(Strict):
    """Everything the board switches, apart from the motors."""

    enable: OutputWire | None = Field(default=None, description="enable of all motor drivers")
    spindle_enable: OutputWire | None = None
    spindle_pwm: OutputWire | None = None
    spindle_dir: OutputWire | None = None
    coolant_flood: OutputWire | None = None
    coolant_mist: OutputWire | None = None
    charge_pump: OutputWire | None = Field(default=None, description="square wave that keeps a safety relay closed")
    charge_pump_hz: int = Field(default=10_000, ge=1, le=20_000, description="what $73 starts at, with a charge_pump")
    servo: OutputWire | None = Field(default=None, description="pulses of 0.5 to 2.5 ms for an RC servo, $85 to $87")
    misc: Annotated[tuple[OutputWire, ...], LooseTuple, not_empty] = Field(default=(), max_length=MISC_OUT_MAX)


class Inputs(Strict):
    """Everything the board reads, apart from limits and the encoder."""

    probe: InputWire | None = None
    toolsetter: InputWire | None = Field(default=None, description="second probe input, of a tool setter")
    estop: InputWire | None = None
    misc: Annotated[tuple[InputWire, ...], LooseTuple, not_empty] = Field(default=(), max_length=MISC_IN_MAX)


class Encoder(Strict):
    """Spindle encoder."""

    a: InputWire
    b: InputWire | None = None
    index: InputWire | None = None


class Led(Strict):
    """Status light."""

    kind: Literal["plain", "ws2812"]
    pin: OutputWire


class ShiftRegisters(Strict):
    """A chain of 74HC595 at the I2S peripheral: its outputs are the pins I2SO.0, I2SO.1 and so on."""

    bck: OutputWire = Field(description="shift clock, SRCLK")
    data: OutputWire = Field(description="serial input of the first register, SER")
    ws: OutputWire = Field(description="latch, RCLK: its rising edge shows a word")
    outputs: Annotated[Literal[8, 16, 24, 32], WholeChoice] = Field(
        description="of all registers; I2SO.0 is the first register's QA"
    )


class Header(Strict):
    """One row of pins as it lies on the board, top to bottom; names that are no chip pins are power and reset."""

    name: Text
    side: Literal["left", "right"]
    pins: Annotated[tuple[Text, ...], LooseTuple] = Field(min_length=1)


class Deviation(Strict):
    """Where this map differs from the published one."""

    key: Text = Field(description="the key in this file, such as axis.b.dir or input.misc[2]")
    published: Text = Field(description='the pin in the published map; "none" if the map has none')
    why: Reason


class Source(Strict):
    """Where the published map is."""

    map: Text
    board: Text
    url: Annotated[Text, Field(pattern=r"^https?://")] | None = None


class BoardFile(Strict):
    """A board of WiFiCNC: what is wired where, and how fast it may step."""

    schema_version: Annotated[Literal[1], WholeChoice] = Field(
        alias="schema", description="always 1, and always the first key"
    )
    name: Text
    summary: Text
    target: str = Field(description="folder under targets/")
    chip: str = Field(description="chip of that target")
    source: Source
    memory: Memory
    timing: Timing
    step: Step = Step()
    onboard: Annotated[tuple[str, ...], LooseTuple, distinct()] = Field(
        default=(), description="pins wired on the board itself"
    )
    axis: AxisSet
    output: Outputs = Outputs()
    input: Inputs = Inputs()
    encoder: Encoder | None = None
    led: Led | None = None
    ethernet: Ethernet | None = None
    serial: Serial | None = None
    spindle_bus: SpindleBus | None = None
    pendant: Pendant | None = None
    dial: Dial | None = None
    driver_bus: DriverBus | None = None
    driver: Drivers = Drivers()
    i2so: ShiftRegisters | None = None
    note: Annotated[tuple[Text, ...], LooseTuple, distinct()] = Field(
        default=(), description="notes for the user before wiring"
    )
    header: Annotated[tuple[Header, ...], LooseTuple, distinct(lambda header: (header.side, header.name))] = ()
    deviation: Annotated[tuple[Deviation, ...], LooseTuple, distinct(lambda each: each.key)] = ()

    def uses(self) -> tuple[Use, ...]:
        """Every wired pin, in the order of the signals."""
        return tuple(_uses(self))

    def value_of(self, key: str) -> str:
        """What a deviation compares: the pin wired at a key, or a number of timing; "none" when nothing is there."""
        wired = {key_text(use.path).removesuffix(".pin"): use.pin for use in self.uses()}
        timing = {f"timing.{name}": str(value) for name, value in self.timing.model_dump().items()}
        return (wired | timing).get(key, "none")


class Role(Enum):
    """What a signal is for; decides which rules look at it and its colour in pictures."""

    STEP = "step"
    DIR = "direction"
    ENABLE = "motor enable"
    LIMIT = "limit"
    HOME = "home switch"
    PROBE = "probe"
    ESTOP = "e-stop"
    SPINDLE = "spindle"
    COOLANT = "coolant"
    PUMP = "charge pump"
    SERVO = "RC servo"
    MISC = "misc output"
    MISC_IN = "misc input"
    ENCODER = "encoder"
    LED = "LED"
    ETHERNET = "Ethernet"
    SERIAL = "console"
    I2SO = "shift registers"
    SPINDLE_BUS = "spindle bus"
    PENDANT = "pendant"
    DIAL = "dial"
    DRIVER_BUS = "driver bus"


@dataclass(frozen=True)
class Use:
    """One signal on one pin."""

    signal: str
    path: KeyPath
    role: Role
    wire: Wire

    @property
    def pin(self) -> str:
        return self.wire.pin

    @property
    def is_output(self) -> bool:
        return isinstance(self.wire, OutputWire)

    @property
    def active(self) -> Level:
        assert isinstance(self.wire, OutputWire | InputWire)
        return self.wire.active

    @property
    def pull(self) -> Pull:
        return self.wire.pull if isinstance(self.wire, InputWire) else "none"

    @property
    def can_hurt(self) -> bool:
        """On at the wrong moment, it moves, cuts or sprays."""
        harmless = {"spindle_dir"}
        return self.role in (Role.ENABLE, Role.SPINDLE, Role.COOLANT) and self.signal not in harmless


class Board(BoardFile):
    """A checked board with its chip. Build it with wificnc.board.load.load_board()."""

    id: str
    path: Path
    sha256: str
    pins: Chip

    @property
    def axes(self) -> tuple[str, ...]:
        """Letters of the wired axes, such as ("X", "Y", "Z")."""
        return tuple(letter.upper() for letter in self.axis.wired())

    @property
    def second_motors(self) -> tuple[str, ...]:
        """Such as ("Y2",)."""
        return tuple(name.upper() for name in self.axis.motors() if name.endswith("2"))

    @property
    def axes_text(self) -> str:
        """Such as "XYZ+Y2"."""
        return "+".join(["".join(self.axes), *self.second_motors])

    @property
    def ganged_axes(self) -> int:
        """Axes with a second motor, bit 0 = X."""
        wired = self.axis.wired().items()
        return sum(1 << AXIS_LETTERS.index(letter.upper()) for letter, axis in wired if axis.second)

    @property
    def home_axes(self) -> int:
        """Axes with home switches of their own, bit 0 = X."""
        wired = self.axis.wired().items()
        return sum(1 << AXIS_LETTERS.index(letter.upper()) for letter, axis in wired if axis.home)

    @property
    def switchless(self) -> int:
        """Motors without a limit, or of home_axes without a home switch: bit n = the first one of axis n, bit 6 + n =
        its second one."""
        motors = 0
        for index, axis in enumerate(self.axis.wired().values()):
            for second, motor in enumerate((axis, axis.second)):
                if motor is not None and not motor.has_switch(at_home=axis.home is not None):
                    motors |= 1 << index + AXES_MAX * second
        return motors

    @property
    def one_switch(self) -> tuple[str, ...]:
        """Axes with two motors of which only the first has a switch, such as ("Y",)."""
        return tuple(letter for n, letter in enumerate(AXIS_LETTERS) if self.switchless >> AXES_MAX + n & 1)

    @property
    def look_ahead(self) -> int:
        """Pieces of path that the chip holds; 0: a PC."""
        return self.pins.core.look_ahead if self.pins.core else 0

    @property
    def laser_marks(self) -> int:
        """Changes of a laser's S in the look-ahead; 0: a PC."""
        return self.pins.core.laser_marks if self.pins.core else 0

    @property
    def missing_outputs(self) -> int:
        """BOARD_OUTPUT_ bits (core/machine/board.h) of outputs that are not wired."""
        out = self.output
        wired = (
            out.spindle_enable or out.spindle_pwm,
            out.spindle_pwm,
            out.spindle_dir,
            out.coolant_flood,
            out.coolant_mist,
            out.servo,
        )
        return sum(1 << bit for bit, wire in enumerate(wired) if wire is None)

    @property
    def digital_inputs(self) -> int:
        """Of M66."""
        return len(self.input.misc)

    @property
    def digital_outputs(self) -> int:
        """Of M62 .. M65."""
        return len(self.output.misc)

    @property
    def is_estop_high(self) -> bool:
        """The e-stop counts while its line is high."""
        return self.input.estop is not None and self.input.estop.active == "high"

    @property
    def encoder_filter_ns(self) -> int:
        """Pulses of the encoder that are shorter are ignored; 0: no filter, or no encoder."""
        return ENCODER_FILTER_NS.get(self.target, 0) if self.encoder and self.encoder.b else 0

    @property
    def spi_host_number(self) -> int:
        """SPI controller of the Ethernet chip; 0: no such chip."""
        return self.pins.spi_hosts[self.ethernet.spi_host] if self.ethernet else 0

    @property
    def spindle_uart_number(self) -> int:
        """UART of the spindle's drive; 0: no bus, or a virtual one."""
        return self.pins.spindle_uarts.get(self.spindle_bus.uart, 0) if self.spindle_bus else 0

    @property
    def pendant_uart_number(self) -> int:
        """UART of a pendant; 0: none, or a virtual one."""
        return self.pins.pendant_uarts.get(self.pendant.uart, 0) if self.pendant else 0

    @property
    def driver_bus_number(self) -> int:
        """UART or SPI controller of the motor drivers; 0: no bus, or a virtual one."""
        bus = self.driver_bus
        if bus is None:
            return 0
        return self.pins.driver_uarts.get(bus.uart, 0) if bus.uart else self.pins.spi_hosts.get(bus.spi or "", 0)

    @property
    def driver_rows(self) -> tuple[tuple[int, ...], ...]:
        """struct driver_wire of core/drivers/drivers.h: kind, axis, motor, address/place, select, chain, mOhm, DIAG."""
        named = self.driver.named()
        chained = bool(self.driver_bus and self.driver_bus.cs)
        selects = iter(range(len(named)))
        return tuple(
            (
                driver.code,
                "xyzabc".index(name[0]),
                int(name.endswith("2")),
                (driver.address if driver.kind == "tmc2209" else driver.place) or 0,
                next(selects) if driver.cs else 0,
                len(named) if chained else 1,
                driver.sense,
                int(driver.diag),
            )
            for name, driver in named.items()
        )

    @property
    def driver_codes(self) -> list[int]:
        """The same as numbers for targets/pc/host_drivers.h, one per axis, then of second motors; 0: a plain driver."""
        codes = [0] * (2 * AXES_MAX)
        for kind, axis, motor, address, select, chain, mohm, diag in self.driver_rows:
            codes[axis + AXES_MAX * motor] = kind | address << 4 | select << 8 | chain << 12 | diag << 16 | mohm << 17
        return codes

    @property
    def dial_code(self) -> int:
        """host_board.dial of targets/pc/host.h; 0: no dial."""
        return self.dial.code if self.dial else 0

    @property
    def dial_filter_ns(self) -> int:
        """Pulses of the dial that are shorter are ignored; 0: no filter, or no dial."""
        return DIAL_FILTER_NS.get(self.target, 0) if self.dial else 0

    @property
    def has_analog(self) -> bool:
        """Analog inputs and outputs of M66 .. M68: no chip's firmware has them, the PC's virtual machine has."""
        return self.target == "host"

    def pin_names(self) -> dict[str, str]:
        """Signal to pin, such as {"step_x": "GPIO1"}."""
        return {use.signal: use.pin for use in self.uses()}

    def use_of(self, pin: str) -> Use | None:
        return next((use for use in self.uses() if use.pin == pin), None)


_AXIS_ROLES = {
    "step": Role.STEP,
    "dir": Role.DIR,
    "enable": Role.ENABLE,
    "limit": Role.LIMIT,
    "limit_min": Role.LIMIT,
    "limit_max": Role.LIMIT,
    "home": Role.HOME,
}
_OUTPUT_ROLES = {
    "enable": Role.ENABLE,
    "spindle_enable": Role.SPINDLE,
    "spindle_pwm": Role.SPINDLE,
    "spindle_dir": Role.SPINDLE,
    "coolant_flood": Role.COOLANT,
    "coolant_mist": Role.COOLANT,
    "charge_pump": Role.PUMP,
    "servo": Role.SERVO,
}
_INPUT_ROLES = {"probe": Role.PROBE, "toolsetter": Role.PROBE, "estop": Role.ESTOP}
_GROUPS = (
    ("encoder", "encoder", Role.ENCODER, ("a", "b", "index")),
    ("ethernet", "eth", Role.ETHERNET, ("mosi", "miso", "sclk", "int", "cs")),
    ("serial", "serial", Role.SERIAL, ("tx", "rx")),
    ("i2so", "i2so", Role.I2SO, ("bck", "data", "ws")),
    ("spindle_bus", "bus", Role.SPINDLE_BUS, ("tx", "rx", "de")),
    ("pendant", "pendant", Role.PENDANT, ("tx", "rx")),
    ("dial", "dial", Role.DIAL, ("a", "b", "x10", "x100")),
    ("driver_bus", "driver", Role.DRIVER_BUS, ("tx", "rx", "mosi", "miso", "sclk", "cs")),
)


def _uses(board: BoardFile) -> Iterator[Use]:
    motors = board.axis.motors()
    for key, role in _AXIS_ROLES.items():
        for name, motor in motors.items():
            signal = f"{key.replace('limit_', f'limit_{name}_')}"
            signal = signal if key.startswith("limit_") else f"{key}_{name}"
            place = (name[0], "second") if name.endswith("2") else (name,)
            yield from _use(signal, ("axis", *place, key), role, getattr(motor, key))
    for key, role in _OUTPUT_ROLES.items():
        yield from _use(key, ("output", key), role, getattr(board.output, key))
    for index, output in enumerate(board.output.misc):
        yield Use(f"misc_out_{index}", ("output", "misc", index), Role.MISC, output)
    for key, role in _INPUT_ROLES.items():
        yield from _use(key, ("input", key), role, getattr(board.input, key))
    for index, entry in enumerate(board.input.misc):
        yield Use(f"misc_in_{index}", ("input", "misc", index), Role.MISC_IN, entry)
    for table, prefix, role, keys in _GROUPS:
        for key in keys:
            yield from _use(f"{prefix}_{key}", (table, key), role, getattr(getattr(board, table), key, None))
    for name, line in (board.dial.axis.named() if board.dial else {}).items():
        yield from _use(f"dial_axis_{name}", ("dial", "axis", name), Role.DIAL, line)
    for name, driver in board.driver.named().items():
        yield from _use(f"driver_cs_{name}", ("driver", name, "cs"), Role.DRIVER_BUS, driver.cs)
    if board.led:
        yield Use("led", ("led", "pin"), Role.LED, board.led.pin)


def _use(signal: str, path: KeyPath, role: Role, wire: Wire | None) -> Iterator[Use]:
    if wire is not None:
        yield Use(signal, path, role, wire)
