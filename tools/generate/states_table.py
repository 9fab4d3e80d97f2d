"""The table of states, protocol/states.toml: what happens with every input in every state."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from functools import cached_property
from pathlib import Path
from typing import Literal

from pydantic import BaseModel, ConfigDict, Field
from wificnc.files.paths import ROOT

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib  # type: ignore[import-not-found, unused-ignore]

PATH = ROOT / "protocol" / "states.toml"
BYTES = (0x18, ord("?"), ord("!"), ord("~"), *range(0x80, 0x100))  # taken out of the stream wherever they come
GCODE = ("move", "dwell", "probe", "spindle_line", "spindle_off", "pause", "tool_change", "program_end", "wrong_line")

Condition = Literal[
    "dwell",
    "probe",
    "line open",
    "probe line open",
    "no change",
    "door open",
    "outputs on",
    "something kept",
    "job waits",
    "stream open",
    "host commands",
    "host's outputs on",
    "locked before",
    "stream known",
    "parked",
    "operator probes",
    "operator waits",
    "lines ended",
    "lines left",
]
Motion = Literal["unchanged", "starts", "held", "dropped", "halted", "resumes"]
Outputs = Literal["unchanged", "stopped", "off", "restored", "toggled", "as programmed", "as commanded", "host's off"]


class _Part(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class State(_Part):
    """A state as the table sees it: some states of the core are several here."""

    name: str
    machine: str  # enum machine_state
    report: str
    outputs: Literal["as programmed", "stopped"] = "as programmed"
    silent: bool = False  # `?` is answered later
    owned: bool = False  # a remote host commands motion
    help: str


class Input(_Part):
    """A class of inputs, and one that stands for it in tests."""

    name: str
    bytes: tuple[str, ...] = ()
    line: str | None = None
    starts: str = ""
    pin: str = ""
    level: bool | None = None  # None: on and off again
    event: str = ""
    packets: tuple[str, ...] = ()  # of protocol/wmc3.toml; the first one is sent to try it
    other_host: bool = False  # not of the host that commands
    server: str = ""  # a line that does not reach the controller
    help: str

    def all_bytes(self) -> Iterator[int]:
        """Every byte of `bytes`: characters, 0xNN and ranges of these."""
        for part in self.bytes:
            if len(part) == 1:
                yield ord(part)
                continue
            first, _, last = part.partition("-")
            yield from range(int(first, 16), int(last or first, 16) + 1)


class Rule(_Part):
    """What a cell is. Fields that are left out say that nothing happens."""

    state: str | tuple[str, ...]
    input: str | tuple[str, ...]
    with_: Condition | tuple[Condition, ...] = Field((), alias="with")
    answer: str = ""
    says: tuple[str, ...] = ()
    next: str = "unchanged"
    motion: Motion = "unchanged"
    outputs: Outputs = "unchanged"
    source: Literal["grbl", "ours"]
    why: str = ""

    @property
    def conditions(self) -> tuple[Condition, ...]:
        """All of them must be met."""
        return (self.with_,) if isinstance(self.with_, str) else self.with_

    @property
    def order(self) -> tuple[str, ...]:
        """The answer and the messages as they come: the answer first, unless `says` names its place."""
        return self.says if not self.answer or self.answer in self.says else (self.answer, *self.says)


class ToolRow(_Part):
    """Lines in the state Tool: inputs of the table, or a line of its own with its help."""

    input: str | tuple[str, ...] = ()
    line: str = ""
    help: str = ""
    answer: str
    after: str  # the operator's first line
    why: str

    @property
    def inputs(self) -> tuple[str, ...]:
        return (self.input,) if isinstance(self.input, str) else self.input


class Table(_Part):
    """All of it. Rules that come later are exceptions to those before them."""

    schema_: Literal[1] = Field(alias="schema")
    state: tuple[State, ...]
    input: tuple[Input, ...]
    rule: tuple[Rule, ...]
    tool: tuple[ToolRow, ...]

    @cached_property
    def states(self) -> dict[str, State]:
        return {state.name: state for state in self.state}

    @property
    def lines(self) -> list[Input]:
        return [entry for entry in self.input if entry.line is not None]

    @property
    def controllers(self) -> list[Input]:
        """What reaches the controller."""
        return [entry for entry in self.input if not entry.server]

    @property
    def packets(self) -> list[Input]:
        return [entry for entry in self.input if entry.packets]

    @cached_property
    def inputs(self) -> dict[str, Input]:
        return {entry.name: entry for entry in self.input}

    def names(self, rule: Rule) -> tuple[frozenset[str], frozenset[str]]:
        """The states and inputs of a rule. Raises ValueError for a name that does not exist."""
        return self._states(rule.state), self._inputs(rule.input)

    def cell(self, state: str, entry: str, conditions: frozenset[str] = frozenset()) -> Rule:
        """What happens: the last rule that names both and whose condition is met."""
        return self._index[state, entry, conditions]

    def variants(self, state: str, entry: str) -> list[Rule]:
        """All that can decide a cell: those with a condition, and the one without that is behind them."""
        found: list[Rule] = []
        for rule, (states, inputs) in zip(reversed(self.rule), reversed(self._named), strict=True):
            covered = any(set(other.conditions) <= set(rule.conditions) for other in found)
            if state in states and entry in inputs and not covered:
                found.append(rule)
                if not rule.conditions:
                    break
        return found

    def _states(self, names: str | tuple[str, ...]) -> frozenset[str]:
        if names == "*":
            return frozenset(self.states)
        chosen = frozenset([names] if isinstance(names, str) else names)
        if unknown := chosen - self.states.keys():
            raise ValueError(f"protocol/states.toml: unknown state {', '.join(sorted(unknown))}")
        return chosen

    def _inputs(self, names: str | tuple[str, ...]) -> frozenset[str]:
        chosen: set[str] = set()
        for name in [names] if isinstance(names, str) else names:
            chosen |= _group(name, self.inputs)
        if unknown := chosen - self.inputs.keys():
            raise ValueError(f"protocol/states.toml: unknown input {', '.join(sorted(unknown))}")
        return frozenset(chosen)

    @cached_property
    def _index(self) -> _Index:
        return _Index(self)

    @cached_property
    def _named(self) -> list[tuple[frozenset[str], frozenset[str]]]:
        """names() of every rule."""
        return [self.names(rule) for rule in self.rule]


def _group(name: str, inputs: dict[str, Input]) -> set[str]:
    if name == "*":
        return set(inputs)
    if name == "lines":
        return {entry.name for entry in inputs.values() if entry.line is not None}
    if name == "packets":
        return {entry.name for entry in inputs.values() if entry.packets}
    return set(GCODE) if name == "gcode" else {name}


class _Index:
    """Cells that were asked for, each found once."""

    def __init__(self, table: Table) -> None:
        self._table = table
        self._found: dict[tuple[str, str, frozenset[str]], Rule] = {}

    def __getitem__(self, key: tuple[str, str, frozenset[str]]) -> Rule:
        if key not in self._found:
            state, entry, conditions = key
            variants = self._table.variants(state, entry)
            fitting = [rule for rule in variants if conditions.issuperset(rule.conditions)]
            if not fitting:
                raise ValueError(f"protocol/states.toml: no rule for {entry} in {state}")
            self._found[key] = fitting[0]
        return self._found[key]


def parse_states(text: str) -> Table:
    """Raises ValueError."""
    return Table.model_validate(tomllib.loads(text))


def load_states(path: Path = PATH) -> Table:
    return parse_states(path.read_text(encoding="utf-8"))
