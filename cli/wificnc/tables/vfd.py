"""protocol/vfd.toml as Python objects: the drives that can be commanded by RS-485, and what their frames must be."""

from __future__ import annotations

import re
import sys
from functools import lru_cache
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, model_validator

from wificnc.files.paths import ROOT

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib  # type: ignore[import-not-found, unused-ignore]

VFD_PATH = ROOT / "protocol" / "vfd.toml"

SEND_MAX, ANSWER_MAX = 8, 8  # bytes without address and CRC: VFD_SEND_MAX, VFD_ANSWER_MAX of core/spindle/vfd_models.h
BAUDS = (2400, 4800, 9600, 19200, 38400, 115200)  # in the order of $374, which is grblHAL's
PARITIES = ("none", "even", "odd")  # $681, grblHAL's, too
OWN = "own"  # the row whose registers are settings
ANY, VALUE, REGISTER, COMMAND = "..", "VV", "RR", "CC"
SPEED_SCALE = re.compile(r"(hz|rpm|max)\*([1-9]\d{0,4})|own")
LOAD_SCALE = re.compile(r"ampere\*([1-9]\d{0,2})")
COMMANDS = ("clockwise", "counter_clockwise", "stop")
FRAMES = (*COMMANDS, "set_speed", "read_speed", "read_load", "read_maximum")
WRITE_COIL, WRITE_REGISTER, WRITE_REGISTERS, READS = 0x05, 0x06, 0x10, (0x03, 0x04)


class _Strict(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)


class VfdFrame(_Strict):
    """A request and its answer, without address and CRC."""

    send: str
    answer: str
    scale: str = ""
    signed: bool = False

    @property
    def sent(self) -> list[str]:
        return self.send.split()

    @property
    def answered(self) -> list[str]:
        """The answer's bytes; those of an echo that are no fixed ones are as sent."""
        return self.sent if self.answer == "echo" else self.answer.split()

    @property
    def may_be_echo(self) -> bool:
        """The request would be taken for its answer."""
        pairs = zip(self.sent, self.answered, strict=False)
        same = all(there in (here, ANY, VALUE) for here, there in pairs)
        return same and len(self.sent) == len(self.answered)

    @property
    def unit(self) -> str:
        """hz, rpm, max, own or ampere."""
        return self.scale.partition("*")[0]

    @property
    def factor(self) -> int:
        return int(self.scale.partition("*")[2] or 1)

    @model_validator(mode="after")
    def _spelt(self) -> VfdFrame:
        for name, words, most in (("send", self.sent, SEND_MAX), ("answer", self.answered, ANSWER_MAX)):
            wrong = [word for word in words if not re.fullmatch(r"[0-9A-F]{2}|\.\.|VV|RR|CC", word)]
            if wrong:
                raise ValueError(f"{name}: {wrong[0]!r} is not a byte: two hex digits in capitals, .., VV, RR or CC")
            if not 2 <= len(words) <= most:
                raise ValueError(f"{name}: {len(words)} bytes; a frame has 2 to {most} without address and CRC")
        if ANY in self.sent:
            raise ValueError("send: .. is any byte, and a request has none of these")
        for name, words in (("send", self.sent), ("answer", self.answered)):
            places = [place for place, word in enumerate(words) if word == VALUE]
            if places and (len(places) != 2 or places[1] != places[0] + 1):
                raise ValueError(f"{name}: a value is VV VV, once")
        return self


def _byte(words: list[str], at: int) -> int | None:
    """A fixed byte, or None."""
    return int(words[at], 16) if at < len(words) and re.fullmatch(r"[0-9A-F]{2}", words[at]) else None


def _modbus_fault(frame: VfdFrame) -> str:
    """Why these are no frames of Modbus; "": they are."""
    sent, answered, function = frame.sent, frame.answered, _byte(frame.sent, 0)
    if _byte(answered, 0) != function:
        return "answer: begins with another function code than the request"
    if function in (WRITE_COIL, WRITE_REGISTER):
        if len(sent) != 5:
            return f"send: function {function:02X} has a register and a value, 5 bytes; these are {len(sent)}"
        return "" if frame.answer == "echo" else f'answer: function {function:02X} is answered by "echo"'
    if function == WRITE_REGISTERS:
        data = _byte(sent, 5)
        if data is None or len(sent) != 6 + data or (_byte(sent, 4) or 0) * 2 != data:
            return "send: function 10 has register, count of registers, count of bytes and as many bytes"
        return "" if answered == sent[:5] else f'answer: function 10 is answered by "{" ".join(sent[:5])}"'
    if function not in READS:
        return f"send: {sent[0]} is not a function code that drives have: 03, 04, 05, 06 or 10"
    return _read_fault(sent, answered)


