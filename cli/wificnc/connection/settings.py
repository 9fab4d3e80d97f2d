"""Settings between a controller, people and files. Pure. A value is the text that `$$` prints; a file has names.

controller  $110=5000.000        people  max_rate_mm_min.x        file  [axis.x] max_rate_mm_min = 5000.0
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from wificnc.errors import UserError
from wificnc.files.digits import is_float
from wificnc.files.problem import FileProblems, Finding, Problem
from wificnc.files.shape import closest, locate
from wificnc.files.tomlfile import TomlFile, read_toml
from wificnc.tables import AXES, Setting, load_settings

SCHEMA = 1
FIRST_OF_ALL = 22  # $20 asks for it, so it goes before
ASCENDING = range(94, 98)  # the laser's curve, after each of its points, too
SECOND_MOTORS = range(210, 216)  # two axes never have the same driver, so one gives it up first

Values = dict[int, str]  # $N -> as $$ prints it


@dataclass(frozen=True)
class Known:
    """One setting of the table, of one axis where it has axes."""

    number: int
    row: Setting
    axis: str  # x y z a b c, or ""

    @property
    def name(self) -> str:
        """junction_deviation_mm, steps_per_mm.x"""
        return f"{self.row.name}.{self.axis}" if self.axis else self.row.name


@dataclass(frozen=True)
class Change:
    """One setting that differs. None = not there."""

    number: int
    name: str
    unit: str
    before: str | None
    after: str | None


def all_known() -> Iterator[Known]:
    """Every setting of the table, in the order of numbers."""
    for row in load_settings().setting:
        for axis in range(row.count):
            yield Known(row.number + axis, row, AXES[axis].lower() if row.per_axis else "")


_SHELL = re.compile(r"-?(?:\S*/)?(?:ba|da|k|z)?sh")
_BY_NUMBER = {known.number: known for known in all_known()}
_BY_NAME = {known.name: known for known in all_known()}


def known(number: int) -> Known | None:
    return _BY_NUMBER.get(number)


def name_of(number: int) -> str:
    """Its name, or $N for one that the table does not have."""
    return _BY_NUMBER[number].name if number in _BY_NUMBER else f"${number}"


def find(key: str) -> int:
    """The number behind $110, 110 or max_rate_mm_min.x. Raises UserError.

    Without its $ a number is refused that may be what a shell has left of another one: of $130 it leaves 30.
    """
    if match := re.fullmatch(r"(\$?)(\d{1,5})", key, re.ASCII):
        number = int(match[2])
        if not match[1] and (meant := _may_be_rest_of(match[2])):
            own = [_BY_NUMBER[number]] if number in _BY_NUMBER else []
            raise UserError(f"{key} may be what a shell has left of ${meant[0].number}", _quoting(*own, *meant))
        return number
    if key.lower() in _BY_NAME:
        return _BY_NAME[key.lower()].number
    if f"{key.lower()}.x" in _BY_NAME:
        raise UserError(f"{key} has a value for each axis", hint=f"give the axis: {key.lower()}.x")
    if _SHELL.fullmatch(key):
        raise UserError(f"{key} is what a shell has made of $0", _quoting(_BY_NUMBER[0]))
    if not key:
        raise UserError("the setting is missing: a shell replaces $1", _quoting(_BY_NUMBER[1]))
    close = closest(key.lower(), _BY_NAME)
    raise UserError(f"unknown setting {key}", hint=f"did you mean {close}?" if close else "a name, or $N")


def _may_be_rest_of(digits: str) -> list[Known]:
    """Settings whose number without its first digit is this one."""
    return [entry for entry in _BY_NUMBER.values() if str(entry.number)[1:] == digits]


def _quoting(*meant: Known) -> str:
    names = " or ".join(f"'${entry.number}' ({entry.name})" for entry in meant[:3])
    return f"quote it: {names}{', ...' * (len(meant) > 3)}; or use its name"


def assignment(text: str) -> tuple[int, str]:
    """`max_rate_mm_min.x=5000` or `$22=on` as number and value: on is 1, off is 0. Raises UserError."""
    key, equals, value = text.partition("=")
    if not equals or not value.strip():
        raise UserError(
            f"{text!r} is not an assignment", hint="a setting looks like max_rate_mm_min.x=5000 or '$110=5000'"
        )
    number = find(key.strip())
    return number, {"on": "1", "true": "1", "off": "0", "false": "0"}.get(value.strip().lower(), value.strip())


def same(number: int, a: str | None, b: str | None) -> bool:
    """Whether two texts are one value: 5000 and 5000.000 are."""
    if a is None or b is None:
        return a == b
    try:
        entry = known(number)
        places = entry.row.decimals if entry else 6
        return abs(float(a) - float(b)) < 0.5 * 10.0**-places
    except ValueError:
        return a == b


def differences(before: Values, after: Values) -> list[Change]:
    """What differs, in the order of numbers."""
    found = []
    for number in sorted({*before, *after}):
        if not same(number, before.get(number), after.get(number)):
            entry = known(number)
            unit = entry.row.unit if entry else ""
            found.append(Change(number, name_of(number), unit, before.get(number), after.get(number)))
    return found


def out_of_range(changes: list[Change]) -> list[str]:
    """What the controller is sure to refuse, in words. A value that it has already may be out of our range."""
    found = []
    for change in changes:
        entry = known(change.number)
        if entry and change.after and not entry.row.min <= float(change.after) <= entry.row.max:
            found.append(f"{change.name} = {change.after}: must be {entry.row.min:g} to {entry.row.max:g}")
    return found


def sending_order(changes: list[Change]) -> list[Change]:
    """Ascending, but homing first: soft limits ask for it. Points of the laser's curve that rise begin at the top. A
    driver is given up before another axis gets it."""

    def place(change: Change) -> tuple[int, int]:
        rises = change.number in ASCENDING and float(change.after or 0) > float(change.before or 0)
        gives_up = change.number in SECOND_MOTORS and change.after == "0"
        rank = 0 if change.number == FIRST_OF_ALL else 1 if rises or gives_up else 2
        return rank, -change.number if rises else change.number

    return sorted(changes, key=place)


# ---- files ----


def export_text(values: Values, source: str) -> str:
    """The TOML file."""
    plain = [entry for entry in all_known() if not entry.axis and entry.number in values]
    lines = [f"# Settings of {source}. `wificnc settings import` shows what would change, and asks.", ""]
    lines += [f"schema = {SCHEMA}", "", "[settings]", *_rows(plain, values)]
    for axis in AXES.lower():
        if of_axis := [entry for entry in all_known() if entry.axis == axis and entry.number in values]:
            lines += ["", f"[axis.{axis}]", *_rows(of_axis, values)]
    if other := sorted(set(values) - set(_BY_NUMBER)):
        lines += ["", "[other] # of this firmware only", *(f'"${number}" = "{values[number]}"' for number in other)]
    return "\n".join(lines) + "\n"


def _rows(entries: list[Known], values: Values) -> list[str]:
    """Name = value, and behind it the number, the unit and what it does."""
    texts = [f"{entry.row.name} = {_toml_value(entry.row, values[entry.number])}" for entry in entries]
    width = max((len(text) for text in texts), default=0)
    rows = []
    for entry, text in zip(entries, texts, strict=True):
        unit = f" {entry.row.unit}" if entry.row.unit else ""
        rows.append(f"{text:<{width}}  # ${entry.number}{unit}: {entry.row.help}")
    return rows


def _toml_value(row: Setting, text: str) -> str:
    if row.type == "bool":
        return "true" if text.strip() not in ("0", "0.000") else "false"
    value = float(text)
    return str(int(value)) if value == int(value) and row.type != "float" else repr(value)


def read_file(path: Path) -> Values:
    """The values of an exported file, or of one written by hand; what it leaves out is left alone.

    Raises:
        FileProblems: it cannot be read, or breaks rules.
    """
    source = read_toml(path)
    values: Values = {}
    findings = list(_take_file(source, values))
    if findings:
        raise FileProblems(locate(findings, source))
    return values


_DOLLAR = re.compile(r"\$(\d{1,5})\s*=\s*(-?\d{0,20}\.?\d{1,20})\s*(?:[(;].*)?")
_NO_SETTING = re.compile(r"(?:ok|\$\$|[;(#<\[].*|Grbl .*)?")


def has_dollar_lines(text: str) -> bool:
    """Whether a file is what `$$` printed, and no TOML."""
    return re.search(r"^\s*\$\d+\s*=", text, re.MULTILINE) is not None


def read_dollar_lines(path: Path, text: str) -> Values:
    """The values of lines like `$110=5000.000 (x max rate, mm/min)`, as senders save them.

    Raises:
        FileProblems: a line that is neither a setting nor an answer around settings.
    """
    values: Values = {}
    problems = []
    for number, line in enumerate(map(str.strip, text.splitlines()), start=1):
        if match := _DOLLAR.fullmatch(line):
            values[int(match[1])] = match[2]
        elif not _NO_SETTING.fullmatch(line):
            problems.append(Problem(path, number, "setting-line", "", f"{line[:60]!r} is not like $110=5000"))
    if problems:
        raise FileProblems(problems)
    return values


def _take_file(source: TomlFile, values: Values) -> Iterator[Finding]:
    """Fill in the values; give every fault."""
    if source.data.get("schema") != SCHEMA:
        yield Finding("schema-first", ("schema",), f"must be {SCHEMA}")
    for key in source.data:
        if key not in ("schema", "settings", "axis", "other"):
            yield Finding("unknown-key", (key,), "unknown key", "known here: schema, settings, axis, other")
    yield from _take_table(source.data.get("settings", {}), ("settings",), "", values)
    for axis, table in _table(source.data.get("axis")).items():
        yield from _take_table(table, ("axis", axis), axis, values)
    for key, value in _table(source.data.get("other")).items():
        if not re.fullmatch(r"\$\d{1,5}", key):
            yield Finding("unknown-key", ("other", key), 'must be like "$37"')
        else:
            values[int(key[1:])] = str(value)


def _table(value: Any) -> dict[str, Any]:
    return value if isinstance(value, dict) else {}


def _take_table(table: Any, path: tuple[str, ...], axis: str, values: Values) -> Iterator[Finding]:
    suffix = f".{axis}" if axis else ""
    names = {entry.row.name: entry for entry in _BY_NAME.values() if entry.axis == axis}
    for key, value in _table(table).items():
        entry = names.get(key)
        if entry is None:
            meant = closest(key, names)
            hint = (
                f"did you mean {meant}?" if meant else f"known here: {', '.join(names)}" if names else "axes are x to c"
            )
            yield Finding("unknown-key", (*path, key), f"unknown setting {key}{suffix}", hint)
        elif reason := _fault(entry.row, value):
            yield Finding("bad-value", (*path, key), reason)
        else:
            values[entry.number] = entry.row.text(value)


def _fault(row: Setting, value: Any) -> str | None:
    """Why a value cannot be one of this setting."""
    if row.type == "bool":
        return None if isinstance(value, bool) else "must be true or false"
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        return "must be a number"
    if not is_float(value):  # the controller itself judges ranges, and what it exports is imported
        return f"must be {row.min:g} to {row.max:g}"
    return "must be a whole number" if row.type != "float" and value != int(value) else None
