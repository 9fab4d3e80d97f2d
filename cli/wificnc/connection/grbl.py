"""What a Grbl 1.1 controller says, line by line. Pure: text in, messages out, and back again.

Nothing here is an error: a line that fits no form is Other, and whoever expected something better decides.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from typing import TypeAlias

LINE_MAX = 4096  # bytes; no one's answer is as long


@dataclass(frozen=True)
class Ok:
    """ok"""


@dataclass(frozen=True)
class Error:
    """error:22"""

    code: int


@dataclass(frozen=True)
class Alarm:
    """ALARM:3"""

    code: int


@dataclass(frozen=True)
class Banner:
    """Grbl 1.1h ['$' for help]: the controller has just started, or was reset."""

    firmware: str
    version: str


@dataclass(frozen=True)
class SettingLine:
    """$110=500.000"""

    number: int
    value: str


@dataclass(frozen=True)
class Bracket:
    """[KEY:body], such as MSG, GC, G54, PRB, VER, OPT, HLP"""

    key: str
    body: str


@dataclass(frozen=True)
class StartupLine:
    """>G20:ok, what became of a start-up block"""

    line: str
    answer: str


@dataclass(frozen=True)
class Other:
    """Anything else."""

    text: str


@dataclass(frozen=True)
class Status:
    """<Idle|MPos:…>: exactly what one report has; None is what it does not say."""

    state: str  # Idle Run Hold Tool Jog Alarm Door Check Home Sleep
    substate: int | None = None
    mpos: tuple[float, ...] | None = None
    wpos: tuple[float, ...] | None = None
    planner_free: int | None = None
    rx_free: int | None = None
    line: int | None = None
    feed: float | None = None
    speed: float | None = None
    pins: str = ""
    wco: tuple[float, ...] | None = None
    overrides: tuple[int, int, int] | None = None
    accessories: str = ""
    other: tuple[tuple[str, str], ...] = field(default=())
    measured: float | None = None  # of the spindle, by its encoder or drive
    ampere: float | None = None  # of a drive's motor


Message: TypeAlias = Ok | Error | Alarm | Banner | SettingLine | Bracket | StartupLine | Other | Status

_NUMBERED = re.compile(r"(error|ALARM):(\d{1,4})")
_BANNER = re.compile(r"(Grbl\w*|GrblHAL) (\S+)(?: .*)?")
_SETTING = re.compile(r"\$(\d{1,5})=([^\s=]*)(?: \(.*\))?")
_BRACKET = re.compile(r"\[([A-Z][A-Z0-9.]*):(.*)\]")
_STARTUP = re.compile(r">(.*):(ok|error:\d+)")


class LineSplitter:
    """Bytes -> text lines, however they were cut on the way."""

    def __init__(self) -> None:
        self._rest = b""

    def take(self, data: bytes) -> list[str]:
        """Whole lines, without their ends; empty ones are left out."""
        *whole, rest = (self._rest + data).replace(b"\r", b"\n").split(b"\n")
        if len(rest) > LINE_MAX:
            whole, rest = [*whole, rest], b""
        self._rest = rest
        return [text for line in whole if (text := line.decode("utf-8", "replace").strip())]


def parse(text: str) -> Message:
    """One line without its end."""
    if text == "ok":
        return Ok()
    if match := _NUMBERED.fullmatch(text):
        code = int(match[2])
        return Error(code) if match[1] == "error" else Alarm(code)
    if text.startswith("<") and text.endswith(">"):
        return _parse_status(text) or Other(text)
    if match := _BRACKET.fullmatch(text):
        return Bracket(match[1], match[2])
    if match := _SETTING.fullmatch(text):
        return SettingLine(int(match[1]), match[2])
    if match := _BANNER.fullmatch(text):
        return Banner(match[1], match[2])
    if match := _STARTUP.fullmatch(text):
        return StartupLine(match[1], match[2])
    return Other(text)


def _parse_status(text: str) -> Status | None:
    """None when a field that we know is not what it should be."""
    head, *parts = text[1:-1].split("|")
    name, _, substate = head.partition(":")
    fields: dict[str, object] = {"state": name, "substate": int(substate) if substate.isdigit() else None}
    other: list[tuple[str, str]] = []
    try:
        for part in parts:
            key, colon, value = part.partition(":")
            if not colon or not _take_field(fields, key, value):
                other.append((key, value))
    except ValueError:
        return None
    if not name.isalpha() or ("mpos" not in fields and "wpos" not in fields):
        return None
    return Status(**fields, other=tuple(other))  # type: ignore[arg-type]


def _take_field(fields: dict[str, object], key: str, value: str) -> bool:
    """Put a known field where it belongs. ValueError when it is malformed."""
    if key in ("MPos", "WPos", "WCO"):
        fields[key.lower()] = _floats(value)
    elif key == "Bf":
        fields["planner_free"], fields["rx_free"] = (int(number) for number in value.split(","))
    elif key == "Ln":
        fields["line"] = int(value)
    elif key == "F":
        fields["feed"] = float(value)
    elif key == "FS":
        fields["feed"], fields["speed"], *more = _floats(value)[:3]
        fields["measured"] = more[0] if more else None
    elif key == "Amp":
        fields["ampere"] = float(value)
    elif key == "Pn":
        fields["pins"] = value
    elif key == "Ov":
        feed, rapid, spindle = (int(number) for number in value.split(","))
        fields["overrides"] = (feed, rapid, spindle)
    elif key == "A":
        fields["accessories"] = value
    else:
        return False
    return True


def _floats(text: str) -> tuple[float, ...]:
    return tuple(float(number) for number in text.split(","))


def form(message: Message) -> str:
    """The line that parse() reads as this message."""
    if isinstance(message, Ok):
        return "ok"
    if isinstance(message, Error):
        return f"error:{message.code}"
    if isinstance(message, Alarm):
        return f"ALARM:{message.code}"
    if isinstance(message, Banner):
        return f"{message.firmware} {message.version} ['$' for help]"
    if isinstance(message, SettingLine):
        return f"${message.number}={message.value}"
    if isinstance(message, Bracket):
        return f"[{message.key}:{message.body}]"
    if isinstance(message, StartupLine):
        return f">{message.line}:{message.answer}"
    if isinstance(message, Status):
        return _form_status(message)
    return message.text


def _form_status(status: Status) -> str:
    def numbers(values: tuple[float, ...]) -> str:
        return ",".join(f"{value:.3f}" for value in values)

    parts = [status.state if status.substate is None else f"{status.state}:{status.substate}"]
    parts += [f"{key}:{numbers(value)}" for key, value in (("MPos", status.mpos), ("WPos", status.wpos)) if value]
    if status.planner_free is not None:
        parts.append(f"Bf:{status.planner_free},{status.rx_free}")
    if status.line is not None:
        parts.append(f"Ln:{status.line}")
    if status.speed is not None:
        measured = "" if status.measured is None else f",{status.measured:.0f}"
        parts.append(f"FS:{status.feed:.0f},{status.speed:.0f}{measured}")
    elif status.feed is not None:
        parts.append(f"F:{status.feed:.0f}")
    parts += [] if status.ampere is None else [f"Amp:{status.ampere:.1f}"]
    parts += [f"Pn:{status.pins}"] if status.pins else []
    parts += [f"WCO:{numbers(status.wco)}"] if status.wco else []
    parts += ["Ov:" + ",".join(str(percent) for percent in status.overrides)] if status.overrides else []
    parts += [f"A:{status.accessories}"] if status.accessories else []
    parts += [f"{key}:{value}" for key, value in status.other]
    return f"<{'|'.join(parts)}>"


@dataclass(frozen=True)
class Options:
    """[OPT:V,15,128]: what the controller was built with."""

    flags: str
    planner_blocks: int
    rx_bytes: int


def parse_options(body: str) -> Options | None:
    """The body of [OPT:…]; None when it gives no sizes."""
    flags, *sizes = body.split(",")
    if len(sizes) < 2 or not (sizes[0].isdigit() and sizes[1].isdigit()):
        return None
    return Options(flags, int(sizes[0]), int(sizes[1]))


def parse_coordinates(body: str) -> tuple[float, ...] | None:
    """The body of [G54:…] and its like; None when it is none."""
    try:
        return _floats(body)
    except ValueError:
        return None


@dataclass(frozen=True)
class ProbeResult:
    """[PRB:x,y,z:1], machine coordinates."""

    position: tuple[float, ...]
    touched: bool


def parse_probe(body: str) -> ProbeResult | None:
    """The body of [PRB:…]; None when it is none."""
    numbers, _, flag = body.rpartition(":")
    position = parse_coordinates(numbers)
    return ProbeResult(position, flag == "1") if position and flag in ("0", "1") else None
