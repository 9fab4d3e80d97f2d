"""A FluidNC configuration as sections and values, which know what has been read of them.

FluidNC reads a line as a key, a colon and the rest of the line, so `pulloff_mm:1.0` and `$X & $H` are values there and
errors in YAML: every value is quoted before the YAML parser gets the text.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import yaml

from wificnc.board.fluidnc.remarks import Remarks
from wificnc.files.bounded import SMALL_MAX, read_text
from wificnc.files.problem import FileProblems, Problem

_LINE = re.compile(r"^(?P<indent>\s*)(?P<key>[A-Za-z0-9_ ]+?)\s*:(?P<value>.*)$")
_COMMENT = re.compile(r"(^|\s)#.*$")
_CHARACTERS_MAX = 500_000  # those of real machines have 20,000
_LEAST = 0.001  # of a number above 0: smaller ones are slips, and profiles have no digits for them
_NOTHING = ("", "no_pin", "null", "~", "{}")

# What earlier versions of FluidNC called a key.
_OLD_NAMES = {
    "max_rate": "max_rate_mm_per_min",
    "acceleration": "acceleration_mm_per_sec2",
    "max_travel": "max_travel_mm",
    "feed_rate": "feed_mm_per_min",
    "seek_rate": "seek_mm_per_min",
    "debounce_ms": "settle_ms",
    "mpos": "mpos_mm",
    "pulloff": "pulloff_mm",
    "delay": "delay_ms",
    "idle_time": "idle_ms",
    "dir_delay_microseconds": "dir_delay_us",
    "pulse_microseconds": "pulse_us",
    "step_type": "engine",
    "shared_stepper_disable": "shared_stepper_disable_pin",
}
# Earlier: without the ending _pin.
_OLD_PINS = {
    *("step", "direction", "disable", "limit_all", "limit_neg", "limit_pos", "output", "enable", "forward", "reverse"),
    *("flood", "mist", "safety_door", "reset", "feed_hold", "cycle_start", "macro0", "macro1", "macro2", "macro3"),
    *("bck", "data", "ws"),
}


@dataclass(frozen=True)
class Value:
    """The text after a colon, and its line."""

    text: str
    line: int


def printable(text: str) -> str:
    """What a name in a file of ours may have of it."""
    return "".join(character for character in text if character.isprintable()).strip()


@dataclass
class Section:
    """A key with keys below it. What is not taken of it was not converted."""

    path: str
    line: int
    values: dict[str, Value] = field(default_factory=dict)
    sections: dict[str, Section] = field(default_factory=dict)
    _taken: set[str] = field(default_factory=set)
    _numbers: set[str] = field(default_factory=set)  # that have none

    def take(self, name: str) -> str | None:
        """The value, read from now on; None where it is missing, empty or NO_PIN."""
        self._taken.add(name)
        found = self.values.get(name)
        return found.text if found and found.text.lower() not in _NOTHING else None

    def title(self, name: str, remarks: Remarks) -> str | None:
        """As take(), with the characters alone that a name in a file of ours may have."""
        text = self.take(name) or ""
        shown = printable(text)
        if shown != text:
            remarks.changed(name, self.line_of(name), "without the characters that cannot be printed")
        return shown or None

    def number(self, name: str) -> float | None:
        """A finite one; any other text, and an empty one, is not taken."""
        text = self.take(name)
        try:
            number = float(text) if text is not None else None
        except ValueError:
            number = math.nan
        if number is not None and math.isfinite(number):
            return number
        if name in self.values:
            self._taken.discard(name)
            self._numbers.add(name)
        return None

    def whole(self, name: str) -> int:
        """0: it is not there. Any other text than a whole number is not taken."""
        number = self.number(name)
        if number is None or number.is_integer():
            return int(number or 0)
        self._taken.discard(name)
        return 0

    def positive(self, name: str, default: float, remarks: Remarks) -> float:
        """A number above 0. Where it is missing FluidNC has the default; where it is none, that is a remark."""
        number = self.number(name)
        if number is not None and number >= _LEAST:
            return number
        self.take(name)
        if name in self.values:
            text = self.values[name].text
            why = f"{text} is not a value for it, which is above 0"
            if number is None:
                why = f"{text!r} is not understood" if text else "has no value"
            why += f": {default:g}, FluidNC's default, is taken; set the right one before the first move"
            remarks.lost(f"{self.path}.{name}".strip("."), self.line_of(name), why)
        return default

    def flag(self, name: str) -> bool:
        return (self.take(name) or "").lower() in ("true", "1", "yes", "on")

    def section(self, name: str) -> Section:
        """An empty one where it is missing."""
        self._taken.add(name)
        return self.sections.get(name) or Section(f"{self.path}.{name}".strip("."), self.line)

    def skip(self, *names: str) -> None:
        """Read them, with all below, and use nothing of them."""
        self._taken.update(names)
        for name in names:
            if name in self.sections:
                self.sections[name].skip_all()

    def skip_all(self) -> None:
        self.skip(*self.values, *self.sections)

    def is_empty(self) -> bool:
        return not any(value.text.lower() not in _NOTHING for value in self.values.values()) and not self.sections

    def line_of(self, name: str) -> int:
        found = self.values.get(name) or self.sections.get(name)
        return found.line if found else self.line

    def left(self) -> Iterator[tuple[str, int, str | None]]:
        """What has not been taken: path, line, text. A section that is left is one entry, with None."""
        for name, value in self.values.items():
            if name not in self._taken and (name in self._numbers or value.text.lower() not in _NOTHING):
                yield f"{self.path}.{name}".strip("."), value.line, value.text
        for name, part in self.sections.items():
            if name in self._taken:
                yield from part.left()
            elif not part.is_empty():
                yield part.path, part.line, None


def read_fluidnc(path: Path) -> Section:
    """Read a configuration.

    Raises:
        FileProblems: it cannot be read, is no YAML, or is no configuration of FluidNC.
    """
    try:
        text = read_text(path, SMALL_MAX)
    except OSError as err:
        raise FileProblems([Problem(path, 1, "unreadable", "", err.strerror or str(err))]) from err
    except UnicodeDecodeError as err:
        raise FileProblems([Problem(path, 1, "unreadable", "", "is not UTF-8 text")]) from err
    if len(text) > _CHARACTERS_MAX:
        reason = f"is too large for a FluidNC configuration: {len(text):,} characters, at most {_CHARACTERS_MAX:,}"
        raise FileProblems([Problem(path, 1, "unreadable", "", reason)])
    try:
        tree = _tree(path, text)
    except RecursionError as err:
        raise FileProblems([Problem(path, 1, "syntax", "", "is nested too deeply for a configuration")]) from err
    if "axes" not in tree.sections:
        raise FileProblems([Problem(path, 1, "missing-key", "axes", "is missing: not a FluidNC configuration")])
    return tree


def _tree(path: Path, text: str) -> Section:
    try:
        root = yaml.compose(quoted(text), Loader=yaml.SafeLoader)
    except yaml.MarkedYAMLError as err:
        line = err.problem_mark.line + 1 if err.problem_mark else 1
        raise FileProblems([Problem(path, line, "syntax", "", f"not YAML: {err.problem}")]) from err
    except yaml.YAMLError as err:
        raise FileProblems([Problem(path, 1, "syntax", "", f"not YAML: {err}")]) from err
    if not isinstance(root, yaml.MappingNode):
        raise FileProblems([Problem(path, 1, "syntax", "", "is not a FluidNC configuration: it has no keys")])
    return _section(path, "", root)


def quoted(text: str) -> str:
    """The same lines, with values that YAML takes as they are."""
    return "\n".join(_quoted_line(line) for line in text.splitlines()) + "\n"


def _quoted_line(line: str) -> str:
    line = _COMMENT.sub("", line.expandtabs(4).rstrip("\0")).rstrip()
    match = _LINE.match(line)
    if not match:
        return line
    value = match["value"].strip()
    if value and value[0] == value[-1] and value[0] in "\"'" and len(value) > 1:
        value = value[1:-1]
    shown = "'{}'".format(value.replace("'", "''")) if value else ""
    return f"{match['indent']}{match['key']}: {shown}".rstrip()


# Of what is not taken anyway, the first one stands for all: public configurations have it twice.
_NOT_TAKEN = ("uart", "i2c", "spi")


def _section(file: Path, path: str, node: yaml.MappingNode) -> Section:
    """Raises FileProblems: a part is there twice, and it would not be clear which one is meant."""
    made = Section(path, node.start_mark.line + 1)
    for key, value in node.value:
        name = _name(str(key.value), path)
        line = key.start_mark.line + 1
        if not isinstance(value, yaml.MappingNode):
            made.values.setdefault(name, Value(str(value.value).strip(), line))
            continue
        part = f"{path}.{name}".strip(".")
        if name in made.sections and path == "" and name.startswith(_NOT_TAKEN):
            continue
        if name in made.sections:
            reason = f"{name!r} is there twice, at lines {made.sections[name].line} and {line}: leave one of them"
            raise FileProblems([Problem(file, line, "duplicate-key", part, reason)])
        made.sections[name] = _section(file, part, value)
        made.sections[name].line = line
    return made


def _name(key: str, path: str) -> str:
    name = key.strip().lower()
    if name in _OLD_PINS and path.partition(".")[0] != "macros":
        return f"{name}_pin"
    return _OLD_NAMES.get(name, name)
