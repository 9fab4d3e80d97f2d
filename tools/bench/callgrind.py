"""Reads callgrind's output: instructions per function, with what it calls outside our own code."""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Iterable
from dataclasses import dataclass, field

NAME = re.compile(r"\((\d+)\)(?: (.*))?")
COST = re.compile(r"^(?:\+\d+|-\d+|\*|\d+|0x[0-9a-f]+) (\d+)$")


# A function is its file and its name: static functions of different files may share one.
Function = tuple[str, str]


@dataclass
class Profile:
    """Instructions: of each function itself, and of each call edge with everything below it."""

    self_cost: dict[Function, int] = field(default_factory=lambda: defaultdict(int))
    edge_cost: dict[tuple[Function, Function], int] = field(default_factory=lambda: defaultdict(int))

    def inclusive(self, name: str) -> int:
        """A function (that does not call itself) with all that it calls."""
        own = sum(cost for function, cost in self.self_cost.items() if function[1] == name)
        return own + sum(cost for (caller, _), cost in self.edge_cost.items() if caller[1] == name)

    def room(self, *prefixes: str) -> int:
        """All functions of these folders or files, with the library functions they call, without calls into other
        rooms of ours."""
        own = sum(cost for function, cost in self.self_cost.items() if is_in(function, prefixes))
        library = sum(
            cost
            for (caller, callee), cost in self.edge_cost.items()
            if is_in(caller, prefixes) and not is_in(callee, ("core/", "targets/"))
        )
        return own + library


def is_in(function: Function, prefixes: Iterable[str]) -> bool:
    return any(f"/{prefix}" in function[0] for prefix in prefixes)


class _Names:
    """callgrind writes a name once, with a number, and only the number afterwards."""

    def __init__(self) -> None:
        self._known: dict[str, str] = {}

    def read(self, text: str) -> str:
        match = NAME.match(text)
        if match is None:
            return text
        if match[2] is not None:
            self._known[match[1]] = match[2]
        return self._known[match[1]]


def parse_callgrind(lines: Iterable[str]) -> Profile:
    """Read a callgrind.out file."""
    profile = Profile()
    files, functions = _Names(), _Names()
    function = callee = ("", "")
    is_call = False
    for line in lines:
        key, _, value = line.rstrip("\n").partition("=")
        if key == "fl":
            function = (files.read(value), "")
        elif key in ("fi", "fe"):
            files.read(value)
        elif key in ("cfi", "cfl"):
            callee = (files.read(value), "")
        elif key == "fn":
            function = callee = (function[0], functions.read(value))
        elif key == "cfn":
            callee = (callee[0], functions.read(value))
        elif key == "calls":
            is_call = True
        elif match := COST.match(key):
            if is_call:
                profile.edge_cost[function, callee] += int(match[1])
                callee = function
            else:
                profile.self_cost[function] += int(match[1])
            is_call = False
    return profile
