"""What `wificnc serve` was asked for, and the program's arguments that say it."""

from __future__ import annotations

import ipaddress
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from wificnc.board.model import Board
from wificnc.board.pin_keys import pin_keys
from wificnc.board.rules import step_spread_ns
from wificnc.board.shift_registers import step_grid_ns
from wificnc.connection.port import SERVE_PORT
from wificnc.errors import UserError
from wificnc.files.digits import whole_number
from wificnc.profile import Machine
from wificnc.simulator.library import Tasks
from wificnc.tables import AXES

DEFAULT_HTTP_PORT = 8080
DEFAULT_TCP = f"127.0.0.1:{SERVE_PORT}"
MOTORS = [letter + second for second in ("", "2") for letter in AXES.lower()]  # of struct host_board's drivers
MAX_SPEED = 1e6
LINEAR = "xyz"
FROM_END_MM = 10.0  # of the tool at power-on
LABEL = "[A-Za-z0-9]([A-Za-z0-9-]{0,61}[A-Za-z0-9])?"
HOST_NAME = re.compile(rf"(?=.{{1,63}}$){LABEL}(\.{LABEL})*")  # NAME_MAX_SIZE of targets/net/net_http_request.c


@dataclass(frozen=True)
class Address:
    """Where TCP listens. Port 0 is any free one."""

    host: str
    port: int

    def __str__(self) -> str:
        return f"[{self.host}]:{self.port}" if ":" in self.host else f"{self.host}:{self.port}"

    @property
    def is_loopback(self) -> bool:
        """Only programs on this computer can connect."""
        try:
            return ipaddress.ip_address(self.host).is_loopback
        except ValueError:
            return self.host == "localhost"


@dataclass(frozen=True)
class Door:
    """Where a pendant is: a serial port, a pty or a TCP port of this computer."""

    kind: str  # serial, pty or tcp
    where: str

    def __str__(self) -> str:
        return self.where if self.kind == "serial" else f"{self.kind}:{self.where}"


@dataclass(frozen=True, kw_only=True)
class ServeOptions:
    """A controller to serve. speed 0: as fast as the computer can."""

    board: Board
    tcp: Address | None = None
    http: Address | None = None  # of the page; None: it is not served
    http_names: tuple[str, ...] = ()  # by which browsers may ask for the page, in addition to its address
    pty: Path | None = None
    wmc3: str | None = None  # IPv4 address of the binary protocol; its ports are fixed
    io_module: bool = False  # of the binary protocol; there is no text side then
    key: str = ""  # access key of network clients, by any protocol; "": access is open
    control: int | None = None  # port of this computer for the hands at the virtual machine; 0: any free one
    speed: float = 1.0
    settings: tuple[str, ...] = ()
    hands: tuple[str, ...] = ()  # what is done at the virtual machine first, in the words of targets/pc/hands.h
    pendant: Door | None = None  # of a pendant
    spindle_bus: Path | None = None  # serial port of a spindle's drive; None: the virtual machine has one
    on_chip: bool = False  # its image runs in the virtual chip
    image: Path | None = None  # of the chip; None: what was built
    network: str | None = None  # of the chip's Ethernet: user, tap:NAME or off; None: user, where that can be had
    store: Path | None = None  # keeps settings, offsets and startup lines


def parse_pendant(text: str) -> Door:
    """'/dev/ttyUSB0', 'pty:LINK' or 'tcp:2324'. Raises UserError."""
    kind, _, where = text.partition(":") if text.startswith(("pty:", "tcp:")) else ("serial", "", text)
    if not where or (kind == "tcp" and not (where.isascii() and where.isdigit() and whole_number(where) <= 65535)):
        raise UserError(
            f"--pendant {text!r} is not a port",
            hint="a serial port such as /dev/ttyUSB0, pty:LINK, or tcp:2324 (of this computer; 0 takes any free one)",
        )
    return Door(kind, where)


def parse_address(text: str, option: str = "--tcp", port: int = SERVE_PORT) -> Address | None:
    """'127.0.0.1:2323', ':2323', 'localhost' or '[::1]:0'; 'off' is None. Raises UserError."""
    if text == "off":
        return None
    found = re.fullmatch(r"(?:\[([^\]]+)\]|([^:\[\]]*))(?::(\d{1,5}))?", text.strip())
    if not found or int(found[3] or 0) > 65535 or not text.strip():
        raise UserError(
            f"{option} {text!r} is not an address", hint=f"like 127.0.0.1:{port}; port 0 takes any free one"
        )
    host = found[1] or found[2] or "127.0.0.1"
    return Address(host, port if found[3] is None else int(found[3]))


def parse_host_name(text: str) -> str:
    """'shop.lan'. Raises UserError."""
    if not HOST_NAME.fullmatch(text):
        raise UserError(f"{text!r} is not a host name", hint="like shop.lan, without http://, port or path")
    return text.lower()