def _read_fault(sent: list[str], answered: list[str]) -> str:
    words = _byte(sent, 4) or 0
    if len(sent) != 5 or words == 0:
        return "send: a read has a register and a count of registers above 0, 5 bytes"
    short, long = _byte(answered, 1), _byte(answered, 2) if _byte(answered, 1) == 0 else None
    head, count = (3, long) if long is not None else (2, short)
    if count != 2 * words or len(answered) != head + 2 * words:
        return f"answer: {words} registers are a count of {2 * words:02X} and as many bytes"
    return ""


def _huanyang_fault(frame: VfdFrame) -> str:
    """Function, count, so many bytes."""
    for name, words in (("send", frame.sent), ("answer", frame.answered)):
        if _byte(words, 1) != len(words) - 2:
            return f"{name}: the second byte must be the count of those that follow, {len(words) - 2:02X}"
    if _byte(frame.answered, 0) != _byte(frame.sent, 0):
        return "answer: begins with another function code than the request"
    return ""


class Vfd(_Strict):
    """One model."""

    number: Annotated[int, Field(ge=1, le=99)]
    name: Annotated[str, Field(pattern=r"^[a-z][a-z0-9_]*$")]
    title: str
    framing: Literal["modbus", "huanyang"]
    baud: int
    parity: Literal["none", "even", "odd"]
    gap_ms: Annotated[int, Field(ge=0, le=50)] = 0
    clockwise: VfdFrame
    counter_clockwise: VfdFrame
    stop: VfdFrame
    set_speed: VfdFrame
    read_speed: VfdFrame | None = None
    read_load: VfdFrame | None = None
    read_maximum: VfdFrame | None = None
    settings: Annotated[tuple[Annotated[tuple[str, str], Field(strict=False)], ...], Field(strict=False)]
    source: str

    def frames(self) -> dict[str, VfdFrame]:
        """Those that it has, by name."""
        found = {name: getattr(self, name) for name in FRAMES}
        return {name: frame for name, frame in found.items() if frame is not None}

    @model_validator(mode="after")
    def _possible(self) -> Vfd:
        if self.baud not in BAUDS:
            raise ValueError(f"{self.name}: {self.baud} baud; $374 has {', '.join(map(str, BAUDS))}")
        for name, frame in self.frames().items():
            fault = self._fault(name, frame)
            if fault:
                raise ValueError(f"{self.name}.{name}: {fault}")
        if len({getattr(self, name).send for name in COMMANDS}) < len(COMMANDS) and self.name != OWN:
            raise ValueError(f"{self.name}: clockwise, counter_clockwise and stop must be different frames")
        if self.read_speed and not self.read_maximum and self.read_speed.may_be_echo:
            reason = "its answer at rest is the request, so a bus that returns what is sent looks like a drive"
            raise ValueError(f"{self.name}.read_speed: {reason}; read_maximum is needed")
        return self

    def _fault(self, name: str, frame: VfdFrame) -> str:
        own = {REGISTER, COMMAND} & {*frame.sent, *frame.answered}
        if own and self.name != OWN:
            return f"{min(own)} stands for a setting, and only the row {OWN!r} has these"
        fault = _modbus_fault(frame) if self.framing == "modbus" else _huanyang_fault(frame)
        return fault or _value_fault(name, frame)


def _value_fault(name: str, frame: VfdFrame) -> str:
    """Where the value is, and what it means."""
    carrier = frame.answered if name.startswith("read_") else frame.sent
    if name in COMMANDS:
        return "a command has no value" if VALUE in frame.sent or frame.scale else ""
    if VALUE not in carrier:
        return f"{'answer' if name.startswith('read_') else 'send'}: the value VV VV is missing"
    pattern, like = (LOAD_SCALE, "ampere*10") if name == "read_load" else (SPEED_SCALE, "hz*100, rpm*1, max*10000")
    if not pattern.fullmatch(frame.scale):
        return f"scale: {frame.scale!r} is unknown: like {like}"
    return "scale: a maximum cannot be a part of itself" if name == "read_maximum" and frame.unit == "max" else ""


class VfdTable(_Strict):
    """All models, in the order of their numbers."""

    schema_: Annotated[Literal[1], Field(alias="schema")]
    vfd: Annotated[tuple[Vfd, ...], Field(strict=False, min_length=1)]

    @model_validator(mode="after")
    def _numbered(self) -> VfdTable:
        for number, row in enumerate(self.vfd, 1):
            if row.number != number:
                raise ValueError(f"{row.name}: number {row.number}, and {number} comes next")
        if len({row.name for row in self.vfd}) < len(self.vfd):
            raise ValueError("two models have the same name")
        return self


def parse_vfds(text: str) -> VfdTable:
    """The table from TOML text. Raises ValueError (TOML syntax, pydantic) when the table itself is wrong."""
    return VfdTable.model_validate(tomllib.loads(text))


@lru_cache(maxsize=1)
def load_vfds() -> VfdTable:
    """The table of this WiFiCNC."""
    return parse_vfds(VFD_PATH.read_text(encoding="utf-8"))