def parse_wmc3(text: str, speed: float) -> str:
    """An IPv4 address. Raises UserError."""
    try:
        ipaddress.IPv4Address(text)
    except ValueError:
        raise UserError(f"--wmc3 {text!r} is not an IPv4 address", hint="127.0.0.1; 0.0.0.0 is every network") from None
    if speed == 0.0:
        raise UserError("--wmc3 needs a clock, and --speed max has none", hint="--speed 1, or a number")
    return text


def parse_speed(text: str) -> float:
    """'1', '10', '0.5', or 'max', which is 0. Raises UserError."""
    if text == "max":
        return 0.0
    try:
        speed = float(text)
    except ValueError:
        speed = -1.0
    if not 0.0 < speed <= MAX_SPEED:
        raise UserError(
            f"--speed {text!r} is not a speed", hint="1 is real time, 10 ten times as fast, max without a clock"
        )
    return speed


def board_numbers(board: Board) -> dict[str, int]:
    """What a host controller must know of a board: fields of struct host_board (targets/pc/host.h), most of them."""
    timing = board.timing
    return {
        "timer_hz": timing.timer_hz,
        "step_pulse_ns": timing.step_pulse_ns,
        "default_pulse_us": timing.default_pulse_us,
        "dir_setup_ns": timing.dir_setup_ns,
        "step_spread_ns": step_spread_ns(board),
        "step_grid_ns": step_grid_ns(board),
        "look_ahead": board.look_ahead,
        "laser_marks": board.laser_marks,
        "max_step_rate_hz": timing.max_step_rate_hz,
        "axes": len(board.axes),
        "ganged": board.ganged_axes,
        "home_axes": board.home_axes,
        "missing_outputs": board.missing_outputs,
        "digital_inputs": board.digital_inputs,
        "digital_outputs": board.digital_outputs,
        "encoder": int(board.encoder is not None),
        "analog": int(board.has_analog),
        "toolsetter": int(board.input.toolsetter is not None),
        "spindle_bus": int(board.spindle_bus is not None),
        **{f"driver_{motor}": code for motor, code in zip(MOTORS, board.driver_codes, strict=True) if code},
        "dial": board.dial_code,
        **pump_numbers(board),
    }


def pump_numbers(board: Board) -> dict[str, int]:
    """Of its charge pump; none where it has none."""
    timer = board.pins.pump
    if board.output.charge_pump is None or timer is None:
        return {}
    return {
        "pump_hz": board.output.charge_pump_hz,
        "pump_clock_hz": timer.clock_hz,
        "pump_ticks_min": timer.ticks_min,
        "pump_ticks_max": timer.ticks_max,
    }


def device_text(board: Board) -> str:
    """Pins and the like, as host_device_parse() of targets/pc/host_device.h wants it."""
    pins = ",".join(f"{row.pin}:{row.legal:x}" for row in pin_keys(board))
    return f"{pins};{int(board.is_estop_high)},{board.encoder_filter_ns},{board.spi_host_number}"


def end_switches(machine: Machine) -> list[str]:
    """A limit switch at both ends of X, Y and Z, in the words of targets/pc/hands.h. The machine is switched
    on with its tool above the corner from which X and Y count up."""
    if machine.kinematics.type not in (None, "cartesian"):  # its motors have no ends of their own
        return []
    lines = []
    for index, travel in enumerate(machine.travel_mm):
        letter = AXES[index].lower()
        if travel is None or letter not in LINEAR:
            continue
        near = min(FROM_END_MM, travel / 2)
        low, high = (near - travel, near) if letter == "z" else (-near, travel - near)
        lines.append(f"travel {letter} {low:g} {high:g}")
    return lines


def _pendant_arguments(board: Board, door: Door) -> list[tuple[str, object]]:
    assert board.pendant
    words = [(f"--pendant-{door.kind}", door.where), ("--pendant-kind", board.pendant.kind)]
    return [*words, ("--pendant-baud", board.pendant.baud)]


def program_arguments(options: ServeOptions) -> list[str]:
    """Arguments of the C program (targets/pc/main.c)."""
    pairs: Sequence[tuple[str, object]] = (
        *((f"--{name.replace('_', '-')}", number) for name, number in board_numbers(options.board).items()),
        ("--switchless", options.board.switchless),
        ("--device", device_text(options.board)),
        ("--tasks", int(Tasks.of(options.board.target))),
        ("--speed", options.speed),
        *([("--host", options.tcp.host), ("--port", options.tcp.port)] if options.tcp else []),
        *([("--wmc3", options.wmc3)] if options.wmc3 else []),
        *([("--control", options.control)] if options.control is not None else []),
        *([("--pty", options.pty)] if options.pty else []),
        *([("--bus-port", options.spindle_bus)] if options.spindle_bus else []),
        *(_pendant_arguments(options.board, options.pendant) if options.pendant else []),
        *([("--store", options.store)] if options.store else []),
        *(("--set", line) for line in options.settings),
        *(("--hands", line) for line in options.hands),
    )
    flags = ["--parent", *(["--io-module"] if options.io_module else [])]
    return [*flags, *(str(word) for pair in pairs for word in pair)]
